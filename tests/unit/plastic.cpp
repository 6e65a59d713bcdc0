/// Plastic laws of perikit/sdk/plastic.hpp: closed forms, an independent return mapping, steps of any size, what is dissipated.

#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>

#include <cmath>
#include <functional>
#include <map>

#include "materials/j2/law.hpp"
#include "perikit/sdk/law_material.hpp"
#include "tests/contract/material_contract.hpp"

using namespace perikit;
using contract::Evaluation;
using contract::Matrix;
using contract::Values;
using Eigen::Matrix3d;

namespace {

using Path = std::function<Matrix3d(double)>;

constexpr double E = 210e9, nu = 0.3, mu = E / (2 * (1 + nu)), bulk = E / (3 * (1 - 2 * nu));
/// Y, H, S - Y, rate and the end of the strength of `j2`, behind the elastic constants.
struct Flow {
  double Y = 0.45e9, H = 0.13e9, saturation = 0.265e9, rate = 16.93, end = 1e300;
  double yield_stress(double a) const { return a < end ? Y + H * a - saturation * std::expm1(-rate * a) : 0.0; }
  std::vector<double> constants() const { return {bulk, mu, Y, H, saturation, rate, end}; }
};

Matrix matrix_of(const Matrix3d& a) {
  Matrix m;
  for (int i = 0; i < 9; ++i) m[i] = a(i / 3, i % 3);
  return m;
}
Matrix3d eigen_of(const Matrix& m) { return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m.data()); }

/// The end of a path F(t), F(0) = I.
struct End {
  Matrix3d P, plastic_strain;
  double a = 0, psi = 0, dissipated = 0, lateral = 0;
  Values state;
};
template <class Law = J2>
End follow(Space space, const Path& path, int steps, const std::vector<double>& constants, Values from = {}, double begin = 0, double until = 1) {
  const LawMaterial<Plastic<Law>> material;
  End end;
  for (int n = 1; n <= steps; ++n) {
    const Matrix3d F = path(begin + (until - begin) * n / steps);
    const std::vector<Values> histories = from.empty() ? std::vector<Values>() : std::vector<Values>{from};
    const Evaluation e(material, space, constants, {contract::restrict_to(space, matrix_of(F - Matrix3d::Identity()))}, {}, false, histories);
    REQUIRE(e.status.ok());
    from = e.at(e.state, 0);
    CHECK(e.dissipated.data()[0] >= 0);
    end.P = eigen_of(contract::extend(space, e.at(e.P, 0)));
    end.psi = e.psi.data()[0];
    end.lateral = e.lateral.data()[0];
    end.dissipated += e.dissipated.data()[0];
  }
  end.state = from;
  end.a = from.back();
  if (space == Space::solid) end.plastic_strain << from[0], from[1], from[2], from[1], from[3], from[4], from[2], from[4], from[5];
  return end;
}

/// f of the principal values of a symmetric matrix.
Matrix3d of_symmetric(const Matrix3d& a, const std::function<double(double)>& f) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(a);
  return solver.eigenvectors() * solver.eigenvalues().unaryExpr(f).asDiagonal() * solver.eigenvectors().transpose();
}
Matrix3d deviator(const Matrix3d& a) { return a - a.trace() / 3 * Matrix3d::Identity(); }
double equivalent(const Matrix3d& tau) { return std::sqrt(1.5) * deviator(tau).norm(); }

/// The same law in another way: F_p itself is kept, F_e = F F_p^-1, C_e = F_e^T F_e in the intermediate configuration, the increment by bisection, F_p1 = exp(increment) F_p0.
struct Reference {
  Flow flow;
  Matrix3d Fp = Matrix3d::Identity(), tau = Matrix3d::Zero();
  double a = 0;

