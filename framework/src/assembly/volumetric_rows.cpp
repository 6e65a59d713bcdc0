#include "assembly/volumetric_rows.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "assembly/assembly.hpp"
#include "perikit/core/dimension.hpp"
#include "perikit/core/tensor.hpp"
#include "spaces/shift.hpp"

namespace perikit {

namespace {

/// b of one bond, zero beyond the dimension, and a vector of the field at a point: one neighbour, one multiply-add.
typedef float Entry __attribute__((vector_size(16)));
typedef double Vector __attribute__((vector_size(32)));

Vector widened(const Entry& b) noexcept {
  return __builtin_convertvector(b, Vector);
}

template <int D>
class Rows final : public VolumetricRows {
  using S = std::conditional_t<D == 3, Solid, std::conditional_t<D == 2, Plane, Line>>;
  using T = Tensor<double, S>;

 public:
  explicit Rows(const SpaceParts& parts)
      : parts_(parts),
        rows_(parts.families),
        own_(rows_.size()),
        row_(rows_.bonds()),
        column_(rows_.bonds()),
        H_(rows_.size()),
        share_(rows_.size()),
        logarithms_(rows_.body().make_field(1)),
        stiffness_(rows_.body().make_field(1)) {
    for (const std::int32_t j : rows_.lists().neighbour)
      far_.push_back(static_cast<std::int32_t>(rows_.point(static_cast<std::size_t>(j))));
  }

  std::int64_t linearise(ConstFieldView u) override {
    memory_.prepare([] { return std::make_unique<Memory>(); });
    FirstBad bad;
    over_batches([&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        if (!make_row(i, u, memory_.mine())) return bad.report(static_cast<std::int64_t>(rows_.point(i)));
      const std::int64_t point = find_stiffness(begin, end, memory_.mine());
      if (point >= 0) bad.report(point);
    });
    if (bad.point() >= 0) return bad.point();
    over_batches([&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) transpose_row(i);
    });
    return -1;
  }

