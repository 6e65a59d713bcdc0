/// One evaluation point that two materials share: the laminate stores least, its stress and tangent are derivatives, for
/// contrasts up to 1e4, finite stretches, all shares and nearly incompressible laws; where there is no solution it says so.

#include "operators/laminate.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "materials/hencky/law.hpp"
#include "materials/linear_elastic/law.hpp"
#include "materials/neo_hookean/law.hpp"
#include "materials/saint_venant_kirchhoff/law.hpp"
#include "perikit/sdk/law_material.hpp"
#include "tests/kit/derivative.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

template <class Law>
MaterialRecord record(double youngs_modulus, double poisson_ratio) {
  MaterialRecord r;
  r.material = std::make_shared<LawMaterial<Law>>();
  r.traits = r.material->traits();
  r.constants.resize(static_cast<std::size_t>(r.traits.constants));
  const MaterialInput input{[](std::string_view key) { return key == "youngs_modulus" || key == "poisson_ratio"; },
                            [=](std::string_view key) { return key == "youngs_modulus" ? youngs_modulus : poisson_ratio; }};
  r.material->constants(input, r.constants.data());
  return r;
}

LaminatePoint laminate(int dimension, double share, const std::array<double, 3>& normal) {
  double plus[3] = {}, minus[3] = {};
  for (int e = 0; e < dimension; ++e) {
    plus[e] = (1 - share) * normal[static_cast<std::size_t>(e)];
    minus[e] = -share * normal[static_cast<std::size_t>(e)];
  }
  LaminatePoint point;
  REQUIRE(make_laminate(dimension, plus, minus, point));
  point.material[1] = 1;
  return point;
}

/// One point on lane 3.
struct Case {
  Case(const Laws& laws, LaminatePoint point)
      : scratch(std::make_unique<LaminateScratch>(laws)), point(point), components(laws.components()) {}

  int evaluate() {
    const int lane = 3;
    const LaminatePoint* const points = &point;
    LaminateBatch batch;
    batch.n = 1;
    batch.lane = &lane;
    batch.laminate = &points;
    batch.H = H;
    batch.psi = psi;
    batch.P = P;
    batch.A = A.data();
    batch.lateral = lateral;
    return scratch->evaluate(batch);
  }
  double energy(const std::vector<double>& h) {
    set(h);
    REQUIRE(evaluate() < 0);
    return psi[3];
  }
  void set(const std::vector<double>& h) {
    for (std::size_t c = 0; c < h.size(); ++c) H[c * batch_points + 3] = h[c];
  }
  double stress(int c) const { return P[c * batch_points + 3]; }
  double tangent(int r, int c) const { return A[static_cast<std::size_t>((r * components + c) * batch_points + 3)]; }

  std::unique_ptr<LaminateScratch> scratch;
  LaminatePoint point;
  int components;
  alignas(64) double H[9 * batch_points] = {};
  alignas(64) double P[9 * batch_points] = {};
  alignas(64) double psi[batch_points] = {};
  alignas(64) double lateral[batch_points] = {};
  std::vector<double> A = std::vector<double>(81 * batch_points);
};

double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1.0p-52 - 1.0;
}

/// Stretches and shears: of a thin soft layer no law keeps what is left when its stiff neighbours are squeezed to half.
std::vector<double> gradient(std::mt19937_64& random, Space space, double size) {
  const int d = dimension(space);
  std::vector<double> H(static_cast<std::size_t>(d * d));
  for (double& h : H) h = size * uniform(random) / d;
  for (int a = 0; a < d; ++a) H[static_cast<std::size_t>(a * d + a)] = size * std::abs(uniform(random));
  return H;
}

/// Two laws of every combination worth a look.
std::vector<std::vector<MaterialRecord>> pairs(double contrast, double first_poisson, double second_poisson) {
  return {{record<NeoHookean>(1.0, first_poisson), record<NeoHookean>(contrast, second_poisson)},
          {record<LinearElastic>(1.0, first_poisson), record<NeoHookean>(contrast, second_poisson)},
          {record<NeoHookean>(1.0, first_poisson), record<LinearElastic>(contrast, second_poisson)}};
}

