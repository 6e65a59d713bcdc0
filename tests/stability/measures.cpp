#include "perikit/problem/motion.hpp"
#include "perikit/sdk/stable_step.hpp"
#include "tests/stability/measures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/eigen.hpp"
#include "tests/contract/fixture.hpp"
#include "tests/kit/observers.hpp"

namespace perikit::stability {

namespace {

constexpr double spacing = 1.0;
constexpr double rough = 0.35;

int points_along(const Setting& s) {
  return s.side > 0 ? s.side : s.dimension == 1 ? 40 : s.dimension == 2 ? 11 : 5;
}

std::string list(int dimension, double value) {
  std::string text = "[";
  for (int a = 0; a < dimension; ++a) text += fmt::format("{}{:.17g}", a > 0 ? ", " : "", value);
  return text + "]";
}

std::string scene_text(const Setting& s, const std::string& integrator) {
  std::string text = fmt::format("format = 1\n[body]\ndimension = {}\n", s.dimension);
  if (s.dimension == 2) text += "plane = \"strain\"\n";
  if (s.dimension == 1) text += "line = \"strain\"\n";
  text += fmt::format("[body.lattice]\nspacing = {}\nlower = {}\nupper = {}\njitter = {}\nseed = 3\n", spacing,
                      list(s.dimension, 0), list(s.dimension, points_along(s) * spacing), s.jitter);
  text += fmt::format("[family]\nhorizon_ratio = {}\ninfluence = \"{}\"\n[kinematics]\n{}\n", s.horizon_ratio, s.influence,
                      s.kinematics);
  return text +
         "[material]\ntype = \"saint_venant_kirchhoff\"\ndensity = 1.0\nyoungs_modulus = 1.0\npoisson_ratio = "
         "0.25\n[run]\nthreads = 1\n[integrator]\n" +
         integrator + "\n";
}

/// Positions of the live points as columns.
Eigen::MatrixXd positions(const Body& body) {
  Eigen::MatrixXd x(3, static_cast<Eigen::Index>(body.points()));
  for (std::size_t p = 0; p < body.points(); ++p) {
    const Point at = body.position(static_cast<std::size_t>(body.internal()[p]));
    for (Eigen::Index a = 0; a < 3; ++a) x(a, static_cast<Eigen::Index>(p)) = at[static_cast<std::size_t>(a)];
  }
  return x;
}

/// Orthonormal rigid motions; component c of point p is row d p + c.
Eigen::MatrixXd rigid_motions(const Eigen::MatrixXd& x, int d) {
  const Eigen::Index n = x.cols();
  Eigen::MatrixXd modes = Eigen::MatrixXd::Zero(d * n, d * (d + 1) / 2);
  const Eigen::Vector3d centre = x.rowwise().mean();
  for (Eigen::Index p = 0; p < n; ++p) {
    int mode = 0;
    for (int c = 0; c < d; ++c) modes(d * p + c, mode++) = 1;
    for (int a = 0; a < d; ++a)
      for (int b = a + 1; b < d; ++b, ++mode) {
        modes(d * p + a, mode) = -(x(b, p) - centre(b));
        modes(d * p + b, mode) = x(a, p) - centre(a);
      }
  }
  return Eigen::HouseholderQR<Eigen::MatrixXd>(modes).householderQ() * Eigen::MatrixXd::Identity(modes.rows(), modes.cols());
}

/// Assembled tangent over the mass, point by point.
Eigen::MatrixXd dense_tangent(BodyProblem& problem) {
  BlockMatrix K;
  Field rest = problem.make_field();
  if (!problem.assemble_tangent({rest, 0}, K).ok()) throw RunError("no tangent at rest");
  const auto d = static_cast<Eigen::Index>(K.dimension);
  const auto mass = problem.masses().by_point();
  // Block rows are in the order of field indices; positions in input order.
  std::vector<Eigen::Index> row(K.rows());
  for (std::size_t r = 0; r < K.rows(); ++r) row[r] = problem.body().input_of(static_cast<std::size_t>(K.point[r]));
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(d * static_cast<Eigen::Index>(K.rows()), d * static_cast<Eigen::Index>(K.rows()));
  for (std::size_t r = 0; r < K.rows(); ++r)
    for (auto b = static_cast<std::size_t>(K.row_first[r]); b < static_cast<std::size_t>(K.row_first[r + 1]); ++b) {
      const auto s = static_cast<std::size_t>(K.column[b]);
      const double scale = 1 / std::sqrt(mass[static_cast<std::size_t>(K.point[r])] * mass[static_cast<std::size_t>(K.point[s])]);
      for (Eigen::Index a = 0; a < d; ++a)
        for (Eigen::Index c = 0; c < d; ++c)
          dense(d * row[r] + a, d * row[s] + c) =
              scale * K.values[(b * static_cast<std::size_t>(d) + static_cast<std::size_t>(a)) * static_cast<std::size_t>(d) +
                               static_cast<std::size_t>(c)];
    }
  return 0.5 * (dense + dense.transpose());
}

/// 0 where neighbours (within 1.5 spacings) move alike, 1 where they move in opposite directions.
Eigen::VectorXd roughness(const Eigen::MatrixXd& modes, const Eigen::MatrixXd& x, int d) {
  Eigen::VectorXd differences = Eigen::VectorXd::Zero(modes.cols()), sums = differences;
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    for (Eigen::Index j = i + 1; j < x.cols(); ++j) {
      if ((x.col(i) - x.col(j)).squaredNorm() > 2.25 * spacing * spacing) continue;
      differences += (modes.middleRows(d * i, d) - modes.middleRows(d * j, d)).colwise().squaredNorm().transpose();
      sums +=
          (modes.middleRows(d * i, d).colwise().squaredNorm() + modes.middleRows(d * j, d).colwise().squaredNorm()).transpose();
    }
  return differences.cwiseQuotient(2 * sums.cwiseMax(std::numeric_limits<double>::min()));
}

/// Watches the kinetic energy.
class Watcher final : public test::Silent {
 public:
  explicit Watcher(BodyProblem& problem) : problem_(problem) {}
  bool wants_sample(std::int64_t, double) override { return true; }
  void step_done(const StepReport& report) override {
    const double kinetic = kinetic_energy(problem_, problem_.state().velocity());
    if (report.step == 0) start_ = kinetic;
    most_ = std::isfinite(kinetic) ? std::max(most_, kinetic) : std::numeric_limits<double>::infinity();
  }
  bool cancelled() const noexcept override { return most_ > 1e12 * start_; }
  double growth() const { return most_ / start_; }

