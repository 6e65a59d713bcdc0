/// Faces of a crack: what closes them beyond what the body does counts; opening, sliding, turning and homogeneous strain do not.

#include "problem/bonds/crossed_faces.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <functional>

using namespace perikit;

namespace {

class Constant final : public InfluenceFunction {
 public:
  void evaluate(std::span<const double>, std::span<double> omega) const override { std::ranges::fill(omega, 1.0); }
};

/// A plate of 20 x 20 points with a pre-crack at x = 10, as a lattice or as a cloud.
struct Plate {
  explicit Plate(bool lattice) {
    BodyFrame frame;
    frame.space = Space::plane_strain;
    frame.spacing = 1;
    frame.horizon = 3.015;
    frame.cracks.emplace_back(std::vector<Point>{{10, -1, 0}, {10, 21, 0}});
    const Lattice grid = make_lattice(2, 1.0, {}, {20, 20, 0}, frame.horizon);
    std::vector<std::int32_t> cells;
    std::vector<Point> positions;
    for (int y = 0; y < 20; ++y)
      for (int x = 0; x < 20; ++x) {
        const std::array<std::int64_t, 3> input{x, y, 0};
        const auto inner = [&](std::size_t k) { return input[static_cast<std::size_t>(grid.axis[k])]; };
        cells.push_back(static_cast<std::int32_t>(grid.index(inner(0), inner(1), 0)));
        positions.push_back({x + 0.5, y + 0.5, 0});
      }
    body = lattice ? std::make_unique<Body>(frame, grid, cells) : std::make_unique<Body>(frame, positions, std::vector<double>(positions.size(), 1.0));
    families = Families::make(*body, std::make_shared<Constant>(), {});
    families->let_fail();
  }

  CrossedFaces crossed(const std::function<Point(const Point&)>& displacement) const {
    Field u = body->make_field(2);
    for (const std::int32_t p : body->internal()) {
      const Point value = displacement(body->position(static_cast<std::size_t>(p)));
      for (int c = 0; c < 2; ++c) u.component(c)[p] = value[static_cast<std::size_t>(c)];
    }
    return find_crossed_faces(*families, u);
  }

  std::unique_ptr<Body> body;
  std::unique_ptr<Families> families;
};

}  // namespace

TEST_CASE("crossed faces: what closes a crack beyond what the body does") {
  for (const bool lattice : {true, false}) {
    INFO((lattice ? "lattice" : "cloud"));
    const Plate plate(lattice);
    const auto right = [](double x, double y) { return [=](const Point& at) { return at[0] > 10 ? Point{x, y, 0} : Point{}; }; };
    const CrossedFaces closed = plate.crossed(right(-0.1, 0));
    CHECK(closed.points >= 40);   // of two rows on either side, but for some at the ends
    CHECK(closed.points <= 80);
    CHECK(closed.deepest > 0.025);   // of about 2.6 spacings
    CHECK(closed.deepest < 0.05);
    CHECK(plate.crossed(right(-5, 0)).points > 0);   // far through
    CHECK(plate.crossed(right(0, 0)).points == 0);
    CHECK(plate.crossed(right(0.5, 0)).points == 0);
    CHECK(plate.crossed(right(0, 0.5)).points == 0);
    CHECK(plate.crossed([](const Point& x) { return Point{-0.2 * x[0], 0.05 * x[1], 0}; }).points == 0);
    for (const double angle : {0.3, 2.0}) {
      INFO(angle);
      const double c = std::cos(angle), s = std::sin(angle);
      const auto turned = [=](double closing) {
        return [=](const Point& at) {
          const double x = at[0] - (at[0] > 10 ? closing : 0.0);
          return Point{c * x - s * at[1] - at[0], s * x + c * at[1] - at[1], 0};
        };
      };
      CHECK(plate.crossed(turned(0)).points == 0);
      CHECK(plate.crossed(turned(-0.3)).points == 0);
      CHECK(plate.crossed(turned(0.1)).points == closed.points);
    }
  }
  // Without a crack nothing is looked at.
  const Plate plate(true);
  CHECK(find_crossed_faces(*plate.families, plate.body->make_field(2)).points == 0);
}

TEST_CASE("crossed faces: of bonds that failed in the run") {
  Plate plate(true);
  // Whole rows on the left of the crack lose their bonds to the left: a strip of three columns comes loose between two faces.
  std::vector<BondChange> changes;
  FamilyArrays family;
  for (const std::int32_t p : plate.body->internal()) {
    plate.families->load(static_cast<std::size_t>(p), BondsOf::set_up, family);
    for (const std::int32_t far : family.far)
      if (plate.body->position(static_cast<std::size_t>(p))[0] < 7 && plate.body->position(static_cast<std::size_t>(far))[0] > 7) changes.push_back({BondId::of(p, far), 0.0});
  }
  plate.families->lower(changes);
  CHECK(plate.crossed([](const Point& x) { return x[0] > 7 && x[0] < 10 ? Point{-0.2, 0, 0} : Point{}; }).points > 0);
  CHECK(plate.crossed([](const Point& x) { return x[0] < 7 ? Point{-1, 0, 0} : x[0] > 10 ? Point{1, 0, 0} : Point{}; }).points == 0);
}