  void step(const Matrix3d& F) {
    const Matrix3d Fe = F * Fp.inverse(), h = of_symmetric(Fe.transpose() * Fe, [](double x) { return 0.5 * std::log(x); }), s = 2 * mu * deviator(h);
    const double q = equivalent(s);
    double low = 0, high = 0;
    if (q > flow.yield_stress(a)) {
      high = q / (3 * mu);
      for (int i = 0; i < 200; ++i) {
        const double middle = 0.5 * (low + high);
        (q - 3 * mu * middle > flow.yield_stress(a + middle) ? low : high) = middle;
      }
    }
    const Matrix3d flowed = q > 0 ? Matrix3d(1.5 * high / q * s) : Matrix3d(Matrix3d::Zero());
    Fp = of_symmetric(flowed, [](double x) { return std::exp(x); }) * Fp;
    a += high;
    const Matrix3d end = F * Fp.inverse();
    tau = deviator(of_symmetric(end * end.transpose(), [](double x) { return mu * std::log(x); })) + bulk * std::log(F.determinant()) * Matrix3d::Identity();
  }
};

Path shear(double by) {
  return [by](double t) {
    Matrix3d F = Matrix3d::Identity();
    F(0, 1) = t * by;
    return F;
  };
}

/// Hardening by a power, which tells nothing of its work: Y (1 + a/a0)^(1/2).
struct RootFlow {
  static constexpr int flow_constants = 2;
  void constants(const MaterialInput&, const Moduli&, double* k) const { k[0] = 0.3e9, k[1] = 0.5; }
  template <class T, class K>
  T yield_stress(const T& a, const K& k) const noexcept { return k[0] * sqrt(1.0 + a / k[1]); }
};

}  // namespace

TEST_CASE("contract: j2, hardening, perfect and softening until nothing is left") {
  for (const Flow& flow : {Flow{}, Flow{.Y = 0.24e9, .H = 0, .saturation = 0, .rate = 0}, Flow{.Y = 0.3e9, .H = -1e9, .saturation = 0, .rate = 0, .end = 0.3}})
    contract::check_material(LawMaterial<Plastic<J2>>(), flow.constants(), {.law = "j2", .moduli = {true, true, true, true, true, false, false}});
}

TEST_CASE("plastic: cyclic uniaxial tension to twice the length and back, against the closed form, in one step a turn or in a thousand") {
  const Flow flow{.saturation = 0, .rate = 0};
  const std::vector<double> turns{2.0, 0.7, 1.8, 1.0};   // stretches
  for (const int steps : {1, 250}) {
    Values state;
    double begin = 1, plastic = 0, a = 0, work = 0, dissipated = 0;
    for (const double turn : turns) {
      const auto stretch = [&](double t) -> Matrix3d {
        Matrix3d F = Matrix3d::Identity();
        F(0, 0) = std::exp((1 - t) * std::log(begin) + t * std::log(turn));
        return F;
      };
      const End end = follow(Space::line_stress, stretch, steps, flow.constants(), state);
      // The flow of this turn goes one way: E (ln stretch - plastic) = sign (Y + H a)
      const double sign = turn > begin ? 1 : -1, trial = E * (std::log(turn) - plastic);
      const double more = (sign * trial - flow.yield_stress(a)) / (E + flow.H);
      REQUIRE(more > 0);
      work += more * (flow.Y + flow.H * (a + 0.5 * more));
      plastic += sign * more, a += more;
      const double tau = E * (std::log(turn) - plastic), lateral = std::exp(-nu * tau / E - 0.5 * plastic);
      dissipated += end.dissipated;
      CAPTURE(steps);
      CAPTURE(turn);
      CHECK(end.P(0, 0) == doctest::Approx(tau / turn).epsilon(1e-10));
      CHECK(end.P(1, 1) == 0);
      CHECK(1 + end.lateral == doctest::Approx(lateral).epsilon(1e-12));
      CHECK(end.a == doctest::Approx(a).epsilon(1e-10));
      CHECK(dissipated == doctest::Approx(work).epsilon(1e-10));
      CHECK(end.psi == doctest::Approx(tau * tau / (2 * E)).epsilon(1e-10));
      CHECK(end.state[0] == doctest::Approx((1 - std::exp(-2 * plastic)) / 2).epsilon(1e-10));
      state = end.state, begin = turn;
    }
  }
}