const std::vector<std::uint16_t> ids{0, 1, 0, 0, 0, 0, 0, 0};

}  // namespace

TEST_CASE("laminates: P = dpsi/dF, A = dP/dF, symmetric, for contrasts up to 1e4 and stretches of 50 %") {
  std::mt19937_64 random(3);
  for (const Space space : {Space::line_strain, Space::line_stress, Space::plane_strain, Space::plane_stress, Space::solid})
    for (const double contrast : {1e-4, 0.1, 10.0, 1e4})
      for (const double share : {0.01, 0.5, 0.99})
        for (auto& records : pairs(contrast, 0.2, contrast > 1 ? 0.3 : 0.49)) {
          const Laws laws(space, std::move(records), ids, 8);
          std::array<double, 3> normal{0.6, dimension(space) > 1 ? -0.5 : 0.0, dimension(space) > 2 ? 0.4 : 0.0};
          const double length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
          for (double& n : normal) n /= length;
          const auto made = std::make_unique<Case>(laws, laminate(dimension(space), share, normal));
          Case& c = *made;
          const int n = dimension(space) * dimension(space);
          const std::vector<double> H = gradient(random, space, 0.5), dH = gradient(random, space, 1.0);
          INFO(tensor_components(space), " components, contrast ", contrast, ", share ", share);
          const auto at = [&](double s) {
            std::vector<double> moved = H;
            for (std::size_t k = 0; k < moved.size(); ++k) moved[k] += s * dH[k];
            return moved;
          };
          const double h = 1e-4;
          const auto slope = [&](auto&& value) { return slope_of(value, h); };
          const double by_difference = slope([&](double s) { return c.energy(at(s)); });
          const double energy = c.energy(H);
          double work = 0, size = energy, stiffness = 0;
          for (int k = 0; k < n; ++k) {
            work += c.stress(k) * dH[static_cast<std::size_t>(k)];
            size += std::abs(c.stress(k));
            for (int l = 0; l < n; ++l) stiffness = std::max(stiffness, std::abs(c.tangent(k, l)));
          }
          CHECK(std::abs(work - by_difference) <= 1e-8 * size);
          for (int k = 0; k < n; ++k)
            for (int l = 0; l < k; ++l) CHECK(std::abs(c.tangent(k, l) - c.tangent(l, k)) <= 1e-11 * stiffness);
          for (int k = 0; k < n; ++k) {
            c.energy(H);
            double row = 0;
            for (int l = 0; l < n; ++l) row += c.tangent(k, l) * dH[static_cast<std::size_t>(l)];
            const double difference = slope([&](double s) {
              c.energy(at(s));
              return c.stress(k);
            });
            CHECK(std::abs(row - difference) <= 1e-7 * stiffness);
          }
        }
}

