// Mirrors that meet at any angle. A place beyond several of them belongs to that behind which it lies deepest: around an edge of
// 150 degrees, where single mirror images would overlap, the seam is the bisector; at one of 90 degrees, where an image of an
// image is found on two ways, each way has its half; at sharper ones images of images of images fill the rest.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>

#include "body/images/curved_cracks.hpp"
#include "body/images/image_list.hpp"
#include "body/points/level_surface.hpp"

namespace perikit {

class Mirror {
 public:
  struct Reflected {
    ImagePlace place;
    double depth;
  };
  Mirror(const std::array<bool, 3>& odd, const std::array<int, 3>& motion) : odd_(odd), motion_(motion) {}
  virtual ~Mirror() = default;
  /// nullopt: place n lies behind, or too far in front, or its image would lie nearer to another part of the mirror. A place on the mirror
  /// is its own image, at a depth of 0.
  virtual std::optional<Reflected> reflect(const ImageList& list, std::size_t n) const = 0;
  /// How far a place lies behind the mirror; 0 in front of it.
  virtual double behind(const Point& x) const = 0;
  /// Appends images of what of the cracks lies in front of the mirror.
  virtual void add_cracks(std::vector<Crack>& cracks) const = 0;
  const std::array<bool, 3>& odd() const noexcept { return odd_; }
  const std::array<int, 3>& motion() const noexcept { return motion_; }
  /// See SymmetryOperation::of_stress.
  virtual bool turns_stress() const noexcept { return false; }

 private:
  std::array<bool, 3> odd_;
  std::array<int, 3> motion_;
};

namespace {

class PlaneMirror final : public Mirror {
 public:
  PlaneMirror(const ImagePlane& plane, double reach, double touching)
      : Mirror(plane.odd, plane.motion), plane_(plane), reach_(reach), touching_(touching) {}

  std::optional<Reflected> reflect(const ImageList& list, std::size_t n) const override {
    const Point& x = list.position(n);
    const double d = depth(plane_, x);
    const bool on_plane = std::abs(d) <= touching_;
    if (!(d >= 0 || on_plane) || d > reach_) return std::nullopt;
    const std::int64_t surface = plane_.surface(list.point(), list.number());
    if (surface < 0) return std::nullopt;
    Point foot = x;
    foot[static_cast<std::size_t>(plane_.axis)] = plane_.at;
    return Reflected{{on_plane ? x : image_of(plane_, x), foot, 1.0, surface}, on_plane ? 0 : d};
  }
  double behind(const Point& x) const override { return std::max(0.0, -depth(plane_, x)); }
  void add_cracks(std::vector<Crack>& cracks) const override { mirror_cracks(plane_, cracks); }
  bool turns_stress() const noexcept override { return !plane_.odd[static_cast<std::size_t>(plane_.axis)]; }

 private:
  ImagePlane plane_;
  double reach_, touching_;
};

class SurfaceMirror final : public Mirror {
 public:
  SurfaceMirror(const BodyFrame& frame, const ImageSurface& surface, double reach)
      : Mirror({true, true, true}, surface.motion),
        surface_(surface.level, dimension(frame.space), frame.spacing),
        nearest_(surface.nearest),
        spacing_(frame.spacing),
        reach_(reach) {}

  std::optional<Reflected> reflect(const ImageList& list, std::size_t n) const override {
    const Point& x = list.position(n);
    if (std::abs(surface_.estimate(x)) <= touching(spacing_)) return Reflected{{x, x, 1.0, nearest_(x, list.number())}, 0};
    if (!(surface_.level(x) < 0) || surface_.estimate(x) > far * reach_) return std::nullopt;
    const std::optional<Foot> foot = surface_.foot(x);
    if (!foot || !(foot->depth > 0) || foot->depth > reach_ || !(foot->stretch > 0)) return std::nullopt;
    const std::optional<Point> image = image_at(x, *foot);
    if (!image) return std::nullopt;
    return Reflected{{*image, foot->at, foot->stretch, nearest_(foot->at, list.number())}, foot->depth};
  }
  double behind(const Point& x) const override {
    if (!(surface_.level(x) > 0)) return 0;
    const double guess = -surface_.estimate(x);
    if (guess > far * reach_) return std::numeric_limits<double>::infinity();
    const std::optional<Foot> foot = surface_.foot(x);
    return foot && foot->depth < 0 ? -foot->depth : guess;
  }
  void add_cracks(std::vector<Crack>& cracks) const override {
    // One piece farther than points have images, so that what these see of a crack has no gap.
    const auto image = [&](const Point& x) -> std::optional<Point> {
      if (surface_.estimate(x) > far * reach_) return std::nullopt;
      const std::optional<Foot> foot = surface_.foot(x);
      if (!foot || foot->depth > reach_ + spacing_ || !(foot->stretch > 0)) return std::nullopt;
      return foot->depth <= touching(spacing_) ? x : image_at(x, *foot);
    };
    mirror_cracks({[&](const Point& x) { return surface_.level(x); }, image, spacing_}, cracks);
  }

