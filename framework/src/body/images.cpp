#include "perikit/body/images.hpp"

#include <algorithm>

#include "body/image_list.hpp"

namespace perikit {

namespace {

/// The planes across one axis. Between two of them images have images in turn, until the reach of both is filled.
void add_across(std::span<const ImagePlane* const> planes, double reach, ImageList& list) {
  for (const ImagePlane* plane : planes) list.mirror_cracks(*plane);
  const auto add_image = [&](const ImagePlane& plane, std::size_t n) {
    const double d = depth(plane, list.position(n));
    if (!(d >= 0) || d > reach) return false;
    const std::int32_t surface = plane.surface[static_cast<std::size_t>(list.source(n))];
    if (surface < 0) return false;
    Point foot = list.position(n);
    foot[static_cast<std::size_t>(plane.axis)] = plane.at;
    list.add(n, {image_of(plane, list.position(n)), foot, 1.0, surface}, plane.odd, plane.motion);
    return true;
  };
  std::vector<std::size_t> done(planes.size(), 0);
  for (bool more = true; more;) {
    more = false;
    for (std::size_t k = 0; k < planes.size(); ++k) {
      const std::size_t end = list.size();
      for (std::size_t n = done[k]; n < end; ++n) more = add_image(*planes[k], n) || more;
      done[k] = end;
    }
  }
}

}  // namespace

double halo(const Body& body) {
  return 2 * body.horizon() * (1 + 1e-9);
}

Images make_images(const Body& body, std::span<const ImagePlane> planes, std::span<const ImageSurface> surfaces) {
  ImageList list(body);
  if (!surfaces.empty()) mirror_in_turn(body, planes, surfaces, list);
  for (int axis = 0; axis < body.dimension(); ++axis) {
    std::vector<const ImagePlane*> across;
    for (const ImagePlane& plane : planes)
      if (plane.axis == axis && (surfaces.empty() || plane.period > 0)) across.push_back(&plane);
    if (!across.empty()) add_across(across, halo(body), list);
  }
  return list.take();
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
    found.volume.push_back(images.volume[k]);
    found.sign.push_back(images.sign[k]);
  }
  for (ImageTerm term : images.terms) {
    term.image = kept[static_cast<std::size_t>(term.image)];
    if (term.image >= 0) found.terms.push_back(term);
  }
  return found;
}

}  // namespace perikit
