#include "local_stencil.hpp"

#include <algorithm>
#include <cmath>

#include "perikit/core/simd.hpp"
#include "shape_tensor.hpp"

namespace perikit {

void FamilyArrays::resize(int d, int n) {
  dimension = d;
  bonds = n;
  size = padded(static_cast<std::size_t>(n));
  for (int c = 0; c < d; ++c) xi[c].assign(size, 1.0);
  length.assign(size, 1.0);
  volume.assign(size, 0.0);
  omega.assign(size, 0.0);
}

FamilyView FamilyArrays::view(double horizon) const noexcept {
  return {dimension, bonds, horizon, {xi[0].data(), dimension > 1 ? xi[1].data() : nullptr, dimension > 2 ? xi[2].data() : nullptr},
          length.data(), volume.data(), omega.data(), inverse_shape, 0};
}

namespace {

/// Inverse by cofactors; false where the condition |K| |K^-1| shows that K is singular. No eigenvalues: this runs per bond.
template <int D>
bool invert_quickly(const double* k, double* inverse) {
  const Square<D> m = symmetric_matrix<D>(k);
  const double size = m.norm();
  if (!(size > 0)) return false;
  const Square<D> scaled = m / size;
  const double det = scaled.determinant();
  if (!(det > 0)) return false;
  const Square<D> inv = scaled.inverse();
  if (!(inv.norm() * singular_ratio < 1)) return false;
  for (int a = 0; a < D; ++a)
    for (int b = a; b < D; ++b) inverse[symmetric_index(D, a, b)] = inv(a, b) / size;
  return true;
}

/// K = sum omega V xi (x) xi, entries in symmetric storage.
template <int D>
void shape_tensor(const FamilyArrays& f, const double* omega, double* K) {
  Pack sums[6];
  for (std::size_t k = 0; k < f.size; k += pack_width) {
    const Pack w = Pack::load(omega + k) * Pack::load(f.volume.data() + k);
    Pack xi[D];
    for (int e = 0; e < D; ++e) xi[e] = Pack::load(f.xi[e].data() + k);
    for (int a = 0; a < D; ++a)
      for (int b = a; b < D; ++b) sums[symmetric_index(D, a, b)] += w * xi[a] * xi[b];
  }
  for (int c = 0; c < symmetric_components(D); ++c) K[c] = sum(sums[c]);
}

template <int D>
void build(const Kinematics& kinematics, const KinematicsTraits& traits, const FamilyArrays& family, double horizon,
           const double* bond_share, LocalStencil& out, AlignedVector<double>& scratch) {
  const bool by_bond = traits.parts == 0;
  const FamilyView view = family.view(horizon);
  out.bonds = family.bonds;
  const int first = traits.selective ? 1 : 0;
  out.points = first + (by_bond ? family.bonds : traits.parts);
  out.tiles = (out.points + 7) / 8;
  out.g.assign(static_cast<std::size_t>(D) * out.tiles * static_cast<std::size_t>(out.bonds) * 8, 0.0);
  out.share.assign(static_cast<std::size_t>(out.tiles) * 8, 0.0);
  out.fallbacks = 0;
  scratch.resize(family.size);
  double K[6], inverse[6];
  const auto write = [&](int q, const double* omega) {
    for (int k = 0; k < family.bonds; ++k) {
      const double w = omega[k] * family.volume[static_cast<std::size_t>(k)];
      for (int e = 0; e < D; ++e) {
        double g = 0;
        for (int a = 0; a < D; ++a) g += inverse[symmetric_index(D, a, e)] * family.xi[a][static_cast<std::size_t>(k)];
        out.g[((static_cast<std::size_t>(e) * out.tiles + static_cast<std::size_t>(q / 8)) * static_cast<std::size_t>(out.bonds) + static_cast<std::size_t>(k)) * 8 + static_cast<std::size_t>(q % 8)] = w * g;
      }
    }
  };
  const auto write_whole = [&](int q) {
    shape_tensor<D>(family, family.omega.data(), K);
    if (invert_quickly<D>(K, inverse)) write(q, family.omega.data());
  };
  if (traits.selective) write_whole(0);
  int admissible = 0;
  for (int q = first; q < out.points; ++q) {
    kinematics.weights(view, q - first, scratch.data());
    shape_tensor<D>(family, scratch.data(), K);
    const bool regular = invert_quickly<D>(K, inverse);
    if (regular) {
      write(q, scratch.data());
    } else {
      ++out.fallbacks;
      if (by_bond) write_whole(q);   // a domain too poor for a gradient of its own uses the whole family
    }
    if (by_bond) {
      out.share[static_cast<std::size_t>(q)] = bond_share[q - first];
    } else if (regular) {
      out.share[static_cast<std::size_t>(q)] = 1.0;
      ++admissible;
    }
  }
  if (by_bond) return;
  if (admissible == 0) {
    write_whole(first);
    out.share[static_cast<std::size_t>(first)] = 1.0;
    admissible = 1;
  }
  for (double& share : out.share) share /= admissible;
}

}  // namespace

void build_stencil(const Kinematics& kinematics, const KinematicsTraits& traits, const FamilyArrays& family, double horizon,
                   const double* bond_share, LocalStencil& out, AlignedVector<double>& scratch) {
  switch (family.dimension) {
    case 1: return build<1>(kinematics, traits, family, horizon, bond_share, out, scratch);
    case 2: return build<2>(kinematics, traits, family, horizon, bond_share, out, scratch);
    default: return build<3>(kinematics, traits, family, horizon, bond_share, out, scratch);
  }
}

}  // namespace perikit
