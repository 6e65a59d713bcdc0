// By how much the stiffness that a body's own bonds add up to is off: pair laws in uniform strains, thin bodies in uniform bending.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <span>

#include "families/families.hpp"
#include "families/family_arrays.hpp"
#include "perikit/core/exact_sum.hpp"
#include "perikit/core/rank_values.hpp"
#include "perikit/core/warnings.hpp"
#include "warnings/doubts.hpp"

namespace perikit {

namespace {

/// Strains of the trial fields: their squares are small beside them, and their energies far above rounding.
constexpr double trial_strain = 1e-5;

/// Stress = lambda tr(strain) 1 + 2 mu strain, in the dimensions of the body.
struct Constants {
  double lambda = 0, mu = 0;

  double energy(const Eigen::MatrixXd& strain) const { return 0.5 * lambda * std::pow(strain.trace(), 2) + mu * strain.squaredNorm(); }
  /// Of a stress along one axis, the others being free; d: 2 or 3.
  double poisson(int d) const { return lambda / ((d - 1) * lambda + 2 * mu); }
  double youngs(int d) const { return 2 * mu * (1 + poisson(d)); }
};

Constants of_material(const Moduli& moduli, Space space) {
  if (space == Space::plane_stress) return {2 * moduli.lambda * moduli.mu / (moduli.lambda + 2 * moduli.mu), moduli.mu};
  if (space == Space::line_stress) return {0, 0.5 * moduli.youngs()};
  return {moduli.lambda, moduli.mu};
}

/// What the kinematics is to represent of the material at a point. Springs alone have one modulus, that of a change of volume.
Constants represented(const BodyProblem& problem, std::size_t p, bool springs_alone) {
  const Constants material = of_material(problem.laws().moduli(p), problem.laws().space());
  if (!springs_alone) return material;
  const int d = problem.dimension();
  const double mu = (d * material.lambda + 2 * material.mu) / (d + 2);
  return {mu, mu};
}

/// Energy density [J/m^3] by point of a field u(x), at images too; none where the field is inadmissible. All ranks must call it.
std::optional<Field> energy_of(BodyProblem& problem, const std::function<Point(const Point&)>& field) {
  const Body& body = problem.body();
  Field u = body.make_field(body.dimension());
  for (const std::int32_t p : body.internal()) {
    const Point value = field(body.position(static_cast<std::size_t>(p)));
    for (int c = 0; c < body.dimension(); ++c) u.component(c)[p] = value[static_cast<std::size_t>(c)];
  }
  PointSamples samples;
  samples.asked = Sampling::energy;
  const bool admissible = problem.terms().sample({u, 0}, samples).ok();
  if (communicator().largest(admissible ? 0 : 1) > 0) return {};
  return std::move(samples.strain_energy_density);
}

/// Some points, not more than about this many, that see nothing but the inside of the body: no image, and their family about them.
constexpr std::int64_t most_inner_points = 2000;

std::vector<std::int32_t> inner_points(const BodyProblem& problem) {
  const Body& body = problem.body();
  const std::int64_t every = body.points_of_all_ranks() / most_inner_points + 1;
  struct Candidate {
    std::int32_t point;
    double volume;
  };
  std::vector<Candidate> candidates;
  double largest = 0;
  FamilyArrays family;
  for (const std::int32_t p : body.owned()) {
    const auto point = static_cast<std::size_t>(p);
    if (body.image(point) || body.number(point) % every != 0) continue;
    problem.families().load(point, BondsOf::intact, family);
    double volume = 0;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    bool beside_image = false;
    for (std::size_t k = 0; k < static_cast<std::size_t>(family.bonds); ++k) {
      volume += family.volume[k];
      for (int a = 0; a < body.dimension(); ++a) centre[a] += family.volume[k] * family.xi[a][k];
      beside_image |= body.image(static_cast<std::size_t>(family.far[k]));
    }
    largest = std::max(largest, volume);
    if (!beside_image && centre.norm() <= 0.1 * body.horizon() * volume) candidates.push_back({p, volume});
  }
  largest = communicator().largest(largest);
  const double least = (body.lattice() ? 1 - 1e-9 : 0.85) * largest;   // of clouds the largest family is large by chance
  std::vector<std::int32_t> inner;
  for (const Candidate& candidate : candidates)
    if (candidate.volume >= least) inner.push_back(candidate.point);
  return inner;
}

/// Of the values of all ranks; NaN without any. All ranks must call it.
double median(const std::vector<double>& mine) {
  std::vector<double> all = told_to_all(gathered(std::span<const double>(mine)));
  if (all.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::ranges::sort(all);
  return all[all.size() / 2];
}

/// Silent below.
constexpr double pair_law_limit = 0.05;

struct Trial {
  const char* name;
  Eigen::MatrixXd strain;
};

std::vector<Trial> trials(int d) {
  const auto zero = [d] { return Eigen::MatrixXd::Zero(d, d).eval(); };
  std::vector<Trial> all = {{"a stretch along an axis", zero()}};
  all[0].strain(0, 0) = 1;
  if (d == 1) return all;
  all.push_back({"an equal stretch in all directions", Eigen::MatrixXd::Identity(d, d)});
  all.push_back({"a shear along the axes", zero()});
  all.back().strain(0, 1) = all.back().strain(1, 0) = 1;
  all.push_back({"a shear at 45 degrees to them", zero()});
  all.back().strain(0, 0) = 1;
  all.back().strain(1, 1) = -1;
  return all;
}

/// Pair laws count on an integral over the family, and have a sum over few bonds.
void find_pair_law(BodyProblem& problem, std::vector<std::string>& lines) {
  if (problem.terms().has_gradients()) return;
  const std::vector<std::int32_t> inner = inner_points(problem);
  const bool springs_alone = problem.terms().springs_alone();
  std::string found;
  double farthest = 0;
  for (const Trial& trial : trials(problem.dimension())) {
    const Eigen::MatrixXd strain = trial_strain * trial.strain;
    const auto energy = energy_of(problem, [&](const Point& x) {
      Point u{};
      for (int r = 0; r < strain.rows(); ++r)
        for (int c = 0; c < strain.cols(); ++c) u[static_cast<std::size_t>(r)] += strain(r, c) * x[static_cast<std::size_t>(c)];
      return u;
    });
    if (!energy) return;
    std::vector<double> ratios;
    for (const std::int32_t p : inner) {
      const double right = represented(problem, static_cast<std::size_t>(p), springs_alone).energy(strain);
      if (right > 0) ratios.push_back(energy->data()[p] / right);
    }
    const double ratio = median(ratios);
    if (!std::isfinite(ratio)) return;
    farthest = std::max(farthest, std::abs(ratio - 1));
    found += fmt::format("{}{:.2f} in {}", found.empty() ? "" : ", ", ratio, trial.name);
  }
  if (farthest < pair_law_limit) return;
  const bool factors = problem.terms().parts().formulation.pair_traits.factors == BondFactorsOf::moments;
  lines.push_back(named("pair_law", fmt::format("inside the body bonds store {} times the energy of the material: the stiffness is off by as much, however fine the points are; {}", found,
                                                factors ? "factors on its bonds cannot do better with these points: a longer horizon or points that lie more evenly, or kinematics with gradients, such as \"baqp\", can"
                                                        : "surface_correction = \"moments\" and kinematics with gradients, such as \"baqp\", are exact there")));
}

/// The box of a body's points, with half a spacing around them, without images.
struct Extents {
  Point low{}, high{};
  double along(int a) const { return high[static_cast<std::size_t>(a)] - low[static_cast<std::size_t>(a)]; }
  double middle(int a) const { return 0.5 * (low[static_cast<std::size_t>(a)] + high[static_cast<std::size_t>(a)]); }
};

Extents extents(const Body& body) {
  Extents box;
  for (std::size_t a = 0; a < static_cast<std::size_t>(body.dimension()); ++a) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const std::int32_t p : body.owned()) {
      if (body.image(static_cast<std::size_t>(p))) continue;
      low = std::min(low, body.position(static_cast<std::size_t>(p))[a]);
      high = std::max(high, body.position(static_cast<std::size_t>(p))[a]);
    }
    box.low[a] = -communicator().largest(-low) - 0.5 * body.spacing();
    box.high[a] = communicator().largest(high) + 0.5 * body.spacing();
  }
  return box;
}

/// Whether images lie beyond a side across this axis: the body goes on there.
bool goes_on(const Body& body, const Extents& box, int axis) {
  const auto a = static_cast<std::size_t>(axis);
  bool beyond = false;
  for (const std::int32_t p : body.internal()) {
    if (!body.image(static_cast<std::size_t>(p))) continue;
    const double x = body.position(static_cast<std::size_t>(p))[a];
    beyond |= x < box.low[a] || x > box.high[a];
  }
  return communicator().largest(beyond ? 1 : 0) > 0;
}

/// Bodies that are longer than this many times their thickness, and thinner than this many horizons, are looked at; silent below the last.
constexpr double slender = 4, thin = 4, bending_limit = 0.1;

/// The energy of the body bent uniformly, over that of the material, in sections that no end is near: the field is that of a stress along
/// the length, which is right for every section. NaN where there is no such section.
double bending_energy(BodyProblem& problem, const Extents& box, int across, int along) {
  const Body& body = problem.body();
  const int d = body.dimension();
  const auto a = static_cast<std::size_t>(across), b = static_cast<std::size_t>(along), c = static_cast<std::size_t>(3 - across - along);
  const Constants material = represented(problem, static_cast<std::size_t>(body.owned().front()), problem.terms().springs_alone());
  const double nu = material.poisson(d), half = 0.5 * box.along(along) - 2 * body.horizon();
  if (half < 0.5 * body.horizon()) return std::numeric_limits<double>::quiet_NaN();
  // Neither strains nor the rotations of the ends are more than small.
  const double curvature = std::min(2 * trial_strain / box.along(across), 1e-2 / box.along(along));
  const auto from_middle = [&](const Point& x, std::size_t axis) { return x[axis] - box.middle(static_cast<int>(axis)); };
  const auto energy = energy_of(problem, [&](const Point& x) {
    const double y = from_middle(x, a), s = from_middle(x, b), z = d == 3 ? from_middle(x, c) : 0;
    Point u{};
    u[b] = curvature * s * y;
    u[a] = -0.5 * curvature * (s * s + nu * (y * y - z * z));
    if (d == 3) u[c] = -nu * curvature * y * z;
    return u;
  });
  if (!energy) return std::numeric_limits<double>::quiet_NaN();
  ExactSum stored, right;
  for (const std::int32_t p : body.owned()) {
    const auto point = static_cast<std::size_t>(p);
    const Point& x = body.position(point);
    if (body.image(point) || std::abs(from_middle(x, b)) > half) continue;
    // The square of the strain over a cell, not at its middle alone.
    const double square = curvature * curvature * (std::pow(from_middle(x, a), 2) + body.spacing() * body.spacing() / 12);
    stored.add(body.volume(point) * energy->data()[p]);
    right.add(body.volume(point) * 0.5 * material.youngs(d) * square);
  }
  return total_over_ranks(stored) / total_over_ranks(right);
}

/// Near free surfaces families are cut, and gradients belong to places inside of their points: thin bodies are nothing but surface.
void find_thin_body(const Scene& scene, BodyProblem& problem, std::vector<std::string>& lines) {
  const Body& body = problem.body();
  const int d = body.dimension();
  const auto stores = [](const MaterialRecord& record) { return !record.silent && !record.incomplete; };
  const std::vector<MaterialRecord>& records = problem.laws().records();
  if (d == 1 || std::ranges::count_if(records, stores) != 1 || !std::ranges::find_if(records, stores)->uniform || problem.laws().state_components() > 0 || !scene.cracks.empty()) return;
  const Extents box = extents(body);
  int across = 0, along = 0;
  for (int a = 1; a < d; ++a) {
    if (box.along(a) < box.along(across)) across = a;
    if (box.along(a) > box.along(along)) along = a;
  }
  if (box.along(across) >= thin * body.horizon() || box.along(along) < slender * box.along(across) || goes_on(body, box, across)) return;
  const double ratio = bending_energy(problem, box, across, along);
  if (!(std::abs(ratio - 1) >= bending_limit)) return;
  lines.push_back(named("thin", fmt::format("the body has {:.0f} points across along {}: bent uniformly it stores {:.2f} times the energy of the material, and deflections come out too {} by about as much; "
                                            "more points across; kinematics = {} comes closest with few",
                                            box.along(across) / body.spacing(), "xyz"[across], ratio, ratio < 1 ? "large" : "small",
                                            body.lattice() ? "{ type = \"conventional\", order = 2, stabilization = \"silling\" }" : "{ type = \"projection\", order = 2 }")));
}

}  // namespace

void find_doubts_of_stiffness(const Scene& scene, BodyProblem& problem, std::vector<std::string>& lines) {
  const auto told = [&](const char* name) { return std::ranges::find(scene.silence, name) == scene.silence.end(); };
  if (told("pair_law")) find_pair_law(problem, lines);
  if (told("thin")) find_thin_body(scene, problem, lines);
}

}  // namespace perikit
