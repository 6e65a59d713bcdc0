/// Bonds that let go in several steps, by hand.

#include "fracture/gradual_failure.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace perikit;

namespace {

/// Three points on a line, and the speed of cracks at each of them.
struct Line {
  Line() : body(frame(), {{0, 0, 0}, {0.8, 0, 0}, {2, 0, 0}}, {1, 1, 1}), crack_speed(body.make_field(1)) {
    const double speeds[] = {3, 5, 1};
    for (int k = 0; k < 3; ++k) crack_speed.data()[point(k)] = speeds[k];
  }
  static BodyFrame frame() {
    BodyFrame frame;
    frame.space = Space::line_strain;
    frame.spacing = 1;
    frame.horizon = 3;
    return frame;
  }
  std::int32_t point(int k) const { return body.internal()[static_cast<std::size_t>(k)]; }
  BondId bond(int a, int b) const { return BondId::of(point(a), point(b)); }

  Body body;
  Field crack_speed;
};

}  // namespace

TEST_CASE("gradual failure: a bond lets go in the time that a crack needs along it, at the mean speed of its ends") {
  const Line line;
  GradualFailure failure(line.body, line.crack_speed);
  const BondChange found{line.bond(0, 1), 0.0};
  for (const double left : {0.75, 0.5, 0.25, 0.0}) {   // 1 - 4 t/0.8
    const std::vector<BondChange> changes = failure.let_go({&found, 1}, 0.05);
    REQUIRE(changes.size() == 1);
    CHECK(changes[0].bond == found.bond);
    CHECK(changes[0].integrity == doctest::Approx(left).epsilon(1e-12));
  }
  CHECK(failure.let_go({}, 0.05).empty());
}

TEST_CASE("gradual failure: bonds of fragments fade by the same factor in each step, found or not, and are dropped at a twentieth") {
  const Line line;
  GradualFailure failure(line.body, line.crack_speed);
  const BondChange found{line.bond(1, 2), 0.0};
  failure.fade({&found.bond, 1});
  for (int step = 1; step <= 7; ++step) {   // exp(-3 (5 + 1)/2 t/3)
    const std::vector<BondChange> changes = failure.let_go({&found, static_cast<std::size_t>(step % 2)}, 0.15);
    REQUIRE(changes.size() == 1);
    CHECK(changes[0].integrity == doctest::Approx(step == 7 ? 0.0 : std::exp(-0.45 * step)).epsilon(1e-12));
  }
  CHECK(failure.let_go({}, 0.15).empty());
}

TEST_CASE("gradual failure: a bond that was not lowered goes on from where it is; a whole one must be found again") {
  const Line line;
  GradualFailure failure(line.body, line.crack_speed);
  const BondChange found{line.bond(0, 1), 0.0};
  failure.let_go({&found, 1}, 0.05);
  failure.hold(found.bond, 1.0);
  CHECK(failure.let_go({}, 0.05).empty());
  CHECK(failure.let_go({&found, 1}, 0.05).front().integrity == doctest::Approx(0.75));
  failure.let_go({}, 0.05);
  failure.hold(found.bond, 0.75);
  CHECK(failure.let_go({}, 0.05).front().integrity == doctest::Approx(0.5));
  // One that was about to go altogether.
  CHECK(failure.let_go({}, 0.5).front().integrity == 0);
  failure.hold(found.bond, 0.5);
  CHECK(failure.let_go({}, 0.05).front().integrity == doctest::Approx(0.25));
  // A bond of a fragment fades on.
  GradualFailure fading(line.body, line.crack_speed);
  fading.fade({&found.bond, 1});
  const double once = fading.let_go({}, 0.01).front().integrity;
  fading.hold(found.bond, 1.0);
  CHECK(fading.let_go({}, 0.01).front().integrity == once);
}
