#pragma once
/// Quasi-static runs with everything that they report.

#include <algorithm>
#include <string>
#include <vector>

#include "perikit/problem/motion.hpp"
#include "tests/validation/scenes.hpp"

namespace perikit::validation {

/// Keeps reports and log lines.
class Protocol final : public Observer {
 public:
  bool wants_sample(std::int64_t, double) override { return true; }
  void step_done(const StepReport& report) override { reports.push_back(report); }
  void log(std::string_view message) override { text += message; }
  void working(std::string_view what) override { shown.emplace_back(what); }

  std::vector<StepReport> reports;
  std::string text;
  std::vector<std::string> shown;   ///< on the line of progress
  int iterations() const {
    int sum = 0;
    for (const StepReport& report : reports) sum += report.iterations;
    return sum;
  }
  int most_iterations() const {
    int most = 0;
    for (const StepReport& report : reports) most = std::max(most, report.iterations);
    return most;
  }
};

inline Protocol run(Simulation& simulation) {
  Protocol protocol;
  simulation.run(protocol);
  return protocol;
}

/// The largest difference of displacements.
inline double distance(Simulation& a, Simulation& b) {
  double most = 0;
  for (const std::int32_t p : a.problem().body().internal())
    for (int c = 0; c < a.problem().dimension(); ++c)
      most = std::max(most, std::abs(a.problem().state().displacement().component(c)[p] - b.problem().state().displacement().component(c)[p]));
  return most;
}

/// Mean displacement of a set.
inline double mean(Simulation& simulation, const std::string& set, int component) {
  double sum = 0;
  const auto& members = simulation.problem().body().set(set);
  for (const std::int32_t p : members) sum += simulation.problem().state().displacement().component(component)[p];
  return sum / static_cast<double>(members.size());
}

/// Sum of the forces that hold a set.
inline double pull(Simulation& simulation, const std::string& set, int component) {
  double sum = 0;
  const Field reaction = reactions(simulation.problem(), false, 1.0);
  for (const std::int32_t p : simulation.problem().body().set(set)) sum += reaction.component(component)[p];
  return sum;
}

}  // namespace perikit::validation
