#include "assembly/volumetric_rows.hpp"

#include <algorithm>

#include "assembly/volumetric_state.hpp"
#include "core/dimension.hpp"
#include "perikit/core/field_operations.hpp"

namespace perikit {

namespace {

/// b of one bond, zero beyond the dimension, and a vector of the field at a point: one neighbour, one multiply-add.
typedef float Entry __attribute__((vector_size(16)));
typedef double Vector __attribute__((vector_size(32)));

Vector widened(const Entry& b) noexcept {
  return __builtin_convertvector(b, Vector);
}

template <int D>
class StoredRows final : public VolumetricState<D> {
  using Base = VolumetricState<D>;
  using typename Base::Memory;
  using typename Base::T;
  using Base::roles_;
  using Base::rows_;

 public:
  StoredRows(const SpaceParts& parts, const LawsOfSpace& laws)
      : Base(parts, laws), own_(rows_.size()), row_(rows_.bonds()), column_(rows_.bonds()) {
    for (const std::int32_t j : rows_.lists().neighbour)
      far_.push_back(static_cast<std::int32_t>(rows_.point(static_cast<std::size_t>(j))));
  }

  std::int64_t linearise(ConstFieldView u) override {
    this->prepare_memory();
    FirstBad bad;
    this->over_rows(roles_.felt, [&](std::size_t i) {
      if (!make_row(i, u, this->memory_.mine())) bad.report(static_cast<std::int64_t>(rows_.point(i)));
    });
    if (bad.point() >= 0) return bad.point();
    this->over_rows(roles_.complete, [&](std::size_t i) { transpose_row(i); });
    return this->find_stiffnesses(u);
  }

  void rates(ConstFieldView w, FieldView q) const override {
    mirror_.resize(rows_.body().stride());
    parallel_for(rows_.size(), [&](std::size_t i) { mirror_[rows_.point(i)] = vector_at(w, rows_.point(i)); });
    this->over_rows(roles_.own, [&](std::size_t i) {
      Vector sum = own_[i] * mirror_[rows_.point(i)];
      each(i, row_, [&](const Entry& b, std::size_t far) { sum += widened(b) * mirror_[far]; });
      q.data[rows_.point(i)] = total(sum);
    });
  }

  void forces(ConstFieldView q, FieldView f) const override {
    if (rows_.body().part()) fill(0.0, f);
    this->over_rows(roles_.complete, [&](std::size_t i) {
      const std::size_t p = rows_.point(i);
      Vector sum = own_[i] * q.data[p];
      each(i, column_, [&](const Entry& b, std::size_t far) { sum += widened(b) * q.data[far]; });
      for (int c = 0; c < D; ++c) f.component(c)[p] = sum[c];
    });
  }

  void squares(ConstFieldView c, FieldView q) const override {
    this->over_rows(roles_.own, [&](std::size_t i) {
      const std::size_t p = rows_.point(i);
      Vector sum = own_[i] * own_[i] * vector_at(c, p);
      each(i, row_, [&](const Entry& b, std::size_t far) { sum += widened(b) * widened(b) * vector_at(c, far); });
      q.data[p] = total(sum);
    });
  }

 private:
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
    const std::size_t p = rows_.point(i), first = rows_.first(i);
    m.points.read(p);
    const double* const g = m.points.own();
    const auto neighbours = rows_.neighbours(i);
    T H{};
    bool regular = false;
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const std::size_t q = rows_.point(static_cast<std::size_t>(neighbours[k]));
      for (int c = 0; c < D; ++c)
        for (int e = 0; e < D; ++e) H(c, e) += (u.component(c)[q] - u.component(c)[p]) * g[k * D + static_cast<std::size_t>(e)];
      for (std::size_t e = 0; e < D; ++e) regular |= g[k * D + e] != 0;
    }
    const std::optional<T> inverse_transpose = this->keep(p, H, regular ? this->parts_.families.remaining_influence(p) : 0.0);
    if (!inverse_transpose) return false;
    own_[i] = Vector{};
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      Entry entry{};
      for (int c = 0; c < D; ++c) {
        double b = 0;
        for (int e = 0; e < D; ++e) b += (*inverse_transpose)(c, e) * g[k * D + static_cast<std::size_t>(e)];
        entry[c] = static_cast<float>(b);
      }
      row_[first + k] = entry;
      own_[i] -= widened(entry);
    }
    return true;
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

  AlignedVector<Vector> own_;      ///< b_ii; 0, as b_ij, in rows that nobody feels
  std::vector<std::int32_t> far_;  ///< field index by bond
  mutable AlignedVector<Vector> mirror_;
  std::vector<Entry> row_, column_;  ///< b_ij, b_ji by bond
};

}  // namespace

std::unique_ptr<VolumetricRows> make_volumetric_rows(const SpaceParts& parts, const LawsOfSpace& laws) {
  const bool plain = parts.families.lattice() && parts.formulation.order == 1 && !parts.shift.data;
  return with_dimension(parts.families.body().dimension(), [&](auto d) -> std::unique_ptr<VolumetricRows> {
    if (plain) return make_lattice_volumes<d>(parts, laws);
    return std::make_unique<StoredRows<d>>(parts, laws);
  });
}

}  // namespace perikit
