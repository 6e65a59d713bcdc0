#include <doctest/doctest.h>

#include "materials/hencky/law.hpp"
#include "materials/linear_elastic/law.hpp"
#include "materials/mooney_rivlin/law.hpp"
#include "materials/neo_hookean/law.hpp"
#include "materials/saint_venant_kirchhoff/law.hpp"
#include "perikit/sdk/law_material.hpp"
#include "tests/contract/material_contract.hpp"

using namespace perikit;
using contract::check_material;
using contract::Evaluation;
using contract::MaterialOptions;

namespace {

/// (lambda, mu) for mu = 1 and Poisson's ratio nu.
std::vector<double> lame(double nu) {
  return {2 * nu / (1 - 2 * nu), 1.0};
}

}  // namespace

TEST_CASE("contract: linear_elastic") {
  for (const double nu : {-0.3, 0.0, 0.25, 0.49999})
    check_material(LawMaterial<LinearElastic>(), lame(nu), {.law = "linear_elastic", .least_free = 0.2, .most_free = 5});
}

TEST_CASE("contract: saint_venant_kirchhoff") {
  for (const double nu : {-0.3, 0.0, 0.25, 0.49999})
    check_material(LawMaterial<SaintVenantKirchhoff>(), lame(nu), {.law = "saint_venant_kirchhoff"});
}

TEST_CASE("contract: neo_hookean") {
  for (const Volumetric form : {Volumetric::quadratic, Volumetric::logarithmic})
    for (const double kappa : {1.7, 20.0, 1e4})
      check_material(LawMaterial(NeoHookean{form}), {1.0, kappa}, {.law = "neo_hookean", .least_free = 0.2, .most_free = 5});
}

TEST_CASE("contract: mooney_rivlin") {
  for (const Volumetric form : {Volumetric::quadratic, Volumetric::logarithmic})
    for (const double kappa : {1.7, 20.0, 1e4})
      check_material(LawMaterial(MooneyRivlin{form}), {0.3, 0.2, kappa},
                     {.law = "mooney_rivlin", .least_free = 0.2, .most_free = 5});
}

TEST_CASE("contract: hencky") {
  for (const double nu : {-0.3, 0.0, 0.25, 0.49999})
    check_material(LawMaterial<Hencky>(), lame(nu), {.law = "hencky", .least_free = 0.2, .most_free = 5});
}

namespace {

/// Laws that keep only a part of another, so that the rest must be differentiated.
template <class Law>
struct PartOfLaw {
  Law law;
  void constants(const MaterialInput& input, double* k) const { law.constants(input, k); }
  Moduli small_strain(const double* k) const noexcept { return law.small_strain(k); }
};
template <class Law>
struct EnergyOnly : PartOfLaw<Law> {
  static constexpr MaterialTraits traits = Law::traits;
  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    return energy(this->law, H, k);
  }
};
template <class Law>
struct StressOnly : PartOfLaw<Law> {
  static constexpr MaterialTraits traits = [] {
    MaterialTraits t = Law::traits;
    t.hyperelastic = false;
    return t;
  }();
  template <class T, class S, class K>
  Tensor<T, S> P(const Tensor<T, S>& H, const K& k) const noexcept {
    return stress(this->law, H, k);
  }
};

/// psi, P, dP, A of two materials agree to 1e-10 of the magnitude of each.
void check_same(const Material& found, const Material& expected, const std::vector<double>& constants, const std::string& what,
                bool with_energy) {
  contract::Random random(11);
  for (const Space space : {Space::solid, Space::plane_strain, Space::plane_stress, Space::line_strain, Space::line_stress}) {
    const bool free = contract::free_stretch(space);
    std::vector<contract::Values> points, directions;
    for (int p = 0; p < 19; ++p) {
      contract::Matrix F = contract::random_deformation(random, space, free ? 0.8 : 0.2, free ? 1.2 : 5.0);
      for (int i = 0; i < 3; ++i) F[4 * i] -= 1;
      points.push_back(contract::restrict_to(space, F));
      directions.push_back(contract::random_direction(random, space));
    }
    const Evaluation a(found, space, constants, points, directions), b(expected, space, constants, points, directions);
    CHECK(a.status.ok());
    for (int p = 0; p < a.n; ++p) {
      const double scale = contract::largest(b.at(b.A, p));
      const contract::Values x = a.all(p), y = b.all(p);
      for (std::size_t i = with_energy ? 0 : 1; i < x.size(); ++i)
        CHECK_MESSAGE(std::abs(x[i] - y[i]) <= 1e-10 * scale, what, ", ", name(space), ": value ", i, " is ", x[i], ", expected ",
                      y[i]);
    }
  }
}

