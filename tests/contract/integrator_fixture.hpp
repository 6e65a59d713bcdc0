#pragma once
/// Integrators to test, scenes for them, and an observer that keeps what they report.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/contract/fixture.hpp"

namespace perikit::contract {

/// Keeps every report with the energies of that step; ends the run after step `last` (-1: never).
class Watch final : public Observer {
 public:
  explicit Watch(Simulation& simulation, std::int64_t last = -1) : simulation_(simulation), last_(last) {}
  bool wants_sample(std::int64_t, double) override { return true; }
  void step_done(const StepReport& report) override;
  void log(std::string_view) override {}
  bool cancelled() const noexcept override { return last_ >= 0 && !reports.empty() && reports.back().step >= last_; }

  std::function<void(const StepReport&)> each;   ///< called after every step
  std::vector<StepReport> reports;
  std::vector<Energies> energies;
  /// Largest change of strain + kinetic energy - external work since the first of the reports [begin, end) [J].
  double imbalance(std::size_t begin, std::size_t end) const;
  double imbalance() const { return imbalance(0, energies.size()); }

 private:
  Simulation& simulation_;
  std::int64_t last_;
};

/// Examples of integrators whose traits agree; with `keys` set in each table, and without doubles.
std::vector<Example> integrators(const std::function<bool(const IntegratorTraits&)>& wanted, const std::map<std::string, std::string>& keys);

/// The table of [integrator].
std::string integrator_table(const Example& example);

/// A run to its end (or to step `last`); what it reported.
Watch run(Simulation& simulation, std::int64_t last = -1);

/// Displacement, velocity (dynamic runs), internal force, time, step and energies, to compare runs with.
std::vector<double> state(Simulation& simulation);

/// Largest |a - b| and largest |b|.
double difference(const std::vector<double>& a, const std::vector<double>& b);
double largest(const std::vector<double>& a);

/// Displacement of the live points, in input order.
std::vector<double> displacement(Simulation& simulation);

/// Sum over points of one component.
double total(const Body& body, ConstFieldView field, int component);

}  // namespace perikit::contract
