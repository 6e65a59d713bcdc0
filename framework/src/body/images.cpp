#include "perikit/body/images.hpp"

#include <algorithm>

namespace perikit {

namespace {

/// Distance of a place in front of the plane whose points it takes: itself, or the opposite side.
double depth(const ImagePlane& plane, const Point& x) {
  const double coordinate = x[static_cast<std::size_t>(plane.axis)];
  return plane.period > 0 ? plane.outward * (coordinate - plane.at) + plane.period : plane.outward * (plane.at - coordinate);
}

Point image_of(const ImagePlane& plane, Point x) {
  double& coordinate = x[static_cast<std::size_t>(plane.axis)];
  coordinate = plane.period > 0 ? coordinate + plane.outward * plane.period : 2 * plane.at - coordinate;
  return x;
}

/// The part of a crack in front of a plane (Sutherland and Hodgman); fewer than two vertices: nothing.
std::vector<Point> in_front(const ImagePlane& plane, const std::vector<Point>& vertices) {
  const bool closed = vertices.size() > 2;
  std::vector<Point> kept;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Point& a = vertices[i];
    const double da = depth(plane, a);
    if (da >= 0) kept.push_back(a);
    if (!closed && i + 1 == vertices.size()) break;
    const Point& b = vertices[(i + 1) % vertices.size()];
    const double db = depth(plane, b);
    if ((da >= 0) == (db >= 0)) continue;
    const double s = da / (da - db);
    kept.push_back({a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2])});
  }
  return kept;
}

class Maker {
 public:
  explicit Maker(const Body& body) : body_(body), reach_(halo(body)), real_(body.points()) {
    for (const std::int32_t p : body.internal()) positions_.push_back(body.position(static_cast<std::size_t>(p)));
    first_.assign(real_ + 1, 0);
    images_.cracks = body.cracks();
  }

  /// The planes across one axis. Between two of them images have images in turn, until the reach of both is filled.
  void add(std::span<const ImagePlane* const> planes) {
    for (const ImagePlane* plane : planes) mirror_cracks(*plane);
    std::vector<std::size_t> done(planes.size(), 0);
    for (bool more = true; more;) {
      more = false;
      for (std::size_t k = 0; k < planes.size(); ++k) {
        const std::size_t end = positions_.size();
        for (std::size_t n = done[k]; n < end; ++n) more = add_image(*planes[k], n) || more;
        done[k] = end;
      }
    }
  }

  Images take() {
    images_.position.assign(positions_.begin() + static_cast<std::ptrdiff_t>(real_), positions_.end());
    return std::move(images_);
  }

 private:
  std::int32_t source(std::size_t n) const { return n < real_ ? static_cast<std::int32_t>(n) : images_.source[n - real_]; }

  bool add_image(const ImagePlane& plane, std::size_t n) {
    const double d = depth(plane, positions_[n]);
    if (!(d >= 0) || d > reach_) return false;
    const std::int32_t source = this->source(n), surface = plane.surface[static_cast<std::size_t>(source)];
    if (surface < 0) return false;
    const auto image = static_cast<std::int32_t>(images_.size());
    const std::array<std::int8_t, 3> of = n < real_ ? std::array<std::int8_t, 3>{1, 1, 1} : images_.sign[n - real_];
    std::array<std::int8_t, 3> sign = of;
    Point at = positions_[n];
    at[static_cast<std::size_t>(plane.axis)] = plane.at;
    for (int c = 0; c < body_.dimension(); ++c) {
      const auto i = static_cast<std::size_t>(c);
      if (plane.odd[i]) {
        sign[i] = static_cast<std::int8_t>(-of[i]);
        images_.terms.push_back({image, c, plane.motion[i], 2.0, at, surface});
      }
      for (std::size_t k = first_[n]; k < first_[n + 1]; ++k) {
        ImageTerm term = images_.terms[k];
        if (term.component != c) continue;
        term.image = image;
        if (plane.odd[i]) term.factor = -term.factor;
        images_.terms.push_back(term);
      }
    }
    images_.source.push_back(source);
    images_.sign.push_back(sign);
    positions_.push_back(image_of(plane, positions_[n]));
    first_.push_back(images_.terms.size());
    return true;
  }

  void mirror_cracks(const ImagePlane& plane) {
    const std::size_t n = images_.cracks.size();
    for (std::size_t k = 0; k < n; ++k) {
      std::vector<Point> part = in_front(plane, images_.cracks[k].vertices());
      if (part.size() < std::min<std::size_t>(images_.cracks[k].vertices().size(), 3)) continue;
      if (part.size() > 1 && part.size() < 3 && part[0] == part[1]) continue;
      for (Point& x : part) x = image_of(plane, x);
      images_.cracks.emplace_back(std::move(part));
    }
  }

  const Body& body_;
  double reach_;
  std::size_t real_;
  std::vector<Point> positions_;               ///< points of the body, then images
  std::vector<std::size_t> first_;             ///< first term of each of them, and the end
  Images images_;
};

}  // namespace

double halo(const Body& body) { return 2 * body.horizon() * (1 + 1e-9); }

Images make_images(const Body& body, std::span<const ImagePlane> planes) {
  Maker maker(body);
  for (int axis = 0; axis < body.dimension(); ++axis) {
    std::vector<const ImagePlane*> across;
    for (const ImagePlane& plane : planes)
      if (plane.axis == axis) across.push_back(&plane);
    if (!across.empty()) maker.add(across);
  }
  return maker.take();
}

Images images_of_part(const Images& images, const Body& part) {
  const auto real = static_cast<std::int32_t>(part.points_of_all_ranks());
  std::vector<std::int32_t> here(static_cast<std::size_t>(real) + images.size(), -1);  // input numbers by those of the whole body
  for (std::size_t n = 0; n < part.points(); ++n)
    here[static_cast<std::size_t>(part.number(static_cast<std::size_t>(part.internal()[n])))] = static_cast<std::int32_t>(n);
  Images found;
  found.cracks = images.cracks;
  std::vector<std::int32_t> kept(images.size(), -1);
  for (std::size_t k = 0; k < images.size(); ++k) {
    if (here[static_cast<std::size_t>(real) + k] < 0) continue;
    kept[k] = static_cast<std::int32_t>(found.size());
    found.position.push_back(images.position[k]);
    found.source.push_back(here[static_cast<std::size_t>(images.source[k])]);
    found.sign.push_back(images.sign[k]);
  }
  for (ImageTerm term : images.terms) {
    term.image = kept[static_cast<std::size_t>(term.image)];
    if (term.image >= 0) found.terms.push_back(term);
  }
  return found;
}

}  // namespace perikit