 private:
  /// At the other end of the straight line through the foot; nullopt where another part of the surface is nearer to it.
  std::optional<Point> image_at(const Point& x, const Foot& foot) const {
    Point image{};
    for (std::size_t c = 0; c < 3; ++c) image[c] = 2 * foot.at[c] - x[c];
    if (!(surface_.level(image) > 0)) return std::nullopt;
    // In a narrow hole the opposite side may be nearer: its images are there.
    const std::optional<Foot> back = surface_.foot(image);
    constexpr double same = 0.01;  // spacings
    if (!back) return std::nullopt;
    double square = 0;
    for (std::size_t c = 0; c < 3; ++c) square += (back->at[c] - foot.at[c]) * (back->at[c] - foot.at[c]);
    if (square > same * same * spacing_ * spacing_) return std::nullopt;
    return image;
  }

  /// Estimates of distances are off where surfaces are bent.
  static constexpr double far = 3;

  LevelSurface surface_;
  std::function<std::int64_t(const Point&, std::int64_t)> nearest_;
  double spacing_, reach_;
};

}  // namespace

TurningMirrors::TurningMirrors(const BodyFrame& frame, std::span<const ImagePlane> planes, std::span<const ImageSurface> surfaces)
    : even_(1e-6 * frame.spacing), surfaces_(surfaces.size()) {
  const double reach = halo(frame.horizon);
  for (const ImageSurface& surface : surfaces) mirrors_.push_back(std::make_unique<SurfaceMirror>(frame, surface, reach));
  for (const ImagePlane& plane : planes)
    if (plane.period == 0) mirrors_.push_back(std::make_unique<PlaneMirror>(plane, reach, touching(frame.spacing)));
}

TurningMirrors::~TurningMirrors() = default;

void TurningMirrors::add_cracks(std::vector<Crack>& cracks) const {
  for (const auto& mirror : mirrors_) mirror->add_cracks(cracks);
}

void TurningMirrors::add_images(ImageList& list) const {
  const auto deepest = [&](std::size_t own, const Point& x, double depth) {
    for (std::size_t k = 0; k < mirrors_.size(); ++k) {
      if (k == own) continue;
      const double other = mirrors_[k]->behind(x);
      if (other > 0 && (other > depth + even_ || (k < own && other >= depth - even_))) return false;
    }
    return true;
  };
  // By place: the last mirror that it is an image of. A point on mirrors has an image there behind each, those of images in the order of the
  // mirrors; an image elsewhere that lies on a mirror has none, since that one's images have images there.
  std::vector<std::size_t> from(list.size(), 0), done(mirrors_.size(), 0);
  for (bool more = true; more;) {
    more = false;
    for (std::size_t k = 0; k < mirrors_.size(); ++k) {
      const std::size_t end = list.size();
      for (std::size_t n = done[k]; n < end; ++n) {
        const auto reflected = mirrors_[k]->reflect(list, n);
        const bool on_mirror = reflected && reflected->depth == 0;
        if (!reflected || (on_mirror && n > 0 && (list.position(n) != list.point() || from[n] >= k)) || !deepest(k, reflected->place.at, reflected->depth)) continue;
        SymmetryOperation operation = list.operation(n);
        operation.mirrors.insert(0, 1, static_cast<char>(k));
        operation.at_surface |= k < surfaces_;
        if (mirrors_[k]->turns_stress()) operation.of_stress = static_cast<std::int8_t>(-operation.of_stress);
        if (on_mirror && n == 0) list.hold(mirrors_[k]->odd(), mirrors_[k]->motion());
        list.add(n, reflected->place, operation, mirrors_[k]->odd(), mirrors_[k]->motion());
        from.push_back(k);
        more = true;
      }
      done[k] = end;
    }
  }
}

}  // namespace perikit
