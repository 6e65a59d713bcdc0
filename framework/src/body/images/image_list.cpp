#include "body/images/image_list.hpp"

#include <algorithm>

namespace perikit {

namespace {

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

}  // namespace

double depth(const ImagePlane& plane, const Point& x) {
  const double coordinate = x[static_cast<std::size_t>(plane.axis)];
  return plane.period > 0 ? plane.outward * (coordinate - plane.at) + plane.period : plane.outward * (plane.at - coordinate);
}

Point image_of(const ImagePlane& plane, Point x) {
  double& coordinate = x[static_cast<std::size_t>(plane.axis)];
  coordinate = plane.period > 0 ? coordinate + plane.outward * plane.period : 2 * plane.at - coordinate;
  return x;
}

SymmetryOperation followed_by(SymmetryOperation operation, const ImagePlane& plane) {
  const auto a = static_cast<std::size_t>(plane.axis);
  if (plane.period > 0) {
    operation.shift[a] += plane.outward * plane.period;
    return operation;
  }
  operation.sign[a] = static_cast<std::int8_t>(-operation.sign[a]);
  operation.shift[a] = 2 * plane.at - operation.shift[a];
  if (!plane.odd[a]) operation.of_stress = static_cast<std::int8_t>(-operation.of_stress);
  return operation;
}

ImageList::ImageList(int dimension, const Point& x, std::int64_t number, std::int32_t source, Images& images)
    : dimension_(dimension),
      number_(number),
      source_(source),
      before_(images.size()),
      position_{x},
      operation_(1),
      first_(2, images.terms.size()),
      images_(images) {}

void ImageList::hold(const std::array<bool, 3>& odd, const std::array<int, 3>& motion) {
  for (int c = 0; c < dimension_; ++c)
    if (const auto i = static_cast<std::size_t>(c); odd[i]) images_.held.push_back({source_, c, motion[i]});
}

void ImageList::add(std::size_t n, const ImagePlace& image, const SymmetryOperation& operation, const std::array<bool, 3>& odd, const std::array<int, 3>& motion) {
  const auto number = static_cast<std::int32_t>(images_.size());
  const bool real = n == 0;
  const std::array<std::int8_t, 3> of = real ? std::array<std::int8_t, 3>{1, 1, 1} : images_.sign[before_ + n - 1];
  std::array<std::int8_t, 3> sign = of;
  for (int c = 0; c < dimension_; ++c) {
    const auto i = static_cast<std::size_t>(c);
    if (odd[i]) {
      sign[i] = static_cast<std::int8_t>(-of[i]);
      images_.terms.push_back({number, c, motion[i], 2.0, image.foot, image.surface});
    }
    for (std::size_t k = first_[n]; k < first_[n + 1]; ++k) {
      ImageTerm term = images_.terms[k];
      if (term.component != c) continue;
      term.image = number;
      if (odd[i]) term.factor = -term.factor;
      images_.terms.push_back(term);
    }
  }
  const double volume = real ? 1.0 : images_.volume[before_ + n - 1];
  images_.position.push_back(image.at);
  images_.source.push_back(source_);
  images_.sign.push_back(sign);
  images_.volume.push_back(image.volume * volume);
  images_.operation.push_back(operation);
  position_.push_back(image.at);
  operation_.push_back(operation);
  first_.push_back(images_.terms.size());
}

void append_image(const Images& made, std::size_t k, std::int32_t source, Images& images) {
  const auto number = static_cast<std::int32_t>(images.size());
  images.position.push_back(made.position[k]);
  images.source.push_back(source);
  images.volume.push_back(made.volume[k]);
  images.sign.push_back(made.sign[k]);
  images.operation.push_back(made.operation[k]);
  for (ImageTerm term : made.terms) {
    if (term.image != static_cast<std::int32_t>(k)) continue;
    term.image = number;
    images.terms.push_back(term);
  }
}

void append_held(const Images& made, std::int32_t source, Images& images) {
  for (const HeldPoint& held : made.held) images.held.push_back({source, held.component, held.motion});
}

void mirror_cracks(const ImagePlane& plane, std::vector<Crack>& cracks) {
  const std::size_t n = cracks.size();
  for (std::size_t k = 0; k < n; ++k) {
    std::vector<Point> part = in_front(plane, cracks[k].vertices());
    if (part.size() < std::min<std::size_t>(cracks[k].vertices().size(), 3)) continue;
    if (part.size() > 1 && part.size() < 3 && part[0] == part[1]) continue;
    for (Point& x : part) x = image_of(plane, x);
    cracks.emplace_back(std::move(part));
  }
}

}  // namespace perikit
