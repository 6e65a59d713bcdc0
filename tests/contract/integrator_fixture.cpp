#include "perikit/problem/motion.hpp"
#include "tests/contract/integrator_fixture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace perikit::contract {

void Watch::step_done(const StepReport& report) {
  BodyProblem& problem = simulation_.problem();
  if (simulation_.dynamic()) problem.state().energies.kinetic = kinetic_energy(problem, problem.state().velocity());
  reports.push_back(report);
  energies.push_back(problem.state().energies);
  if (each) each(report);
}

double Watch::imbalance(std::size_t begin, std::size_t end) const {
  const auto balance = [&](std::size_t k) { return energies[k].strain + energies[k].kinetic - energies[k].external_work; };
  double most = 0;
  for (std::size_t k = begin; k < end; ++k) most = std::max(most, std::abs(balance(k) - balance(begin)));
  return most;
}

namespace {

std::string key_of(const std::string& line) { return line.substr(0, line.find_first_of(" =")); }

/// `table` with keys replaced; what cannot stand beside them is dropped.
std::string with_keys(const ParameterTable& parameters, const std::string& table, const std::map<std::string, std::string>& keys) {
  std::set<std::string> dropped;
  for (const auto& [key, value] : keys) dropped.insert(key);
  for (const ParameterGroup& group : parameters.groups()) {
    if (std::none_of(group.names.begin(), group.names.end(), [&](const std::string& name) { return keys.contains(name); })) continue;
    dropped.insert(group.names.begin(), group.names.end());
  }
  std::string result;
  for (std::size_t begin = 0; begin < table.size();) {
    const std::size_t end = std::min(table.find('\n', begin), table.size());
    const std::string line = table.substr(begin, end - begin);
    if (!dropped.contains(key_of(line))) result += line + "\n";
    begin = end + 1;
  }
  for (const auto& [key, value] : keys) result += key + " = " + value + "\n";
  return result;
}

}  // namespace

std::vector<Example> integrators(const std::function<bool(const IntegratorTraits&)>& wanted, const std::map<std::string, std::string>& keys) {
  std::vector<Example> all;
  std::set<std::pair<std::string, std::string>> seen;
  for (Example example : examples(Kind::integrator)) {
    Registry& registry = subject().registry;
    if (!wanted(registry.integrator(*parse_part(Kind::integrator, example.part, example.table, registry))->traits())) continue;
    example.table = with_keys(registry.describe(Kind::integrator, example.part).parameters, example.table, keys);
    if (seen.emplace(example.part, example.table).second) all.push_back(example);
  }
  return all;
}

std::string integrator_table(const Example& example) { return fmt::format("type = \"{}\"\n{}", example.part, example.table); }

Watch run(Simulation& simulation, std::int64_t last) {
  Watch watch(simulation, last);
  simulation.run(watch);
  return watch;
}

std::vector<double> displacement(Simulation& simulation) {
  std::vector<double> values;
  const FieldView u = simulation.problem().state().displacement();
  for (const std::int32_t p : simulation.problem().body().internal())
    for (int c = 0; c < u.components; ++c) values.push_back(u.component(c)[p]);
  return values;
}

std::vector<double> state(Simulation& simulation) {
  BodyProblem& problem = simulation.problem();
  const Energies& e = problem.state().energies;
  std::vector<double> values{problem.state().time, static_cast<double>(problem.state().step), e.strain, e.kinetic, e.external_work, e.dissipated};
  std::vector<FieldView> fields{problem.state().displacement(), problem.state().internal_force()};
  if (simulation.dynamic()) fields.push_back(problem.state().velocity());
  if (problem.loads().any()) fields.push_back(problem.state().external_force());
  for (const FieldView& field : fields) values.insert(values.end(), field.data, field.data + field.size());
  return values;
}

double largest(const std::vector<double>& a) { return difference(a, std::vector<double>(a.size(), 0.0)); }

double difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = a.size() == b.size() ? 0.0 : INFINITY;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) {
    const double value = std::abs(a[k] - b[k]);
    most = std::isnan(value) ? INFINITY : std::max(most, value);
  }
  return most;
}

double total(const Body& body, ConstFieldView field, int component) {
  double sum = 0;
  for (const std::int32_t p : body.internal()) sum += field.component(component)[p];
  return sum;
}

}  // namespace perikit::contract
