/// Vicinity: everything that so many bonds in a row reach is in it, and what lies much farther is not.

#include "families/vicinity.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace perikit;

TEST_CASE("vicinity: holds what chains of bonds reach from some points, in any body, and little else") {
  std::mt19937 random(7);
  for (const int d : {1, 2, 3})
    for (const double size : {1.0, 1e-9, 1e9}) {
      INFO(d, "D, size ", size);
      std::uniform_real_distribution<double> place(0, d == 1 ? 80 : d == 2 ? 40 : 16);
      BodyFrame frame;
      frame.space = d == 1 ? Space::line_strain : d == 2 ? Space::plane_strain : Space::solid;
      frame.spacing = size;
      frame.horizon = 1.6 * size;
      std::vector<Point> positions;
      for (int k = 0; k < (d == 3 ? 3000 : 1200); ++k) {
        Point x{};
        for (int a = 0; a < d; ++a) x[static_cast<std::size_t>(a)] = place(random) * size;
        positions.push_back(x);
      }
      const Body body(frame, positions, std::vector<double>(positions.size(), 1.0));
      Vicinity vicinity(body);
      const auto distance = [&](std::size_t p, std::size_t q) {
        const Point x = body.position(p), y = body.position(q);
        return std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]);
      };
      const std::int32_t seed[] = {5}, other[] = {200};
      vicinity.add(seed, 2);
      vicinity.grow(1);
      vicinity.add(other, 1);
      const GroupMarks groups = vicinity.groups();
      std::size_t far = 0, held = 0;
      for (std::size_t p = 0; p < body.points(); ++p) {
        const bool reached = distance(p, 5) <= 3 * frame.horizon || distance(p, 200) <= frame.horizon;
        if (reached) CHECK(vicinity.holds(p));
        if (vicinity.holds(p)) CHECK(groups[p / padding]);
        // Two cells of a third of the horizon more along each axis, for each of the two steps.
        const double more = std::sqrt(d) * (3 + 4.0 / 3) * frame.horizon;
        far += distance(p, 5) > more && distance(p, 200) > more;
        held += vicinity.holds(p) && distance(p, 5) > more && distance(p, 200) > more;
      }
      CHECK(far > body.points() / 4);
      CHECK(held == 0);
      vicinity.clear();
      CHECK(!vicinity.holds(5));
    }
}
