/// Images of cracks behind a curved surface: bonds between images are cut where those between their sources are.

#include <doctest/doctest.h>

#include <cmath>

#include "perikit/body/images.hpp"

using namespace perikit;

namespace {

double distance(const Point& a, const Point& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

/// Points around a hole, a round one or a tube along z, of radius 8, which these cracks run into.
Body around_hole(int dimension, std::vector<Crack> cracks) {
  std::vector<Point> positions;
  const int high = dimension == 3 ? 4 : 1;
  for (int k = 0; k < high; ++k)
    for (int j = -8; j < 8; ++j)
      for (int i = 0; i < 16; ++i)
        if (std::hypot(i + 0.5, j + 0.5) > 8.3) positions.push_back({i + 0.5, j + 0.5, dimension == 3 ? k + 0.5 : 0.0});
  BodyFrame frame;
  frame.space = dimension == 3 ? Space::solid : Space::plane_strain;
  frame.spacing = 1;
  frame.horizon = 2.515;
  frame.cracks = std::move(cracks);
  return Body(frame, positions, std::vector<double>(positions.size(), 1.0));
}

}  // namespace

TEST_CASE("cracks have images behind curved surfaces, whichever way they run into them, and as deep as points have") {
  const std::vector<Point> across{{7, 0.2, 0}, {15, 0.9, 0}}, askew{{7.5, -3, 0}, {13, 5, 0}}, beside{{9.2, -5.1, 0}, {9.3, 4.9, 0}};
  for (const int dimension : {2, 3})
    for (const std::vector<Point>& line : {across, askew, beside}) {
      INFO(dimension, "D, crack from (", line[0][0], ", ", line[0][1], ")");
      std::vector<Point> vertices = line;
      if (dimension == 3) vertices = {{line[0][0], line[0][1], -1}, {line[1][0], line[1][1], -1}, {line[1][0], line[1][1], 5}, {line[0][0], line[0][1], 5}};
      const Body body = around_hole(dimension, {Crack(vertices)});
      const ImageSurface hole{[](const Point& x) { return 8 - std::hypot(x[0], x[1]); }, {0, 0, 0}, [](const Point&, std::int64_t otherwise) { return otherwise; }};
      const Images images = make_images(body, {}, {&hole, 1});
      REQUIRE(images.size() > 20);
      const Body whole(body, images, 1);
      int cut = 0, other = 0;
      for (std::size_t a = 0; a < images.size(); ++a)
        for (std::size_t b = 0; b < a; ++b) {
          const Point x = body.position(static_cast<std::size_t>(body.internal()[static_cast<std::size_t>(images.source[a])])),
                      y = body.position(static_cast<std::size_t>(body.internal()[static_cast<std::size_t>(images.source[b])]));
          if (distance(x, y) > body.horizon() || distance(images.position[a], images.position[b]) > body.horizon()) continue;
          const bool here = body.cut(x, y), there = whole.cut(images.position[a], images.position[b]);
          cut += here;
          other += here != there;
        }
      CHECK(cut > 5);
      // Mirrored bonds are curved where those between images are straight: some pass a tip, or a line of points, on the other side.
      CHECK_MESSAGE(other <= 0.06 * cut, other, " of ", cut);
    }
}
