/// Kinematics of every class, and terms, as a third party may write them: no part of perikit, no example tables, no dense reference.

#include <memory>

#include "perikit/core/tensor.hpp"
#include "perikit/kinematics.hpp"
#include "perikit/model/elastic_constants.hpp"
#include "perikit/sdk/law_material.hpp"
#include "perikit/sdk/law_term.hpp"

using namespace perikit;

namespace {

class PointSet final : public PointKinematics {
 public:
  int order() const noexcept override { return 2; }
};

/// A gradient that is not exact along the bond.
class Bonds final : public BondKinematics {
 public:
  BondTraits traits() const noexcept override { return {.base = BondBase::mean, .pair_symmetric = true, .g_from_xi_only = true}; }
  void correction(const FamilyView& family, double* g, std::size_t stride) const noexcept override {
    for (int c = 0; c < family.dimension; ++c, g += stride)
      for (int k = 0; k < family.bonds; ++k) g[k] = 0.7 * family.xi[c][k] / (family.length[k] * family.length[k]);
  }
};

/// Between projection and baqp: three tenths of the far end's gradient.
class Blend final : public BondKinematics {
 public:
  BondTraits traits() const noexcept override { return {.base = BondBase::blend, .far_share = 0.3, .g_from_xi_only = true}; }
  void correction(const FamilyView& family, double* g, std::size_t stride) const noexcept override {
    for (int c = 0; c < family.dimension; ++c, g += stride)
      for (int k = 0; k < family.bonds; ++k) g[k] = family.xi[c][k] / (family.length[k] * family.length[k]);
  }
};

/// Rubber after Yeoh, written in F as in a textbook: rounding leaves a stress and an energy at rest.
struct TextbookRubber {
  static constexpr MaterialTraits traits{.constants = 2};
  void constants(const MaterialInput& input, double* k) const {
    k[0] = input.value("C1");
    k[1] = input.value("kappa");
  }
  Moduli small_strain(const double* k) const noexcept { return {k[1] - 4 * k[0] / 3, 2 * k[0]}; }
  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    const Tensor<T, S> F = add_diagonal(H, T(1.0));
    const T J = 1.0 + jacobian_minus_one(H), i = inner(F, F) / rational_power<2, 3>(J) - 3.0;
    return k[0] * i + 0.1 * k[0] * i * i + 0.01 * k[0] * i * i * i + 0.5 * k[1] * (J - 1.0) * (J - 1.0);
  }
};

/// k <- lambda, mu and a constant of the law's own.
void elastic_constants_and(const MaterialInput& input, const char* further, double* k) {
  const Moduli moduli = elastic_constants(input);
  k[0] = moduli.lambda;
  k[1] = moduli.mu;
  k[2] = input.value(further);
}

/// An elastic law that counts its steps, and takes none in which its strain changes by more than it is made for.
struct Careful {
  static constexpr MaterialTraits traits{.constants = 3, .hyperelastic = false, .limits_step = true};
  template <class S>
  static constexpr std::array state{StateVariable{"strain", "-", symmetric_size<S>}, StateVariable{"steps", "-", 1}};
  template <class S>
  static constexpr int size = components_of(state<S>);

  void constants(const MaterialInput& input, double* k) const {
    elastic_constants_and(input, "largest_change", k);
  }
  Moduli small_strain(const double* k) const noexcept { return {k[0], k[1]}; }

  template <class T, class S>
  struct Step {
    std::array<T, size<S>> begin;

