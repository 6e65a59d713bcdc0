#pragma once
/// Eight points with one mirrored stencil, one a lane: from displacements to coefficients, from coefficients to batches of
/// evaluation points, and the way back.

#include "perikit/core/simd.hpp"
#include "perikit/operators/laws.hpp"
#include "spaces/weighted/mirrored_stencil.hpp"

namespace perikit {

/// Eight points (the last ones may repeat the first) and the far ends of their bonds: `shift[k]` further on in memory.
struct LanePoints {
  const std::int32_t* point;
  int count;        ///< different ones
  bool contiguous;  ///< eight in a row
  const std::int32_t* shift;

  Pack load(const double* component, std::int32_t by, int l) const noexcept {
    return contiguous ? Pack::load(component + point[0] + by + l) : gather(component + by, point + l);
  }
  void subtract(double* component, std::int32_t by, int l, Pack value) const noexcept {
    if (contiguous) {
      double* at = component + point[0] + by + l;
      (Pack::load(at) - value).store(at);
    } else {
      for (int i = 0; i < pack_width && l + i < count; ++i) component[point[l + i] + by] -= value[i];
    }
  }
};

/// v[b] <- sum over a of (-1)^popcount(a & b) v[a].
template <int N>
void walsh_hadamard(Pack* v) noexcept {
  for (int step = 1; step < N; step *= 2)
    for (int i = 0; i < N; ++i) {
      if ((i & step) != 0) continue;
      const Pack a = v[i], b = v[i + step];
      v[i] = a + b;
      v[i + step] = a - b;
    }
}

/// For each orbit of 1, 2, 4 or 8 elements: read each, transform, write each; indices are known to the compiler but for the
/// memory.
template <class Read, class Write>
void transform_orbit(int size, const Read& read, const Write& write) noexcept {
  const auto run = [&]<int N>() {
    Pack v[N];
    for (int i = 0; i < N; ++i) v[i] = read(i);
    walsh_hadamard<N>(v);
    for (int i = 0; i < N; ++i) write(i, v[i]);
  };
  switch (size) {
    case 1:
      return run.template operator()<1>();
    case 2:
      return run.template operator()<2>();
    case 4:
      return run.template operator()<4>();
    default:
      return run.template operator()<8>();
  }
}

/// uhat[(position * D + c) * 8 + lane]: coefficients of u_far - u_own.
template <int D>
void gather_coefficients(const MirrorBasis& basis, const LanePoints& points, ConstFieldView u, double* uhat) noexcept {
  for (int c = 0; c < D; ++c) {
    const double* component = u.component(c);
    for (int l = 0; l < 8; l += pack_width) {
      const Pack own = points.load(component, 0, l);
      for (const MirrorBasis::Orbit& orbit : basis.orbits)
        transform_orbit(
            orbit.size, [&](int i) { return points.load(component, points.shift[orbit.element[i]], l) - own; },
            [&](int i, Pack v) { v.store(uhat + (orbit.position[i] * D + c) * 8 + l); });
    }
  }
}

/// out_own += sum t, out_far -= t. t: memory like `that`, by bond.
template <int D>
void scatter_coefficients(const MirrorBasis& basis, const LanePoints& points, const double* that, double* t,
                          FieldView out) noexcept {
  for (const MirrorBasis::Orbit& orbit : basis.orbits)
    for (int c = 0; c < D; ++c)
      for (int l = 0; l < 8; l += pack_width)
        transform_orbit(
            orbit.size, [&](int i) { return Pack::load(that + (orbit.position[i] * D + c) * 8 + l); },
            [&](int i, Pack v) { v.store(t + (orbit.element[i] * D + c) * 8 + l); });
  // Bonds are sorted along the rows of the lattice: a sum is not read again while part of it is still on its way to memory.
  // Bond by bond for all eight points, so that what a far end gets comes in the same order whatever the width of a pack is.
  const int bonds = basis.first[8];
  EightSums sum[D];
  for (int k = 0; k < bonds; ++k)
    for (int c = 0; c < D; ++c)
      for (int l = 0; l < 8; l += pack_width) {
        const Pack v = Pack::load(t + (k * D + c) * 8 + l);
        sum[c].at(l) += v;
        points.subtract(out.component(c), points.shift[k], l, v);
      }
  for (int c = 0; c < D; ++c)
    for (int l = 0; l < 8; l += pack_width) points.subtract(out.component(c), 0, l, -sum[c].at(l));
}

/// Evaluation points of one orbit from their coefficients m to H, at lanes (slot + element of the orbit) * 8 + point.
template <int D>
void orbit_gradients(const MirrorBasis::Orbit& orbit, const double* m, int slot, double* H) noexcept {
  for (int c = 0; c < D; ++c)
    for (int e = 0; e < D; ++e)
      for (int l = 0; l < 8; l += pack_width)
        transform_orbit(
            orbit.size, [&](int i) { return Pack::load(m + ((orbit.position[i] * D + e) * D + c) * 8 + l); },
            [&](int i, Pack v) { v.store(H + (c * D + e) * batch_points + (slot + i) * 8 + l); });
}

/// The transpose: stress of one orbit to coefficients.
template <int D>
void orbit_stresses(const MirrorBasis::Orbit& orbit, const double* P, int slot, double* m) noexcept {
  for (int c = 0; c < D; ++c)
    for (int e = 0; e < D; ++e)
      for (int l = 0; l < 8; l += pack_width)
        transform_orbit(
            orbit.size, [&](int i) { return Pack::load(P + (c * D + e) * batch_points + (slot + i) * 8 + l); },
            [&](int i, Pack v) { v.store(m + ((orbit.position[i] * D + e) * D + c) * 8 + l); });
}

}  // namespace perikit
