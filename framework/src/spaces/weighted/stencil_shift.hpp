#pragma once
#include <algorithm>

#include "families/family_arrays.hpp"
#include "families/stencils.hpp"
#include "perikit/core/field.hpp"

namespace perikit {

/// visit(k, e, d) of what lambda moves the gradient g[k * D + e] of a loaded family by: d_k = omega_k V_k (lambda_k - G xi_k), G = sum_k
/// lambda_k (x) g_k, with the influence omega[k] of the evaluation point, and lambda by point in components first ... Not where there is no
/// gradient to move, and not of bonds without influence.
template <int D, class Visit>
void each_shift(const FamilyArrays& family, const double* omega, const double* g, ConstFieldView lambda, int first, Visit&& visit) {
  const std::size_t bonds = family.far.size();
  if (std::all_of(g, g + bonds * D, [](double x) { return x == 0; })) return;
  const double* values[D];
  for (int c = 0; c < D; ++c) values[c] = lambda.component(first + c);
  const auto difference = [&](std::size_t k, int c) { return values[c][family.far[k]] - values[c][family.owner]; };
  double G[D * D] = {};
  for (std::size_t k = 0; k < bonds; ++k) {
    if (omega[k] == 0) continue;
    for (int c = 0; c < D; ++c) {
      const double l = difference(k, c);
      for (int e = 0; e < D; ++e) G[c * D + e] += l * g[k * D + static_cast<std::size_t>(e)];
    }
  }
  for (std::size_t k = 0; k < bonds; ++k) {
    if (omega[k] == 0) continue;
    double xi[D];
    for (int e = 0; e < D; ++e) xi[e] = family.xi[e][k];
    for (int c = 0; c < D; ++c) visit(k, static_cast<std::size_t>(c), omega[k] * family.volume[k] * bond_residual<D>(difference(k, c), G + c * D, xi));
  }
}

/// What a balanced cloud adds to the gradients of a family (spaces/shift.hpp), and second moments of cells to that of a point: d_qk of its first evaluation points, H_q += sum_k u_k
/// (x) d_qk, and t_k += sum_q P_q d_qk.
template <int D>
class StencilShift {
 public:
  /// No evaluation point is shifted.
  void clear() noexcept { points_ = 0; }
  bool empty() const noexcept { return points_ == 0; }
  /// d = 0 for so many evaluation points.
  void begin(int points, const FamilyArrays& family);
  /// As each_shift has it.
  void set(int q, const FamilyArrays& family, const double* omega, const double* g, ConstFieldView lambda, int first);
  /// d_qk = d[k * D + e].
  void set(int q, const double* d);
  /// Takes the fields (local_stencil.hpp).
  void gradients(int fields, const double* const (*u)[D]);

  // As those of LocalStencil.
  void add_gradient(int field, int first, int n, double* H, std::size_t stride) const noexcept;
  void add_stress(int first, int n, const double* P, std::size_t stride) noexcept;
  void add_adjoint(double* const (&t)[D]) const noexcept;
  double d(int q, std::size_t k, std::size_t e) const noexcept { return row(q, e)[k]; }
  int points() const noexcept { return points_; }

 private:
  const double* row(int q, std::size_t e) const noexcept { return d_.data() + (static_cast<std::size_t>(q) * D + e) * row_; }

  int points_ = 0;
  std::size_t bonds_ = 0, row_ = 0;
  AlignedVector<double> d_;       ///< [(q D + e) row + k]
  AlignedVector<double> H_, P_;   ///< of the fields: [((field points + q) D + c) D + e], and of stresses: [(q D + c) D + e]
};

}  // namespace perikit
