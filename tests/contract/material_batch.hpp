#pragma once
/// Random deformations and one evaluation of a material with poisoned, guarded outputs: what the material contract is made of.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "perikit/core/field.hpp"
#include "perikit/model/material.hpp"

namespace perikit::contract {

using Matrix = std::array<double, 9>;  ///< row-major 3 x 3
using Values = std::vector<double>;    ///< components of one tensor in one space

inline constexpr Matrix identity{1, 0, 0, 0, 1, 0, 0, 0, 1};

inline Matrix product(const Matrix& a, const Matrix& b) {
  Matrix r{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) r[3 * i + j] += a[3 * i + k] * b[3 * k + j];
  return r;
}

inline Matrix scaled(Matrix a, double factor) {
  for (double& x : a) x *= factor;
  return a;
}
inline Matrix transposed(const Matrix& a) { return {a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]}; }
inline double determinant(const Matrix& a) {
  return a[0] * (a[4] * a[8] - a[5] * a[7]) - a[1] * (a[3] * a[8] - a[5] * a[6]) + a[2] * (a[3] * a[7] - a[4] * a[6]);
}
inline Matrix inverse(const Matrix& a) {
  const Matrix r{a[4] * a[8] - a[5] * a[7], a[2] * a[7] - a[1] * a[8], a[1] * a[5] - a[2] * a[4], a[5] * a[6] - a[3] * a[8], a[0] * a[8] - a[2] * a[6],
           a[2] * a[3] - a[0] * a[5], a[3] * a[7] - a[4] * a[6], a[1] * a[6] - a[0] * a[7], a[0] * a[4] - a[1] * a[3]};
  return scaled(r, 1 / determinant(a));
}

/// Where component k of a space stands in the 3 x 3 matrix.
inline std::span<const int> places(Space space) {
  static constexpr int solid[] = {0, 1, 2, 3, 4, 5, 6, 7, 8}, plane[] = {0, 1, 3, 4, 8}, line[] = {0, 4, 8};
  const int d = dimension(space);
  if (d == 3) return solid;
  return d == 2 ? std::span<const int>(plane) : std::span<const int>(line);
}

inline Values restrict_to(Space space, const Matrix& m) {
  Values r;
  for (const int k : places(space)) r.push_back(m[k]);
  return r;
}
inline Matrix extend(Space space, std::span<const double> values) {
  Matrix m{};
  std::size_t c = 0;
  for (const int k : places(space)) m[k] = values[c++];
  return m;
}

constexpr bool free_stretch(Space space) {
  return space == Space::plane_stress || space == Space::line_stress;
}
/// True for a component that a free stretch determines (zz of plane stress; yy, zz of uniaxial stress).
inline bool is_free(Space space, int component) {
  return free_stretch(space) && component >= gradient_components(dimension(space));
}

inline double largest(std::span<const double> v) {
  double r = 0;
  for (const double x : v) r = std::abs(x) > r ? std::abs(x) : r;
  return r;
}

using Random = std::mt19937_64;

inline double uniform(Random& random, double a, double b) {
  return std::uniform_real_distribution<double>(a, b)(random);
}

/// A random rotation of the space: any in 3D, about z in 2D, none in 1D.
inline Matrix random_rotation(Random& random, Space space) {
  const int d = dimension(space);
  if (d == 1) return identity;
  std::normal_distribution<double> normal;
  double q[4];
  for (double& x : q) x = normal(random);
  if (d == 2) q[1] = q[2] = 0;
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& x : q) x /= n;
  const auto [w, x, y, z] = q;
  return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),    1 - 2 * (x * x + z * z),
          2 * (y * z - w * x),     2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
}

/// F = rotation x stretches x rotation, principal stretches log-uniform in [least, most].
inline Matrix random_deformation(Random& random, Space space, double least, double most) {
  Matrix stretch{};
  for (int i = 0; i < 3; ++i) stretch[4 * i] = std::exp(uniform(random, std::log(least), std::log(most)));
  return product(random_rotation(random, space), product(stretch, random_rotation(random, space)));
}

inline Values random_direction(Random& random, Space space) {
  Values d(tensor_components(space));
  for (double& x : d) x = uniform(random, -1, 1);
  return d;
}

/// All outputs of one call of evaluate for points H_p with directions dH_p, from histories (empty: fresh). Outputs hold NaN before; entries behind padded(n) are
/// guarded and must not change. outside: variables from outside, of all points or of each; empty: their reference values.
struct Evaluation {
  int n, components;
  std::size_t stride;
  Field H, dH, psi, P, dP, A, lateral, dissipated, step_factor, constant_field, external, state_old, state;
  Status status;
  bool guards_intact = true;