TEST_CASE("plastic: plane stress of a body that is pulled alone is uniaxial stress, in large steps and small ones") {
  const Flow flow;
  for (const int steps : {1, 20}) {
    const auto pull = [&](double t) -> Matrix3d { return Eigen::Vector3d(1 + t, 1, 1).asDiagonal(); };
    const End bar = follow(Space::line_stress, pull, steps, flow.constants());
    const auto with_lateral = [&](double t) -> Matrix3d {   // lateral stretches of the bar
      const End at = follow(Space::line_stress, [&](double s) { return pull(s * t); }, 1, flow.constants());
      return Eigen::Vector3d(1 + t, 1 + at.lateral, 1).asDiagonal();
    };
    const End plate = follow(Space::plane_stress, with_lateral, steps, flow.constants());
    CHECK(plate.P(0, 0) == doctest::Approx(bar.P(0, 0)).epsilon(1e-10));
    CHECK(std::abs(plate.P(1, 1)) <= 1e-10 * bar.P(0, 0));
    CHECK(plate.lateral == doctest::Approx(bar.lateral).epsilon(1e-10));
    CHECK(plate.a == doctest::Approx(bar.a).epsilon(1e-10));
  }
}

TEST_CASE("plastic: cyclic simple shear to 200 % against a return mapping with F_p, in one step or in a thousand") {
  const Flow flow;
  const auto there_and_back = [](double t) -> Matrix3d { return shear(2.0)(t < 0.5 ? 2 * t : 3 - 4 * t); };   // 0 to 2 to -1
  for (const int steps : {1, 10, 1000}) {
    CAPTURE(steps);
    const End end = follow(Space::solid, there_and_back, steps, flow.constants());
    Reference reference{.flow = flow};
    for (int n = 1; n <= steps; ++n) reference.step(there_and_back(double(n) / steps));
    const Matrix3d tau = end.P * there_and_back(1).transpose();
    CHECK_MESSAGE((tau - reference.tau).norm() <= 1e-10 * reference.tau.norm(), (tau - reference.tau).norm());
    CHECK(end.a == doctest::Approx(reference.a).epsilon(1e-10));
    // On the yield surface, and without a change of volume.
    CHECK(equivalent(tau) == doctest::Approx(flow.yield_stress(end.a)).epsilon(1e-10));
    CHECK((Matrix3d::Identity() - 2 * end.plastic_strain).determinant() == doctest::Approx(1).epsilon(1e-11));
    const End plane = follow(Space::plane_strain, there_and_back, steps, flow.constants());
    CHECK((plane.P - end.P).norm() <= 1e-11 * end.P.norm());
  }
  // Axes turn in simple shear: results depend on the steps to first order.
  const auto at = [&](int steps) { return follow(Space::solid, shear(2.0), steps, flow.constants()).P; };
  const Matrix3d finest = 2 * at(640) - at(320);
  CHECK((at(40) - finest).norm() / (at(80) - finest).norm() == doctest::Approx(2).epsilon(0.05));
}

TEST_CASE("plastic: steps of any size come back to the yield surface") {
  contract::Random random(7);
  const LawMaterial<Plastic<J2>> material;
  int strong = 0, none_left = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const double yield = mu * std::pow(10.0, contract::uniform(random, -8, 0)), hardening = mu * contract::uniform(random, -2.9, 0) * (trial % 2 == 0 ? 1 : -std::pow(10.0, trial % 7));
    const double saturation = yield * contract::uniform(random, 0, 10), rate = std::pow(10.0, contract::uniform(random, -3, 5));
    std::vector<double> k{bulk, mu, 0, 0, 0, 0, 0};
    const std::map<std::string, double, std::less<>> values{{"yield_stress", yield}, {"hardening", hardening}, {"saturation_stress", yield + saturation}, {"saturation_rate", rate}};
    J2().constants({[&](std::string_view key) { return values.contains(key); }, [&](std::string_view key) { return values.find(key)->second; }}, {bulk - 2 * mu / 3, mu}, k.data() + 2);
    const Flow flow{k[2], k[3], k[4], k[5], k[6]};
    const double most = std::pow(10.0, contract::uniform(random, 0, 2));   // P F^T loses as many digits as the square of this has
    const Matrix3d F = eigen_of(contract::random_deformation(random, Space::solid, 1 / most, most));
    const End end = follow(Space::solid, [&](double) { return F; }, 1, k);
    const double q = equivalent(end.P * F.transpose()), expected = flow.yield_stress(end.a), trial_q = equivalent(2 * mu * of_symmetric(F * F.transpose(), [](double x) { return 0.5 * std::log(x); }));
    CAPTURE(trial);
    if (trial_q > flow.Y) CHECK(std::abs(q - expected) <= 1e-10 * trial_q);
    else CHECK(end.a == 0);
    (expected > 0 ? strong : none_left) += trial_q > flow.Y;
  }
  CHECK((strong > 100 && none_left > 20));
}

