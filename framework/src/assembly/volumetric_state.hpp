#pragma once
/// What VolumetricRows keep of every point, whatever their products are made of.

#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>

#include "assembly/assembly.hpp"
#include "assembly/row_roles.hpp"
#include "assembly/tangent_batch.hpp"
#include "assembly/volumetric_rows.hpp"
#include "operators/volume_stiffness.hpp"
#include "perikit/core/tensor.hpp"
#include "spaces/evaluation_points.hpp"

namespace perikit {

template <int D>
class VolumetricState : public VolumetricRows {
 public:
  ConstFieldView logarithms() const final { return logarithms_; }
  ConstFieldView stiffness() const final { return stiffness_; }

 protected:
  using S = std::conditional_t<D == 3, Solid, std::conditional_t<D == 2, Plane, Line>>;
  using T = Tensor<double, S>;

  /// Memory of a thread.
  struct Memory {
    Memory(const SpaceParts& parts, const LawsOfSpace& laws) : points(parts), lanes(laws, true) {}
    EvaluationPoints<D> points;
    TangentBatch<D> lanes;   ///< of points near interfaces
    LawScratch law;
    alignas(64) double H[9 * batch_points] = {}, F[9 * batch_points] = {}, P[9 * batch_points], dP[9 * batch_points];
    std::int32_t owner[batch_points];
  };

  VolumetricState(const SpaceParts& parts, const LawsOfSpace& laws)
      : parts_(parts),
        laws_(laws),
        rows_(parts.families),
        roles_(rows_, parts.laws),
        H_(rows_.body().make_field(D * D)),
        share_(rows_.body().make_field(1)),
        logarithms_(rows_.body().make_field(1)),
        stiffness_(rows_.body().make_field(1)) {}

  /// Some block rows, in batches of the law.
  template <class Body>
  static void over_batches(std::span<const std::int32_t> rows, Body&& body) {
    constexpr auto batch = static_cast<std::size_t>(batch_points);
    parallel_for((rows.size() + batch - 1) / batch,
                 [&](std::size_t b) { body(rows.subspan(b * batch, std::min(batch, rows.size() - b * batch))); });
  }
  /// The same, one by one.
  template <class Body>
  static void over_rows(std::span<const std::int32_t> rows, Body&& body) {
    over_batches(rows, [&](std::span<const std::int32_t> batch) {
      for (const std::int32_t row : batch) body(static_cast<std::size_t>(row));
    });
  }

  /// Fbar - I of point p.
  T gradient(std::size_t p) const noexcept {
    T H{};
    for (int c = 0; c < D * D; ++c) H(c / D, c % D) = H_.component(c)[p];
    return H;
  }

  /// Keeps Fbar - I of point p, and its share c in the volumes of evaluation points (maps/selective_map.hpp). Fbar^-T; none where
  /// Jbar <= 0.
  std::optional<T> keep(std::size_t p, const T& H, double share) noexcept {
    for (int c = 0; c < D * D; ++c) H_.component(c)[p] = H(c / D, c % D);
    share_.data()[p] = share;
    const double j = jacobian_minus_one(H);
    if (!(j > -1)) return std::nullopt;
    logarithms_.data()[p] = std::log1p(j);
    return 1 / (1 + j) * cofactor(add_diagonal(H, 1.0));
  }

  /// Stiffness of the points that are this rank's. Field index of the first one where the law has none, or -1.
  std::int64_t find_stiffnesses(ConstFieldView u) {
    FirstBad bad;
    over_batches(roles_.own, [&](std::span<const std::int32_t> rows) {
      const std::int64_t point = find_stiffness(rows, memory_.mine());
      if (point >= 0) return bad.report(point);
      for (const std::int32_t row : rows)
        if (const std::size_t p = rows_.point(static_cast<std::size_t>(row)); laws_.laminates && laws_.laminates->near(static_cast<std::int32_t>(p)))
          if (!find_stiffness_of_laminates(p, u, memory_.mine())) bad.report(static_cast<std::int64_t>(p));
    });
    return bad.point();
  }
  void prepare_memory() const {
    memory_.prepare([&] { return std::make_unique<Memory>(parts_, laws_); });
  }

