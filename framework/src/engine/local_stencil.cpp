#include "local_stencil.hpp"

#include <algorithm>
#include <cmath>

#include "perikit/core/simd.hpp"
#include "reproducing_kernel.hpp"
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

/// Inverse by cofactors; false where the eigenvalues of K spread by more than 1 / ratio. This runs per bond: eigenvalues are only
/// computed where norms leave it open.
template <int D>
bool invert_quickly(const double* k, double* inverse, double ratio) {
  const Square<D> m = symmetric_matrix<D>(k);
  const double size = m.norm();
  if (!(size > 0)) return false;
  const Square<D> scaled = m / size;
  // A determinant of the size of rounding says nothing about K, nor does the inverse (of bonds on one line in 3D, say).
  const double det = scaled.determinant();
  if (!(det > 1e-12)) return false;
  const Square<D> inv = scaled.inverse();
  const double bound = inv.norm() * ratio;   // spread * ratio <= bound <= D spread * ratio
  if (!(bound < 1)) {
    double spread;
    if (!(bound < D) || !invert_shape<D>(k, inverse, &spread) || !(spread * ratio < 1)) return false;
  }
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

/// Volume of a part: bonds that it shares count with their share.
double part_volume(const FamilyArrays& f, const double* omega) {
  double volume = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(f.bonds); ++k) {
    if (f.omega[k] > 0) volume += omega[k] / f.omega[k] * f.volume[k];
  }
  return volume;
}

template <int D>
void build(const Kinematics& kinematics, const KinematicsTraits& traits, const FamilyArrays& family, double horizon,
           const double* bond_share, LocalStencil& out, AlignedVector<double>& scratch) {
  const bool at_points = traits.at == EvaluationPoints::points;   // a point gradient of higher order
  const int parts = at_points ? 1 : kinematics.parts(D);
  const bool by_bond = parts == 0;
  const FamilyView view = family.view(horizon);
  out.bonds = family.bonds;
  const int first = traits.selective ? 1 : 0;
  out.points = first + (by_bond ? family.bonds : parts);
  out.tiles = (out.points + 7) / 8;
  out.g.assign(static_cast<std::size_t>(D) * out.tiles * static_cast<std::size_t>(out.bonds) * 8, 0.0);
  out.share.assign(static_cast<std::size_t>(out.tiles) * 8, 0.0);
  out.fallbacks = out.dropped = 0;
  scratch.resize(family.size);
  // Writes row q where these weights give a gradient.
  const auto write = [&](int q, const double* omega, double ratio) {
    double K[6], inverse[6];
    shape_tensor<D>(family, omega, K);
    if (!invert_quickly<D>(K, inverse, ratio)) return false;
    for (int e = 0; e < D; ++e) {
      double* row = out.g.data() + (static_cast<std::size_t>(e) * out.tiles + static_cast<std::size_t>(q / 8)) * static_cast<std::size_t>(out.bonds) * 8 + q % 8;
      for (std::size_t k = 0; k < static_cast<std::size_t>(family.bonds); ++k) {
        double g = 0;
        for (int a = 0; a < D; ++a) g += inverse[symmetric_index(D, a, e)] * family.xi[a][k];
        row[8 * k] = omega[k] * family.volume[k] * g;
      }
    }
    return true;
  };
  if (at_points) {
    std::vector<double> g;
    out.fallbacks = reproducing_kernel(family, horizon, traits.order, g) < traits.order;
    for (std::size_t e = 0; e < D; ++e)
      for (std::size_t k = 0; k < static_cast<std::size_t>(out.bonds); ++k) out.g[(e * static_cast<std::size_t>(out.bonds) + k) * 8] = g[k * D + e];
    out.share[0] = 1;
    return;
  }
  if (traits.selective) write(0, family.omega.data(), singular_ratio);
  double total = 0;
  for (int q = first; q < out.points; ++q) {
    double& share = out.share[static_cast<std::size_t>(q)];
    kinematics.weights(view, q - first, scratch.data());
    const bool regular = write(q, scratch.data(), poor_ratio);
    if (by_bond) {
      share = bond_share[q - first];
      if (!regular) {
        ++out.fallbacks;
        write(q, family.omega.data(), singular_ratio);
      }
    } else if (regular) {
      share = traits.part_weight == PartWeight::volume ? part_volume(family, scratch.data()) : 1.0;
      total += share;
    } else {
      ++out.dropped;
    }
  }
  if (by_bond) return;
  if (!(total > 0)) {
    ++out.fallbacks;
    write(first, family.omega.data(), singular_ratio);
    out.share[static_cast<std::size_t>(first)] = total = 1.0;
  }
  for (double& share : out.share) share /= total;
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
