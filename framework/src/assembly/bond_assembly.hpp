#pragma once
#include "assembly/assembly.hpp"
#include "assembly/block_pattern.hpp"
#include "assembly/tangent_batch.hpp"
#include "families/cloud/cloud_rows.hpp"
#include "spaces/bond_ends.hpp"
#include "spaces/evaluation_space.hpp"

namespace perikit {

/// Bond shape. With the point gradients kept as unknowns every bond is a small matrix on X_i = [Hbar_i, u_i] and X_j; their sum Q
/// is condensed with X = G u, row by row:  K = G^T Q G. Component s < D of X_i belongs to column s of Hbar_i, component D to u_i;
/// G_ik has g_ik there, and 1 at (i, i) for u.
template <int D>
class BondAssembly final : public Assembly {
 public:
  BondAssembly(const SpaceParts& parts, const LawsOfSpace& laws, const BlockRows& rows);

  std::int64_t add(const Configuration& at, BlockMatrix& K) override;
  void bonds_changed() override { read_bonds(); }
  std::size_t bytes() const noexcept override;

 private:
  static constexpr std::size_t slots = D + 1, entries = D * D;
  /// Doubles of a block of Q: [s][s'][a][b].
  static constexpr std::size_t coupling = slots * slots * entries;
  static constexpr std::size_t strip = slots * entries;

  struct Memory {
    Memory(const LawsOfSpace& laws, bool selective) : batch(laws, selective) {}
    TangentBatch<D> batch;
    std::vector<std::size_t> bond_of_lane, row_of_lane;
    Reach reach;
    RowPlaces places;
    AlignedVector<double> C;  ///< row k of G^T Q: [j][s'][a][b]
  };
  /// Reference data of a bond i -> j.
  struct Bond {
    double xi[D];
    double correction[D];  ///< g_b
    double gradient[D];    ///< g_ij of Hbar_i
    double weight;         ///< V_i w_ij
    EndShares shares;      ///< of Hbar_i and Hbar_j in A_b
    std::size_t reverse;   ///< the bond j -> i
  };

  void read_bonds();
  void point_gradients(std::size_t row, ConstFieldView u) noexcept;
  /// ij and ji have the same gradient and the same law: one evaluation with both weights.
  bool evaluated_once(std::size_t i, std::size_t j) const noexcept;
  std::int64_t add_bonds(std::size_t first, std::size_t last, const Configuration& at, bool convex, Memory& m);
  void add_lane(std::size_t i, std::size_t k, ConstFieldView u, Memory& m);
  void couple(std::size_t i, std::size_t k, int lane, const TangentBatch<D>& batch) noexcept;
  void condense(std::size_t row, BlockMatrix& K, Memory& m) const;

  SpaceParts parts_;
  LawsOfSpace laws_;
  const BlockRows& rows_;
  const Formulation& formulation_;
  bool symmetric_;
  std::vector<Bond> bond_;
  AlignedVector<double> own_gradient_;             ///< g_ii by row, D each
  AlignedVector<double> Hbar_;                     ///< by row
  AlignedVector<double> volume_share_;             ///< selective: c by row
  AlignedVector<double> diagonal_, off_diagonal_;  ///< Q by row, by bond
  CloudBlocks blocks_;
  Colouring colouring_;
  PerThread<Memory> memory_;
};

}  // namespace perikit
