#include "operators/laminate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace perikit {

namespace {

/// Factor of a symmetric matrix plus shift times the unit matrix, L of L L^T; false where that is not positive.
bool factorise(int d, const double (&K)[3][3], double shift, double least, double* L) noexcept {
  for (int i = 0, at = 0; i < d; ++i)
    for (int j = 0; j <= i; ++j, ++at) {
      double sum = K[i][j] + (i == j ? shift : 0.0);
      for (int k = 0; k < j; ++k) sum -= L[i * (i + 1) / 2 + k] * L[j * (j + 1) / 2 + k];
      if (i != j) {
        L[at] = sum / L[j * (j + 1) / 2 + j];
      } else if (sum > least) {
        L[at] = std::sqrt(sum);
      } else {
        return false;
      }
    }
  return true;
}

void solve(int d, const double* L, double* x) noexcept {
  for (int i = 0; i < d; ++i) {
    for (int k = 0; k < i; ++k) x[i] -= L[i * (i + 1) / 2 + k] * x[k];
    x[i] /= L[i * (i + 1) / 2 + i];
  }
  for (int i = d - 1; i >= 0; --i) {
    for (int k = i + 1; k < d; ++k) x[i] -= L[k * (k + 1) / 2 + i] * x[k];
    x[i] /= L[i * (i + 1) / 2 + i];
  }
}

constexpr double least_share = 1e-3;
constexpr int most_iterations = 100;
constexpr double smallest_step = 1e-12;
/// Strains below are as good as none: the front of rounding that runs ahead of a wave has strains without digits, where no iteration ends.
constexpr double smallest_strain = std::numeric_limits<double>::min() / std::numeric_limits<double>::epsilon();

}  // namespace

bool make_laminate(int dimension, const double* plus, const double* minus, LaminatePoint& out) noexcept {
  double normal[3] = {}, square = 0, positive = 0;
  for (int e = 0; e < dimension; ++e) {
    normal[e] = plus[e] - minus[e];
    square += normal[e] * normal[e];
    positive += normal[e] * plus[e];
  }
  // Where the gradient of the distance itself is far from a unit vector, the stencil sees a corner or both sides of a layer. On lattices just a half is
  // common, of bonds one of whose ends is in the middle of a layer: one of these, whatever rounding says.
  constexpr double half = 0.25 * (1 + 1e-6);
  if (square < half) return false;
  // What has next to no share has none: laws in series would let rounding of the share decide between stiffnesses far apart.
  double share = 1 - positive / square;
  if (share < least_share) share = 0;
  if (share > 1 - least_share) share = 1;
  out.share = share;
  for (int e = 0; e < 3; ++e) {
    out.direction[0][e] = (1 - share) * normal[e];
    out.direction[1][e] = -share * normal[e];
  }
  return true;
}

LaminateScratch::LaminateScratch(const Laws& laws)
    : laws_(laws), dimension_(dimension(laws.space())), components_(laws.components()) {
  laws.prepare(law_, true);
  for (Side& side : side_) {
    std::fill(std::begin(side.H), std::end(side.H), 0.0);
    side.A.assign(static_cast<std::size_t>(components_ * components_) * batch_points, 0.0);
  }
}

/// H_1 and H_2 of point k with its jump.
void LaminateScratch::place(const LaminateBatch& batch, int first, int k) noexcept {
  const LaminatePoint& laminate = *batch.laminate[first + k];
  const int lane = batch.lane[first + k];
  for (int s = 0; s < 2; ++s) {
    for (int c = 0; c < components_; ++c) {
      double h = batch.H[c * batch_points + lane];
      if (c < dimension_ * dimension_) h -= search_[k].jump[c / dimension_] * laminate.direction[s][c % dimension_];
      side_[s].H[c * batch_points + k] = h;
    }
  }
}

int LaminateScratch::evaluate_laws(int n, bool confined, std::uint16_t first, std::uint16_t second) {
  for (int s = 0; s < 2; ++s) {
    Side& side = side_[s];
    LawBatch call;
    call.n = n;
    call.H = side.H;
    call.confined = confined;
    call.points = side.point;
    call.psi = side.psi;
    call.P = side.P;
    call.A = side.A.data();
    call.lateral = side.lateral;
    const Status status = laws_.evaluate_law(s == 0 ? first : second, call, law_);
    if (!status.ok()) return status.inadmissible;
  }
  return -1;
}

