/// Two ranks in one process, each with a part of the body and the ghosts that it needs: the same run as that of one rank, to rounding.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <barrier>
#include <cmath>
#include <exception>
#include <memory>
#include <thread>

#include "perikit/core/communicator.hpp"
#include "perikit/core/parallel.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// What the ranks share: one slot each for a number and for messages.
struct Meeting {
  explicit Meeting(int ranks) : barrier(ranks), numbers(static_cast<std::size_t>(ranks)), messages(numbers.size()) {}
  std::barrier<> barrier;
  std::vector<double> numbers;
  std::vector<const std::vector<std::vector<double>>*> messages;
};

/// A rank that is a thread.
class ThreadRank final : public Communicator {
 public:
  ThreadRank(Meeting& meeting, int rank) : meeting_(meeting), rank_(rank) {}
  int rank() const noexcept override { return rank_; }
  int size() const noexcept override { return static_cast<int>(meeting_.numbers.size()); }
  double sum(double value) override {
    return together(value, [](double a, double b) { return a + b; });
  }
  double largest(double value) override {
    return together(value, [](double a, double b) { return std::max(a, b); });
  }
  void exchange(const std::vector<std::vector<double>>& to, std::vector<std::vector<double>>& from) override {
    ++exchanges;
    meeting_.messages[mine()] = &to;
    meeting_.barrier.arrive_and_wait();
    from.clear();
    for (const auto* messages : meeting_.messages) from.push_back((*messages)[mine()]);
    meeting_.barrier.arrive_and_wait();
  }
  int exchanges = 0;

 private:
  std::size_t mine() const noexcept { return static_cast<std::size_t>(rank_); }
  template <class Join>
  double together(double value, Join join) {
    meeting_.numbers[mine()] = value;
    meeting_.barrier.arrive_and_wait();
    double all = meeting_.numbers[0];
    for (std::size_t k = 1; k < meeting_.numbers.size(); ++k) all = join(all, meeting_.numbers[k]);
    meeting_.barrier.arrive_and_wait();
    return all;
  }

  Meeting& meeting_;
  int rank_;
};

struct Result {
  std::vector<double> displacement;   ///< of the owned points, 3 numbers for each point of the whole body, in input order
  Energies energies;
  std::int64_t steps = 0;
};

/// The state of this rank's owned points, at the places of the points of the whole body that lie where they do.
void collect(Simulation& simulation, const Body& whole, Result& result) {
  BodyProblem& problem = simulation.problem();
  result.displacement.resize(3 * whole.points());
  for (std::size_t n = 0, p = 0; n < whole.points(); ++n) {
    // Owned points keep the order of the input.
    if (p == problem.body().owned().size()) break;
    const auto mine = static_cast<std::size_t>(problem.body().owned()[p]);
    if (problem.body().position(mine) != whole.position(static_cast<std::size_t>(whole.internal()[n]))) continue;
    for (int c = 0; c < problem.dimension(); ++c) result.displacement[3 * n + static_cast<std::size_t>(c)] = problem.state().displacement().component(c)[mine];
    ++p;
  }
  result.energies = problem.state().energies;
  result.steps = problem.state().step;
}

/// Runs the scene on so many ranks.
Result run_on(int ranks, const std::string& text) {
  INFO(ranks, " ranks");
  Meeting meeting(ranks);
  std::vector<std::unique_ptr<ThreadRank>> communicators;
  std::vector<std::unique_ptr<Simulation>> simulations;
  for (int r = 0; r < ranks; ++r) {
    communicators.push_back(std::make_unique<ThreadRank>(meeting, r));
    const CommunicatorScope scope(*communicators.back());
    simulations.push_back(contract::build(text));
  }
  std::vector<std::exception_ptr> failures(simulations.size());
  std::vector<std::thread> threads;
  for (std::size_t r = 0; r < simulations.size(); ++r)
    threads.emplace_back([&, r] {
      const CommunicatorScope scope(*communicators[r]);
      try {
        contract::run(*simulations[r]);
      } catch (...) {
        failures[r] = std::current_exception();
        meeting.barrier.arrive_and_drop();
      }
    });
  for (std::thread& thread : threads) thread.join();
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
  Result result;
  for (const auto& simulation : simulations) {
    collect(*simulation, simulation->problem().whole(), result);
    if (ranks > 1) CHECK(simulation->problem().body().points() > simulation->problem().body().owned().size());
  }
  for (const auto& c : communicators)
    if (ranks > 1) CHECK(c->exchanges > 0);
  return result;
}