 private:
  BodyProblem& problem_;
  double start_ = 0, most_ = 0;
};

}  // namespace

std::vector<Setting> all_settings(Registry& registry) {
  std::vector<std::pair<std::string, std::string>> kinematics;
  const auto table = [](const std::string& type, const std::string& keys) {
    return fmt::format("type = \"{}\"\n{}", type, keys);
  };
  for (const std::string& name : registry.names(Kind::kinematics)) {
    kinematics.emplace_back(name, table(name, registry.describe(Kind::kinematics, name).examples.front()));
  }
  for (const std::string& name : registry.names(Kind::stabilization)) {
    kinematics.emplace_back("conventional + " + name, table("conventional", fmt::format("stabilization = \"{}\"", name)));
  }
  std::vector<Setting> all;
  for (const auto& [label, keys] : kinematics)
    for (int dimension = 1; dimension <= 3; ++dimension)
      for (const std::string influence : {"constant", "inverse", "cone", "gaussian", "cubic_spline"})
        for (const double ratio : {1.015, 2.015, 3.015, 5.0})
          for (const double jitter : {0.0, 0.1, 0.2, 0.3}) all.push_back({label, keys, influence, ratio, jitter, dimension});
  return all;
}

Specimen::Specimen(Registry& registry, const Setting& setting)
    : registry_(registry), setting_(setting), simulation_(make("type = \"evaluate\"")) {}

std::unique_ptr<Simulation> Specimen::make(const std::string& integrator) const {
  return std::make_unique<Simulation>(parse_scene(scene_text(setting_, integrator), "stability.toml", registry_), registry_);
}

Spectrum Specimen::spectrum() {
  BodyProblem& problem = simulation_->problem();
  const int d = problem.dimension();
  const Eigen::MatrixXd x = positions(problem.body()), K = dense_tangent(problem), rigid = rigid_motions(x, d);
  Spectrum result;
  // Rigid motions are moved to the top of the spectrum.
  const double bound = K.cwiseAbs().rowwise().sum().maxCoeff();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(K + 2 * bound * rigid * rigid.transpose());
  const Eigen::Index count = K.rows() - rigid.cols();
  const Eigen::VectorXd values = solver.eigenvalues().head(count);
  const Eigen::VectorXd rough_modes = roughness(solver.eigenvectors().leftCols(count), x, d);
  result.largest = values(count - 1);
  result.lowest = values(0) / result.largest;
  result.roughness = rough_modes(0);
  result.lowest_rough = 1;
  for (Eigen::Index k = 0; k < count; ++k) {
    if (rough_modes(k) >= rough) result.lowest_rough = std::min(result.lowest_rough, values(k) / result.largest);
    result.zero_modes += std::abs(values(k)) < 1e-10 * result.largest;
  }
  Field rest = problem.body().make_field(d);
  result.estimate = largest_eigenvalue(problem, rest) / result.largest;
  result.poor_points = problem.report().singular_families;
  return result;
}

Accuracy Specimen::accuracy() {
  BodyProblem& problem = simulation_->problem();
  if (!problem.terms().has_gradients()) return {};
  const Body& body = problem.body();
  const int d = problem.dimension(), n = d * d;
  contract::Noise random(11);
  std::array<std::array<double, 9>, 3> Q{};  // u_a = Q_a(x, x), small enough for every law
  for (auto& form : Q)
    for (double& q : form) q = 1e-4 * random();
  const auto gradient = [&](const Point& x, int a, int b, bool quadratic) {
    const auto& form = Q[static_cast<std::size_t>(a)];
    if (!quadratic) return form[static_cast<std::size_t>(b)];
    double sum = 0;
    for (int c = 0; c < d; ++c)
      sum += (form[static_cast<std::size_t>(3 * b + c)] + form[static_cast<std::size_t>(3 * c + b)]) *
             x[static_cast<std::size_t>(c)];
    return sum;
  };
  double scale[2] = {0, 0};
  for (int a = 0; a < d; ++a)
    for (int b = 0; b < d; ++b) {
      scale[0] = std::max(scale[0], std::abs(Q[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)]));
      for (int c = 0; c < d; ++c)
        scale[1] = std::max(scale[1], spacing * std::abs(Q[static_cast<std::size_t>(a)][static_cast<std::size_t>(3 * b + c)] +
                                                         Q[static_cast<std::size_t>(a)][static_cast<std::size_t>(3 * c + b)]));
    }
  Accuracy result;
  const double middle = 0.5 * points_along(setting_) * spacing;
  for (const bool quadratic : {false, true}) {
    Field u = problem.body().make_field(d);
    contract::set_field(body, u, [&](const Point& x) {
      Point v{};
      for (int a = 0; a < d; ++a)
        for (int b = 0; b < d; ++b)
          v[static_cast<std::size_t>(a)] +=
              (quadratic ? 0.5 : 1.0) * gradient(x, a, b, quadratic) * x[static_cast<std::size_t>(b)];
      return v;
    });
    PointSamples samples;
    if (!problem.terms().sample({u, 0}, samples).ok()) throw RunError("inadmissible test field");
    double most = 0, centre = 0, nearest = std::numeric_limits<double>::infinity();
    for (const std::int32_t index : body.internal()) {
      const Point x = body.position(static_cast<std::size_t>(index));
      double error = 0, distance = 0;
      for (int k = 0; k < n; ++k)
        error = std::max(error, std::abs(samples.H.component(k)[index] - gradient(x, k / d, k % d, quadratic)));
      for (int a = 0; a < d; ++a)
        distance += (x[static_cast<std::size_t>(a)] - middle) * (x[static_cast<std::size_t>(a)] - middle);
      most = std::max(most, error);
      if (distance < nearest) centre = error, nearest = distance;
    }
    (quadratic ? result.quadratic_surface : result.affine) = most / scale[quadratic];
    if (quadratic) result.quadratic_centre = centre / scale[1];
  }
  return result;
}

std::unique_ptr<Simulation> Specimen::shaken(double largest, double share, std::int64_t steps) const {
  const double step = share * 2 / std::sqrt(largest);
  auto simulation = make(fmt::format("type = \"verlet\"\nend_time = {:.17g}\ntime_step = {:.17g}\nallow_unstable = true",
                                     static_cast<double>(steps) * step, step));
  BodyProblem& problem = simulation->problem();
  contract::Noise random(5);
  contract::set_field(problem.body(), problem.state().velocity(), [&](const Point&) {
    Point v{};
    for (int c = 0; c < problem.dimension(); ++c) v[static_cast<std::size_t>(c)] = 1e-8 * random();
    return v;
  });
  return simulation;
}

double Specimen::growth(double largest, double share, std::int64_t steps) const {
  const auto simulation = shaken(largest, share, steps);
  Watcher watcher(simulation->problem());
  try {
    simulation->run(watcher);
  } catch (const RunError&) {
    return std::numeric_limits<double>::infinity();
  }
  return watcher.growth();
}

}  // namespace perikit::stability