template <class Law>
void check_differentiated(const std::vector<double>& constants, const std::string& what) {
  check_same(LawMaterial<EnergyOnly<Law>>(), LawMaterial<Law>(), constants, what + " from psi alone", true);
  check_same(LawMaterial<StressOnly<Law>>(), LawMaterial<Law>(), constants, what + " from P alone", false);
}

/// P of one point in 3D.
contract::Matrix stress_of(const Material& material, const std::vector<double>& constants, contract::Matrix F) {
  for (int i = 0; i < 3; ++i) F[4 * i] -= 1;
  const Evaluation e(material, Space::solid, constants, {contract::restrict_to(Space::solid, F)});
  return contract::extend(Space::solid, e.at(e.P, 0));
}

}  // namespace

TEST_CASE("missing pieces by forward differentiation equal the written ones") {
  check_differentiated<SaintVenantKirchhoff>({1.2, 0.8}, "saint_venant_kirchhoff");
  check_differentiated<NeoHookean>({0.8, 8.0}, "neo_hookean");
  check_differentiated<MooneyRivlin>({0.3, 0.1, 8.0}, "mooney_rivlin");
  check_differentiated<LinearElastic>({1.2, 0.8}, "linear_elastic");
}

namespace {

/// dP for a given dH where the lateral strains of H keep free of stress, in extended precision. lateral: nearly that strain.
template <class S, class Law>
contract::Values freed_tangent(const Law& law, const std::vector<double>& constants, const contract::Values& H, double lateral, const contract::Values& dH) {
  using Long = long double;
  std::array<Long, Law::traits.constants> k;
  std::copy(constants.begin(), constants.end(), k.begin());
  const auto tensor = [](const contract::Values& a, Long free) { return with_free_part(Tensor<Long, S>::map([&](int c) { return Long(a[c]); }), free); };
  const Tensor<Long, S> N = free_direction<Long, S>();
  Long h = lateral;
  for (int step = 0; step < 3; ++step) h -= inner(N, stress(law, tensor(H, h), k)) / inner(N, tangent(law, tensor(H, h), k)(N));
  const auto action = tangent(law, tensor(H, h), k);
  const Tensor<Long, S> given = action(tensor(dH, 0)), freed = action(N);
  contract::Values dP;
  for (int c = 0; c < S::components; ++c) dP.push_back(static_cast<double>(given[c] - inner(N, given) / inner(N, freed) * freed[c]));
  return dP;
}

/// Plane and uniaxial stress at stretches from 1/20 to 20: the solid at the free stretch has no stress along it, the same stress, and the same tangent.
template <class Law>
void check_extreme_stretches(const Law& law, const std::vector<double>& constants, const std::string& what) {
  const LawMaterial<Law> material(law);
  const double stretches[] = {0.05, 0.2, 0.6, 0.95, 1 - 1e-9, 1.0, 1.0001, 1.4, 3, 20};
  std::vector<contract::Values> planes, lines, solids;
  for (const double a : stretches) {
    lines.push_back({a - 1, 0, 0});
    for (const double b : stretches)
      for (const double shear : {0.0, 0.4}) planes.push_back({a - 1, shear * a, -0.3 * shear * b, b - 1, 0});
  }
  for (const Space space : {Space::plane_stress, Space::line_stress}) {
    const std::vector<contract::Values>& points = space == Space::plane_stress ? planes : lines;
    contract::Random random(3);
    std::vector<contract::Values> directions;
    for (std::size_t p = 0; p < points.size(); ++p) directions.push_back(contract::random_direction(random, space));
    const Evaluation free(material, space, constants, points, directions);
    CHECK_MESSAGE(free.status.ok(), what, ", ", name(space), ": no free stretch at point ", free.status.inadmissible);
    solids.clear();
    for (int p = 0; p < free.n; ++p) {
      const double h = free.lateral.data()[p];
      if (space == Space::plane_stress)
        solids.push_back({points[p][0], points[p][1], 0, points[p][2], points[p][3], 0, 0, 0, h});
      else
        solids.push_back({points[p][0], 0, 0, 0, h, 0, 0, 0, h});
    }
    const Evaluation solid(material, Space::solid, constants, solids);
    for (int p = 0; p < free.n; ++p) {
      // What a rounding error of F = I + H changes, where F is a twentieth of H.
      const double rounding = 1e-12 * contract::largest(solid.at(solid.A, p)) * (1 + contract::largest(solids[p]));
      const contract::Values P = solid.at(solid.P, p), plane = free.at(free.P, p);
      CHECK_MESSAGE(std::abs(P[8]) <= rounding, what, ", ", name(space), ", point ", p, ": free stress ", P[8]);
      CHECK_MESSAGE(std::abs(P[0] - plane[0]) <= rounding, what, ", ", name(space), ", point ", p, ": P11 ", plane[0], ", expected ", P[0]);
      if (space == Space::plane_stress) CHECK_MESSAGE(std::abs(P[1] - plane[1]) <= rounding, what, ", point ", p, ": P12 ", plane[1], ", expected ", P[1]);
      const contract::Values found = free.at(free.dP, p), expected = space == Space::plane_stress ? freed_tangent<Plane>(law, constants, points[p], free.lateral.data()[p], directions[p])
                                                                                                   : freed_tangent<Line>(law, constants, points[p], free.lateral.data()[p], directions[p]);
      for (std::size_t c = 0; c < expected.size(); ++c)
        CHECK_MESSAGE(std::abs(found[c] - expected[c]) <= 4 * rounding, what, ", ", name(space), ", point ", p, ": dP ", c, " is ", found[c], ", expected ", expected[c]);
    }
  }
}

}  // namespace

