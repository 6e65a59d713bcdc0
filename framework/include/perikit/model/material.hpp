#pragma once
/// Point laws: displacement gradient H = F - I -> stored energy psi, first Piola-Kirchhoff stress P = dpsi/dF, tangent A = dP/dF.

#include <cstddef>
#include <functional>
#include <span>
#include <string_view>

#include "perikit/core/space.hpp"
#include "perikit/model/external.hpp"

namespace perikit {

struct MaterialTraits {
  int constants = 0;          ///< doubles per point that `evaluate` reads
  bool constant_tangent = false;
  bool objective = true;      ///< false for small-strain laws
  bool isotropic = true;
  bool hyperelastic = true;   ///< P = dpsi/dF; false for rate laws, whose psi is the work done so far
  bool green_linear = false;  ///< S is linear in the Green strain E, 3 kappa I of E = I (kappa of Moduli::bulk): P(a F) = a^3 P(F) + 3 kappa a (a^2 - 1)/2 F
  bool symmetric_tangent = true;   ///< A_ij,kl = A_kl,ij: of hyperelastic laws always; of others where they say so
  bool dissipates = false;    ///< psi is the energy that is stored; of laws with history, which say what their steps dissipate
  bool limits_step = false;   ///< of laws with history: some steps are too long for it, and it says by how much
};

/// Lame constants of the law at F = I [Pa].
struct Moduli {
  double lambda = 0, mu = 0;
  double bulk() const noexcept { return lambda + 2.0 * mu / 3.0; }
  double youngs() const noexcept { return mu == 0 ? 0 : mu * (3 * lambda + 2 * mu) / (lambda + mu); }   // points that store nothing have neither
  double poisson() const noexcept { return lambda == 0 ? 0 : lambda / (2 * (lambda + mu)); }
};

/// n evaluation points. Arrays are component-major: component c at point p is x[c * stride + p]; components as in Space.
/// stride is a multiple of `padding`; arrays are 64-byte aligned. Points n ... padded(n) - 1 exist: they hold H = 0 on entry
/// and may be written. A null output is not wanted.
struct MaterialBatch {
  int n = 0;
  std::size_t stride = 0;
  bool confined = false;       ///< lateral components of H and dH are all zero (plane and uniaxial strain); a law may rely on it
  double time_step = 0;        ///< of laws with history [s]; 0 where no step is taken
  const double* H = nullptr;   ///< displacement gradient [-]
  const double* dH = nullptr;  ///< direction of dP [-]
  const double* constants = nullptr;  ///< read them by `constant`
  std::size_t constant_stride = 0;    ///< 0: the same constants at all points; else each point has its own
  const double* external = nullptr;   ///< variables from outside: number k at point p is external[k * external_stride + p], or where that is 0 external[k]; null: all have their reference values
  std::size_t external_stride = 0;
  const double* state_old = nullptr;  ///< history at the beginning of the step; null: fresh (all zeros)
  double* state_new = nullptr;        ///< history if the step ends at H
  std::size_t state_stride = 0;  ///< component c of the history at point p: state[c * state_stride + p]; a multiple of `padding`
  double* psi = nullptr;         ///< [J/m^3]
  double* P = nullptr;           ///< [Pa]
  double* dP = nullptr;          ///< A : dH [Pa]
  double* lateral = nullptr;     ///< H33 that plane stress (or H22 = H33 that line stress) found [-]; one component
  double* A = nullptr;           ///< A[(r * components + c) * stride + p] = dP_r / dF_c [Pa]
  double* dissipated = nullptr;  ///< what the step from state_old to H dissipates [J/m^3], never negative; of laws that declare it
  /// The share of its length that the step from state_old to H should have had at most, above 0: below 1 it was too long, and what else is returned counts for nothing; of
  /// laws that declare it (limits_step).
  double* step_factor = nullptr;

  /// Constant k at point p, and where it is stored.
  double constant(std::size_t k, int p) const noexcept { return *constant_at(k, p); }
  const double* constant_at(std::size_t k, int p) const noexcept {
    return constant_stride == 0 ? constants + k : constants + k * constant_stride + p;
  }
};

/// n changes of volume, for a law psi = psi_iso(J^(-1/3) F) + U(J) with the same constants everywhere. Arrays are 64-byte aligned and have
/// padded(n) entries, all of which may be read and written. A null output is not wanted.
struct VolumeBatch {
  int n = 0;
  const double* j = nullptr;          ///< J - 1 > -1 [-]
  const double* constants = nullptr;
  double* psi = nullptr;              ///< U [J/m^3]
  double* kirchhoff = nullptr;        ///< tau = J U' [Pa]
  double* slope = nullptr;            ///< J dtau/dJ [Pa]
};

/// ok, or the first point of the batch whose F is inadmissible (det F <= 0 or not finite).
struct Status {
  int inadmissible = -1;
  bool ok() const noexcept { return inadmissible < 0; }
};

/// Reads a material parameter at one point: value("shear_modulus"); has("shear_modulus").
struct MaterialInput {
  std::function<bool(std::string_view)> has;
  std::function<double(std::string_view)> value;
};

/// What a law remembers at an evaluation point, zero at the start.
struct StateVariable {
  std::string_view name;   ///< as output fields are called: lower case and underscores
  std::string_view unit;   ///< "-" without one
  int components = 1;      ///< 1, or those of a symmetric or full tensor of the space
};

constexpr int components_of(std::span<const StateVariable> state) noexcept {
  int components = 0;
  for (const StateVariable& variable : state) components += variable.components;
  return components;
}

class Material {
 public:
  virtual ~Material() = default;
  virtual MaterialTraits traits() const noexcept = 0;
  /// The law's constants [traits().constants] from the parameters at one point. Throws std::domain_error naming what is wrong
  /// (nu >= 1/2, negative modulus).
  virtual void constants(const MaterialInput& input, double* out) const = 0;
  virtual Moduli small_strain(const double* constants) const noexcept = 0;
  /// What it remembers, in the order of MaterialBatch::state_old; empty: the law depends on F alone.
  virtual std::span<const StateVariable> state(Space) const noexcept { return {}; }
  int state_components(Space space) const noexcept { return components_of(state(space)); }
  /// What it reads from outside, in the order of MaterialBatch::external. At the reference values it is a law as all others are; at others it may be stressed at rest.
  virtual std::span<const ExternalVariable> external() const noexcept { return {}; }
  /// Overwrites every wanted output for all n points. P(0) is exactly zero.
  virtual Status evaluate(Space space, const MaterialBatch& batch) const noexcept = 0;

  /// Whether psi = psi_iso(J^(-1/3) F) + U(J): then writes the constants with which `evaluate` gives psi_iso, its stress and its tangent alone, in
  /// spaces without free stretches. The selective map evaluates such a law once where it evaluates others for each end of a bond.
  virtual bool isochoric_constants([[maybe_unused]] const double* constants, [[maybe_unused]] double* isochoric) const noexcept { return false; }
  /// Overwrites every wanted output with those of U, of laws with isochoric constants; of the law's own constants. U(1) and tau are exactly zero
  /// at rest.
  virtual void volumetric([[maybe_unused]] const VolumeBatch& batch) const noexcept {}
};

}  // namespace perikit
