#include "tests/contract/fixture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "tests/kit/derivative.hpp"

namespace perikit::contract {

Subject& subject() {
  static Subject instance;
  return instance;
}

std::vector<Example> examples(Kind kind) {
  std::vector<Example> all;
  for (const auto& [k, part] : subject().parts) {
    if (k != kind) continue;
    for (const std::string& table : subject().registry.describe(kind, part).examples) all.push_back({part, table});
    // No example of the parts themselves: where factors on bonds cannot do all that they are asked for, their last digits differ between machines, and
    // `perikit check --machine` compares examples.
    if (kind == Kind::kinematics && (part == "bond_based" || part == "ordinary")) all.push_back({part, "surface_correction = \"moments\""});
  }
  return all;
}

double of_iterations(const Example& example) { return example.table.find("moments") != std::string::npos ? 100 : 1; }

std::vector<Example> kinematics_examples() {
  std::vector<Example> all = examples(Kind::kinematics);
  std::string known;   // order 2 with the first example of each part, and what it alone has
  for (const Example& example : examples(Kind::stabilization)) {
    std::string table = fmt::format("type = \"{}\"{}{}", example.part, example.table.empty() ? "" : "\n", example.table);
    std::replace(table.begin(), table.end(), '\n', ',');
    const auto part = parse_part(Kind::stabilization, example.part, example.table, subject().registry);
    const bool linear = example.table.find("fit = \"linear\"") != std::string::npos, first = example.part != known;
    known = example.part;
    for (const char* order : {"", "order = 2"})
      if (*order ? first || linear : !linear)
        all.push_back({"conventional", order, fmt::format("{{ {} }}", table), subject().registry.stabilization(*part)->traits().isotropic});
  }
  return all;
}

std::string kinematics_table(const Example& example) {
  const std::string stabilization = example.stabilization.empty() ? "" : fmt::format("stabilization = {}\n", example.stabilization);
  return fmt::format("type = \"{}\"\n{}{}", example.part, stabilization, example.table);
}

std::string scene_text(const BodyOptions& o, const std::string& kinematics) {
  const int d = o.dimension;
  const int n = o.cells > 0 ? o.cells : d == 3 ? 9 : d == 2 ? 13 : 40;
  // Unequal sides: the axes must not be interchangeable, and the longest one is not a multiple of a SIMD pack.
  const std::array<int, 3> cells{n - 2 > 1 && d > 1 ? n - 2 : n, d > 1 ? n : 1, d > 2 ? std::max(3, n - 4) : 1};
  const auto vector = [&](auto&& value) {
    std::string text = "[";
    for (int a = 0; a < d; ++a) text += fmt::format("{}{:.17g}", a > 0 ? ", " : "", static_cast<double>(value(a)));
    return text + "]";
  };
  std::string text = "format = 1\n[body]\n";
  text += fmt::format("dimension = {}\n", d);
  if (d == 2) text += fmt::format("plane = \"{}\"\nthickness = {:.17g}\n", o.plane, 1.5 * o.scale);
  if (d == 1) text += fmt::format("line = \"{}\"\narea = {:.17g}\n", o.plane == "stress" ? "stress" : "strain", 1.5 * o.scale * o.scale);
  text += fmt::format("[body.lattice]\nspacing = {:.17g}\nlower = {}\nupper = {}\n", o.scale, vector([](int) { return 0.0; }),
                      vector([&](int a) { return o.scale * cells[static_cast<std::size_t>(a)]; }));
  // Points of a tongue on a cloud lie on a line, but for a millionth of the spacing.
  if (o.cloud) text += fmt::format("jitter = {}\nseed = {}\n", o.tongues ? 1e-6 : 0.25, o.tongues ? 8 : 7);
  if (o.tongues) {
    const char* const rod = d == 2 ? "abs(y - 3.5*{0:.17g}) < 0.4*{0:.17g}" : "abs(y - 2.5*{0:.17g}) < 0.4*{0:.17g} && abs(z - 1.5*{0:.17g}) < 0.4*{0:.17g}";
    const char* const flange = d == 2 ? "" : " || (y > 3*{0:.17g} && abs(z - 1.5*{0:.17g}) < 0.4*{0:.17g})";
    text += fmt::format("inside = \"x < 3*{:.17g} || ({}){}\"\n", o.scale, fmt::format(fmt::runtime(rod), o.scale), fmt::format(fmt::runtime(flange), o.scale));
  }
  text += fmt::format("[sets]\npart = \"x < {:.17g}\"\n", 0.4 * o.scale * cells[0]) + o.sets;
  text += fmt::format("[family]\nhorizon_ratio = {}\ninfluence = {}\n", o.horizon_ratio,
                      o.influence.find('=') == std::string::npos ? "\"" + o.influence + "\"" : "{ " + o.influence + " }");
  if (o.cloud) text += fmt::format("consistent = {}\n", o.consistent);
  text += "[kinematics]\n" + kinematics + "\n[material]\n" + o.material + "\n";
  if (o.two_materials) {
    text += fmt::format("[[region]]\nset = \"part\"\nmaterial = {{ type = \"neo_hookean\", density = 2.0, shear_modulus = {:.17g}, bulk_modulus = {:.17g} }}\n",
                        0.4 * o.modulus, 1.3 * o.modulus);
  }
  if (o.crack && d == 2) {
    text += fmt::format("[[crack]]\nsegment = [[-1.0, {0:.17g}], [{1:.17g}, {0:.17g}]]\n", 0.5013 * o.scale * cells[1], 0.55 * o.scale * cells[0]);
  }
  if (o.crack && d == 3) {
    const double z = 0.5013 * o.scale * cells[2], x = 0.45 * o.scale * cells[0], y = o.scale * (cells[1] + 1);
    text += fmt::format("[[crack]]\npolygon = [[-1.0, -1.0, {0:.17g}], [{1:.17g}, -1.0, {0:.17g}], [{1:.17g}, {2:.17g}, {0:.17g}], [-1.0, {2:.17g}, {0:.17g}]]\n", z, x, y);
  }
  text += "[integrator]\n" + o.integrator + "\n[run]\n" + fmt::format("skip = {}\nshare = {}\n", o.skip, o.share) + o.conditions;
  return text;
}

std::string Case::label() const {
  return fmt::format("{} ({}{}) {}D {}{}{}{}", example.part, example.table, example.stabilization, body.dimension, body.cloud ? "cloud" : "lattice", body.crack ? " cracked" : body.tongues ? " with tongues" : "",
                     body.two_materials ? " two materials" : "", body.plane == "stress" ? " plane stress" : "");
}

Formulation formulation_of(const Example& example) {
  Registry& registry = subject().registry;
  return make_formulation(registry.kinematics(*parse_part(Kind::kinematics, example.part, example.table, registry)));
}

bool Case::conservative() const { return formulation_of(example).force_state == ForceState::variational; }

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const Example& example : kinematics_examples()) {
    const bool selective = formulation_of(example).selective();
    for (int d = 1; d <= 3; ++d) {
      for (const bool cloud : {false, true}) {
        BodyOptions body;
        body.dimension = d;
        body.cloud = cloud;
        all.push_back({example, body});
        if (d > 1) {
          body.crack = true;
          body.two_materials = true;
          all.push_back({example, body});
        } else {
          body.two_materials = true;
          all.push_back({example, body});
        }
        if (d == 2 && !cloud && !selective) {
          body.crack = body.two_materials = false;
          body.plane = "stress";
          all.push_back({example, body});
        }
      }
    }
  }
  return all;
}

