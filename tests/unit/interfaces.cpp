/// Where materials meet: distances from flat faces of lattices are exact, from round ones of second order, and independent of
/// threads.

#include "body/interfaces.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>

#include "perikit/core/parallel.hpp"

using namespace perikit;

namespace {

/// A lattice of n cells along an edge of 1, with the materials that `of` gives.
template <class Of>
Body lattice_body(int dimension, int n, Of&& of, std::vector<Crack> cracks = {}) {
  const double h = 1.0 / n;
  const Space space = dimension == 1 ? Space::line_strain : dimension == 2 ? Space::plane_strain : Space::solid;
  Point upper{};
  for (int a = 0; a < dimension; ++a) upper[static_cast<std::size_t>(a)] = 1;
  const Lattice lattice = make_lattice(dimension, h, {0, 0, 0}, upper, 3.015 * h);
  std::vector<std::int32_t> cells;
  const int ny = dimension > 1 ? n : 1, nz = dimension > 2 ? n : 1;
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < n; ++x) {
        std::array<int, 3> k{x, y, z}, inner{};
        for (std::size_t a = 0; a < 3; ++a) inner[a] = k[static_cast<std::size_t>(lattice.axis[a])];
        cells.push_back(static_cast<std::int32_t>(lattice.index(inner[0], inner[1], inner[2])));
      }
  Body body({space, 1, h, 3.015 * h, std::move(cracks)}, lattice, cells);
  std::vector<std::uint16_t> ids(body.stride(), 0);
  for (const std::int32_t p : body.internal()) ids[static_cast<std::size_t>(p)] = of(body.position(static_cast<std::size_t>(p)));
  body.set_materials(std::move(ids));
  return body;
}

Interfaces find(const Body& body, double reach) {
  std::vector<std::uint16_t> material;
  for (const std::int32_t p : body.internal()) material.push_back(body.material_ids()[static_cast<std::size_t>(p)]);
  return find_interfaces(body, material, {}, reach);
}

}  // namespace

TEST_CASE("interfaces: half way between the layers of a lattice, along every axis and the diagonal") {
  for (int d = 1; d <= 3; ++d)
    for (int kind = 0; kind < (d == 1 ? 1 : 4); ++kind) {
      const int n = d == 3 ? 10 : 20;
      const double h = 1.0 / n, root = std::sqrt(2.0);
      const auto value = [&](const Point& x) {
        return kind < d ? x[static_cast<std::size_t>(kind)] - 0.5 : kind == 3 ? (x[0] + x[1] - 1 - 1.5 * h) / root : NAN;
      };
      if (kind == 2 && d == 2) continue;
      // Diagonal layers lie half a spacing apart along x + y: that of x + y = 1 + h and that of 1 + 2 h are the last and the
      // first.
      const Body body = lattice_body(d, n, [&](const Point& x) { return static_cast<std::uint16_t>(value(x) > 0); });
      const Interfaces found = find(body, 9 * h);
      INFO(d, "D, kind ", kind);
      REQUIRE(found.all.size() == 1);
      CHECK(found.all[0].first == 0);
      double worst = 0;
      std::size_t near = 0;
      for (const std::int32_t p : body.internal()) near += std::abs(value(body.position(static_cast<std::size_t>(p)))) < 8 * h;
      CHECK(found.all[0].point.size() >= near);
      for (std::size_t k = 0; k < found.all[0].point.size(); ++k)
        worst = std::max(
            worst, std::abs(found.all[0].distance[k] - value(body.position(static_cast<std::size_t>(found.all[0].point[k])))));
      CHECK(worst <= 1e-10 * h);
    }
}