  Evaluation(const Material& material, Space space, std::span<const double> constants, const std::vector<Values>& points,
             const std::vector<Values>& directions = {}, bool constants_per_point = false,
             const std::vector<Values>& histories = {}, bool confined = false, double time_step = 0, const std::vector<Values>& outside = {})
      : n(static_cast<int>(points.size())),
        components(tensor_components(space)),
        stride(padded(points.size()) + padding),
        H(components, stride),
        dH(components, stride),
        psi(1, stride),
        P(components, stride),
        dP(components, stride),
        A(components * components, stride),
        lateral(1, stride),
        dissipated(1, stride),
        step_factor(1, stride),
        constant_field(static_cast<int>(constants.size()), stride),
        external(static_cast<int>(outside.empty() ? 0 : outside.front().size()), stride),
        state_old(material.state_components(space), stride + padding),
        state(material.state_components(space), stride + padding) {
    for (int p = 0; p < n; ++p)
      for (int c = 0; c < components; ++c) {
        H.component(c)[p] = points[p][c];
        if (!directions.empty()) dH.component(c)[p] = directions[p][c];
      }
    for (std::size_t p = 0; p < histories.size(); ++p)
      for (int c = 0; c < state_old.components(); ++c) state_old.component(c)[p] = histories[p][c];
    // One for all comes without a stride.
    for (std::size_t p = 0; p < outside.size(); ++p)
      for (int k = 0; k < external.components(); ++k) (outside.size() == 1 ? external.data()[k] : external.component(k)[p]) = outside[p][static_cast<std::size_t>(k)];
    for (std::size_t k = 0; k < constants.size(); ++k)
      for (std::size_t p = 0; p < stride; ++p) constant_field.component(static_cast<int>(k))[p] = constants[k];
    for (Field* f : {&psi, &P, &dP, &A, &lateral, &dissipated, &step_factor, &state}) f->fill(std::numeric_limits<double>::quiet_NaN());
    status = material.evaluate(space, {.n = n,
                                       .stride = stride,
                                       .confined = confined,
                                       .time_step = time_step,
                                       .H = H.data(),
                                       .dH = dH.data(),
                                       .constants = constants_per_point ? constant_field.data() : constants.data(),
                                       .constant_stride = constants_per_point ? stride : 0,
                                       .external = outside.empty() ? nullptr : external.data(),
                                       .external_stride = outside.size() > 1 ? stride : 0,
                                       .state_old = histories.empty() ? nullptr : state_old.data(),
                                       .state_new = state.components() > 0 ? state.data() : nullptr,
                                       .state_stride = state.stride(),
                                       .psi = psi.data(),
                                       .P = P.data(),
                                       .dP = dP.data(),
                                       .lateral = free_stretch(space) ? lateral.data() : nullptr,
                                       .A = confined ? nullptr : A.data(),
                                       .dissipated = material.traits().dissipates ? dissipated.data() : nullptr,
                                       .step_factor = material.traits().limits_step ? step_factor.data() : nullptr});
    if (!material.traits().dissipates) std::fill_n(dissipated.data(), padded(points.size()), 0.0);
    if (!material.traits().limits_step) std::fill_n(step_factor.data(), padded(points.size()), 1.0);
    for (Field* f : {&psi, &P, &dP, &A, &lateral, &dissipated, &step_factor, &state})
      for (int c = 0; c < f->components(); ++c)
        for (std::size_t p = padded(points.size()); p < f->stride(); ++p) guards_intact &= std::isnan(f->component(c)[p]);
  }

  Values at(const Field& f, int p) const {
    Values r;
    for (int c = 0; c < f.components(); ++c) r.push_back(f.component(c)[p]);
    return r;
  }
  /// Every output at point p: psi, P, dP, A, dissipated.
  Values all(int p) const {
    Values r;
    for (const Field* f : {&psi, &P, &dP, &A, &dissipated})
      for (int c = 0; c < f->components(); ++c) r.push_back(f->component(c)[p]);
    return r;
  }
};

/// What the volumetric part of a law says of n changes of volume: everything, or one output alone.
struct Volumes {
  Values psi, kirchhoff, slope;

  Volumes(const Material& material, std::span<const double> constants, const std::vector<double>& j, double* VolumeBatch::*only = nullptr) {
    const std::size_t size = padded(j.size());
    Field in(1, size), out(3, size);
    std::ranges::copy(j, in.data());
    VolumeBatch batch{.n = static_cast<int>(j.size()), .j = in.data(), .constants = constants.data()};
    int c = 0;
    for (double* VolumeBatch::*output : {&VolumeBatch::psi, &VolumeBatch::kirchhoff, &VolumeBatch::slope}) {
      if (!only || only == output) batch.*output = out.component(c);
      ++c;
    }
    material.volumetric(batch);
    for (Values* to : {&psi, &kirchhoff, &slope}) to->assign(j.size(), 0.0);
    for (std::size_t p = 0; p < j.size(); ++p) psi[p] = out.component(0)[p], kirchhoff[p] = out.component(1)[p], slope[p] = out.component(2)[p];
  }
};

}  // namespace perikit::contract