TEST_CASE("laminates: tractions are continuous, and no jump near it stores less") {
  std::mt19937_64 random(4);
  for (auto& records : pairs(30.0, 0.3, 0.4)) {
    const Laws laws(Space::solid, std::move(records), ids, 8);
    const std::array<double, 3> n{0.48, 0.6, 0.64};
    const auto made = std::make_unique<Case>(laws, laminate(3, 0.3, n));
    const std::vector<double> H = gradient(random, Space::solid, 0.4);
    const double least = made->energy(H);
    // The two sides by themselves: of one material at H - a (x) g.
    LaminatePoint first = made->point, second = made->point;
    first.share = 1;
    second.share = 0;
    const auto one = std::make_unique<Case>(laws, first), other = std::make_unique<Case>(laws, second);
    const auto stored = [&](const std::array<double, 3>& a) {
      std::vector<double> sides[2] = {H, H};
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t e = 0; e < 3; ++e)
          for (std::size_t s = 0; s < 2; ++s) sides[s][3 * i + e] -= a[i] * made->point.direction[s][e];
      return 0.3 * one->energy(sides[0]) + 0.7 * other->energy(sides[1]);
    };
    // A coarse search of its own, by shrinking steps along the axes.
    std::array<double, 3> a{};
    double best = stored(a);
    for (double step = 0.1; step > 1e-9;) {
      bool better = false;
      for (std::size_t i = 0; i < 3; ++i)
        for (const double sign : {1.0, -1.0}) {
          std::array<double, 3> moved = a;
          moved[i] += sign * step;
          if (const double value = stored(moved); value < best) {
            best = value;
            a = moved;
            better = true;
          }
        }
      if (!better) step *= 0.5;
    }
    CHECK(least == doctest::Approx(best).epsilon(1e-10));
    CHECK(best < 0.999 * stored({0, 0, 0}));
    stored(a);
    for (std::size_t i = 0; i < 3; ++i) {
      double jump = 0, size = 0;
      for (std::size_t e = 0; e < 3; ++e) {
        jump += (one->stress(static_cast<int>(3 * i + e)) - other->stress(static_cast<int>(3 * i + e))) * n[e];
        size += std::abs(one->stress(static_cast<int>(3 * i + e)));
      }
      CHECK(std::abs(jump) <= 1e-3 * (size + 1e-3));
    }
  }
}

namespace {

/// Its energies lose the digits of small strains, as those of many laws do.
struct PlainRubber : NeoHookean {
  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k, const RubberInvariants<T>& of) const noexcept {
    (void)H;
    return 1.5 * k[0] * (of.root * of.root * (1.0 + of.m) - 1.0) + volumetric_energy(volumetric, k[1], of.j);
  }
};

}  // namespace

TEST_CASE("laminates are found where energies have no digits left") {
  std::mt19937_64 random(6);
  for (const Space space : {Space::plane_strain, Space::plane_stress, Space::solid})
    for (const double contrast : {1e-4, 0.1, 1e4})
      for (const double size : {0.3, 1e-2, 1e-4, 1e-6, 1e-8})
        for (int trial = 0; trial < 20; ++trial) {
          INFO(tensor_components(space), " components, contrast ", contrast, ", strains of ", size);
          const auto of = [&]<class Law>(Law) { return Laws(space, {record<Law>(1.0, 0.3), record<Law>(contrast, 0.45)}, ids, 8); };
          const Laws careful = of(NeoHookean()), plain = of(PlainRubber());
          const LaminatePoint point = laminate(dimension(space), 0.4, {0.6, -0.8, 0});
          const auto expected = std::make_unique<Case>(careful, point), found = std::make_unique<Case>(plain, point);
          const std::vector<double> H = gradient(random, space, size);
          expected->energy(H);
          found->energy(H);
          double most = 0;
          for (int c = 0; c < tensor_components(space); ++c) most = std::max(most, std::abs(expected->stress(c)));
          for (int c = 0; c < tensor_components(space); ++c) CHECK(std::abs(found->stress(c) - expected->stress(c)) <= 1e-11 * most);
        }
}

TEST_CASE("laminates of one material are this material, and series springs in one dimension") {
  std::mt19937_64 random(5);
  {
    std::vector<MaterialRecord> records{record<NeoHookean>(3.0, 0.3), record<NeoHookean>(3.0, 0.3)};
    const Laws laws(Space::solid, std::move(records), ids, 8);
    const auto made = std::make_unique<Case>(laws, laminate(3, 0.37, {0, 0.6, 0.8}));
    LaminatePoint alone = made->point;
    alone.share = 1;
    const auto plain = std::make_unique<Case>(laws, alone);
    const std::vector<double> H = gradient(random, Space::solid, 0.5);
    CHECK(made->energy(H) == doctest::Approx(plain->energy(H)).epsilon(1e-13));
    for (int k = 0; k < 9; ++k) CHECK(made->stress(k) == doctest::Approx(plain->stress(k)).epsilon(1e-12));
  }
  std::vector<MaterialRecord> records{record<LinearElastic>(10.0, 0.0), record<LinearElastic>(1.0, 0.0)};
  const Laws laws(Space::line_strain, std::move(records), ids, 8);
  const auto made = std::make_unique<Case>(laws, laminate(1, 0.25, {1, 0, 0}));
  made->energy({1e-3});
  CHECK(made->stress(0) == doctest::Approx(1e-3 / (0.25 / 10 + 0.75)).epsilon(1e-13));
}

