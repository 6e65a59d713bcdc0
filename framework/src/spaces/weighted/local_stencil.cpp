#include "spaces/weighted/local_stencil.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "families/reproducing_kernel.hpp"
#include "families/stencils.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

namespace {

/// Rows of the influence that are multiplied at a time; a multiple of every pack width.
constexpr int tile = pack_registers == 32 ? 8 : 4;
/// Packs of bonds, and rows of stresses, whose sums are found at a time.
constexpr int bond_packs = pack_registers == 32 ? 2 : 4;
template <int D>
constexpr int stress_rows = pack_registers == 32 ? D : 1;

/// out[column * stride + q] = sum_k weight[q * row + k] columns[k * width + column] for a tile of q and P packs of columns. The
/// sums stay in registers; they come out with q along the lanes.
template <int P>
void multiply_tile(const double* weight, std::size_t row, int bonds, const double* columns, std::size_t width, double* out,
                   std::size_t stride) noexcept {
  Pack sums[tile][P];
  for (std::size_t k = 0; k < static_cast<std::size_t>(bonds); ++k) {
    Pack x[P];
    for (int p = 0; p < P; ++p) x[p] = Pack::load(columns + k * width + static_cast<std::size_t>(p * pack_width));
    for (std::size_t q = 0; q < tile; ++q) {
      const Pack w(weight[q * row + k]);
      for (int p = 0; p < P; ++p) sums[q][p] += w * x[p];
    }
  }
  for (int p = 0; p < P; ++p)
    for (int q = 0; q < tile; q += pack_width) {
      Pack rows[pack_width];
      for (int i = 0; i < pack_width; ++i) rows[i] = sums[q + i][p];
      transpose(rows);
      for (int i = 0; i < pack_width; ++i)
        rows[i].store(out + static_cast<std::size_t>(p * pack_width + i) * stride + static_cast<std::size_t>(q));
    }
}

/// t[c] at bonds k ... += b_k . sum_q S_q(c, :) omega_q(k), C packs of bonds at a time.
template <int D, int C>
void adjoint_tile(const double* weight, std::size_t row, int points, const double* stress, std::size_t lanes, const double* lever,
                  double* const (&t)[D], std::size_t k) noexcept {
  constexpr int rows = stress_rows<D>;
  for (int first = 0; first < D; first += rows) {
    Pack sums[rows * D][C];
    for (std::size_t q = 0; q < static_cast<std::size_t>(points); ++q) {
      Pack s[rows * D];
      for (int c = 0; c < rows * D; ++c) s[c] = Pack(stress[static_cast<std::size_t>(first * D + c) * lanes + q]);
      for (int p = 0; p < C; ++p) {
        const Pack w = Pack::load(weight + q * row + k + static_cast<std::size_t>(p * pack_width));
        for (int c = 0; c < rows * D; ++c) sums[c][p] += s[c] * w;
      }
    }
    for (int p = 0; p < C; ++p)
      for (int c = 0; c < rows; ++c) {
        const std::size_t at = k + static_cast<std::size_t>(p * pack_width);
        Pack force(0.0);
        for (int e = 0; e < D; ++e) force += sums[c * D + e][p] * Pack::load(lever + static_cast<std::size_t>(e) * row + at);
        force.store(t[first + c] + at);
      }
  }
}

/// Inverse of symmetric K by cofactors; `regular` and `poor` where it is sure that the eigenvalues spread by less, or more, than
/// 1 / ratio: the product of the norms of K and K^-1 is at least their spread, and at most D times as much.
template <int D>
void invert_lanes(const Pack* K, double ratio, Pack* inverse, PackMask& regular, PackMask& poor) noexcept {
  Pack square(0.0), m[6];
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) square += K[symmetric_index(D, a, b)] * K[symmetric_index(D, a, b)];
  const Pack size = sqrt(square), scale = 1.0 / size;
  for (int c = 0; c < symmetric_components(D); ++c) m[c] = scale * K[c];
  Pack cofactor[6], det;
  if constexpr (D == 1) {
    cofactor[0] = Pack(1.0);
    det = m[0];
  } else if constexpr (D == 2) {
    cofactor[0] = m[1];
    cofactor[1] = m[0];
    cofactor[2] = -m[2];
    det = m[0] * m[1] - m[2] * m[2];
  } else {
    const Pack xx = m[0], yy = m[1], zz = m[2], xy = m[3], xz = m[4], yz = m[5];
    cofactor[0] = yy * zz - yz * yz;
    cofactor[1] = xx * zz - xz * xz;
    cofactor[2] = xx * yy - xy * xy;
    cofactor[3] = xz * yz - xy * zz;
    cofactor[4] = xy * yz - xz * yy;
    cofactor[5] = xy * xz - xx * yz;
    det = xx * cofactor[0] + xy * cofactor[3] + xz * cofactor[4];
  }
  Pack norm(0.0);
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) norm += cofactor[symmetric_index(D, a, b)] * cofactor[symmetric_index(D, a, b)];
  const Pack bound = sqrt(norm) * ratio;
  regular = (det > Pack(1e-12)) & (bound < det);
  poor = !(det > Pack(1e-12)) | (det * Pack(D) < bound);  // K has norm 1: such a determinant means a spread above 1e5
  const Pack by = scale / det;
  for (int c = 0; c < symmetric_components(D); ++c) inverse[c] = select(regular, cofactor[c] * by, Pack(0.0));
}

}  // namespace