TEST_CASE("interfaces: both sides of a thin layer") {
  for (const int width : {1, 2, 3}) {
    const double h = 1.0 / 20, half = 0.5 * width * h, middle = 0.5 + half;
    const Body body =
        lattice_body(2, 20, [&](const Point& x) { return static_cast<std::uint16_t>(std::abs(x[0] - middle) > half); });
    const Interfaces found = find(body, 5 * h);
    REQUIRE(found.all.size() == 1);
    double worst = 0;
    for (std::size_t k = 0; k < found.all[0].point.size(); ++k)
      worst = std::max(worst,
                       std::abs(found.all[0].distance[k] -
                                (std::abs(body.position(static_cast<std::size_t>(found.all[0].point[k]))[0] - middle) - half)));
    INFO(width, " points");
    CHECK(worst <= 1e-10 * h);
  }
}

TEST_CASE("interfaces: the distance from a small block is the same on all its sides, however its corners are rounded") {
  for (const int width : {1, 2, 3})
    for (const int first : {7, 8, 9}) {
      const double h = 1.0 / 20, half = 0.5 * width * h;
      const Point middle{first * h + half, first * h + half, 0};
      const Body body = lattice_body(2, 20, [&](const Point& x) { return static_cast<std::uint16_t>(std::max(std::abs(x[0] - middle[0]), std::abs(x[1] - middle[1])) > half); });
      const Interfaces found = find(body, 3.3 * h);
      REQUIRE(found.all.size() == 1);
      std::map<std::pair<long, long>, double> distances;   // by twice the cells from the middle
      for (std::size_t k = 0; k < found.all[0].point.size(); ++k) {
        const Point x = body.position(static_cast<std::size_t>(found.all[0].point[k]));
        distances[{std::lround(2 * (x[0] - middle[0]) / h), std::lround(2 * (x[1] - middle[1]) / h)}] = found.all[0].distance[k];
      }
      double worst = 0;
      for (const auto& [at, distance] : distances)
        for (const std::pair<long, long>& there : {std::pair{-at.first, at.second}, {at.first, -at.second}, {at.second, at.first}}) {
          REQUIRE(distances.contains(there));
          worst = std::max(worst, std::abs(distances[there] - distance));
        }
      CHECK_MESSAGE(worst <= 1e-10 * h, width, " points from ", first, " on: ", worst / h);
    }
}

TEST_CASE("interfaces: the distances from grains of a few points do not depend on the order of the axes") {
  constexpr int n = 6;
  constexpr double h = 1.0 / n;
  std::mt19937 random(5);
  for (int trial = 0; trial < 60; ++trial) {
    // Some of the cells of a cube of two, which may lie at the surface.
    std::array<int, 3> corner{};
    for (int& at : corner) at = static_cast<int>(random() % (n - 1));
    const unsigned grain = 1 + random() % 255;
    const auto distances = [&](bool swapped) {
      const Body body = lattice_body(3, n, [&](const Point& x) {
        unsigned bit = 0;
        for (std::size_t a = 0; a < 3; ++a) {
          const int k = static_cast<int>(x[swapped ? 2 - a : a] / h) - corner[a];
          if (k < 0 || k > 1) return std::uint16_t{0};
          bit += static_cast<unsigned>(k) << a;
        }
        return static_cast<std::uint16_t>(grain >> bit & 1);
      });
      std::map<std::array<long, 3>, double> all;
      for (const Interface& interface : find(body, 2.2 * h).all)
        for (std::size_t k = 0; k < interface.point.size(); ++k) {
          std::array<long, 3> cell{};
          for (std::size_t a = 0; a < 3; ++a) cell[a] = std::lround(2 * body.position(static_cast<std::size_t>(interface.point[k]))[swapped ? 2 - a : a] / h);
          all[cell] = interface.distance[k];
        }
      return all;
    };
    const auto straight = distances(false), swapped = distances(true);
    REQUIRE(straight.size() == swapped.size());
    double worst = 0;
    for (const auto& [cell, distance] : straight) worst = std::max(worst, std::abs(distance - swapped.at(cell)));
    CHECK_MESSAGE(worst <= 1e-10 * h, "grain ", grain, ": ", worst / h);
  }
}

