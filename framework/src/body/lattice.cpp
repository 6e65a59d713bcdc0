#include "perikit/body/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <set>

#include "body/family_limit.hpp"
#include "perikit/core/field.hpp"

namespace perikit {

std::array<std::int64_t, 3> Lattice::cell(std::int64_t index) const noexcept {
  const std::int64_t rest = index - base;
  const std::int64_t row = pitch[0] > 0 ? rest / pitch[0] : 0;
  return {rest - row * pitch[0], pitch[1] > 0 ? row % pitch[1] : row, pitch[1] > 0 ? row / pitch[1] : 0};
}

std::array<double, 3> Lattice::centre(const std::array<std::int64_t, 3>& k) const noexcept {
  std::array<double, 3> x{};
  for (int a = 0; a < dimension; ++a) {
    x[static_cast<std::size_t>(axis[a])] =
        lower[static_cast<std::size_t>(axis[a])] + (static_cast<double>(k[a] + first[a] + origin[a]) + 0.5) * spacing;
  }
  return x;
}

std::int64_t Lattice::input_number(const std::array<std::int64_t, 3>& cell) const noexcept {
  std::array<std::int64_t, 3> k{}, n{};
  for (std::size_t a = 0; a < 3; ++a) {
    k[static_cast<std::size_t>(axis[a])] = cell[a];
    n[static_cast<std::size_t>(axis[a])] = extent[a];
  }
  return k[0] + n[0] * (k[1] + n[1] * k[2]);
}

std::array<std::int64_t, 3> Lattice::cell_of_input(std::int64_t number) const noexcept {
  std::array<std::int64_t, 3> n{}, cell{};
  for (std::size_t a = 0; a < 3; ++a) n[static_cast<std::size_t>(axis[a])] = extent[a];
  const std::array<std::int64_t, 3> k{number % n[0], number / n[0] % n[1], number / n[0] / n[1]};
  for (std::size_t a = 0; a < 3; ++a) cell[a] = k[static_cast<std::size_t>(axis[a])];
  return cell;
}

std::array<std::int64_t, 3> Lattice::around(const std::array<double, 3>& x) const noexcept {
  std::array<std::int64_t, 3> k{};
  for (std::size_t a = 0; a < static_cast<std::size_t>(dimension); ++a) {
    const auto along = static_cast<std::size_t>(axis[a]);
    k[a] = std::llround((x[along] - lower[along]) / spacing - 0.5) - origin[a] - first[a];
  }
  return k;
}

std::int64_t lattice_cells(double lower, double upper, double spacing) {
  // The last point may lie on `upper` up to rounding.
  return static_cast<std::int64_t>(std::floor((upper - lower) / spacing * (1 + 1e-12) + 0.5 + 1e-9));
}

namespace {

/// The longest axis first.
void set_cells(Lattice& lattice, const std::array<std::int64_t, 3>& cells) {
  lattice.axis = {0, 1, 2};
  std::stable_sort(lattice.axis.begin(), lattice.axis.begin() + lattice.dimension, [&](int a, int b) {
    return cells[static_cast<std::size_t>(a)] > cells[static_cast<std::size_t>(b)];
  });
  lattice.extent = {1, 1, 1};
  for (int k = 0; k < lattice.dimension; ++k) lattice.extent[k] = cells[static_cast<std::size_t>(lattice.axis[k])];
  lattice.whole = lattice.extent;
}

/// Pitches and sizes, from the extent.
void lay_out(Lattice& lattice, double horizon) {
  std::array<std::int64_t, 3> reach{};
  for (int k = 0; k < lattice.dimension; ++k)
    reach[k] = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(family_limit(horizon / lattice.spacing))), 0,
                                        lattice.extent[k] - 1);
  lattice.pitch[0] = static_cast<std::int64_t>(padded(static_cast<std::size_t>(lattice.extent[0] + reach[0])));
  lattice.pitch[1] = lattice.extent[1] + reach[1];
  lattice.reach = reach[0] + lattice.pitch[0] * (reach[1] + lattice.pitch[1] * reach[2]);
  lattice.base = static_cast<std::int64_t>(padded(static_cast<std::size_t>(lattice.reach)));
  const std::int64_t last = lattice.index(lattice.extent[0] - 1, lattice.extent[1] - 1, lattice.extent[2] - 1);
  lattice.cells = static_cast<std::int64_t>(padded(static_cast<std::size_t>(last + 1 + lattice.reach)));
}

}  // namespace

