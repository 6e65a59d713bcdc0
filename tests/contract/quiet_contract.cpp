/// What no wave has reached yet: leaving it out saves work and changes no bit, whatever was evaluated before.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cstring>
#include <limits>

#include "tests/contract/fixture.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

/// Two equal bodies, one of which leaves out what is at rest.
class Pair {
 public:
  Pair(BodyOptions body, const std::string& kinematics) {
    some_ = build(scene_text(body, kinematics));
    body.skip = false;
    all_ = build(scene_text(body, kinematics));
  }
  BodyProblem& some() { return some_->problem(); }
  BodyProblem& all() { return all_->problem(); }

  /// A displacement of the points within a short way of one end of the body, at rest elsewhere.
  Field bump(bool at_upper_end) {
    const Body& body = some().body();
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const std::int32_t p : body.internal()) {
      const double x = body.position(static_cast<std::size_t>(p))[0];
      low = std::min(low, x), high = std::max(high, x);
    }
    const double from = at_upper_end ? high : low;
    Noise noise(at_upper_end ? 61 : 62);
    Field u = some().make_field();
    set_field(body, u, [&](const Point& x) {
      const double size = std::abs(x[0] - from) < 4 * body.spacing() ? 0.03 * body.spacing() : 0.0;
      return Point{size * noise(), size * noise(), size * noise()};
    });
    return u;
  }

  /// Forces and energies of both are the same, bit for bit (but for the sign of zero).
  void compare(const Field& u, const char* when) {
    double energy[2] = {};
    const Field of_some = force_of(some(), u, &energy[0]), of_all = force_of(all(), u, &energy[1]);
    CHECK_MESSAGE((energy[0] == energy[1] && difference(some().body(), of_some, of_all) == 0), "the result is another one ", when);
  }

 private:
  std::unique_ptr<Simulation> some_, all_;
};

}  // namespace

TEST_CASE("kinematics: what no wave has reached is left out, and not a bit of the result changes") {
  for (const Case& c : cases()) {
    INFO(c.label());
    BodyOptions body = c.body;
    if (body.dimension == 1) body.cells = 3000;
    if (body.dimension == 2) body.cells = 96;
    if (body.dimension == 3) body.cells = 12;
    Pair pair(body, kinematics_table(c.example));
    const Field rest = pair.some().make_field(), left = pair.bump(false), right = pair.bump(true);
    pair.compare(rest, "at rest");
    pair.compare(left, "with one end moving");
    pair.compare(right, "with the other end moving");
    const RestingCounts before = pair.some().report().resting;
    for (BodyProblem* problem : {&pair.some(), &pair.all()}) {
      Field Kw = problem->make_field();
      REQUIRE(problem->tangent_action({right, 0}, left, Kw).ok());
    }
    pair.compare(left, "after a tangent action");
    for (BodyProblem* problem : {&pair.some(), &pair.all()}) {
      PointSamples samples;
      REQUIRE(problem->terms().sample({right, 0}, samples).ok());
    }
    pair.compare(right, "after a sample");
    pair.compare(rest, "back at rest");
    const RestingCounts after = pair.some().report().resting;
    CHECK(pair.all().report().resting.blocks == 0);
    if (!c.conservative()) continue;
    const std::int64_t blocks = after.blocks - before.blocks, quiet = after.quiet - before.quiet;
    CHECK(blocks > 0);
    if (body.dimension < 3) CHECK_MESSAGE(quiet > blocks / 3, quiet, " of ", blocks, " blocks left out");
  }
}