  void rates(ConstFieldView w, FieldView q) const override {
    mirror_.resize(rows_.body().stride());
    over_batches([&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) mirror_[rows_.point(i)] = vector_at(w, rows_.point(i));
    });
    over_batches([&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        Vector sum = own_[i] * mirror_[rows_.point(i)];
        each(i, row_, [&](const Entry& b, std::size_t far) { sum += widened(b) * mirror_[far]; });
        q.data[rows_.point(i)] = total(sum);
      }
    });
  }

  void forces(ConstFieldView q, FieldView f) const override {
    over_batches([&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t p = rows_.point(i);
        Vector sum = own_[i] * q.data[p];
        each(i, column_, [&](const Entry& b, std::size_t far) { sum += widened(b) * q.data[far]; });
        for (int c = 0; c < D; ++c) f.component(c)[p] = sum[c];
      }
    });
  }

  void squares(ConstFieldView c, FieldView q) const override {
    over_batches([&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t p = rows_.point(i);
        Vector sum = own_[i] * own_[i] * vector_at(c, p);
        each(i, row_, [&](const Entry& b, std::size_t far) { sum += widened(b) * widened(b) * vector_at(c, far); });
        q.data[p] = total(sum);
      }
    });
  }

  ConstFieldView logarithms() const override { return logarithms_; }
  ConstFieldView stiffness() const override { return stiffness_; }

 private:
  struct Memory {
    FamilyArrays family;
    std::vector<double> g;
    LawScratch law;
    alignas(64) double H[9 * batch_points] = {}, F[9 * batch_points] = {}, P[9 * batch_points], dP[9 * batch_points];
    std::int32_t owner[batch_points];
  };

  template <class Body>
  void over_batches(Body&& body) const {
    constexpr auto batch = static_cast<std::size_t>(batch_points);
    const std::size_t n = rows_.size();
    parallel_for((n + batch - 1) / batch, [&](std::size_t b) { body(b * batch, std::min(n, (b + 1) * batch)); });
  }

  template <class Visit>
  void each(std::size_t i, const std::vector<Entry>& entries, Visit&& visit) const {
    for (std::size_t k = rows_.first(i); k < rows_.first(i + 1); ++k) visit(entries[k], static_cast<std::size_t>(far_[k]));
  }

  static Vector vector_at(ConstFieldView w, std::size_t p) noexcept {
    Vector x{};
    for (int c = 0; c < D; ++c) x[c] = w.component(c)[p];
    return x;
  }
  static double total(const Vector& x) noexcept { return (x[0] + x[1]) + x[2]; }

  /// b_ij = Fbar_i^-T g_ij; false where Jbar_i <= 0.
  bool make_row(std::size_t i, ConstFieldView u, Memory& m) {
    rows_.load(i, m.family);
    point_gradient(m.family, rows_.body().horizon(), parts_.formulation.order, m.g);
    if (parts_.shift.data) shift_gradient(m.family, rows_.point(i), parts_.shift, m.g);
    const std::size_t p = rows_.point(i), first = rows_.first(i);
    const auto neighbours = rows_.neighbours(i);
    T H{};
    bool regular = false;
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const std::size_t q = rows_.point(static_cast<std::size_t>(neighbours[k]));
      for (int c = 0; c < D; ++c)
        for (int e = 0; e < D; ++e) H(c, e) += (u.component(c)[q] - u.component(c)[p]) * m.g[k * D + static_cast<std::size_t>(e)];
      for (std::size_t e = 0; e < D; ++e) regular |= m.g[k * D + e] != 0;
    }
    H_[i] = H;
    share_[i] = regular ? parts_.families.left(p) : 0.0;
    const double j = jacobian_minus_one(H), J = 1 + j;
    if (!(J > 0)) return false;
    logarithms_.data()[p] = std::log1p(j);
    const T inverse_transpose = 1 / J * cofactor(add_diagonal(H, 1.0));
    own_[i] = Vector{};
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      Entry entry{};
      for (int c = 0; c < D; ++c) {
        double b = 0;
        for (int e = 0; e < D; ++e) b += inverse_transpose(c, e) * m.g[k * D + static_cast<std::size_t>(e)];
        entry[c] = static_cast<float>(b);
      }
      row_[first + k] = entry;
      own_[i] -= widened(entry);
    }
    return true;
  }

  /// d^2/dt^2 of the energy of exp(t/3) Fbar at t = 0, (F : A : F + P : F)/9, times the weight that is left. What a torn family
  /// shares in the volumes of its evaluation points is c (maps/selective_map.hpp).
  std::int64_t find_stiffness(std::size_t begin, std::size_t end, Memory& m) {
    const int n = static_cast<int>(end - begin);
    for (int l = 0; l < static_cast<int>(padded(static_cast<std::size_t>(n))); ++l) {
      const T H = l < n ? H_[begin + static_cast<std::size_t>(l)] : T{}, F = add_diagonal(H, 1.0);
      for (int c = 0; c < S::components; ++c) m.H[c * batch_points + l] = H[c], m.F[c * batch_points + l] = l < n ? F[c] : 0.0;
      m.owner[l] = static_cast<std::int32_t>(rows_.point(begin + static_cast<std::size_t>(std::min(l, n - 1))));
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
      const std::size_t i = begin + static_cast<std::size_t>(l), p = rows_.point(i);
      double sum = 0;
      for (int c = 0; c < S::components; ++c)
        sum += m.F[c * batch_points + l] * (m.dP[c * batch_points + l] + m.P[c * batch_points + l]);
      const double weight = rows_.volume(i) * (1 - parts_.families.damage(p));
      stiffness_.data()[p] = weight * share_[i] * share_[i] * std::max(0.0, sum / 9);
    }
    return -1;
  }

  /// b_ji of the neighbours j: families are symmetric.
  void transpose_row(std::size_t i) {
    for (std::size_t k = rows_.first(i); k < rows_.first(i + 1); ++k) {
      const auto j = static_cast<std::size_t>(rows_.lists().neighbour[k]);
      const auto back = rows_.neighbours(j);
      const auto at = std::lower_bound(back.begin(), back.end(), static_cast<std::int32_t>(i)) - back.begin();
      column_[k] = row_[rows_.first(j) + static_cast<std::size_t>(at)];
    }
  }

  SpaceParts parts_;
  BlockRows rows_;
  AlignedVector<Vector> own_;      ///< b_ii
  std::vector<std::int32_t> far_;  ///< field index by bond
  mutable AlignedVector<Vector> mirror_;
  std::vector<Entry> row_, column_;  ///< b_ij, b_ji by bond
  std::vector<T> H_;                 ///< Fbar - I at the state of the rows
  std::vector<double> share_;        ///< c of the selective map
  Field logarithms_, stiffness_;
  PerThread<Memory> memory_;
};

}  // namespace

std::unique_ptr<VolumetricRows> make_volumetric_rows(const SpaceParts& parts) {
  return with_dimension(parts.families.body().dimension(),
                        [&](auto d) -> std::unique_ptr<VolumetricRows> { return std::make_unique<Rows<d>>(parts); });
}

}  // namespace perikit
