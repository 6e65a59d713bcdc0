#pragma once
/// Force and energy of a stabilization (see perikit/model/stabilization.hpp) on one body. With V_i contained in M_i from here on:
///
///   E = 1/2 sum_i sum_j V_j omega_ij z_ij . M_i z_ij,   z_ij = u_ij - H_i xi_ij
///   f_k = sum_j omega_kj [(V_j M_k + V_k M_j) u_kj - (V_j M_k H_k + V_k M_j H_j) xi_kj]   (order 1)
///
/// (z_jk = -(u_kj - H_j xi_kj).) E is quadratic: d2E/du2 w = -f(w). At higher orders the gradient's own share remains: see
/// stencil_penalty.cpp.

#include <cstdint>
#include <memory>
#include <span>

#include "families/bond_state.hpp"
#include "perikit/core/field.hpp"
#include "perikit/model/stabilization.hpp"

namespace perikit {

struct ModelParts;
template <int D>
class CloudModel;
template <int D>
class LatticeModel;

class ZeroEnergyPenalty {
 public:
  virtual ~ZeroEnergyPenalty() = default;
  /// force += -factor dE/du [N]; *energy += E [J] where wanted.
  virtual void add_forces(ConstFieldView u, double factor, FieldView force, double* energy) = 0;
  /// density[p] += energy of point p per volume [J/m^3].
  virtual void add_density(ConstFieldView u, double* density) = 0;
  virtual std::size_t bytes() const noexcept = 0;
  /// E of the points of the marked groups (where bonds fail).
  virtual double energy_of(ConstFieldView u, const GroupMarks& marks) = 0;
  /// What follows from the bonds of these points is to be computed anew; the model knows already.
  virtual void bonds_changed(std::span<const std::int32_t> points) = 0;
  /// The force needs no divergence of its own, as sum of omega z (x) xi V = 0.
  virtual bool simple_force() const noexcept { return true; }
};

/// The penalty of parts.stabilization over a point gradient of order 1, whose families it shares: `model` must outlive it.
template <int D>
std::unique_ptr<ZeroEnergyPenalty> make_penalty(const ModelParts& parts, const LatticeModel<D>& model);
template <int D>
std::unique_ptr<ZeroEnergyPenalty> make_penalty(const ModelParts& parts, const CloudModel<D>& model);
/// Over a point gradient of higher order; bonds do not fail.
template <int D>
std::unique_ptr<ZeroEnergyPenalty> make_stencil_penalty(const ModelParts& parts);

}  // namespace perikit