template <int D>
void LocalStencil<D>::multiply(int begin, int end) noexcept {
  const int packs = static_cast<int>(width_) / pack_width;
  for (int q = begin / tile * tile; q < end; q += tile) {
    const double* weight = omega_.data() + static_cast<std::size_t>(q) * row_;
    for (int p = 0; p < packs;) {
      const auto first = static_cast<std::size_t>(p * pack_width);
      double* out = moments_.data() + first * lanes_ + static_cast<std::size_t>(q);
      const double* columns = columns_.data() + first;
      const int left = packs - p, take = left == 3 ? 3 : std::min(left, 2);
      // Calls, not a choice among function pointers: g++ 12 compiles a conditional over three of them wrongly for many Intel processors
      // (-mtune=skylake and its like), so that the second function runs where the third is meant.
      switch (take) {
        case 3: multiply_tile<3>(weight, row_, bonds_, columns, width_, out, lanes_); break;
        case 2: multiply_tile<2>(weight, row_, bonds_, columns, width_, out, lanes_); break;
        default: multiply_tile<1>(weight, row_, bonds_, columns, width_, out, lanes_);
      }
      p += take;
    }
  }
}

template <int D>
template <int Fields>
void LocalStencil<D>::fill_columns(const FamilyArrays& family, const double* const (*u)[D]) {
  constexpr int entries = symmetric_components(D), used = entries + Fields * D * D;
  constexpr std::size_t width = static_cast<std::size_t>(used + pack_width - 1) / pack_width * pack_width;
  width_ = width;
  columns_.resize(row_ * width);
  for (std::size_t k = 0; k < row_; k += pack_width) {
    Pack b[D], column[width];  // the rest of the last pack: zero
    for (std::size_t e = 0; e < D; ++e) b[e] = Pack::load(lever_.data() + e * row_ + k);
    for (int e = 0; e < D; ++e) {
      const Pack xi = Pack::load(family.xi[e].data() + k);
      for (int a = 0; a <= e; ++a) column[symmetric_index(D, a, e)] = b[a] * xi;
    }
    for (int f = 0; f < Fields; ++f)
      for (int c = 0; c < D; ++c) {
        const Pack v = Pack::load(u[f][c] + k);
        for (int e = 0; e < D; ++e) column[entries + (f * D + c) * D + e] = v * b[e];
      }
    for (std::size_t first = 0; first < width; first += pack_width) {
      Pack rows[pack_width];
      for (std::size_t i = 0; i < pack_width; ++i) rows[i] = column[first + i];
      transpose(rows);
      for (std::size_t i = 0; i < pack_width; ++i) rows[i].store(columns_.data() + (k + i) * width + first);
    }
  }
}

template <int D>
void LocalStencil<D>::invert_one(int q, double ratio) {
  constexpr int entries = symmetric_components(D);
  double K[entries], inverse[entries], spread;
  for (std::size_t c = 0; c < entries; ++c) K[c] = moments_[c * lanes_ + static_cast<std::size_t>(q)];
  const bool regular = invert_shape(D, K, inverse, &spread) && spread * ratio < 1;
  for (std::size_t c = 0; c < entries; ++c) inverse_[c * lanes_ + static_cast<std::size_t>(q)] = regular ? inverse[c] : 0.0;
  regular_[static_cast<std::size_t>(q)] = regular;
}