    template <class K>
    HistoryUpdate<T, S, size<S>> update(const Tensor<T, S>& H, const K& k) const noexcept {
      const Tensor<T, S> E = 0.5 * right_cauchy_green_minus_identity(H), change = E - unpack_symmetric<S>(begin.data());
      HistoryUpdate<T, S, size<S>> end;
      end.psi = 0.5 * k[0] * (trace(E) * trace(E)) + k[1] * inner(E, E);
      end.P = P(H, k);
      const T size_of_change = sqrt(inner(change, change));
      end.step_factor = select(size_of_change > k[2], k[2] / size_of_change, T(1.0));
      pack_symmetric(E, end.state.data());
      end.state.back() = begin.back() + 1.0;
      return end;
    }
    template <class U, class K>
    Tensor<U, S> P(const Tensor<U, S>& H, const K& k) const noexcept {
      const Tensor<U, S> E = U(0.5) * right_cauchy_green_minus_identity(H), second = add_diagonal(U(2.0 * k[1]) * E, k[0] * trace(E));
      return second + H * second;
    }
  };
  template <class S, class T>
  Step<T, S> after(const std::array<T, size<S>>& begin) const noexcept {
    return {begin};
  }
};

void add_careful(Registrar& registrar) {
  ParameterTable table = elastic_parameters();
  table.material("largest_change", "-", "Norm of the change of strain in a step.").by_default("0.5").positive();
  registrar.material({.name = "their_careful", .summary = "their_careful", .parameters = std::move(table), .examples = {"density = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.3"}},
                     [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawMaterial<Careful>>(); });
}

/// A solid that grows with its temperature.
struct Warm {
  static constexpr MaterialTraits traits{.constants = 3};
  static constexpr std::array external{ExternalVariable{"temperature", "K", 300.0}};

  void constants(const MaterialInput& input, double* k) const {
    elastic_constants_and(input, "expansion", k);
  }
  Moduli small_strain(const double* k) const noexcept { return {k[0], k[1]}; }
  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    const Tensor<T, S> E = T(0.5) * right_cauchy_green_minus_identity(H);
    const T grown = trace(E);
    return 0.5 * k[0] * (grown * grown) + k[1] * inner(E, E) - (3.0 * k[0] + 2.0 * k[1]) * k[2] * (k[3] - external[0].reference) * grown;
  }
};

void add_warm(Registrar& registrar) {
  ParameterTable table = elastic_parameters();
  table.material("expansion", "1/K", "Strain by temperature.").by_default("1e-5").at_least(0);
  registrar.material({.name = "their_warm", .summary = "their_warm", .parameters = std::move(table), .examples = {"density = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.3"}},
                     [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawMaterial<Warm>>(); });
}

template <class Law>
void add_rubber(Registrar& registrar, const char* name) {
  ParameterTable table;
  table.material("density", "kg/m^3", "Mass per volume.").positive();
  table.material("C1", "Pa", "Half of the shear modulus.").require();
  table.material("kappa", "Pa", "Bulk modulus.").require();
  registrar.material({.name = name,
                      .summary = name,
                      .parameters = std::move(table),
                      .examples = {"density = 1000.0\nC1 = 1.7e5\nkappa = 1.0e7"}},
                     [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawMaterial<Law>>(); });
}

/// One domain per bond: the family, in which the bond itself counts twenty times.
class Domains final : public WeightedKinematics {
 public:
  WeightedTraits traits() const noexcept override { return {}; }
  int parts(int /*dimension*/) const override { return 0; }
  void weights(const FamilyView& family, double* omega, std::size_t stride) const noexcept override {
    for (int q = 0; q < family.bonds; ++q, omega += stride)
      for (int k = 0; k < family.bonds; ++k) omega[k] = family.omega[k] * (k == q ? 20.0 : 1.0);
  }
};

class VolumeSpring final : public DilatationLaw {
 public:
  void evaluate(const DilatationBatch& b) const noexcept override {
    for (int k = 0; k < b.n; ++k) {
      if (b.energy) b.energy[k] = 0.5 * b.modulus[k] * b.theta[k] * b.theta[k];
      if (b.pressure) b.pressure[k] = b.modulus[k] * b.theta[k];
      if (b.stiffness) b.stiffness[k] = b.modulus[k];
    }
  }
};

