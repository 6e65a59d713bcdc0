#include "setup/body/placed_points.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "setup/body/scene_lattice.hpp"
#include "setup/body/sets.hpp"

namespace perikit {

namespace {

/// The points of the sets that list points or take the nearest one, and that faces are of, by their numbers: on all ranks.
class SinglePoints {
 public:
  /// All ranks must call it.
  SinglePoints(const Scene& scene, const PointStream& points) {
    const ShownPoints shown = [&](const auto& visit) {
      points([&](const CloudShares::OnePoint& point) { visit(point.x, point.number); });
    };
    for (const BoundaryDescription& boundary : scene.boundaries) {
      const auto set = std::ranges::find(scene.sets, boundary.set, &SetDescription::name);
      if (boundary.face.empty() || set == scene.sets.end() || set->expression || of_set_.contains(set->name)) continue;
      of_set_[set->name] = single_points(*set, shown);
    }
  }
  /// Ascending; null for other sets.
  const std::vector<std::int64_t>* of(const std::string& set) const {
    const auto found = of_set_.find(set);
    return found == of_set_.end() ? nullptr : &found->second;
  }

 private:
  std::map<std::string, std::vector<std::int64_t>> of_set_;
};

class PointsOfBody final : public PlacedPoints {
 public:
  explicit PointsOfBody(const Body& body) : PlacedPoints(body.frame()), body_(body) {}

  const Lattice* lattice() const noexcept override { return body_.lattice(); }
  bool shared() const noexcept override { return false; }
  void over(const std::string& set, const Visit& visit) const override {
    for (const std::int32_t index : body_.set(set)) {
      const auto p = static_cast<std::size_t>(index);
      visit({body_.position(p), body_.volume(p), body_.number(p)});
    }
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
      : PlacedPoints(scene_frame(scene, lattice.spacing)),
        scene_(scene),
        lattice_(lattice),
        inside_(inside),
        single_(scene, [this](const auto& visit) { over_run("all", visit); }) {}

  const Lattice* lattice() const noexcept override { return &lattice_; }
  bool shared() const noexcept override { return true; }
  void over(const std::string& set, const Visit& visit) const override {
    if (set != "all" || inside_) {
      over_run(set, visit);
      return;
    }
    // The corners of the box are its outermost points.
    for (std::int64_t corner = 0; corner < 8; ++corner) {
      std::array<std::int64_t, 3> k{};
      for (std::size_t a = 0; a < 3; ++a)
        if (corner >> lattice_.axis[a] & 1) k[a] = lattice_.extent[a] - 1;
      visit(point(k));
    }
  }
  std::int64_t at(const std::array<std::int64_t, 3>& k, const std::string& set) const override {
    for (std::size_t a = 0; a < 3; ++a)
      if (k[a] < 0 || k[a] >= lattice_.extent[a]) return -1;
    const Point x = lattice_.centre(k);
    if (inside_ && !inside_(x)) return -1;
    const std::int64_t number = lattice_.input_number(k);
    if (set == "all") return number;
    const std::vector<std::int64_t>* const single = single_.of(set);
    const bool member = single ? std::ranges::binary_search(*single, number) : (*set_expression(scene_, set))(x) != 0.0;
    return member ? number : -1;
  }

 private:
  /// In the rank's run of the cells.
  void over_run(const std::string& set, const Visit& visit) const {
    const Run run = own_run(lattice_.extent[0] * lattice_.extent[1] * lattice_.extent[2]);
    for (std::int64_t number = run.first; number < run.last; ++number) {
      const std::array<std::int64_t, 3> k = lattice_.cell_of_input(number);
      if (at(k, set) >= 0) visit(point(k));
    }
  }
  OnePoint point(const std::array<std::int64_t, 3>& k) const {
    return {lattice_.centre(k), std::pow(lattice_.spacing, lattice_.dimension) * frame().section, lattice_.input_number(k)};
  }

  const Scene& scene_;
  Lattice lattice_;
  Inside inside_;
  SinglePoints single_;
};

class PointsOfCloud final : public PlacedPoints {
 public:
  PointsOfCloud(const Scene& scene, const BodyFrame& frame, PointStream points)
      : PlacedPoints(frame),
        scene_(scene),
        points_(std::move(points)),
        single_(scene, [this](const auto& visit) { over("all", visit); }) {}

  const Lattice* lattice() const noexcept override { return nullptr; }
  bool shared() const noexcept override { return true; }
  void over(const std::string& set, const Visit& visit) const override {
    const Expression* const condition = set_expression(scene_, set);
    const std::vector<std::int64_t>* const single = set == "all" ? nullptr : single_.of(set);
    points_([&](const CloudShares::OnePoint& point) {
      if (condition ? (*condition)(point.x) != 0.0 : !single || std::ranges::binary_search(*single, point.number)) visit(point);
    });
  }
  std::int64_t at(const std::array<std::int64_t, 3>&, const std::string&) const override { return -1; }

 private:
  const Scene& scene_;
  PointStream points_;
  SinglePoints single_;
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
