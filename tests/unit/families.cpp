/// Families: the same points as a lattice and as a cloud have the same families, whole and with bonds that failed or weakened.

#include "families/families.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "families/cloud/cloud_families.hpp"
#include "families/lattice/lattice_families.hpp"
#include "families/shape_tensor.hpp"

using namespace perikit;

namespace {

class Cone final : public InfluenceFunction {
 public:
  void evaluate(std::span<const double> r, std::span<double> omega) const override {
    for (std::size_t k = 0; k < r.size(); ++k) omega[k] = 1.1 - r[k];
  }
};

/// A plate of 11 x 6 points, as a lattice and as a cloud with the same input numbers, cut half way along a crack.
struct Plates {
  explicit Plates(FamilyNeeds needs = {}) {
    BodyFrame frame;
    frame.space = Space::plane_strain;
    frame.spacing = 1;
    frame.horizon = 2.3;
    frame.cracks.emplace_back(std::vector<Point>{{-1, 3, 0}, {5, 3, 0}});
    const Lattice grid = make_lattice(2, 1.0, {}, {11, 6, 0}, frame.horizon);
    std::vector<std::int32_t> cells;
    std::vector<Point> positions;
    for (int y = 0; y < 6; ++y)
      for (int x = 0; x < 11; ++x) {
        const std::array<std::int64_t, 3> input{x, y, 0};
        const auto inner = [&](std::size_t k) { return input[static_cast<std::size_t>(grid.axis[k])]; };
        cells.push_back(static_cast<std::int32_t>(grid.index(inner(0), inner(1), 0)));
        positions.push_back({x + 0.5, y + 0.5, 0});
      }
    lattice_body = std::make_unique<Body>(frame, grid, cells);
    cloud_body = std::make_unique<Body>(frame, positions, std::vector<double>(positions.size(), 1.0));
    lattice = Families::make(*lattice_body, std::make_shared<Cone>(), needs);
    cloud = Families::make(*cloud_body, std::make_shared<Cone>(), needs);
    for (Families* f : {lattice.get(), cloud.get()}) f->let_fail();
  }
  static std::size_t point(const Families& f, std::size_t input) { return static_cast<std::size_t>(f.body().internal()[input]); }
  static BondId bond(const Families& f, std::size_t a, std::size_t b) {
    return BondId::of(static_cast<std::int32_t>(point(f, a)), static_cast<std::int32_t>(point(f, b)));
  }

  std::unique_ptr<Body> lattice_body, cloud_body;
  std::unique_ptr<Families> lattice, cloud;
};

/// Far ends by input number with omega and b, ascending.
std::vector<std::array<double, 3>> family(const Families& f, std::size_t input, BondsOf which) {
  FamilyArrays arrays;
  f.load(Plates::point(f, input), which, arrays);
  std::vector<std::array<double, 3>> bonds;
  for (std::size_t k = 0; k < arrays.far.size(); ++k)
    bonds.push_back({double(f.body().input_of(static_cast<std::size_t>(arrays.far[k]))), arrays.omega[k], arrays.b(k)});
  std::sort(bonds.begin(), bonds.end());
  return bonds;
}

void check_equal(const Plates& plates) {
  for (std::size_t i = 0; i < plates.cloud_body->points(); ++i) {
    INFO("point ", i);
    for (const BondsOf which : {BondsOf::uncut, BondsOf::set_up, BondsOf::intact}) {
      const auto a = family(*plates.lattice, i, which), b = family(*plates.cloud, i, which);
      REQUIRE(a.size() == b.size());
      for (std::size_t k = 0; k < a.size(); ++k) {
        CHECK(a[k][0] == b[k][0]);
        CHECK(a[k][1] == doctest::Approx(b[k][1]).epsilon(1e-12));
        CHECK(a[k][2] == b[k][2]);
      }
    }
    const std::size_t p = Plates::point(*plates.lattice, i), q = Plates::point(*plates.cloud, i);
    CHECK(plates.lattice->damage(p) == doctest::Approx(plates.cloud->damage(q)).epsilon(1e-12));
    CHECK(plates.lattice->remaining_influence(p) == doctest::Approx(plates.cloud->remaining_influence(q)).epsilon(1e-12));
    CHECK(plates.lattice->condition(p) == doctest::Approx(plates.cloud->condition(q)).epsilon(1e-10));
    CHECK(plates.lattice->normaliser(p, BondWeight::volume) == doctest::Approx(plates.cloud->normaliser(q, BondWeight::volume)));
    CHECK(plates.lattice->lost_bonds(p) == plates.cloud->lost_bonds(q));
  }
}

}  // namespace

TEST_CASE("families: points on a crack count to one side of it, all to the same") {
  // Cells of 0.1; a crack along either diagonal passes through their centres, whose coordinates are rounded.
  const auto point = [](int i, int j) { return Point{(i + 0.5) * 0.1, (j + 0.5) * 0.1, 0}; };
  const Crack along({{-0.05, -0.05, 0}, {0.7, 0.7, 0}}), against({{-0.05, 1.05, 0}, {0.7, 0.3, 0}});
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      CHECK_FALSE(along.cuts(point(i, i), point(j, j)));
      CHECK_FALSE(against.cuts(point(i, 9 - i), point(j, 9 - j)));
      CHECK(along.cuts(point(i, i), point(j, j + 1)) == along.cuts(point(0, 0), point(0, 1)));
      CHECK(against.cuts(point(i, 9 - i), point(j, 8 - j)) == against.cuts(point(0, 9), point(0, 8)));
    }
}

TEST_CASE("families: a lattice and a cloud of the same points, with a pre-crack") {
  const Plates plates;
  CHECK(plates.lattice->bonds() == plates.cloud->bonds());
  CHECK(plates.lattice->cut() == plates.cloud->cut());
  CHECK(plates.lattice->cut() > 0);
  check_equal(plates);
}

