#include "spaces/weighted/mirrored_stencil.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <utility>

#include "perikit/core/simd.hpp"

namespace perikit {

namespace {

/// Mirror images of gradients agree to this, relative to the largest: they differ by the rounding of K^-1.
constexpr double symmetric_to = 1e-12;

/// As many as have their sums in registers.
constexpr int tile_rows = pack_registers == 32 ? 8 : 4;

double sign(std::size_t character, std::size_t element) {
  return std::popcount(character & element) % 2 == 0 ? 1.0 : -1.0;
}

template <int D, int R>
void gradient_tile(const StencilTile& tile, const double* g, const double* uhat, double* m) noexcept {
  const double* first = uhat + tile.column * D * 8;
  for (int l = 0; l < 8; l += pack_width) {
    Pack sums[R][D];
    for (int k = 0; k < tile.columns; ++k) {
      Pack v[D];
      for (int c = 0; c < D; ++c) v[c] = Pack::load(first + (k * D + c) * 8 + l);
      for (int r = 0; r < R; ++r)
        for (int c = 0; c < D; ++c) sums[r][c] += Pack(g[k * R + r]) * v[c];
    }
    for (int r = 0; r < R; ++r)
      for (int c = 0; c < D; ++c) sums[r][c].store(m + tile.target[r] + c * 8 + l);
  }
}

template <int D, int R>
void adjoint_tile(const StencilTile& tile, const double* g, const double* m, double* t) noexcept {
  double* first = t + tile.column * D * 8;
  for (int l = 0; l < 8; l += pack_width) {
    Pack p[R][D];
    for (int r = 0; r < R; ++r)
      for (int c = 0; c < D; ++c) p[r][c] = Pack::load(m + tile.target[r] + c * 8 + l);
    for (int k = 0; k < tile.columns; ++k)
      for (int c = 0; c < D; ++c) {
        double* at = first + (k * D + c) * 8 + l;
        Pack sum = Pack::load(at);
        for (int r = 0; r < R; ++r) sum += Pack(g[k * R + r]) * p[r][c];
        sum.store(at);
      }
  }
}

using TileKernel = void (*)(const StencilTile&, const double*, const double*, double*) noexcept;

/// The kernels for 1 ... 8 rows.
template <int D, std::size_t... R>
constexpr std::array<TileKernel, sizeof...(R)> gradient_tiles(std::index_sequence<R...>) {
  return {gradient_tile<D, static_cast<int>(R) + 1>...};
}
template <int D, std::size_t... R>
constexpr std::array<TileKernel, sizeof...(R)> adjoint_tiles(std::index_sequence<R...>) {
  return {adjoint_tile<D, static_cast<int>(R) + 1>...};
}

}  // namespace

bool MirrorBasis::build(int elements, const std::array<std::vector<std::int32_t>, 3>& images) {
  orbits.clear();
  std::vector<bool> seen(static_cast<std::size_t>(elements), false);
  std::array<std::vector<std::int32_t*>, 8> coefficients;  // by character
  std::vector<std::vector<int>> movers;
  for (std::int32_t x = 0; x < elements; ++x) {
    if (seen[static_cast<std::size_t>(x)]) continue;
    std::vector<int>& moves = movers.emplace_back();
    for (int e = 0; e < 3; ++e)
      if (!images[static_cast<std::size_t>(e)].empty() && images[static_cast<std::size_t>(e)][static_cast<std::size_t>(x)] != x)
        moves.push_back(e);
    Orbit& orbit = orbits.emplace_back();
    orbit.size = 1 << moves.size();
    for (std::size_t b = 0; b < static_cast<std::size_t>(orbit.size); ++b) {
      std::int32_t y = x;
      for (std::size_t i = 0; i < moves.size(); ++i)
        if (b >> i & 1) y = images[static_cast<std::size_t>(moves[i])][static_cast<std::size_t>(y)];
      if (seen[static_cast<std::size_t>(y)]) return false;
      seen[static_cast<std::size_t>(y)] = true;
      orbit.element[b] = y;
    }
  }
  for (std::size_t o = 0; o < orbits.size(); ++o)
    for (std::size_t b = 0; b < static_cast<std::size_t>(orbits[o].size); ++b) {
      std::size_t character = 0;
      for (std::size_t i = 0; i < movers[o].size(); ++i) character |= (b >> i & 1) << movers[o][i];
      coefficients[character].push_back(&orbits[o].position[b]);
    }
  std::int32_t position = 0;
  for (std::size_t character = 0; character < 8; ++character) {
    first[character] = position;
    for (std::int32_t* at : coefficients[character]) *at = position++;
  }
  first[8] = position;
  return true;
}

template <int D>
MirroredStencil<D>::MirroredStencil(const FamilyArrays& family, const LocalStencil<D>& stencil, int owners, bool by_bond)
    : bonds_(family.bonds) {
  std::vector<double> g;
  stencil.expand(g);
  for (int q = 0; q < stencil.points(); ++q) {
    if (q >= owners && stencil.share(q) == 0) continue;
    kept_.push_back(q);
    shares_.push_back(stencil.share(q));
  }
  find_mirrors(family, g, owners, by_bond);
  make_tiles(g);
}

template <int D>
void MirroredStencil<D>::find_mirrors(const FamilyArrays& family, const std::vector<double>& g, int owners, bool by_bond) {
  const std::vector<std::int32_t>& kept = kept_;
  const auto bonds = static_cast<std::size_t>(bonds_), points = kept.size();
  double largest = 0;
  for (const double value : g) largest = std::max(largest, std::abs(value));
  std::map<std::array<double, D>, std::int32_t> bond_at;
  const auto vector = [&](std::size_t k) {
    std::array<double, D> xi;
    for (std::size_t c = 0; c < D; ++c) xi[c] = family.xi[c][k];
    return xi;
  };
  for (std::size_t k = 0; k < bonds; ++k) bond_at[vector(k)] = static_cast<std::int32_t>(k);
  std::vector<std::int32_t> index_of(bonds + static_cast<std::size_t>(owners), -1);  // of kept evaluation points
  for (std::size_t q = 0; q < points; ++q)
    if (by_bond) index_of[static_cast<std::size_t>(kept[q])] = static_cast<std::int32_t>(q);
  std::array<std::vector<std::int32_t>, 3> bond_images, point_images;
  for (std::size_t e = 0; e < D; ++e) {
    std::vector<std::int32_t> image, point_image;
    for (std::size_t k = 0; k < bonds; ++k) {
      std::array<double, D> xi = vector(k);
      xi[e] = -xi[e];
      const auto found = bond_at.find(xi);
      if (found == bond_at.end()) break;
      image.push_back(found->second);
    }
    if (image.size() < bonds) continue;
    const auto mirrored = [&](std::size_t q, std::size_t other) {
      const double *row = &g[static_cast<std::size_t>(kept[q]) * bonds * D],
                   *far = &g[static_cast<std::size_t>(kept[other]) * bonds * D];
      for (std::size_t k = 0; k < bonds; ++k)
        for (std::size_t c = 0; c < D; ++c)
          if (!(std::abs((c == e ? -1.0 : 1.0) * row[k * D + c] - far[static_cast<std::size_t>(image[k]) * D + c]) <=
                symmetric_to * largest))
            return false;
      return true;
    };
    // The owner's gradient is its own image, a bond's is that of its mirror image, a part's the only one that fits.
    for (std::size_t q = 0; q < points; ++q) {
      std::vector<std::int32_t> fits;
      const auto row = static_cast<std::size_t>(kept[q]), first = static_cast<std::size_t>(owners);
      if (row < first) {
        fits.push_back(static_cast<std::int32_t>(q));
      } else if (by_bond) {
        fits.push_back(index_of[first + static_cast<std::size_t>(image[row - first])]);
      } else {
        for (std::size_t other = first; other < points; ++other)
          if (mirrored(q, other)) fits.push_back(static_cast<std::int32_t>(other));
      }
      if (fits.size() != 1 || fits[0] < 0 || !mirrored(q, static_cast<std::size_t>(fits[0]))) break;
      point_image.push_back(fits[0]);
    }
    if (point_image.size() < points) continue;
    mirror_[e] = true;
    bond_images[e] = std::move(image);
    point_images[e] = std::move(point_image);
  }
  const int n = static_cast<int>(points);
  if (bond_basis_.build(bonds_, bond_images) && point_basis_.build(n, point_images)) return;
  std::fill_n(mirror_, 3, false);
  bond_basis_.build(bonds_, {});
  point_basis_.build(n, {});
}

template <int D>
void MirroredStencil<D>::make_tiles(const std::vector<double>& g) {
  const std::vector<std::int32_t>& kept = kept_;
  const auto bonds = static_cast<std::size_t>(bonds_);
  // Orbit and character (in the bits of the orbit) of each coefficient.
  const auto coefficients = [](const MirrorBasis& basis) {
    std::vector<std::pair<const MirrorBasis::Orbit*, std::size_t>> all(static_cast<std::size_t>(basis.first[8]));
    for (const MirrorBasis::Orbit& orbit : basis.orbits)
      for (std::size_t b = 0; b < static_cast<std::size_t>(orbit.size); ++b)
        all[static_cast<std::size_t>(orbit.position[b])] = {&orbit, b};
    return all;
  };
  const auto columns = coefficients(bond_basis_), rows = coefficients(point_basis_);
  struct Row {
    std::int32_t position;
    std::size_t e;
  };
  for (std::size_t character = 0; character < 8; ++character) {
    const std::int32_t first = bond_basis_.first[character], count = bond_basis_.first[character + 1] - first;
    std::vector<Row> block;
    for (std::size_t e = 0; e < D; ++e) {
      const std::size_t own = mirror_[e] ? character ^ (std::size_t{1} << e) : character;
      for (std::int32_t p = point_basis_.first[own]; p < point_basis_.first[own + 1]; ++p) block.push_back({p, e});
    }
    // Tiles of nearly equal height.
    const std::size_t tiles = (block.size() + tile_rows - 1) / tile_rows;
    for (std::size_t t = 0; t < tiles; ++t) {
      const std::size_t begin = block.size() * t / tiles, end = block.size() * (t + 1) / tiles;
      StencilTile& tile = tiles_.emplace_back(StencilTile{static_cast<std::int32_t>(end - begin), first, count, g_.size(), {}});
      for (std::size_t r = begin; r < end; ++r)
        tile.target[r - begin] = (block[r].position * D + static_cast<std::int32_t>(block[r].e)) * D * 8;
      for (std::int32_t k = first; k < first + count; ++k) {
        const auto& [orbit, signs] = columns[static_cast<std::size_t>(k)];
        for (std::size_t r = begin; r < end; ++r) {
          const std::int32_t point = rows[static_cast<std::size_t>(block[r].position)].first->element[0];
          const double* row = &g[static_cast<std::size_t>(kept[static_cast<std::size_t>(point)]) * bonds * D];
          double sum = 0;
          for (std::size_t b = 0; b < static_cast<std::size_t>(orbit->size); ++b)
            sum += sign(signs, b) * row[static_cast<std::size_t>(orbit->element[b]) * D + block[r].e];
          g_.push_back(sum / orbit->size);
        }
      }
    }
  }
}

template <int D>
std::size_t MirroredStencil<D>::bytes() const noexcept {
  return (g_.size() + shares_.size()) * sizeof(double) + tiles_.size() * sizeof(StencilTile) +
         (bond_basis_.orbits.size() + point_basis_.orbits.size()) * sizeof(MirrorBasis::Orbit);
}

template <int D>
void MirroredStencil<D>::gradient(const double* uhat, double* m) const noexcept {
  static constexpr auto kernels = gradient_tiles<D>(std::make_index_sequence<tile_rows>());
  for (const StencilTile& tile : tiles_) kernels[static_cast<std::size_t>(tile.rows - 1)](tile, g_.data() + tile.g, uhat, m);
}

template <int D>
void MirroredStencil<D>::adjoint(const double* m, double* t) const noexcept {
  static constexpr auto kernels = adjoint_tiles<D>(std::make_index_sequence<tile_rows>());
  for (const StencilTile& tile : tiles_) kernels[static_cast<std::size_t>(tile.rows - 1)](tile, g_.data() + tile.g, m, t);
}

template class MirroredStencil<1>;
template class MirroredStencil<2>;
template class MirroredStencil<3>;

}  // namespace perikit