Lattice make_lattice(int dimension, double spacing, const std::array<double, 3>& lower, const std::array<double, 3>& upper,
                     double horizon) {
  Lattice lattice;
  lattice.dimension = dimension;
  lattice.spacing = spacing;
  lattice.lower = lower;
  std::array<std::int64_t, 3> cells{1, 1, 1};
  for (int a = 0; a < dimension; ++a) cells[static_cast<std::size_t>(a)] = lattice_cells(lower[a], upper[a], spacing);
  set_cells(lattice, cells);
  lay_out(lattice, horizon);
  return lattice;
}

Lattice regrown(const Lattice& lattice, const std::array<std::int64_t, 3>& low, const std::array<std::int64_t, 3>& high,
                double horizon) {
  std::array<std::int64_t, 3> before{}, cells{1, 1, 1};
  for (std::size_t k = 0; k < static_cast<std::size_t>(lattice.dimension); ++k) {
    const auto along = static_cast<std::size_t>(lattice.axis[k]);
    before[along] = lattice.origin[k] + low[along];
    cells[along] = high[along] - low[along];
  }
  Lattice grown = lattice;
  set_cells(grown, cells);
  for (std::size_t k = 0; k < 3; ++k) grown.origin[k] = before[static_cast<std::size_t>(grown.axis[k])];
  lay_out(grown, horizon);
  return grown;
}

Lattice box_of(const Lattice& lattice, const std::array<std::int64_t, 3>& first, const std::array<std::int64_t, 3>& last,
               double horizon) {
  Lattice box = lattice;
  box.first = first;
  for (std::size_t k = 0; k < 3; ++k) box.extent[k] = last[k] - first[k];
  lay_out(box, horizon);
  return box;
}

LatticeTiling::LatticeTiling(const Lattice& lattice) {
  constexpr std::int64_t segment = 32;  // groups
  const auto& n = lattice.whole;
  const auto group = static_cast<std::int64_t>(padding);
  const std::int64_t groups = (n[0] + group - 1) / group, segments = (groups + segment - 1) / segment,
                     points = n[0] * n[1] * n[2];
  // Tiles that touch each other wait for each other, so that the rows of as many tiles as there are colours are the least time of
  // a step: of small tiles, that is a third. They cost a few percent, so large bodies, which have tiles enough, are spared them.
  constexpr std::int64_t many_rows = 20000, few_points = 64000;
  const bool small = n[2] > 1 && points >= few_points && n[1] * n[2] < many_rows;
  std::int64_t tile1 = small ? 4 : 8, tile2 = small ? 2 : 8;
  while (points / (tile1 * tile2 * std::min<std::int64_t>(n[0], segment * group)) < 16 && tile1 * tile2 > 1)
    (tile1 > tile2 ? tile1 : tile2) /= 2;
  size = {segments > 1 || n[1] * n[2] > 8 ? segment : std::max<std::int64_t>(1, groups / 16), tile1, tile2};
  // Thin bars: small pieces of a cross-section would all touch each other, pieces of the length leave every other one alone. Halves of them keep
  // two threads busy when their number is odd.
  if (n[2] > 1 && std::max(n[1], n[2]) <= 16 && n[0] > 4 * std::max(n[1], n[2])) size = {2, n[1], (n[2] + 1) / 2};
  for (std::size_t a = 0; a < 3; ++a) count[a] = ((a == 0 ? groups : n[a]) + size[a] - 1) / size[a];
}