TEST_CASE("laminates of strains of any size: down to those that have no digits, and up to squares beyond all numbers") {
  for (const Space space : {Space::line_stress, Space::plane_stress, Space::plane_strain, Space::solid}) {
    std::vector<MaterialRecord> records{record<LinearElastic>(1e6, 0.25), record<LinearElastic>(1e9, 0.3)};
    const Laws laws(space, std::move(records), ids, 8);
    const auto made = std::make_unique<Case>(laws, laminate(dimension(space), 0.37, {1, 0, 0}));
    std::vector<double> unit(static_cast<std::size_t>(tensor_components(space)));
    unit[0] = 1;
    made->set(unit);
    REQUIRE(made->evaluate() < 0);
    const double stress = made->stress(0);
    for (const double size : {0.0, 5e-324, 3e-320, 1e-310, 1e-300, 1e-290, 1e-160, 1e-150, 1e-20, 1e100}) {
      INFO("strain ", size);
      std::vector<double> H = unit;
      H[0] = size;
      made->set(H);
      REQUIRE(made->evaluate() < 0);
      const double few = 1e-13 * stress * size + 1e-300;   // of strains without digits stresses have none
      CHECK(std::abs(made->stress(0) - stress * size) <= few);
    }
  }
}

TEST_CASE("laminates: at rest nothing is stored, bitwise; what is turned over is refused; others are left alone") {
  std::vector<MaterialRecord> records{record<NeoHookean>(10.0, 0.2), record<NeoHookean>(1.0, 0.3)};
  const Laws laws(Space::plane_strain, std::move(records), ids, 8);
  const auto made = std::make_unique<Case>(laws, laminate(2, 0.4, {0.8, 0.6, 0}));
  made->P[0] = 7;
  CHECK(made->energy({0, 0, 0, 0}) == 0.0);
  for (int k = 0; k < 5; ++k) CHECK(made->stress(k) == 0.0);
  CHECK(made->P[0] == 7);
  made->set({-1.5, 0, 0, 0});
  CHECK(made->evaluate() == 3);
  made->set({std::nan(""), 0, 0, 0});
  CHECK(made->evaluate() == 3);
  // A law that softens in tension: a thin soft layer takes all of the stretch.
  std::vector<MaterialRecord> softening{record<Hencky>(1.0, 0.0), record<LinearElastic>(100.0, 0.0)};
  const Laws open(Space::line_stress, std::move(softening), ids, 8);
  const auto layer = std::make_unique<Case>(open, laminate(1, 0.01, {1, 0, 0}));
  const double energy = layer->energy({0.5});
  CHECK(energy < 0.01 * 0.5 * std::log(51.0) * std::log(51.0));
}

TEST_CASE("a stencil that sees a corner or both sides of a layer is no laminate") {
  LaminatePoint point;
  const double up[2] = {0.4, 0}, down[2] = {0.3, 0}, one[2] = {0.3, 0.1}, other[2] = {-0.7, 0.1};
  CHECK(!make_laminate(2, up, down, point));
  for (const double rounding : {-1e-15, 0.0, 1e-15}) {
    const double half[2] = {0.5 + rounding, 0}, none[2] = {0, 0};
    CHECK(!make_laminate(2, half, none, point));
  }
  REQUIRE(make_laminate(2, one, other, point));
  CHECK(point.share == doctest::Approx(0.7));
  // What is tangential is left out: both directions lie along the normal, and their mean vanishes.
  for (int e = 0; e < 2; ++e)
    CHECK(std::abs(point.share * point.direction[0][e] + (1 - point.share) * point.direction[1][e]) <= 1e-16);
}
