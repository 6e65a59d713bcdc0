#include "perikit/body/images.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "body/family_limit.hpp"
#include "body/images/image_list.hpp"

namespace perikit {

namespace {

/// The planes across one axis. Between two of them images have images in turn, until the reach of both is filled.
void add_across(std::span<const ImagePlane> all, std::span<const std::size_t> across, double reach, double touching, ImageList& list) {
  std::vector<std::size_t> from(list.size(), across.size());  // by place: the plane that it is an image behind
  const auto add_image = [&](std::size_t k, std::size_t n) {
    const ImagePlane& plane = all[across[k]];
    const double d = depth(plane, list.position(n));
    const bool mirror = plane.period == 0, on_plane = std::abs(d) <= touching;
    // Of two periodic sides the lower one has the points on it.
    if (on_plane ? (mirror ? from[n] == k : plane.outward < 0) : !(d > 0) || d > reach) return false;
    const std::int64_t surface = plane.surface(list.point(), list.number());
    if (surface < 0) return false;
    Point foot = list.position(n);
    foot[static_cast<std::size_t>(plane.axis)] = plane.at;
    if (mirror && on_plane && n == 0) list.hold(plane.odd, plane.motion);
    list.add(n, {mirror && on_plane ? list.position(n) : image_of(plane, list.position(n)), foot, 1.0, surface}, followed_by(list.operation(n), plane), plane.odd, plane.motion);
    from.push_back(k);
    return true;
  };
  std::vector<std::size_t> done(across.size(), 0);
  for (bool more = true; more;) {
    more = false;
    for (std::size_t k = 0; k < across.size(); ++k) {
      const std::size_t end = list.size();
      for (std::size_t n = done[k]; n < end; ++n) more = add_image(k, n) || more;
      done[k] = end;
    }
  }
}

}  // namespace

OverlappingImage::OverlappingImage(const Point& x)
    : std::domain_error(fmt::format("found an image of a point on another point at ({:.6g}, {:.6g}, {:.6g})", x[0], x[1], x[2])) {}

double halo(double horizon) {
  return 2 * search_radius(horizon);
}

ImageMaker::ImageMaker(int dimension, double reach, std::vector<ImagePlane> planes)
    : dimension_(dimension), reach_(reach), planes_(std::move(planes)) {
  for (int axis = 0; axis < dimension_; ++axis) {
    std::vector<std::size_t> across;
    for (std::size_t k = 0; k < planes_.size(); ++k)
      if (planes_[k].axis == axis) across.push_back(k);
    if (!across.empty()) across_.push_back(std::move(across));
  }
  // Periodic sides last, of images too: what is prescribed along a held face is asked for at places of the body, not beyond a periodic side.
  std::stable_partition(across_.begin(), across_.end(), [&](const std::vector<std::size_t>& across) { return planes_[across.front()].period == 0; });
}

ImageMaker::ImageMaker(const BodyFrame& frame, std::vector<ImagePlane> planes, std::span<const ImageSurface> surfaces)
    : ImageMaker(perikit::dimension(frame.space), halo(frame.horizon), std::move(planes)) {
  touching_ = touching(frame.spacing);
  if (surfaces.empty()) return;
  turning_ = std::make_unique<TurningMirrors>(frame, planes_, surfaces);
  for (std::vector<std::size_t>& across : across_)
    std::erase_if(across, [&](std::size_t k) { return planes_[k].period == 0; });
}

ImageMaker::~ImageMaker() = default;
ImageMaker::ImageMaker(ImageMaker&&) noexcept = default;

void ImageMaker::add(const Point& x, std::int64_t number, std::int32_t source, Images& images) const {
  const bool near = std::ranges::any_of(planes_, [&](const ImagePlane& plane) {
    const double d = depth(plane, x);
    return d >= -touching_ && d <= reach_;
  });
  if (!near && !turning_) return;
  ImageList list(dimension_, x, number, source, images);
  if (turning_) turning_->add_images(list);
  for (const std::vector<std::size_t>& across : across_) add_across(planes_, across, reach_, touching_, list);
}

std::vector<Crack> ImageMaker::cracks(std::vector<Crack> cracks) const {
  if (turning_) turning_->add_cracks(cracks);
  for (const std::vector<std::size_t>& across : across_)
    for (const std::size_t k : across) mirror_cracks(planes_[k], cracks);
  return cracks;
}

Images make_images(const Body& body, std::vector<ImagePlane> planes, std::span<const ImageSurface> surfaces) {
  Images images;
  if (body.lattice()) images.lattice = with_images(*body.lattice(), body.horizon(), planes);
  const ImageMaker maker(body.frame(), std::move(planes), surfaces);
  images.cracks = maker.cracks(body.cracks());
  for (std::size_t n = 0; n < body.points(); ++n)
    maker.add(body.position(static_cast<std::size_t>(body.internal()[n])), static_cast<std::int64_t>(n), static_cast<std::int32_t>(n),
              images);
  return images;
}

Lattice with_images(const Lattice& lattice, double horizon, std::vector<ImagePlane> planes) {
  for (ImagePlane& plane : planes) plane.surface = itself;
  const ImageMaker maker(lattice.dimension, halo(horizon), std::move(planes));
  std::array<std::int64_t, 3> low{}, high = lattice.extent;
  Images images;
  // What lies behind planes across an axis depends on the coordinate along it alone.
  for (std::size_t a = 0; a < static_cast<std::size_t>(lattice.dimension); ++a)
    for (std::array<std::int64_t, 3> k{}; k[a] < lattice.extent[a]; ++k[a]) maker.add(lattice.centre(k), 0, 0, images);
  for (const Point& x : images.position) {
    const std::array<std::int64_t, 3> k = lattice.around(x);
    for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], k[a]), high[a] = std::max(high[a], k[a] + 1);
  }
  std::array<std::int64_t, 3> input_low{}, input_high{};
  for (std::size_t a = 0; a < 3; ++a) {
    input_low[static_cast<std::size_t>(lattice.axis[a])] = low[a];
    input_high[static_cast<std::size_t>(lattice.axis[a])] = high[a];
  }
  return regrown(lattice, input_low, input_high, horizon);
}

}  // namespace perikit