std::array<std::int64_t, 3> LatticeTiling::of(const std::array<std::int64_t, 3>& cell) const noexcept {
  return {cell[0] / static_cast<std::int64_t>(padding) / size[0], cell[1] / size[1], cell[2] / size[2]};
}

namespace {

/// How far apart (i, j) tiles may be whose rows reach a common one.
std::vector<std::array<std::int64_t, 2>> tiles_that_meet(const LatticeTiling& tiling,
                                                         std::span<const std::array<int, 3>> offsets) {
  std::set<std::array<std::int64_t, 2>> rows{{0, 0}}, apart, tiles;
  for (const auto& d : offsets) rows.insert({d[1], d[2]});
  for (const auto& a : rows)
    for (const auto& b : rows) apart.insert({a[0] - b[0], a[1] - b[1]});
  const std::int64_t size1 = tiling.size[1], size2 = tiling.size[2];
  const auto floored = [](std::int64_t value, std::int64_t size) { return (value >= 0 ? value : value - size + 1) / size; };
  for (const auto& [d1, d2] : apart)  // from any row of a tile
    for (const std::int64_t i : {floored(d1, size1), floored(d1 + size1 - 1, size1)})
      for (const std::int64_t j : {floored(d2, size2), floored(d2 + size2 - 1, size2)})
        if (std::abs(i) < tiling.count[1] && std::abs(j) < tiling.count[2] && (i != 0 || j != 0)) tiles.insert({i, j});
  return {tiles.begin(), tiles.end()};
}

}  // namespace

TileColours::TileColours(const LatticeTiling& tiling, std::span<const std::array<int, 3>> offsets) : tiling_(tiling) {
  std::int64_t reach = 0;
  for (const auto& d : offsets) reach = std::max<std::int64_t>(reach, std::abs(d[0]));
  const auto group = static_cast<std::int64_t>(padding), groups = (reach + group - 1) / group;
  along_ = std::min(tiling.count[0], 1 + (2 * groups + tiling.size[0] - 1) / tiling.size[0]);
  const std::vector<std::array<std::int64_t, 2>> meet = tiles_that_meet(tiling, offsets);
  const auto found = [&](std::int64_t first, std::int64_t second) {
    first_ = first;
    second_ = second;
    return std::ranges::all_of(meet, [&](const auto& tile) { return (first * tile[0] + second * tile[1]) % across_ != 0; });
  };
  // Squares would do with first = 1 and second their number along i.
  for (across_ = 1;; ++across_)
    for (std::int64_t factor = 0; factor < across_; ++factor)
      if (found(1, factor) || found(factor, 1)) return;
}

std::int32_t TileColours::of(std::int64_t number) const noexcept {
  const auto& count = tiling_.count;
  const std::int64_t i = number / count[0] % count[1], j = number / count[0] / count[1];
  return static_cast<std::int32_t>(number % count[0] % along_ + along_ * ((first_ * i + second_ * j) % across_));
}

std::vector<std::array<int, 3>> family_offsets(const Lattice& lattice, double horizon) {
  const double m = family_limit(horizon / lattice.spacing);
  std::array<int, 3> reach{};
  for (int k = 0; k < lattice.dimension; ++k) {
    reach[k] = static_cast<int>(std::min<std::int64_t>(static_cast<std::int64_t>(std::floor(m)), lattice.extent[k] - 1));
  }
  std::vector<std::array<int, 3>> offsets;
  for (int a = -reach[0]; a <= reach[0]; ++a) {
    for (int c = 0; c <= reach[2]; ++c) {
      for (int b = -reach[1]; b <= reach[1]; ++b) {
        const bool first_of_pair = c > 0 || (c == 0 && (b > 0 || (b == 0 && a > 0)));
        if (first_of_pair && std::sqrt(double(a) * a + double(b) * b + double(c) * c) <= m) offsets.push_back({a, b, c});
      }
    }
  }
  const std::size_t half = offsets.size();
  for (std::size_t s = 0; s < half; ++s) offsets.push_back({-offsets[s][0], -offsets[s][1], -offsets[s][2]});
  return offsets;
}

}  // namespace perikit