TEST_CASE("plane and uniaxial stress at extreme stretches") {
  check_extreme_stretches(Hencky(), {1.2, 0.8}, "hencky");
  for (const Volumetric form : {Volumetric::quadratic, Volumetric::logarithmic})
    for (const double kappa : {0.4, 3.0, 1e3, 1e6}) {
      check_extreme_stretches(NeoHookean{form}, {1.0, kappa}, "neo_hookean, bulk modulus " + std::to_string(kappa));
      check_extreme_stretches(MooneyRivlin{form}, {0.3, 0.2, kappa}, "mooney_rivlin, bulk modulus " + std::to_string(kappa));
    }
}

TEST_CASE("saint_venant_kirchhoff: uniaxial strain and uniaxial stress") {
  const double lambda = 1.2, mu = 0.8, E = mu * (3 * lambda + 2 * mu) / (lambda + mu);
  const LawMaterial<SaintVenantKirchhoff> material;
  for (const double stretch : {0.7, 0.9, 1.1, 1.4}) {
    const double green = (stretch * stretch - 1) / 2;
    const Evaluation strain(material, Space::line_strain, std::vector{lambda, mu}, {{stretch - 1, 0, 0}});
    CHECK(strain.P.data()[0] == doctest::Approx(stretch * (lambda + 2 * mu) * green).epsilon(1e-14));
    CHECK(strain.P.component(1)[0] == doctest::Approx(lambda * green).epsilon(1e-14));
    const Evaluation stress(material, Space::line_stress, std::vector{lambda, mu}, {{stretch - 1, 0, 0}});
    CHECK(stress.P.data()[0] == doctest::Approx(stretch * E * green).epsilon(1e-14));
    CHECK(stress.psi.data()[0] == doctest::Approx(E * green * green / 2).epsilon(1e-14));
  }
  // E33 = -lambda/(lambda + 2 mu) (E11 + E22) < -1/2, in a bar -lambda/(2 (lambda + mu)) E11: no thickness is left to carry
  for (const double part : {1 - 1e-12, 1 + 1e-12}) {
    const double plane = std::sqrt(1 + part * (lambda + 2 * mu) / (2 * lambda)) - 1, bar = std::sqrt(1 + part * 2 * (lambda + mu) / lambda) - 1;
    const int refused = part > 1 ? 1 : -1;
    const Evaluation sheet(material, Space::plane_stress, std::vector{lambda, mu}, {{0.1, 0, 0, 0, 0}, {plane, 0, 0, plane, 0}});
    CHECK(sheet.status.inadmissible == refused);
    const Evaluation wire(material, Space::line_stress, std::vector{lambda, mu}, {{0.1, 0, 0}, {bar, 0, 0}});
    CHECK(wire.status.inadmissible == refused);
  }
}