  SpaceParts parts_;
  LawsOfSpace laws_;
  BlockRows rows_;
  RowRoles roles_;
  mutable PerThread<Memory> memory_;

 private:
  /// That of the energy at Fbar, times the weight that is left. Field index of a point where the law has none, or -1.
  std::int64_t find_stiffness(std::span<const std::int32_t> batch_rows, Memory& m) {
    const int n = static_cast<int>(batch_rows.size());
    const auto row = [&](int l) { return static_cast<std::size_t>(batch_rows[static_cast<std::size_t>(l)]); };
    for (int l = 0; l < static_cast<int>(padded(static_cast<std::size_t>(n))); ++l) {
      const T H = l < n ? gradient(rows_.point(row(l))) : T{}, F = add_diagonal(H, 1.0);
      for (int c = 0; c < S::components; ++c) m.H[c * batch_points + l] = H[c], m.F[c * batch_points + l] = l < n ? F[c] : 0.0;
      m.owner[l] = static_cast<std::int32_t>(rows_.point(row(std::min(l, n - 1))));
    }
    parts_.laws.prepare(m.law, false);
    LawBatch batch;
    batch.n = n;
    batch.H = m.H;
    batch.dH = m.F;
    batch.points = m.owner;
    batch.P = m.P;
    batch.dP = m.dP;
    const Status status = parts_.laws.evaluate(batch, m.law);
    if (!status.ok()) return m.owner[status.inadmissible];
    for (int l = 0; l < n; ++l) {
      const std::size_t i = row(l), p = rows_.point(i);
      const double weight = rows_.volume(i) * (1 - parts_.families.damage(p)), share = share_.data()[p];
      stiffness_.data()[p] = weight * share * share * volume_stiffness(S::components, batch_points, m.F + l, m.P + l, m.dP + l);
    }
    return -1;
  }

  /// Near interfaces the stiffness of the evaluation points in place of that of one law. Of two materials in layers the softer one takes most of a
  /// change of volume: a stiffness that is too large would leave the rest of the tangent indefinite. False where the law has none.
  bool find_stiffness_of_laminates(std::size_t p, ConstFieldView u, Memory& m) {
    const double share = share_.data()[p];
    if (!(stiffness_.data()[p] > 0)) return true;
    m.points.read(p);
    double sum = 0;
    const auto finish = [&] {
      if (m.lanes.evaluate({u, 0}) >= 0) return false;
      for (int lane = 0; lane < m.lanes.lanes(); ++lane) sum += m.lanes.volume_stiffness(lane);
      m.lanes.clear();
      return true;
    };
    m.lanes.clear();
    for (int q = 0; q < m.points.points(); ++q) {
      if (m.lanes.lanes() == batch_points && !finish()) return false;
      const double weight = m.points.weight(q);
      if (weight == 0) continue;
      const int lane = m.lanes.add(p, m.points.far(q), q, weight, share);
      for (int c = 0; c < D; ++c) {
        double own[2][D], H[D];
        const auto gradient_at = [&](std::size_t at) -> const double* {
          double* const to = own[at == p ? 0 : 1];
          for (int e = 0; e < D; ++e) to[e] = H_.component(c * D + e)[at];
          return to;
        };
        m.points.gradient_of(q, [&](std::size_t at) { return u.component(c)[at]; }, gradient_at, H);
        for (int e = 0; e < D; ++e) {
          m.lanes.H(lane, c * D + e) = H[e];
          m.lanes.owner_H(lane, c * D + e) = H_.component(c * D + e)[p];
        }
      }
    }
    if (!finish()) return false;
    stiffness_.data()[p] = share * share * sum;
    return true;
  }

  Field H_;                        ///< Fbar - I at the state of the rows
  Field share_;                    ///< c of the selective map
  Field logarithms_, stiffness_;
};

/// On a lattice, with point gradients of order 1: products of whole rows of points, without stored stencils.
template <int D>
std::unique_ptr<VolumetricRows> make_lattice_volumes(const SpaceParts& parts, const LawsOfSpace& laws);

}  // namespace perikit
