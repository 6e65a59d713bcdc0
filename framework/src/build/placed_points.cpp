#include "build/placed_points.hpp"

#include <map>

#include "build/scene_lattice.hpp"
#include "build/sets.hpp"

namespace perikit {

namespace {

class PointsOfBody final : public PlacedPoints {
 public:
  explicit PointsOfBody(const Body& body)
      : PlacedPoints({body.space(), body.section(), body.spacing(), body.horizon(), body.cracks()}), body_(body) {}

  const Lattice* lattice() const noexcept override { return body_.lattice(); }
  bool shared() const noexcept override { return false; }
  void over(const std::string& set, const Visit& visit) const override {
    for (const std::int32_t p : body_.set(set))
      visit(body_.position(static_cast<std::size_t>(p)), body_.number(static_cast<std::size_t>(p)));
  }
  std::int64_t at(const std::array<std::int64_t, 3>& k, const std::string& set) const override {
    for (std::size_t a = 0; a < 3; ++a)
      if (k[a] < 0 || k[a] >= body_.lattice()->extent[a]) return -1;
    const auto p = static_cast<std::size_t>(body_.lattice()->index(k[0], k[1], k[2]));
    if (!body_.alive(p)) return -1;
    if (set != "all") {
      std::vector<bool>& members = members_[set];
      if (members.empty()) {
        members.resize(body_.stride(), false);
        for (const std::int32_t member : body_.set(set)) members[static_cast<std::size_t>(member)] = true;
      }
      if (!members[p]) return -1;
    }
    return body_.number(p);
  }

 private:
  const Body& body_;
  mutable std::map<std::string, std::vector<bool>> members_;  ///< by internal index, of sets that were asked for
};

class PointsOfLattice final : public PlacedPoints {
 public:
  PointsOfLattice(const Scene& scene, const Lattice& lattice, const Inside& inside)
      : PlacedPoints(scene_frame(scene, lattice.spacing)), scene_(scene), lattice_(lattice), inside_(inside) {}

  const Lattice* lattice() const noexcept override { return &lattice_; }
  bool shared() const noexcept override { return true; }
  void over(const std::string& set, const Visit& visit) const override {
    const auto visit_point = [&](const std::array<std::int64_t, 3>& k) {
      if (const std::int64_t number = at(k, set); number >= 0) visit(lattice_.centre(k), number);
    };
    const std::array<std::int64_t, 3>& n = lattice_.extent;
    if (set == "all" && !inside_) {
      // The corners of the box are its outermost points.
      for (std::int64_t corner = 0; corner < 8; ++corner) {
        std::array<std::int64_t, 3> k{};
        for (std::size_t a = 0; a < 3; ++a)
          if (corner >> lattice_.axis[a] & 1) k[a] = n[a] - 1;
        visit_point(k);
      }
      return;
    }
    const Run run = own_run(n[0] * n[1] * n[2]);
    for (std::int64_t number = run.first; number < run.last; ++number) visit_point(lattice_.cell_of_input(number));
  }
  std::int64_t at(const std::array<std::int64_t, 3>& k, const std::string& set) const override {
    for (std::size_t a = 0; a < 3; ++a)
      if (k[a] < 0 || k[a] >= lattice_.extent[a]) return -1;
    const Point x = lattice_.centre(k);
    if ((inside_ && !inside_(x)) || (set != "all" && (*set_expression(scene_, set))(x) == 0.0)) return -1;
    return lattice_.input_number(k);
  }

 private:
  const Scene& scene_;
  Lattice lattice_;
  Inside inside_;
};

class PointsOfCloud final : public PlacedPoints {
 public:
  PointsOfCloud(const Scene& scene, const BodyFrame& frame, PointStream points)
      : PlacedPoints(frame), scene_(scene), points_(std::move(points)) {}

  const Lattice* lattice() const noexcept override { return nullptr; }
  bool shared() const noexcept override { return true; }
  void over(const std::string& set, const Visit& visit) const override {
    const Expression* const condition = set == "all" ? nullptr : set_expression(scene_, set);
    points_([&](const CloudShares::OnePoint& point) {
      if (!condition || (*condition)(point.x) != 0.0) visit(point.x, point.number);
    });
  }
  std::int64_t at(const std::array<std::int64_t, 3>&, const std::string&) const override { return -1; }

 private:
  const Scene& scene_;
  PointStream points_;
};

}  // namespace

std::shared_ptr<const PlacedPoints> placed_points(const Scene& scene, const BodyFrame& frame, PointStream points) {
  return std::make_shared<const PointsOfCloud>(scene, frame, std::move(points));
}

std::shared_ptr<const PlacedPoints> placed_points(const Body& whole) {
  return std::make_shared<const PointsOfBody>(whole);
}

std::shared_ptr<const PlacedPoints> placed_points(const Scene& scene, const Lattice& lattice, const Inside& inside) {
  return std::make_shared<const PointsOfLattice>(scene, lattice, inside);
}

}  // namespace perikit