TEST_CASE("neo_hookean: nearly incompressible tension and simple shear") {
  const double mu = 0.8, kappa = 8e6;
  const LawMaterial<NeoHookean> material;
  for (const double stretch : {0.5, 0.8, 1.5, 3.0}) {
    const Evaluation e(material, Space::line_stress, std::vector{mu, kappa}, {{stretch - 1, 0, 0}});
    CHECK(e.P.data()[0] == doctest::Approx(mu * (stretch - 1 / (stretch * stretch))).epsilon(1e-6));
    const Evaluation sheet(material, Space::plane_stress, std::vector{mu, kappa}, {{stretch - 1, 0, 0, stretch - 1, 0}});
    CHECK(sheet.P.data()[0] == doctest::Approx(mu * (stretch - std::pow(stretch, -5))).epsilon(1e-5));
  }
  for (const double gamma : {1e-6, 0.1, 2.0}) {
    const contract::Matrix P = stress_of(material, {mu, kappa}, {1, gamma, 0, 0, 1, 0, 0, 0, 1});
    // tau = mu dev b with b = I + gamma (xy + yx) + gamma^2 xx, P = tau F^-T
    CHECK(P[1] == doctest::Approx(mu * gamma).epsilon(1e-13));
    CHECK(P[3] == doctest::Approx(mu * gamma * (1 + gamma * gamma / 3)).epsilon(1e-13));
    CHECK(P[8] == doctest::Approx(-mu * gamma * gamma / 3).epsilon(1e-9));
  }
}

TEST_CASE("hencky: hydrostatic and principal stretches") {
  const double lambda = 1.2, mu = 0.8, kappa = lambda + 2 * mu / 3;
  const LawMaterial<Hencky> material;
  for (const double a : {0.2, 0.9, 1.0 + 1e-9, 1.1, 5.0}) {
    const contract::Matrix P = stress_of(material, {lambda, mu}, {a, 0, 0, 0, a, 0, 0, 0, a});
    for (int i = 0; i < 9; ++i)
      CHECK(P[i] == doctest::Approx(i % 4 == 0 ? 3 * kappa * std::log(a) / a : 0.0).epsilon(1e-14).scale(kappa));
  }
  const double l[3] = {0.6, 1.1, 2.5}, volume = std::log(l[0] * l[1] * l[2]);
  const contract::Matrix P = stress_of(material, {lambda, mu}, {l[0], 0, 0, 0, l[1], 0, 0, 0, l[2]});
  for (int i = 0; i < 3; ++i)
    CHECK(P[4 * i] == doctest::Approx((lambda * volume + 2 * mu * std::log(l[i])) / l[i]).epsilon(1e-13));
}

namespace {

/// P and A : dH at H against differences of order six of the same law in long double, to `tolerance` of the largest |A| (1 +
/// |H|).
template <class S, class Law>
void check_extended(const Law& law, Space space, const std::vector<double>& constants, const contract::Matrix& F,
                    contract::Random& random, double tolerance, const std::string& what) {
  using Long = long double;
  using LongTensor = Tensor<Long, S>;
  constexpr Long weights[] = {3.0L / 4, -3.0L / 20, 1.0L / 60};
  std::array<Long, Law::traits.constants> k;
  std::copy(constants.begin(), constants.end(), k.begin());
  contract::Values H = contract::restrict_to(space, F);
  for (int c = 0; c < S::components; ++c) H[c] -= row<S>(c) == column<S>(c) ? 1.0 : 0.0;
  const contract::Values direction = contract::random_direction(random, space);
  const Evaluation e(LawMaterial<Law>(law), space, constants, {H}, {direction});
  const double allowed = tolerance * contract::largest(e.at(e.A, 0)) * (1 + contract::largest(H));
  const Long h = 1e-3L;
  const auto moved = [&](int c, Long by) {
    return LongTensor::map([&](int i) { return Long(H[i]) + (c < 0 ? by * Long(direction[i]) : i == c ? by : 0.0L); });
  };
  LongTensor stress_slope = LongTensor::map([](int) { return 0.0L; });
  for (int step = 1; step <= 3; ++step)
    stress_slope =
        stress_slope + (weights[step - 1] / h) * (stress(law, moved(-1, step * h), k) - stress(law, moved(-1, -step * h), k));
  for (int c = 0; c < S::components; ++c) {
    Long slope = 0;
    for (int step = 1; step <= 3; ++step)
      slope += weights[step - 1] / h * (energy(law, moved(c, step * h), k) - energy(law, moved(c, -step * h), k));
    CHECK_MESSAGE(std::abs(double(slope - e.P.component(c)[0])) <= allowed, "P: ", what, ", component ", c);
    CHECK_MESSAGE(std::abs(double(stress_slope[c] - e.dP.component(c)[0])) <= allowed, "dP: ", what, ", component ", c);
  }
}

template <class Law>
void check_extended(const Law& law, const std::vector<double>& constants, const std::string& what) {
  contract::Random random(5);
  for (int trial = 0; trial < 12; ++trial) {
    const auto check = [&]<class S>(S, Space space) {
      check_extended<S>(law, space, constants, contract::random_deformation(random, space, 0.2, 5.0), random, 1e-10, what);
    };
    check(Solid(), Space::solid);
    check(Plane(), Space::plane_strain);
    check(Line(), Space::line_strain);
  }
}

}  // namespace