/// d2 psi/da dH.
void LaminateScratch::mixed_tangent(const LaminatePoint& laminate, int k, double (&B)[3][9]) const noexcept {
  const double share[2] = {laminate.share, 1 - laminate.share};
  for (int i = 0; i < dimension_; ++i)
    for (int c = 0; c < components_; ++c) {
      B[i][c] = 0;
      for (int s = 0; s < 2; ++s)
        for (int e = 0; e < dimension_; ++e)
          B[i][c] -= share[s] * laminate.direction[s][e] *
                     side_[s].A[static_cast<std::size_t>(((i * dimension_ + e) * components_ + c) * batch_points + k)];
    }
}

/// A step of Newton's method with a line search; false where it cannot go on.
bool LaminateScratch::look(const LaminatePoint& laminate, int k, int iteration) noexcept {
  Search& search = search_[k];
  const int d = dimension_;
  const double share[2] = {laminate.share, 1 - laminate.share};
  const double energy = share[0] * side_[0].psi[k] + share[1] * side_[1].psi[k];
  double gradient[3] = {}, K[3][3] = {}, trace = 0, slope = 0, new_slope = 0;
  for (int i = 0; i < d; ++i)
    for (int s = 0; s < 2; ++s)
      for (int e = 0; e < d; ++e) {
        const double g = share[s] * laminate.direction[s][e];
        gradient[i] -= g * side_[s].P[(i * d + e) * batch_points + k];
        for (int j = 0; j < d; ++j)
          for (int f = 0; f < d; ++f)
            K[i][j] += g * laminate.direction[s][f] *
                       side_[s].A[static_cast<std::size_t>(((i * d + e) * components_ + j * d + f) * batch_points + k)];
      }
  for (int i = 0; i < d; ++i) {
    slope += search.gradient[i] * search.direction[i];
    new_slope += gradient[i] * search.direction[i];
  }
  if (iteration > 0) {
    // Energies of laws may have no digits left where strains are small: there the slopes tell, by the trapezoidal rule, how they differ.
    const double noise = 1e-13 * (std::abs(energy) + std::abs(search.energy)), allowed = 1e-4 * search.step * slope;
    const bool short_step = search.step * search.size < 1e-3;
    if (!(energy <= search.energy + allowed + noise) && !(short_step && 0.5 * search.step * (slope + new_slope) <= allowed)) {
      search.step *= 0.5;
      if (search.step < smallest_step) return false;
      return true;
    }
    for (int i = 0; i < d; ++i) search.jump[i] += search.step * search.direction[i];
  }
  for (int i = 0; i < d; ++i) trace += std::abs(K[i][i]);
  double shift = 0;
  while (!factorise(d, K, shift, 1e-12 * trace, search.factor)) {
    if (!(trace > 0) || shift > 1e6 * trace) return false;
    shift = shift == 0 ? 1e-3 * trace : 4 * shift;
  }
  double delta[3] = {};
  for (int i = 0; i < d; ++i) delta[i] = -gradient[i];
  solve(d, search.factor, delta);
  double size = 0, scale = smallest_strain, norm[2] = {};
  for (int s = 0; s < 2; ++s) {
    for (int e = 0; e < d; ++e) norm[s] = std::max(norm[s], std::abs(laminate.direction[s][e]));
    for (int c = 0; c < d * d; ++c) scale = std::max(scale, std::abs(side_[s].H[c * batch_points + k]));
  }
  for (int i = 0; i < d; ++i) size = std::max(size, std::abs(delta[i]) * std::max(norm[0], norm[1]));
  if (!std::isfinite(size)) return false;
  search.done = size <= 4e-15 * scale || (iteration > 2 && size <= 1e-9 * scale && size >= 0.25 * search.size);
  if (search.done) {
    std::fill_n(search.direction, 3, 0.0);
    return shift == 0;  // else a saddle: no a near this one stores least
  }
  std::copy_n(delta, 3, search.direction);
  std::copy_n(gradient, 3, search.gradient);
  search.energy = energy;
  search.size = size;
  search.step = 1;
  return true;
}