template <int D>
void LocalStencil<D>::invert_all(double ratio) {
  constexpr int entries = symmetric_components(D);
  for (std::size_t q = 0; q < lanes_; q += pack_width) {
    Pack K[entries], inverse[entries];
    PackMask regular, poor;
    for (std::size_t c = 0; c < entries; ++c) K[c] = Pack::load(moments_.data() + c * lanes_ + q);
    invert_lanes<D>(K, ratio, inverse, regular, poor);
    for (std::size_t c = 0; c < entries; ++c) inverse[c].store(inverse_.data() + c * lanes_ + q);
    for (int i = 0; i < pack_width; ++i) {
      const std::size_t at = q + static_cast<std::size_t>(i);
      regular_[at] = regular[i];
      if (!regular[i] && !poor[i]) invert_one(static_cast<int>(at), ratio);
    }
  }
}

template <int D>
double LocalStencil<D>::least_ratio(const FamilyArrays& family, double beside) const {
  double whole[6] = {};
  for (int a = 0; a < D; ++a)
    for (int b = a; b < D; ++b) {
      EightSums sums;
      for (std::size_t k = 0; k < row_; k += pack_width)
        sums.at(static_cast<int>(k)) += Pack::load(family.omega.data() + k) * Pack::load(lever_.data() + static_cast<std::size_t>(a) * row_ + k) *
                 Pack::load(family.xi[b].data() + k);
      whole[symmetric_index(D, a, b)] = sums.total();
    }
  return std::max(poor_ratio, beside * eigenvalue_ratio(D, whole));
}

template <int D>
void LocalStencil<D>::set_lever(const StencilRules& rules, const FamilyArrays& family) {
  lever_.resize(D * row_);
  if (rules.at_points()) {
    std::vector<double> g;
    order_ = point_gradient(family, rules.horizon, rules.formulation->order, g);
    fallbacks_ = order_ < rules.formulation->order;
    std::fill(lever_.begin(), lever_.end(), 0.0);
    for (std::size_t k = 0; k < static_cast<std::size_t>(bonds_); ++k)
      for (std::size_t e = 0; e < D; ++e) lever_[e * row_ + k] = g[k * D + e];
  } else {
    for (std::size_t e = 0; e < D; ++e)
      for (std::size_t k = 0; k < row_; ++k) lever_[e * row_ + k] = family.volume[k] * family.xi[e][k];
  }
}

template <int D>
void LocalStencil<D>::weigh(const StencilRules& rules, const FamilyArrays& family, double* rows) {
  FamilyView view = family.view(rules.horizon);
  if (family.integrity.empty()) return rules.formulation->weighted->weights(view, rows, row_);
  // Weakened bonds: the influence is that of whole ones, times b, however a kinematics makes use of omega.
  view.omega = family.whole.data();
  rules.formulation->weighted->weights(view, rows, row_);
  for (int q = rules.formulation->selective() ? 1 : 0; q < points_; ++q, rows += row_)
    for (std::size_t k = 0; k < static_cast<std::size_t>(bonds_); ++k) rows[k] *= family.integrity[k];
}

template <int D>
void LocalStencil<D>::build(const StencilRules& rules, const FamilyArrays& family, const double* bond_share, int fields,
                            const double* const (*u)[D], double family_volume) {
  make(rules, family, bond_share, fields, u, family_volume);
  shift_.clear();
  if (rules.at_points() && points_ > 1 && order_ > 1) set_cell(rules, family);
  else if (rules.shift.data) set_shift(rules, family);
  else return;
  shift_.gradients(fields, u);
}

template <int D>
void LocalStencil<D>::set_cell(const StencilRules& rules, const FamilyArrays& family) {
  const double s = rules.formulation->cell * std::sqrt(D / 12.0);
  std::array<std::array<double, 3>, 2 * D> places{};
  for (std::size_t q = 0; q < places.size(); ++q) places[q][q / 2] = q % 2 == 0 ? s : -s;
  std::vector<double> g;
  kernel_gradients_at(family, rules.horizon, order_, places, g);
  shift_.begin(points_, family);
  double* d = g.data();
  for (int q = 0; q < points_; ++q, d += static_cast<std::size_t>(bonds_) * D) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(bonds_); ++k)
      for (std::size_t e = 0; e < D; ++e) d[k * D + e] -= lever_[e * row_ + k];
    shift_.set(q, d);
  }
}

template <int D>
void LocalStencil<D>::set_shift(const StencilRules& rules, const FamilyArrays& family) {
  const bool selective = rules.formulation->selective();
  shift_.begin(rules.formulation->parts(D) > 0 ? points_ : selective ? 1 : 0, family);
  std::vector<double> g(static_cast<std::size_t>(bonds_) * D);
  for (int q = 0; q < shift_.points(); ++q) {
    expand_one(q, g.data());
    shift_.set(q, family, omega_.data() + static_cast<std::size_t>(q) * row_, g.data(), rules.shift, selective && q > 0 ? D : 0);
  }
}