TEST_CASE("interfaces: the distance from a circle, whatever the number of threads") {
  for (const int n : {40, 80}) {
    const double radius = 0.31, h = 1.0 / n;
    const auto value = [&](const Point& x) { return std::hypot(x[0] - 0.5, x[1] - 0.5) - radius; };
    const Body body = lattice_body(2, n, [&](const Point& x) { return static_cast<std::uint16_t>(value(x) > 0); });
    const int threads = thread_count();
    set_thread_count(1);
    const Interfaces found = find(body, 9 * h);
    REQUIRE(found.all.size() == 1);
    double sum = 0;
    for (std::size_t k = 0; k < found.all[0].point.size(); ++k) {
      const double error = found.all[0].distance[k] - value(body.position(static_cast<std::size_t>(found.all[0].point[k])));
      sum += error * error;
    }
    // Stairs are h wide: what is left of them is a fraction of it.
    CHECK(std::sqrt(sum / static_cast<double>(found.all[0].point.size())) <= 0.25 * h);
    for (const int count : {2, 3}) {
      set_thread_count(count);
      const Interfaces again = find(body, 9 * h);
      CHECK(again.all[0].point == found.all[0].point);
      CHECK(again.all[0].distance == found.all[0].distance);
      CHECK(again.all[0].counterpart == found.all[0].counterpart);
    }
    set_thread_count(threads);
  }
}

TEST_CASE("interfaces: points do not see a surface from behind, through another material") {
  for (const bool upside_down : {false, true}) {
    // From beyond the layers of 0 and 2 the points of 1 have the surface between 0 and 1 behind it.
    const auto layers = [&](const Point& x) {
      const double y = upside_down ? 1 - x[1] : x[1];
      return static_cast<std::uint16_t>(y < 0.3 ? 1 : y < 0.4 ? 0 : y < 0.5 ? 2 : 1);
    };
    const Body body = lattice_body(2, 10, layers);
    const Interfaces found = find(body, 0.6);
    REQUIRE(found.all.size() == 3);
    const Interface& of = found.all[0];
    REQUIRE((of.first == 0 && of.second == 1));
    for (const std::int32_t p : body.internal()) {
      const Point& x = body.position(static_cast<std::size_t>(p));
      const double height = (upside_down ? 1 - x[1] : x[1]) - 0.3;
      const std::ptrdiff_t k = of.find(p);
      if (layers(x) == 2 || height > 0.2) {
        CHECK(k < 0);
      } else {
        REQUIRE(k >= 0);
        CHECK(of.distance[static_cast<std::size_t>(k)] == doctest::Approx(-height).epsilon(1e-12));
      }
    }
  }
}

TEST_CASE("interfaces: none between equal materials; where they are whatever cracks; one for each pair") {
  const auto halves = [](const Point& x) { return static_cast<std::uint16_t>(x[0] > 0.5); };
  CHECK(find(lattice_body(2, 10, [](const Point&) { return std::uint16_t{1}; }), 1).empty());
  const Interfaces whole = find(lattice_body(2, 10, halves), 1),
                   cut = find(lattice_body(2, 10, halves, {Crack({{0.5, -1, 0}, {0.5, 2, 0}})}), 1);
  CHECK(whole.all[0].distance == cut.all[0].distance);
  const auto thirds = [](const Point& x) { return static_cast<std::uint16_t>(x[0] < 0.3 ? 0 : x[1] < 0.5 ? 1 : 2); };
  const Interfaces found = find(lattice_body(2, 20, thirds), 0.2);
  REQUIRE(found.all.size() == 3);
  for (const Interface& of : found.all) {
    CHECK(of.first < of.second);
    CHECK(std::ranges::is_sorted(of.point));
    for (std::size_t k = 0; k < of.point.size(); ++k) {
      const std::uint16_t own = found.material[static_cast<std::size_t>(of.point[k])],
                          other = found.material[static_cast<std::size_t>(of.counterpart[k])];
      CHECK((own == of.first ? other == of.second : own == of.second && other == of.first));
      CHECK((own == of.first ? of.distance[k] <= 0 : of.distance[k] >= 0));
    }
  }
}
