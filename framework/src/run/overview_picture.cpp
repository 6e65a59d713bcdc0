// The body of a scene as an engineer draws it: what is held, what is loaded and where to, which points the sets hold.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "output/picture/body_picture.hpp"
#include "output/picture/gnuplot.hpp"
#include "output/plot.hpp"
#include "run/simulation.hpp"
#include "setup/conditions.hpp"

namespace perikit {

namespace {

enum Role { free_points, in_a_set, loaded, held };

/// By point; what comes later in Role covers what comes before it.
std::vector<double> roles_of(const Scene& scene, const Body& body) {
  std::vector<double> role(body.stride(), free_points);
  const auto mark = [&](const std::string& set, Role as) {
    for (const std::int32_t p : body.set(set)) role[static_cast<std::size_t>(p)] = std::max<double>(role[static_cast<std::size_t>(p)], as);
  };
  for (const SetDescription& set : scene.sets) mark(set.name, in_a_set);
  for (const LoadDescription& load : scene.loads)
    if (load.set != "all" && load.face.empty()) mark(load.set, loaded);
  for (const BoundaryDescription& boundary : scene.boundaries)
    if (boundary.set != "all" && !boundary.holds_side()) mark(boundary.set, held);
  return role;
}

/// Forces of loads at the points, the longest about a tenth of the body long, those of a few dozen points. Points inside, which carry a small part of what acts on
/// a face, have none.
std::vector<BodyArrow> arrows_of(BodyProblem& problem, double end, double longest) {
  constexpr std::size_t most = 60;
  const Points& points = problem.points();
  Field force = problem.make_field();
  if (!problem.external_forces({problem.state().displacement(), end}, force).ok()) return {};
  std::vector<BodyArrow> arrows;
  double largest = 0;
  for (const std::int32_t index : points.owned()) {
    BodyArrow arrow{points.position(static_cast<std::size_t>(index)), {}};
    double square = 0;
    for (int a = 0; a < points.dimension(); ++a) {
      arrow.along[static_cast<std::size_t>(a)] = force.component(a)[index];
      square += std::pow(force.component(a)[index], 2);
    }
    largest = std::max(largest, std::sqrt(square));
    if (square > 0) arrows.push_back(arrow);
  }
  std::erase_if(arrows, [&](const BodyArrow& arrow) { return std::hypot(arrow.along[0], arrow.along[1], arrow.along[2]) < 0.3 * largest; });
  const std::size_t every = arrows.size() / most + 1;
  std::vector<BodyArrow> shown;
  for (std::size_t k = 0; k < arrows.size(); k += every) {
    for (double& component : arrows[k].along) component *= longest / largest;
    shown.push_back(arrows[k]);
  }
  return shown;
}

}  // namespace

void plot_overview(Simulation& simulation, const std::filesystem::path& picture) {
  const Scene& scene = simulation.scene();
  const Body& body = simulation.problem().body();
  if (body.dimension() == 1) throw InputError({}, "output", "found a body on a line, of which there is no picture; allowed: bodies in a plane or in space");
  const std::vector<double> role = roles_of(scene, body);
  std::vector<double> position, volume, values;
  std::array<double, 3> lower, upper;
  lower.fill(INFINITY), upper.fill(-INFINITY);
  for (const std::int32_t index : body.owned()) {
    const auto p = static_cast<std::size_t>(index);
    const Point x = body.position(p);
    for (std::size_t a = 0; a < 3; ++a) {
      position.push_back(x[a]);
      lower[a] = std::min(lower[a], x[a]), upper[a] = std::max(upper[a], x[a]);
    }
    volume.push_back(body.volume(p));
    values.push_back(role[p]);
  }
  BodyPicture drawn;
  drawn.dimension = body.dimension();
  drawn.reference = drawn.drawn = position;
  drawn.volume = volume;
  drawn.values = values;
  drawn.range = {0.0, static_cast<double>(held)};
  drawn.view = {1, -1, 0.6};
  drawn.value_names = {"body", "in a set", "loaded", "held"};
  const double end = end_of(scene, simulation.quasi_static());
  drawn.arrows = arrows_of(simulation.problem(), end, 0.12 * std::hypot(upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]));
  std::string sides;
  for (const BoundaryDescription& boundary : scene.boundaries)
    if (boundary.holds_side()) sides += fmt::format("{}{}", sides.empty() ? "; held at " : ", ", boundary.face.empty() ? "a surface" : boundary.face);
  drawn.title = fmt::format("{}{}", scene.title.empty() ? scene.file.stem().string() : scene.title, sides);
  drawn.length_unit = "m";
  drawn.file = picture;
  run_gnuplot(body_script(drawn), picture);
}

}  // namespace perikit