TEST_CASE("plastic: the tangent is symmetric, and is that of the elastic law where a step unloads") {
  const Flow flow;
  const LawMaterial<Plastic<J2>> material;
  const Path path = [](double t) -> Matrix3d {
    Matrix3d A;
    A << 0.3, 0.5, -0.2, 0.1, -0.3, 0.2, -0.4, 0.1, 0.2;
    return Matrix3d::Identity() + t * A;
  };
  const End begin = follow(Space::solid, path, 10, flow.constants());
  for (const double t : {1.1, 1.0 - 1e-4}) {
    const Evaluation e(material, Space::solid, flow.constants(), {contract::restrict_to(Space::solid, matrix_of(path(t) - Matrix3d::Identity()))}, {}, false, {begin.state});
    double largest = 0, skew = 0;
    for (int r = 0; r < 9; ++r)
      for (int c = 0; c < 9; ++c) {
        largest = std::max(largest, std::abs(e.A.component(9 * r + c)[0]));
        skew = std::max(skew, std::abs(e.A.component(9 * r + c)[0] - e.A.component(9 * c + r)[0]));
      }
    CHECK(skew <= 1e-12 * largest);
    const bool unloads = t < 1;
    CHECK((e.at(e.state, 0) == begin.state) == unloads);
    CHECK((e.dissipated.data()[0] == 0) == unloads);
  }
}

TEST_CASE("plastic: a law that tells no plastic work has it by quadrature") {
  std::vector<double> k{bulk, mu, 0, 0};
  RootFlow().constants({}, {}, k.data() + 2);
  const auto pull = [&](double t) -> Matrix3d { return Eigen::Vector3d(1 + 0.2 * t, 1, 1).asDiagonal(); };
  const End end = follow<RootFlow>(Space::line_stress, pull, 1, k);
  CHECK(end.P(0, 0) * 1.2 == doctest::Approx(0.3e9 * std::sqrt(1 + end.a / 0.5)).epsilon(1e-10));
  CHECK(end.dissipated == doctest::Approx(0.3e9 * 0.5 / 1.5 * (std::pow(1 + end.a / 0.5, 1.5) - 1)).epsilon(1e-9));
}

TEST_CASE("j2: what its parameters must be") {
  const auto make = [](double yield, double hardening, double saturation, double rate) {
    const std::map<std::string, double, std::less<>> values{{"yield_stress", yield}, {"hardening", hardening}, {"saturation_stress", saturation}, {"saturation_rate", rate}};
    double k[5];
    J2().constants({[&](std::string_view key) { return values.contains(key); }, [&](std::string_view key) { return values.find(key)->second; }}, {1.0, 1.0}, k);
  };
  CHECK_NOTHROW(make(0.1, -2.9, 0.2, 5));
  CHECK_THROWS_WITH(make(0, 0, 0.1, 0), doctest::Contains("yield_stress"));
  CHECK_THROWS_WITH(make(0.2, 0, 0.1, 1), doctest::Contains("found saturation_stress = 0.1; allowed: a finite value that is not below yield_stress"));
  CHECK_THROWS_WITH(make(0.1, 0, 0.2, 0), doctest::Contains("found saturation_rate = 0"));
  CHECK_THROWS_WITH(make(0.1, 0, 0.2, -1), doctest::Contains("found saturation_rate = -1"));
  CHECK_THROWS_WITH(make(0.1, -3, 0.1, 0), doctest::Contains("snaps back"));
}
