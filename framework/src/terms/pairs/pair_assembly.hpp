#pragma once
#include "assembly/assembly.hpp"
#include "assembly/block_pattern.hpp"
#include "model/formulation.hpp"
#include "terms/pairs/pair_loop.hpp"

namespace perikit {

/// What a pair model knows of its points.
struct PairPoints {
  const PairFields& fields;
  const Field& scale;               ///< d/m_i; empty without dilatation
  const Field& dilatation_modulus;  ///< k_i
};

/// Pair laws: with the force dE/de = T of a bond, K is the sum over bonds of (w'' n (x) n + T/|y| (I - n (x) n)) on both ends,
/// and over points of V_i phi'' dtheta_i (x) dtheta_i, where theta_i depends on the family.
template <int D>
class PairAssembly final : public Assembly {
 public:
  PairAssembly(const Formulation& formulation, const PairPoints& points, const BlockRows& rows);

  std::int64_t add(const Configuration& at, BlockMatrix& K) override;
  void bonds_changed() override {}
  std::size_t bytes() const noexcept override;

 private:
  /// Memory of one thread: arrays over the bonds of one row, padded.
  struct Memory {
    FamilyArrays family;
    AlignedVector<double> omega, extension, inverse_length, direction[D], du[D], modulus, force, stiffness;
    RowPlaces places;
  };
  /// Bonds of a row at u, one after the other. Returns whether all lengths are finite and positive.
  bool stretch(std::size_t row, ConstFieldView u, Memory& m) const;
  void moduli(std::size_t row, Memory& m) const;
  double dilatation_weight(const Memory& m, std::size_t p, std::size_t q, std::size_t k) const;
  bool dilatation(std::size_t row, ConstFieldView u, Memory& m);
  void fill_row(std::size_t row, ConstFieldView u, BlockMatrix& K, Memory& m) const;

  const BlockRows& rows_;
  const Formulation& formulation_;
  const PairKinematics& law_;
  PairPoints points_;
  AlignedVector<double> pressure_;   ///< q_i = phi' d/m, by row
  AlignedVector<double> stiffness_;  ///< V_i phi'', by row
  AlignedVector<double> slope_;      ///< dtheta_i/du_j by bond, D each
  AlignedVector<double> own_slope_;  ///< dtheta_i/du_i by row
  PerThread<Memory> memory_;
};

}  // namespace perikit