template <int D>
void LocalStencil<D>::make(const StencilRules& rules, const FamilyArrays& family, const double* bond_share, int fields,
                           const double* const (*u)[D], double family_volume) {
  bonds_ = family.bonds;
  row_ = family.size;
  fallbacks_ = dropped_ = 0;
  set_lever(rules, family);
  constexpr std::size_t entries = symmetric_components(D);
  const int parts = rules.formulation->parts(D), first = rules.formulation->selective() ? 1 : 0;
  const bool by_bond = parts == 0;
  points_ = first + (by_bond ? bonds_ : parts);
  lanes_ = padded(static_cast<std::size_t>(points_));
  if (fields == 0)
    fill_columns<0>(family, u);
  else if (fields == 1)
    fill_columns<1>(family, u);
  else
    fill_columns<2>(family, u);
  omega_.resize(lanes_ * row_);
  moments_.resize(width_ * lanes_);
  inverse_.resize(entries * lanes_);
  regular_.resize(lanes_);
  stress_.assign(D * D * lanes_, 0.0);
  share_.assign(lanes_, 0.0);
  const auto row = [&](int q) { return omega_.data() + static_cast<std::size_t>(q) * row_; };
  std::fill(row(points_), omega_.data() + omega_.size(), 0.0);
  if (rules.at_points()) {
    std::fill(row(0), row(points_), 1.0);
    multiply(0, points_);
    std::fill(inverse_.begin(), inverse_.end(), 0.0);
    for (std::size_t q = 0; q < static_cast<std::size_t>(points_); ++q) {
      for (int e = 0; e < D; ++e) inverse_[static_cast<std::size_t>(symmetric_index(D, e, e)) * lanes_ + q] = 1.0;
      share_[q] = 1.0 / points_;
    }
    return;
  }
  const auto use_family = [&](int q) {
    std::copy_n(family.omega.data(), row_, row(q));
    multiply(q, q + 1);
    if (!family.fragment) invert_one(q, singular_ratio);
  };
  weigh(rules, family, row(first));
  if (first == 1) std::copy_n(family.omega.data(), row_, row(0));
  multiply(0, points_);
  // The ratio of a family is at most 1: most domains need not ask for it.
  if (by_bond) invert_all(domain_ratio);
  if (!by_bond || std::find(regular_.begin() + first, regular_.begin() + points_, 0) != regular_.begin() + points_)
    invert_all(least_ratio(family, by_bond ? domain_ratio : part_ratio));
  if (first == 1 && !regular_[0]) invert_one(0, singular_ratio);
  if (family.fragment) {
    std::ranges::fill(regular_, std::uint8_t{0});
    std::ranges::fill(inverse_, 0.0);
  }
  double total = 0;
  for (int q = first; q < points_; ++q) {
    double& share = share_[static_cast<std::size_t>(q)];
    const bool regular = regular_[static_cast<std::size_t>(q)];
    if (by_bond) {
      share = bond_share[q - first];
      if (regular) continue;
      ++fallbacks_;
      use_family(q);
    } else if (!regular) {
      ++dropped_;
    } else if (rules.formulation->part_weight == PartWeight::equal) {
      total += share = 1.0;
    } else {
      // Volume of the part: bonds that it shares count with their share.
      for (std::size_t k = 0; k < static_cast<std::size_t>(bonds_); ++k)
        if (family.omega[k] > 0) share += row(q)[k] / family.omega[k] * family.volume[k];
      total += share;
    }
  }
  tested_.clear();
  if (by_bond) return rules.local() ? set_tested(family, family_volume, first) : void();
  if (!(total > 0)) {
    ++fallbacks_;
    use_family(first);
    share_[static_cast<std::size_t>(first)] = total = 1.0;
  }
  for (double& share : share_) share /= total;
}

template <int D>
void LocalStencil<D>::set_tested(const FamilyArrays& family, double family_volume, int first) {
  tested_.assign(static_cast<std::size_t>(bonds_), 0.0);
  for (std::size_t q = 0; q < tested_.size(); ++q) {
    const double* row = omega_.data() + (q + static_cast<std::size_t>(first)) * row_;
    double volume = 0;
    for (std::size_t k = 0; k < tested_.size(); ++k)
      if (family.omega[k] > 0) volume += row[k] / family.omega[k] * family.volume[k];
    const double share = share_[q + static_cast<std::size_t>(first)];
    tested_[q] = share > 0 ? volume / family_volume / share : 0.0;
  }
}