contract::BodyOptions body_of(int dimension, bool cloud) {
  contract::BodyOptions body;
  body.dimension = dimension;
  body.cloud = cloud;
  body.two_materials = dimension > 1;
  body.cells = dimension == 3 ? 14 : dimension == 2 ? 22 : 60;
  body.horizon_ratio = dimension == 3 ? 2.015 : 2.515;
  body.material += "\ndensity = 1.0";
  body.sets = fmt::format("low = \"x < 1.5\"\nhigh = \"x > {}\"\n", body.cells - (dimension > 1 ? 2 : 0) - 1.5);
  const std::string load = dimension == 3 ? "[0.02, 0.01, 0.0]" : dimension == 2 ? "[0.02, 0.01]" : "[0.02]";
  const std::string fixed = dimension == 3 ? "[0, 0, 0]" : dimension == 2 ? "[0, 0]" : "[0]";
  body.conditions = fmt::format("[[boundary]]\nset = \"low\"\ndisplacement = {}\n[[load]]\nset = \"high\"\nforce = {}\n", fixed, load);
  return body;
}

void compare(const std::string& text, const std::vector<int>& shares, double tolerance) {
  const int threads = thread_count();
  set_thread_count(1);
  const Result one = run_on(1, text);
  for (const int ranks : shares) {
    const Result more = run_on(ranks, text);
    CHECK(more.steps == one.steps);
    const double largest = contract::largest(one.displacement);
    REQUIRE(largest > 1e-7);
    CHECK_MESSAGE(contract::difference(more.displacement, one.displacement) <= tolerance * largest, ranks, " ranks: off by ",
                  contract::difference(more.displacement, one.displacement) / largest);
    const double scale = std::abs(one.energies.external_work);
    CHECK_MESSAGE(std::abs(more.energies.external_work - one.energies.external_work) <= tolerance * scale, ranks, " ranks, work");
    CHECK_MESSAGE(std::abs(more.energies.strain - one.energies.strain) <= tolerance * scale, ranks, " ranks, strain energy");
    CHECK_MESSAGE(std::abs(more.energies.kinetic - one.energies.kinetic) <= tolerance * scale, ranks, " ranks, kinetic energy");
  }
  set_thread_count(threads);
}

/// Every kinematics with its first examples, and stabilisations.
std::vector<std::string> kinematics_tables() {
  std::vector<std::string> tables;
  for (const std::string& name : registry().names(Kind::kinematics))
    for (const std::string& example : registry().describe(Kind::kinematics, name).examples) tables.push_back(fmt::format("type = \"{}\"\n{}", name, example));
  tables.push_back("type = \"conventional\"\nstabilization = { type = \"silling\", coefficient = 0.5 }");
  tables.push_back("type = \"conventional\"\nstabilization = { type = \"wan\" }");
  tables.push_back("type = \"conventional\"\norder = 2\nstabilization = { type = \"wan\" }");
  tables.push_back("type = \"bond_based\"\nsurface_correction = \"energy\"");
  return tables;
}

}  // namespace

TEST_CASE("partition: two ranks with ghosts make the explicit run of one, for every kinematics") {
  for (const std::string& kinematics : kinematics_tables())
    for (const int dimension : {1, 2, 3})
      for (const bool cloud : {false, true}) {
        INFO(kinematics, ", ", dimension, "D ", std::string(cloud ? "cloud" : "lattice"));
        contract::BodyOptions body = body_of(dimension, cloud);
        // Gradients of order 2 on jittered clouds in space are stiff: shorter steps.
        body.integrator = dimension == 3 ? "type = \"verlet\"\nend_time = 0.2\ntime_step = 0.01" : "type = \"verlet\"\nend_time = 1.5\ntime_step = 0.05";
        compare(contract::scene_text(body, kinematics), dimension == 3 ? std::vector{2} : std::vector{2, 3}, 1e-11);
      }
}

TEST_CASE("partition: two ranks with ghosts make the matrix-free implicit run of one, for every kinematics") {
  for (const std::string& kinematics : kinematics_tables())
    for (const bool cloud : {false, true}) {
      INFO(kinematics, ", ", std::string(cloud ? "cloud" : "lattice"));
      contract::BodyOptions body = body_of(2, cloud);
      body.cells = 14;
      body.sets = "low = \"x < 1.5\"\nhigh = \"x > 10.5\"\n";
      body.integrator = "type = \"jfnk\"\nsteps = 1\ntolerance = 1e-11";
      compare(contract::scene_text(body, kinematics), {2}, 1e-8);
    }
}

TEST_CASE("partition: what needs the whole body on one rank says so") {
  contract::BodyOptions body = body_of(2, false);
  body.integrator = "type = \"newton\"\nsteps = 1";
  CHECK_THROWS_WITH(run_on(2, contract::scene_text(body, "type = \"conventional\"")), doctest::Contains("needs the whole body on one rank"));
  body.conditions += "[damage]\ntype = \"critical_stretch\"\nstretch = 0.1\n";
  body.integrator = "type = \"verlet\"\nend_time = 1.0";
  CHECK_THROWS_WITH(run_on(2, contract::scene_text(body, "type = \"conventional\"")), doctest::Contains("found with a body on several ranks; allowed: one rank"));
}
