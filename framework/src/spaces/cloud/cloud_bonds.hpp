#pragma once
#include <cmath>

#include "families/blocks.hpp"
#include "families/cloud/cloud_row_simd.hpp"
#include "spaces/bond_ends.hpp"
#include "spaces/bond_shape.hpp"
#include "spaces/cloud/cloud_gradient.hpp"
#include "spaces/evaluation_space.hpp"

namespace perikit {

/// Evaluation points at the bonds of a cloud, one point at a time; gathered quantities are mirrored point-major.
template <int D>
class CloudBonds final : public EvaluationSpace {
 public:
  explicit CloudBonds(const SpaceParts& parts);

  void run(Pass& pass) override;
  std::size_t numbers() const noexcept override { return (two_states_ ? 2 : 1) * one_end_; }
  PointNumbers number_of(std::int32_t p, std::int32_t far, int) const noexcept override {
    const std::int64_t state = state_number(static_cast<std::size_t>(p), families_.index(p, far), static_cast<std::size_t>(far));
    return {state >= far_number() && two_states_ ? state - far_number() : state, state};
  }
  void bonds_changed(std::span<const std::int32_t> points) override;
  std::size_t factors() const noexcept override { return families_.lists().neighbour.size(); }
  void set_factors(std::span<const double> factors) override;
  void shift_gradients(ConstFieldView lambda) override;
  void report(ModelReport& report) const override;
  PointFlux point_flux() const noexcept override {
    if (last_ == Last::other || gradient_of_.stored() || gradient_of_.shifted()) return {};
    const auto matrices = [](const AlignedVector<Row>& rows) {
      return PointMatrices{reinterpret_cast<const double*>(rows.data()), D * sizeof(Row) / sizeof(double), 1, sizeof(Row) / sizeof(double)};
    };
    return {matrices(gradient_), matrices(flux_), last_ == Last::all_forces};
  }

 private:
  void gradients(std::size_t b, Pass& pass);
  void bonds(std::size_t b, Pass& pass);
  int bonds_of_point(std::size_t p, BatchScratch& s, Pass& pass, GroupEnergy* energy);
  void read_bonds(std::size_t p, std::int64_t begin, int n, int lanes, BatchScratch& s) const noexcept;
  void bond_gradients(std::size_t p, std::int64_t begin, int n, int lanes, const BatchScratch& s, const AlignedVector<Row>& u,
                      const AlignedVector<Row>& H, double* out) const noexcept;
  void scatter(std::size_t p, int n, const BatchScratch& s, bool both_ends, bool tangent) noexcept;
  void number(std::size_t p, std::int64_t begin, int n, int lanes, BatchScratch& s) const noexcept;
  /// Of the bond at this place of the lists, which leads from p to j.
  std::int64_t state_number(std::size_t p, std::int64_t bond, std::size_t j) const noexcept {
    if (bond >= first_bond(p)) return number_[p] + bond - first_bond(p);
    const bool same = !two_states_ || (!selective_ && laws_.same(p, j));
    return number_[j] + families_.index(static_cast<std::int32_t>(j), static_cast<std::int32_t>(p)) - upper_[j] + (same ? 0 : far_number());
  }
  std::int64_t far_number() const noexcept { return two_states_ ? static_cast<std::int64_t>(one_end_) : 0; }
  void number_bonds();
  // Selective map: volume changes of the points of a block; its stress on their gradients, from the pressures.
  void volumes(std::size_t b, const Pass& pass) noexcept;
  void pressures(std::size_t b, const Pass& pass) noexcept;
  void volumes_of_bonds(std::size_t p, int lanes, bool both_ends, BatchScratch& s) const noexcept;
  double share_of_volume(std::size_t p) const noexcept {
    return std::isfinite(families_.condition(p)) ? families_.remaining_influence(p) : 0.0;
  }
  /// Calls visit(lane, far, shares) for those of n intact bonds of p that have an end without a gradient.
  template <class Visit>
  void over_one_sided(std::size_t p, std::int64_t begin, int n, const BatchScratch& s, Visit&& visit) const;
  void one_sided_gradients(std::size_t p, std::int64_t begin, int n, BatchScratch& s, const AlignedVector<Row>& u, const AlignedVector<Row>& H,
                           double* out) const noexcept;
  void one_sided_stress(std::size_t p, std::int64_t begin, int n, const BatchScratch& s) noexcept;
  template <class Visit>
  void over_points(std::size_t b, Visit&& visit) const {
    for (std::size_t p = blocks_.begin(b); p < blocks_.end(b); ++p) visit(p);
  }
  int bonds_at_once() const noexcept { return selective_ && pairs_ ? batch_points / 2 : batch_points; }
  std::int64_t first_bond(std::size_t p) const noexcept { return pairs_ ? upper_[p] : families_.lists().first[p]; }

  const CloudFamilies& families_;
  const Formulation& formulation_;
  const Laws& laws_;
  bool selective_;
  double far_share_;
  PointsWithoutGradient without_;
  bool pairs_;       ///< each bond evaluated once for both ends
  bool two_states_;  ///< and yet with a history of its own for each
  std::size_t points_;
  CloudBlocks blocks_;
  const Row* position_;                        ///< {x, y, z, V}
  CloudGradient<D> gradient_of_;
  std::vector<std::int64_t> upper_;            ///< first neighbour with a larger index
  std::vector<std::int64_t> number_;           ///< of the first bond that a point evaluates, where laws have a history
  std::size_t one_end_ = 0;
  AlignedVector<double> scale_;       ///< V_i / N_i, by internal index
  const double* factor_ = nullptr;    ///< w_ij / W_ij; null: 1
  AlignedVector<double> far_factor_;      ///< w_ji / W_ji of the bonds that points evaluate for both ends, point by point
  std::vector<std::int64_t> far_first_;   ///< by point: of the first of its bonds
  BlockSequence sequence_;
  Colouring colouring_;
  ArrivingPieces pieces_;
  AlignedVector<Row> u_, w_;                 ///< mirrors; {u, scale}
  AlignedVector<Row> gradient_, direction_;  ///< Hbar of u and w, D rows a point
  AlignedVector<Row> stress_;                ///< on shifted gradients
  AlignedVector<Row> flux_;                  ///< the stress on Hbar, then Q; likewise
  enum class Last { all_forces, some_forces, other } last_ = Last::other;  ///< run
  AlignedVector<Row> force_;                 ///< scattered bond forces
  AlignedVector<Row> volume_, pressure_;     ///< selective: volume changes of points; pressures on them and their rates
  ScratchPool scratch_;
};

}  // namespace perikit