std::vector<BodyOptions> bodies_with_tongues() {
  std::vector<BodyOptions> all;
  for (const int d : {2, 3})
    for (const bool cloud : {false, true}) {
      BodyOptions body;
      body.dimension = d;
      body.cloud = cloud;
      body.tongues = true;
      body.cells = 8;
      body.horizon_ratio = 1.515;
      all.push_back(body);
    }
  return all;
}

std::vector<Case> cases_and_tongues() {
  std::vector<Case> all = cases();
  for (const Example& example : kinematics_examples())
    for (const BodyOptions& body : bodies_with_tongues()) all.push_back({example, body});
  return all;
}

std::unique_ptr<Simulation> build(const std::string& text) {
  return std::make_unique<Simulation>(parse_scene(text, "contract.toml", subject().registry), subject().registry);
}

void set_field(const Body& body, FieldView field, const std::function<Point(const Point&)>& value) {
  for (const std::int32_t p : body.internal()) {
    const Point v = value(body.position(static_cast<std::size_t>(p)));
    for (int c = 0; c < field.components; ++c) field.component(c)[p] = v[static_cast<std::size_t>(c)];
  }
}

void deform(const Body& body, FieldView u, std::uint64_t seed, double noise) {
  Noise random(seed);
  std::array<std::array<double, 3>, 3> G{};
  for (auto& row : G)
    for (double& g : row) g = 0.08 * random();
  const double s = body.spacing();
  set_field(body, u, [&](const Point& x) {
    Point v{};
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < static_cast<std::size_t>(body.dimension()); ++b) v[a] += G[a][b] * x[b];
      v[a] += noise * s * random();
    }
    return v;
  });
}

