#pragma once
#include <cmath>
#include <memory>
#include <optional>

#include "operators/batch.hpp"
#include "families/blocks.hpp"
#include "spaces/bond_kernel.hpp"
#include "families/cloud_families.hpp"
#include "families/cloud_rows.hpp"
#include "families/quiet_blocks.hpp"
#include "assembly/assembly.hpp"

namespace perikit {

/// Any point or bond kinematics on an irregular cloud: one point at a time over sorted neighbour lists; gathered quantities are
/// mirrored point-major.
template <int D>
class CloudModel final : public AssemblingModel {
 public:
  explicit CloudModel(const ModelParts& parts);

  EvaluationStatus forces(ConstFieldView u, FieldView force, double* energy) override;
  EvaluationStatus tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) override;
  EvaluationStatus sample(ConstFieldView u, PointSamples& samples) override;
  Field shape_tensor_condition() override { return families_.condition; }
  Field damage() override { return families_.damage; }
  ModelReport report() const override;
  QuietCounts quiet_counts() const override { return quiet_.counts(); }

  const CloudFamilies& families() const noexcept { return families_; }
  /// H of point p as rows: H[D p + e][c] = H_ce.
  void gradient_rows(std::size_t p, const AlignedVector<Row>& u, AlignedVector<Row>& H) const noexcept;

 private:
  static constexpr std::size_t block_points = cloud_block_points;

  double energy_of(ConstFieldView u, const GroupMarks& marks) override;
  std::vector<BondChange> bonds_changed(std::span<const std::int32_t> points) override;
  EvaluationStatus run(Pass& pass);
  /// sum_j omega V_j u_ij xi_e as rows over components: S[e].
  void moments(std::size_t p, const AlignedVector<Row>& u, Row (&S)[D]) const noexcept;
  void gradient_lane(std::size_t p, const AlignedVector<Row>& u, double* H, int lane) const noexcept;
  void points_block(std::size_t b, Pass& pass);
  void bonds_block(std::size_t b, Pass& pass);
  void store_stencils();
  int bonds_of_point(std::size_t p, BatchScratch& s, Pass& pass, double* energy);
  /// selective: volume changes of the points of the block; its stress on their gradients, from the pressures.
  void volumes_block(std::size_t b, bool tangent) noexcept;
  void pressures_block(std::size_t b, bool tangent) noexcept;
  /// selective: c of a point (selective_map.hpp).
  double share_of_volume(std::size_t p) const noexcept {
    return std::isfinite(families_.condition.data()[p]) ? families_.left(p) : 0.0;
  }
  /// force_ += G^T S for the block, S the stress on Hbar (stored stencils).
  void scatter_block(std::size_t b) noexcept;
  /// Rows of Q = S K^-1 from rows of S.
  void flux_row(std::size_t p, const Row* S, Row* Q) const noexcept;
  void divergence(std::size_t p, FieldView out) const noexcept;
  int bonds_at_once() const noexcept { return formulation_.selective() && pairs_ ? batch_points / 2 : batch_points; }
  std::size_t blocks() const noexcept { return (body_.points() + block_points - 1) / block_points; }

  const Body& body_;
  const Laws& laws_;
  Formulation formulation_;
  bool pairs_;
  const Row* position_;                        ///< {x, y, z, V}
  CloudFamilies families_;
  std::vector<std::int64_t> upper_;            ///< first neighbour with a larger index (bonds)
  AlignedVector<double> scale_;                ///< V_i / N_i (bonds)
  AlignedVector<double> stencil_;              ///< g[D * bond + e] of point gradients of order 2 and more
  std::size_t fallbacks_ = 0;                  ///< points of a lower order than asked for
  Colouring colouring_;
  QuietBlocks quiet_;
  AlignedVector<Row> u_, w_;                   ///< mirrors
  AlignedVector<Row> gradient_, direction_;    ///< Hbar[c][e] as row e over c, D rows a point
  AlignedVector<Row> flux_;                    ///< S, then Q; likewise
  AlignedVector<Row> force_;                   ///< scattered bond forces
  AlignedVector<Row> volume_, pressure_;       ///< selective: volume changes of points; pressures on them and their rates
  ScratchPool scratch_;
};

}  // namespace perikit