template <int D>
void LocalStencil<D>::gradient(int field, int first, int n, double* H, std::size_t stride) const noexcept {
  const double* moment = moments_.data() + static_cast<std::size_t>(symmetric_components(D) + field * D * D) * lanes_ + first;
  const double* inverse = inverse_.data() + first;
  for (std::size_t l = 0; l < static_cast<std::size_t>(n); l += pack_width)
    for (std::size_t c = 0; c < D; ++c)
      for (int e = 0; e < D; ++e) {
        Pack sum(0.0);
        for (int a = 0; a < D; ++a)
          sum += Pack::load(moment + (c * D + static_cast<std::size_t>(a)) * lanes_ + l) *
                 Pack::load(inverse + static_cast<std::size_t>(symmetric_index(D, a, e)) * lanes_ + l);
        sum.store(H + (c * D + static_cast<std::size_t>(e)) * stride + l);
      }
  shift_.add_gradient(field, first, n, H, stride);
}

template <int D>
void LocalStencil<D>::add_stress(int first, int n, const double* P, std::size_t stride) noexcept {
  const double* inverse = inverse_.data() + first;
  double* stress = stress_.data() + first;
  for (std::size_t l = 0; l < static_cast<std::size_t>(n); l += pack_width)
    for (std::size_t c = 0; c < D; ++c)
      for (int a = 0; a < D; ++a) {
        double* at = stress + (c * D + static_cast<std::size_t>(a)) * lanes_ + l;
        Pack sum = Pack::load(at);
        for (int e = 0; e < D; ++e)
          sum += Pack::load(P + (c * D + static_cast<std::size_t>(e)) * stride + l) *
                 Pack::load(inverse + static_cast<std::size_t>(symmetric_index(D, a, e)) * lanes_ + l);
        sum.store(at);
      }
  shift_.add_stress(first, n, P, stride);
}

template <int D>
void LocalStencil<D>::adjoint(double* const (&t)[D]) noexcept {
  constexpr std::size_t pack = pack_width;
  std::size_t k = 0;
  // Of local force states only the owner's own gradient (selective map) acts through all bonds.
  const int points = tested_.empty() ? points_ : points_ - bonds_;
  for (constexpr std::size_t step = bond_packs * pack; k + step <= row_; k += step)
    adjoint_tile<D, bond_packs>(omega_.data(), row_, points, stress_.data(), lanes_, lever_.data(), t, k);
  for (; k < row_; k += pack) adjoint_tile<D, 1>(omega_.data(), row_, points, stress_.data(), lanes_, lever_.data(), t, k);
  for (std::size_t b = 0; b < tested_.size(); ++b) {
    const std::size_t q = b + static_cast<std::size_t>(points);
    for (std::size_t c = 0; c < D; ++c)
      for (std::size_t e = 0; e < D; ++e) t[c][b] += tested_[b] * omega_[q * row_ + b] * stress_[(c * D + e) * lanes_ + q] * lever_[e * row_ + b];
  }
  if (!shift_.empty()) shift_.add_adjoint(t);
}

template <int D>
void LocalStencil<D>::expand_one(int q, double* g) const {
  double inverse[symmetric_components(D)], b[D], of_bond[D];
  for (int c = 0; c < symmetric_components(D); ++c) inverse[c] = this->inverse(q, c);
  for (std::size_t k = 0; k < static_cast<std::size_t>(bonds_); ++k) {
    for (std::size_t a = 0; a < D; ++a) b[a] = lever_[a * row_ + k];
    weighted_stencil<D>(influences(q)[k], inverse, b, of_bond);
    std::copy_n(of_bond, D, g + k * D);
  }
}

template <int D>
void LocalStencil<D>::expand(std::vector<double>& g) const {
  const auto bonds = static_cast<std::size_t>(bonds_);
  g.assign(static_cast<std::size_t>(points_) * bonds * D, 0.0);
  for (int q = 0; q < points_; ++q) {
    double* const to = g.data() + static_cast<std::size_t>(q) * bonds * D;
    expand_one(q, to);
    for (std::size_t k = 0; k < bonds && q < shift_.points(); ++k)
      for (std::size_t e = 0; e < D; ++e) to[k * D + e] += shift_.d(q, k, e);
  }
}

template class LocalStencil<1>;
template class LocalStencil<2>;
template class LocalStencil<3>;

}  // namespace perikit