void stretch_at_random(const Body& body, FieldView u, std::uint64_t seed) {
  deform(body, u, seed, 0.02);
  for (const std::int32_t p : body.internal()) {
    const Point x = body.position(static_cast<std::size_t>(p));
    for (int c = 0; c < u.components; ++c) u.component(c)[p] += 0.2 * x[static_cast<std::size_t>(c)];
  }
}

void to_problem(const BodyProblem& problem, FieldView u) {
  Field of_sources = problem.make_field();
  for (int c = 0; c < u.components; ++c)
    for (const std::int32_t p : problem.body().owned()) of_sources.component(c)[p] = u.component(c)[p];
  problem.images()->extend(of_sources);
  for (std::size_t n = problem.body().owned().size(); n < problem.body().points(); ++n)
    for (int c = 0; c < u.components; ++c) u.component(c)[problem.body().internal()[n]] -= of_sources.component(c)[problem.body().internal()[n]];
}

Field force_of(BodyProblem& problem, ConstFieldView u, double* energy) {
  Field f = problem.make_field();
  f.fill(std::numeric_limits<double>::quiet_NaN());
  const EvaluationStatus status = problem.evaluate_forces({u, 0}, f, energy);
  if (!status.ok()) throw std::runtime_error(status.description);
  return f;
}

double energy_of(BodyProblem& problem, ConstFieldView u) {
  double energy = 0;
  force_of(problem, u, &energy);
  return energy;
}

Field shifted(const BodyProblem& problem, ConstFieldView u, ConstFieldView w, double h) {
  Field v = problem.body().make_field(u.components);
  for (std::size_t k = 0; k < u.size(); ++k) v.data()[k] = u.data[k] + h * w.data[k];
  return v;
}

Field random_direction(const BodyProblem& problem, std::uint64_t seed) {
  Field w = problem.make_field();
  Noise random(seed);
  set_field(problem.body(), w, [&](const Point&) { return Point{random(), random(), random()}; });
  return w;
}

Derivatives derivatives_at(BodyProblem& problem, ConstFieldView u, std::uint64_t seed, double h) {
  const Body& body = problem.body();
  const Field v = random_direction(problem, seed + 1), f = force_of(problem, u);
  Derivatives at{0, 0, 0, random_direction(problem, seed), problem.make_field()};
  Field Kv = problem.make_field();
  for (Field* out : {&at.Kw, &Kv}) out->fill(std::numeric_limits<double>::quiet_NaN());
  if (!problem.tangent_action({u, 0}, at.w, at.Kw).ok() || !problem.tangent_action({u, 0}, v, Kv).ok()) throw std::runtime_error("no tangent");
  const auto points = static_cast<double>(body.points()), scale = largest(body, f) * points, stiffness = largest(body, at.Kw) * points;
  const auto moved = [&](double s) { return shifted(problem, u, at.w, s); };
  const double slope = test::slope_of([&](double s) { return energy_of(problem, moved(s)); }, h);
  const double curvature = test::slope_of([&](double s) { return -dot(body, force_of(problem, moved(s)), v); }, h);
  at.force = std::abs(slope + dot(body, f, at.w)) / scale;
  at.tangent = std::abs(curvature - dot(body, at.Kw, v)) / stiffness;
  at.asymmetry = std::abs(dot(body, Kv, at.w) - dot(body, at.Kw, v)) / stiffness;
  return at;
}

double dot(const Body& body, ConstFieldView a, ConstFieldView b) {
  double sum = 0;
  for (const std::int32_t p : body.internal())
    for (int c = 0; c < a.components; ++c) sum += a.component(c)[p] * b.component(c)[p];
  return sum;
}

double difference(const Body& body, ConstFieldView a, ConstFieldView b) {
  double most = 0;
  for (const std::int32_t p : body.internal())
    for (int c = 0; c < a.components; ++c) {
      const double off = std::abs(a.component(c)[p] - b.component(c)[p]);
      most = std::isnan(off) ? INFINITY : std::max(most, off);
    }
  return most;
}

double largest(const Body& body, ConstFieldView a) {
  double most = 0;
  for (const std::int32_t p : body.internal())
    for (int c = 0; c < a.components; ++c) {
      const double value = std::abs(a.component(c)[p]);
      most = std::isnan(value) ? INFINITY : std::max(most, value);
    }
  return most;
}

}  // namespace perikit::contract
