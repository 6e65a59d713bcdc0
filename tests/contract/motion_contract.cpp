/// Points that move as forces are evaluated: whichever loop moves them, each moves once, before anything reads it, and forces are those of where
/// they have come, bit for bit.

#include <doctest/doctest.h>

#include <limits>
#include <vector>

#include "perikit/core/parallel.hpp"
#include "tests/contract/fixture.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

/// u += du, force <- 0.
class Shift final : public PointMotion {
 public:
  Shift(FieldView u, ConstFieldView du, FieldView force) : PointMotion(u.stride, 0), u_(u), du_(du), force_(force), moves_(u.stride, 0) {}
  void start() {
    std::fill(moves_.begin(), moves_.end(), 0);
    expect();
  }
  bool each_once() const {
    return !pending() && std::all_of(moves_.begin(), moves_.end(), [](int n) { return n == 1; });
  }

 private:
  void move(std::size_t begin, std::size_t end) noexcept override {
    for (std::size_t p = begin; p < end; ++p) {
      ++moves_[p];
      for (int c = 0; c < u_.components; ++c) {
        u_.component(c)[p] += du_.component(c)[p];
        force_.component(c)[p] = 0;
      }
    }
  }

  FieldView u_;
  ConstFieldView du_;
  FieldView force_;
  std::vector<int> moves_;
};

}  // namespace

TEST_CASE("kinematics: points that move as forces are evaluated") {
  const int threads = thread_count();
  for (const Case& c : cases()) {
    INFO(c.label());
    BodyOptions options = c.body;
    options.cells = options.dimension == 1 ? 3000 : options.dimension == 2 ? 60 : 12;
    const auto simulation = build(scene_text(options, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    const Body& body = problem.body();
    Noise noise(63);
    Field u = problem.make_field(), du = problem.make_field(), force = problem.make_field(), expected = problem.make_field();
    const double size = 1e-3 * body.spacing();
    const auto shake = [&](double most_x) {
      set_field(body, du, [&](const Point& x) { return x[0] < most_x ? Point{size * noise(), size * noise(), size * noise()} : Point{}; });
    };
    const auto evaluate = [&](bool with_energy) {
      force.fill(std::numeric_limits<double>::quiet_NaN());
      Shift shift(u, du, force);
      shift.start();
      double energy = 0, energy_expected = 0;
      REQUIRE(problem.evaluate_forces(Configuration(u, 0).moving(shift), force, with_energy ? &energy : nullptr).ok());
      REQUIRE(problem.evaluate_forces({u, 0}, expected, with_energy ? &energy_expected : nullptr).ok());
      CHECK_MESSAGE(shift.each_once(), "not all points have moved, or some twice");
      bool same = energy == energy_expected;
      for (std::size_t k = 0; k < force.size(); ++k) same = same && force.data()[k] == expected.data()[k];
      CHECK_MESSAGE(same, "forces or energies are others, ", thread_count(), " threads");
    };
    shake(body.position(static_cast<std::size_t>(body.internal()[body.points() / 2]))[0]);
    evaluate(true);   // parts are at rest
    for (const int n : {1, 2, 5}) {
      set_thread_count(n);
      for (const bool with_energy : {false, true}) {
        shake(std::numeric_limits<double>::infinity());
        evaluate(with_energy);
      }
    }
    set_thread_count(threads);
  }
}