class Pairs final : public PairKinematics {
 public:
  PairTraits traits() const noexcept override { return {}; }
  PairModuli moduli(const PairPoint& x) const noexcept override {
    return {.bond = x.intact * x.moduli.mu / x.weighted_volume, .dilatation = x.intact * x.bulk()};
  }
  std::string warning(const PairPoint&) const override { return {}; }
  void bond_law(const BondBatch& b) const noexcept override {
    for (int k = 0; k < b.n; ++k) {
      const double stiffness = b.modulus[k] * b.omega[k], e = b.extension[k];
      if (b.energy) b.energy[k] = 0.5 * stiffness * e * e;
      if (b.force) b.force[k] = stiffness * e;
      if (b.stiffness) b.stiffness[k] = stiffness;
    }
  }
  const DilatationLaw* dilatation() const noexcept override { return &volume_; }

 private:
  VolumeSpring volume_;
};

template <class Base>
class Selective final : public MappedKinematics {
 public:
  GradientMap map() const noexcept override { return GradientMap::selective; }
  const Kinematics& base() const noexcept override { return base_; }

 private:
  Base base_;
};

/// A fluid that the body moves through: f = -c v.
struct Drag {
  static constexpr TermTraits traits{.constants = 1, .conservative = false, .dissipates = true, .velocity = true, .constant_tangent = true};
  void constants(const MaterialInput& input, double* k) const { k[0] = input.value("coefficient"); }
  template <class T, std::size_t d, class K>
  Vector<T, d> force(const Vector<T, d>& /*u*/, const Vector<Pack, d>& v, const Vector<Pack, d>& /*x*/, double /*time*/, const K& k) const noexcept {
    Vector<T, d> f;
    for (std::size_t c = 0; c < d; ++c) f[c] = -(k[0] * v[c]);
    return f;
  }
};

/// A well that moves along with the time, and a force across the displacement, which no energy has.
struct Swirl {
  static constexpr TermTraits traits{.constants = 1, .conservative = false, .time = true};
  void constants(const MaterialInput& input, double* k) const { k[0] = input.value("coefficient"); }
  template <class T, std::size_t d, class K>
  T energy(const Vector<T, d>& u, const Vector<Pack, d>& x, double time, const K& k) const noexcept {
    const T along = u[0] - 0.1 * std::sin(time);
    return k[0] * (sqrt(1.0 + along * along) + 0.01 * time * (x[0] * u[d - 1]));
  }
  template <class T, std::size_t d, class K>
  Vector<T, d> force(const Vector<T, d>& u, const Vector<Pack, d>& /*v*/, const Vector<Pack, d>& /*x*/, double /*time*/, const K& k) const noexcept {
    Vector<T, d> f;
    for (std::size_t c = 0; c < d; ++c) f[c] = 0.3 * k[0] * (c == 0 ? T(-u[d - 1]) : u[0]);
    return f;
  }
};

template <class Law>
void add_term(Registrar& registrar, const char* name) {
  ParameterTable table;
  table.expression("coefficient", "-", "How strong it is.").require().with_time();
  registrar.term({.name = name, .summary = name, .parameters = std::move(table), .examples = {"coefficient = 0.2", "coefficient = \"0.2 + 0.1*x*t\""}},
                 [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawTerm<Law>>(); });
}

template <class Part>
void add(Registrar& registrar, const char* name) {
  registrar.kinematics({.name = name, .summary = name, .parameters = {}, .examples = {""}},
                       [](const ParameterValues&, const PartFactory&) { return std::make_unique<Part>(); });
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  add<PointSet>(registrar, "their_points");
  add<Bonds>(registrar, "their_bonds");
  add<Blend>(registrar, "their_blend");
  add_rubber<TextbookRubber>(registrar, "their_rubber");
  add_careful(registrar);
  add_warm(registrar);
  add_term<Drag>(registrar, "their_drag");
  add_term<Swirl>(registrar, "their_swirl");
  add<Domains>(registrar, "their_domains");
  add<Pairs>(registrar, "their_pairs");
  add<Selective<Bonds>>(registrar, "their_selective_bonds");
  add<Selective<Domains>>(registrar, "their_selective_domains");
}