void LaminateScratch::write(const LaminateBatch& batch, int first, int k) const noexcept {
  const LaminatePoint& laminate = *batch.laminate[first + k];
  const int lane = batch.lane[first + k], d = dimension_, n = components_;
  const double share[2] = {laminate.share, 1 - laminate.share};
  const bool inside = laminate.share > 0 && laminate.share < 1;
  const auto mean = [&](const double* a, const double* b, int c) {
    return share[0] * a[c * batch_points + k] + share[1] * b[c * batch_points + k];
  };
  if (batch.psi) batch.psi[lane] = mean(side_[0].psi, side_[1].psi, 0);
  if (batch.lateral) batch.lateral[lane] = mean(side_[0].lateral, side_[1].lateral, 0);
  for (int c = 0; batch.P && c < n; ++c) batch.P[c * batch_points + lane] = mean(side_[0].P, side_[1].P, c);
  if (!batch.dP && !batch.A) return;
  double B[3][9] = {};
  if (inside) mixed_tangent(laminate, k, B);
  const auto tangent = [&](int s, int r, int c) { return side_[s].A[static_cast<std::size_t>((r * n + c) * batch_points + k)]; };
  if (batch.A) {
    for (int c = 0; c < n; ++c) {
      double x[3] = {B[0][c], B[1][c], B[2][c]};
      if (inside) solve(d, search_[k].factor, x);
      for (int r = 0; r < n; ++r) {
        double sum = share[0] * tangent(0, r, c) + share[1] * tangent(1, r, c);
        for (int i = 0; i < d; ++i) sum -= B[i][r] * x[i];
        batch.A[(r * n + c) * batch_points + lane] = sum;
      }
    }
  }
  if (!batch.dP) return;
  double jump[3] = {};
  for (int i = 0; i < d; ++i)
    for (int c = 0; c < n; ++c) jump[i] -= B[i][c] * batch.dH[c * batch_points + lane];
  if (inside) solve(d, search_[k].factor, jump);
  for (int r = 0; r < n; ++r) {
    double sum = 0;
    for (int s = 0; s < 2; ++s)
      for (int c = 0; c < n; ++c) {
        double dh = batch.dH[c * batch_points + lane];
        if (c < d * d) dh -= jump[c / d] * laminate.direction[s][c % d];
        sum += share[s] * tangent(s, r, c) * dh;
      }
    batch.dP[r * batch_points + lane] = sum;
  }
}

/// Points first ... first + n - 1 of the batch, all of the same two materials.
int LaminateScratch::evaluate_together(const LaminateBatch& batch, int first, int n) {
  const std::uint16_t* material = batch.laminate[first]->material;
  const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
  for (int k = 0; k < lanes; ++k) {
    search_[k] = {};
    // Of one material alone there is nothing to search.
    search_[k].done = k >= n || !(batch.laminate[first + k]->share > 0 && batch.laminate[first + k]->share < 1);
    for (int s = 0; s < 2; ++s) side_[s].point[k] = batch.laminate[first + (k < n ? k : 0)]->point[s];
    if (k < n) {
      place(batch, first, k);
      continue;
    }
    for (Side& side : side_)
      for (int c = 0; c < components_; ++c) side.H[c * batch_points + k] = 0.0;
  }
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    for (int bad = evaluate_laws(n, batch.confined, material[0], material[1]); bad >= 0;
         bad = evaluate_laws(n, batch.confined, material[0], material[1])) {
      // An admissible H_q has an admissible beginning; from there on steps that leave what is admissible are shortened.
      Search& search = search_[bad];
      if (iteration == 0 || search.done || (search.step *= 0.5) < smallest_step) return first + bad;
      const Search kept = search;
      for (int i = 0; i < 3; ++i) search.jump[i] += search.step * search.direction[i];
      place(batch, first, bad);
      std::copy_n(kept.jump, 3, search.jump);
    }
    bool all = true;
    for (int k = 0; k < n; ++k) {
      Search& search = search_[k];
      if (search.done) continue;
      if (!look(*batch.laminate[first + k], k, iteration)) return first + k;
      if (search.done) continue;
      all = false;
      const Search kept = search;
      for (int i = 0; i < 3; ++i) search.jump[i] += search.step * search.direction[i];
      place(batch, first, k);
      std::copy_n(kept.jump, 3, search.jump);
    }
    if (!all) continue;
    for (int k = 0; k < n; ++k) write(batch, first, k);
    return -1;
  }
  for (int k = 0; k < n; ++k)
    if (!search_[k].done) return first + k;
  return -1;
}

int LaminateScratch::evaluate(const LaminateBatch& batch) {
  for (int first = 0; first < batch.n;) {
    const auto same = [&](int k) { return std::ranges::equal(batch.laminate[k]->material, batch.laminate[first]->material); };
    int end = first + 1;
    while (end < batch.n && same(end)) ++end;
    const int bad = evaluate_together(batch, first, end - first);
    if (bad >= 0) return batch.lane[bad];
    first = end;
  }
  return -1;
}

}  // namespace perikit
