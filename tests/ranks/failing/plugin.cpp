/// An integrator that throws on one rank, somewhere in a run: the others are then waiting for it.

#include "perikit/integrator.hpp"

#include <sys/resource.h>

#include <new>
#include <stdexcept>

#include "perikit/core/communicator.hpp"

namespace {

using namespace perikit;

class Failing final : public Integrator {
 public:
  explicit Failing(const ParameterValues& values)
      : rank_(static_cast<int>(values.integer("rank"))), at_(values.text("at")), error_(values.text("error")) {
    fail_at("construction");
  }
  IntegratorTraits traits() const noexcept override { return {.several_ranks = true}; }
  std::string plan(Problem& problem) override {
    fail_at("plan");
    (void)problem.evaluate_forces({problem.state().displacement(), 0}, problem.state().internal_force(), nullptr);
    return "ten evaluations";
  }
  void run(Problem& problem, Observer& observer) override {
    State& state = problem.state();
    for (; state.step < 10; ++state.step) {
      if (state.step == 5) fail_at("step");
      (void)problem.evaluate_forces({state.displacement(), 0}, state.internal_force(), nullptr);
      observer.wants_sample(state.step, 0.0);
      StepReport report;
      report.step = state.step;
      report.steps_expected = 10;
      observer.step_done(report);
    }
  }

 private:
  void fail_at(const std::string& place) const {
    if (place != at_ || communicator().rank() != rank_) return;
    if (error_ == "disk") {
      const rlimit limit{4096, 4096};
      setrlimit(RLIMIT_FSIZE, &limit);
      return;
    }
    if (error_ == "input") throw InputError("thrown on purpose: input");
    if (error_ == "run") throw RunError("thrown on purpose: run");
    if (error_ == "memory") throw std::bad_alloc();
    throw std::logic_error("thrown on purpose: other");
  }

  int rank_;
  std::string at_, error_;
};

}  // namespace

PERIKIT_PLUGIN(registrar) {
  using namespace perikit;
  ParameterTable table;
  table.integer("rank", "Which throws.").by_default("0").at_least(0);
  table.choice("at", {"construction", "plan", "step"}, "Where.").by_default("\"step\"");
  table
      .choice("error", {"input", "run", "memory", "other", "disk"},
              "What; disk: it throws nothing, but its files cannot grow beyond 4 kB any more.")
      .by_default("\"run\"");
  registrar.integrator({.name = "failing",
                        .summary = "throws on one rank",
                        .parameters = std::move(table),
                        .examples = {""},
                        .equations = "",
                        .source = "",
                        .limits = ""},
                       [](const ParameterValues& values, const PartFactory&) { return std::make_unique<Failing>(values); });
}