TEST_CASE("P = dpsi/dF and A = dP/dF to ten digits, against the same law in extended precision") {
  check_extended(LinearElastic(), {1.2, 0.8}, "linear_elastic");
  check_extended(SaintVenantKirchhoff(), {1.2, 0.8}, "saint_venant_kirchhoff");
  for (const Volumetric form : {Volumetric::quadratic, Volumetric::logarithmic}) {
    check_extended(NeoHookean{form}, {0.8, 8.0}, "neo_hookean");
    check_extended(MooneyRivlin{form}, {0.3, 0.1, 8.0}, "mooney_rivlin");
  }
  check_extended(Hencky(), {1.2, 0.8}, "hencky");
}

namespace {

/// psi where small strains are turned far, of the same H in extended precision.
template <class Law>
void check_turned(const Law& law, const std::vector<double>& constants, const std::string& what) {
  using Long = long double;
  contract::Random random(8);
  std::array<Long, Law::traits.constants> k;
  std::copy(constants.begin(), constants.end(), k.begin());
  for (const double size : {0.1, 1e-2, 1e-3, 1e-4, 1e-5})
    for (const double angle : {0.0, 1e-6, 1e-3, 0.1, 1.0, 3.0})
      for (int trial = 0; trial < 8; ++trial) {
        const contract::Values e = contract::random_direction(random, Space::solid);
        const auto strain = Tensor<double, Solid>::build_symmetric([&](int i, int j) { return size * e[3 * i + j]; });
        const double c = std::cos(angle), s = std::sin(angle);
        const Tensor<double, Solid> turn{{c, -s, 0, s, c, 0, 0, 0, 1}}, F = turn * add_diagonal(strain, 1.0);
        contract::Values H(F.c, F.c + 9);
        for (int i = 0; i < 3; ++i) H[4 * i] -= 1;
        const Evaluation found(LawMaterial<Law>(law), Space::solid, constants, {H});
        const auto HL = Tensor<Long, Solid>::map([&](int i) { return Long(H[i]); });
        const Long expected = energy(law, HL, k);
        CHECK_MESSAGE(std::abs(static_cast<double>(found.psi.data()[0] - expected)) <= 2e-9 * static_cast<double>(expected), what, ", strains of ", size, " turned by ", angle, ": ",
                      found.psi.data()[0], ", expected ", static_cast<double>(expected));
      }
}

}  // namespace

TEST_CASE("energies of rubber keep nine digits where small strains are turned far") {
  check_turned(NeoHookean(), {0.8, 8.0}, "neo_hookean");
  check_turned(MooneyRivlin(), {0.3, 0.1, 8.0}, "mooney_rivlin");
}

TEST_CASE("energies of neo_hookean have all digits at any stretch, against their definition in extended precision") {
  using Long = long double;
  const std::vector<double> constants = {0.8, 8.0};
  // On both sides of J^(-2/3) tr C / 3 = 2, where a step of Newton ends, and far beyond.
  for (const double stretch : {0.01, 0.1, 0.3, 0.5, 0.9, 0.99, 1.01, 1.1, 1.5, 2.0, 2.1, 2.2, 2.3, 2.4, 2.5, 3.0, 10.0, 100.0})
    for (const double volume : {0.2, 0.7, 1.0, 1.3, 5.0}) {
      const double across = std::sqrt(volume / stretch);
      const contract::Values H = {stretch - 1, 0, 0, 0.1 * across, across - 1, 0, 0, 0, across - 1};
      const Evaluation found(LawMaterial<NeoHookean>(), Space::solid, constants, {H});
      Long trace = 0;
      for (std::size_t i = 0; i < 9; ++i) {
        const Long F = H[i] + (i % 4 == 0 ? Long(1) : Long(0));
        trace += F * F;
      }
      const Long J = (1 + Long(H[0])) * (1 + Long(H[4])) * (1 + Long(H[8]));
      const Long expected = Long(constants[0]) / 2 * (trace / std::cbrt(J * J) - 3) + Long(constants[1]) / 2 * (J - 1) * (J - 1);
      CHECK_MESSAGE(std::abs(static_cast<double>(found.psi.data()[0] / expected - 1)) <= 2e-14, "stretch ", stretch, ", volume ", volume, ": ",
                    found.psi.data()[0], ", expected ", static_cast<double>(expected));
    }
}