TEST_CASE("families: bonds that fail and weaken, the same on both, and mended bit for bit") {
  Plates plates;
  std::vector<std::vector<double>> fresh;
  const auto conditions = [](const Families& f) {
    std::vector<double> values;
    for (const std::int32_t p : f.body().internal()) values.push_back(f.condition(static_cast<std::size_t>(p)));
    return values;
  };
  for (Families* f : {plates.lattice.get(), plates.cloud.get()}) {
    fresh.push_back(conditions(*f));
    const std::size_t version = f->version();
    const std::vector<BondChange> changes = {{Plates::bond(*f, 40, 41), 0.0}, {Plates::bond(*f, 40, 51), 0.25}, {Plates::bond(*f, 52, 53), 0.0}};
    const std::vector<std::int32_t> ends = f->lower(changes);
    CHECK(std::is_sorted(ends.begin(), ends.end()));
    CHECK(ends.size() == 5);
    CHECK(f->version() != version);
    CHECK(f->integrity(Plates::bond(*f, 51, 40)) == 0.25);
    CHECK(f->integrity(Plates::bond(*f, 40, 41)) == 0);
    CHECK(f->integrity(Plates::bond(*f, 41, 42)) == 1);
    const std::vector<BondChange> named = f->changed();
    CHECK(named.size() == 3);
    CHECK(std::is_sorted(named.begin(), named.end(), [](const BondChange& a, const BondChange& b) { return a.bond < b.bond; }));
  }
  check_equal(plates);
  std::size_t k = 0;
  for (Families* f : {plates.lattice.get(), plates.cloud.get()}) {
    CHECK(f->mend().size() == 5);
    CHECK(f->changed().empty());
    CHECK(conditions(*f) == fresh[k++]);
  }
  check_equal(plates);
}

TEST_CASE("families: points with little support are fragments; pair laws have none") {
  for (const bool shapes : {true, false}) {
    Plates plates({.influence = true, .shapes = shapes});
    for (Families* f : {plates.lattice.get(), plates.cloud.get()}) {
      FamilyArrays arrays;
      const std::size_t p = Plates::point(*f, 60);
      f->load(p, BondsOf::intact, arrays);
      std::vector<BondChange> changes;
      for (std::size_t n = 1; n < arrays.far.size(); ++n) changes.push_back({BondId::of(static_cast<std::int32_t>(p), arrays.far[n]), 0.0});
      f->lower(changes);
      const std::int32_t point = static_cast<std::int32_t>(p);
      const std::vector<BondId> left = f->fragment_bonds({&point, 1});
      CHECK(left.size() == (shapes ? 1u : 0u));
      if (shapes) CHECK(left[0] == BondId::of(point, arrays.far[0]));
    }
  }
}

TEST_CASE("families: a tenth is support enough, whatever rounding makes of it: what lattices leave is often just that") {
  for (int d = 1; d <= 3; ++d)
    for (const double rounding : {-4e-16, 0.0, 4e-16}) {
      std::array<double, 6> whole{}, left{};
      for (int a = 0; a < d; ++a)
        for (int b = a; b < d; ++b) {
          const auto n = static_cast<std::size_t>(symmetric_index(d, a, b));
          whole[n] = a == b ? 3.0 + a : 0.7;
          left[n] = 0.1 * (1 + rounding) * whole[n];
        }
      CHECK(!(shape_support(d, left.data(), whole.data()) < least_support));
    }
}

TEST_CASE("families: marked are points and what they reach, on lattices their groups, and no others, whatever the reach along a row") {
  for (const double horizon : {1.01, 2.3, 5.1, 11.6, 37.2}) {
    BodyFrame frame;
    frame.space = Space::plane_strain;
    frame.spacing = 1;
    frame.horizon = horizon;
    const Lattice grid = make_lattice(2, 1.0, {}, {61, 9, 0}, frame.horizon);
    std::vector<std::int32_t> cells;
    for (std::int64_t k1 = 0; k1 < grid.extent[1]; ++k1)
      for (std::int64_t k0 = 0; k0 < grid.extent[0]; ++k0)
        if ((7 * k0 + 3 * k1) % 11 != 0) cells.push_back(static_cast<std::int32_t>(grid.index(k0, k1, 0)));  // with holes
    const Body lattice(frame, grid, cells);
    std::vector<Point> positions;
    for (const std::int32_t p : lattice.internal()) positions.push_back(lattice.position(static_cast<std::size_t>(p)));
    const Body cloud(frame, positions, std::vector<double>(positions.size(), 1.0));
    for (const Body* const body : {&lattice, &cloud}) {
      const auto families = Families::make(*body, std::make_shared<Cone>(), {});
      for (std::size_t first = 0; first < 40; ++first) {
        INFO((body == &cloud ? "cloud" : "lattice"), ", horizon ", horizon, ", from point ", first);
        std::vector<std::int32_t> points;
        for (std::size_t n = first; n < body->points(); n += 1 + 29 * first) points.push_back(body->internal()[n]);
        GroupMarks marks(body->stride() / padding, 0), expected = marks;
        families->mark(points, marks);
        for (const std::int32_t p : points)
          for (const std::int32_t q : body->internal()) {
            const Point a = body->position(static_cast<std::size_t>(p)), b = body->position(static_cast<std::size_t>(q));
            if (std::hypot(a[0] - b[0], a[1] - b[1]) <= horizon) mark(expected, static_cast<std::size_t>(q));
          }
        CHECK(marks == families->evaluated(expected));
        CHECK((body == &lattice || marks == expected));   // of a cloud the points, not their groups
      }
    }
  }
}