TEST_CASE("hencky: stress and tangent at and near equal principal stretches") {
  contract::Random random(3);
  for (int shape = 0; shape < 3; ++shape)
    for (int exponent = 0; exponent <= 17; ++exponent) {
      const double gap = exponent == 17 ? 0.0 : std::pow(10.0, -exponent);
      // 0: two equal and a third above, 1: below, 2: all three near
      const double third = shape == 0 ? 2.0 : shape == 1 ? 0.5 : 1.3 + 2 * gap;
      const std::string what = "shape " + std::to_string(shape) + ", gap 1e-" + std::to_string(exponent);
      const auto check = [&]<class S>(S, Space space) {
        const contract::Matrix F = contract::product(
            contract::random_rotation(random, space),
            contract::product({1.3, 0, 0, 0, 1.3 + gap, 0, 0, 0, third}, contract::random_rotation(random, space)));
        check_extended<S>(Hencky(), space, {1.2, 0.8}, F, random, 5e-12, what);
      };
      check(Solid(), Space::solid);
      check(Plane(), Space::plane_strain);
    }
}

namespace {

/// A law with a pressure that somebody forgot.
struct StressedLaw {
  static constexpr MaterialTraits traits{.constants = 1};
  void constants(const MaterialInput& input, double* k) const { k[0] = input.value("kappa"); }
  Moduli small_strain(const double* k) const noexcept { return {k[0], 0}; }
  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    const T j = jacobian_minus_one(H);
    return k[0] * (0.5 * j * j + 1e-3 * j);
  }
};

}  // namespace

TEST_CASE("a law that is stressed at rest by more than rounding is refused") {
  double k = 0;
  const MaterialInput input{[](std::string_view) { return true; }, [](std::string_view) { return 2.0; }};
  CHECK_THROWS_WITH_AS(LawMaterial<StressedLaw>().constants(input, &k), doctest::Contains("stressed"), std::domain_error);
}

namespace {

/// A law written in such a way that its energy at rest is not zero.
template <int digits>
struct OffsetLaw {
  static constexpr MaterialTraits traits{.constants = 1};
  void constants(const MaterialInput& input, double* k) const { k[0] = input.value("kappa"); }
  Moduli small_strain(const double* k) const noexcept { return {k[0], 0}; }
  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    const T j = jacobian_minus_one(H);
    return k[0] * (0.5 * j * j + std::pow(10.0, -digits));
  }
};

}  // namespace

TEST_CASE("what rounding leaves of a law's energy at rest is taken off at every point, and more than that is refused") {
  double k = 0;
  const MaterialInput input{[](std::string_view) { return true; }, [](std::string_view) { return 2e9; }};
  CHECK_THROWS_WITH_AS(LawMaterial<OffsetLaw<9>>().constants(input, &k), doctest::Contains("stressed, or stores energy"), std::domain_error);
  const LawMaterial<OffsetLaw<11>> material;
  REQUIRE_NOTHROW(material.constants(input, &k));
  for (const int n : {1, 11}) {
    for (const double stretch : {0.0, 0.25}) {
      const std::vector<contract::Values> points(static_cast<std::size_t>(n), {stretch, 0, 0, 0, 0, 0, 0, 0, 0});
      const Evaluation e(material, Space::solid, std::vector{k}, points);
      for (int p = 0; p < n; ++p) {
        // The offset itself, 1e-11 k, would show in the eleventh digit of k.
        if (stretch == 0) CHECK(e.psi.data()[p] == 0);
        CHECK(std::abs(e.psi.data()[p] - 0.5 * k * stretch * stretch) <= 1e-15 * k);
      }
    }
  }
}
