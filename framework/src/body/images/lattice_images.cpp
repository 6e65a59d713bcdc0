#include "body/images/lattice_images.hpp"

#include <algorithm>

#include "body/images/image_list.hpp"

namespace perikit {

LatticeImages::LatticeImages(const Lattice& points, const Lattice& grown, Inside inside, ImageMaker maker)
    : points_(points), grown_(grown), inside_(std::move(inside)), maker_(std::move(maker)) {
  for (std::size_t a = 0; a < 3; ++a) {
    box_.low[a] = -grown.origin[a];
    box_.high[a] = box_.low[a];
    for (std::size_t k = 0; k < 3; ++k)
      if (points.axis[k] == grown.axis[a]) box_.high[a] += points.extent[k];
  }
  std::vector<ImagePlane> planes = maker_.planes();
  for (ImagePlane& plane : planes) plane.surface = itself;
  for (std::size_t a = 0; a < 3; ++a) {
    // Planes across an axis move nothing along the others.
    std::vector<ImagePlane> across;
    std::ranges::copy_if(planes, std::back_inserter(across), [&](const ImagePlane& plane) { return plane.axis == grown_.axis[a]; });
    along_[a].resize(static_cast<std::size_t>(box_.length(a)));
    if (across.empty()) continue;
    const ImageMaker lines(grown_.dimension, maker_.reach(), std::move(across));
    std::size_t most = 0;
    Cell k = box_.low;
    for (std::vector<std::int64_t>& of : along_[a]) {
      Images images;
      lines.add(grown_.centre(k), 0, 0, images);
      for (const Point& x : images.position) of.push_back(grown_.around(x)[a]);
      most = std::max(most, of.size());
      ++k[a];
    }
    most_ *= static_cast<std::int64_t>(most + 1);
  }
}

bool LatticeImages::real(const Cell& cell) const {
  return box_.holds(cell) && (!inside_ || inside_(grown_.centre(cell)));
}

void LatticeImages::make(const Cell& source, Images& images) const {
  const Point x = grown_.centre(source);
  maker_.add(x, points_.input_number(points_.around(x)), 0, images);
}

void LatticeImages::over(const CellBox& box, const std::function<void(const OneImage&, const Images&, std::size_t)>& visit) const {
  // Along each axis: coordinates that lie in the box or have images there, and which of them have any at all.
  std::array<std::vector<std::int64_t>, 3> wanted;
  std::array<std::vector<std::uint8_t>, 3> moved;
  for (std::size_t a = 0; a < 3; ++a)
    for (std::int64_t k = box_.low[a]; k < box_.high[a]; ++k) {
      const auto in_box = [&](std::int64_t at) { return at >= box.low[a] && at < box.high[a]; };
      const bool moves = std::ranges::any_of(along_[a][static_cast<std::size_t>(k - box_.low[a])], in_box);
      if (!moves && !in_box(k)) continue;
      wanted[a].push_back(k);
      moved[a].push_back(moves);
    }
  std::array<std::size_t, 3> inner{};
  for (std::size_t a = 0; a < 3; ++a) inner[static_cast<std::size_t>(grown_.axis[a])] = a;
  const auto [ax, ay, az] = inner;
  Images images;
  for (std::size_t z = 0; z < wanted[az].size(); ++z)
    for (std::size_t y = 0; y < wanted[ay].size(); ++y)
      for (std::size_t x = 0; x < wanted[ax].size(); ++x) {
        if (!moved[ax][x] && !moved[ay][y] && !moved[az][z]) continue;
        Cell source{};
        source[ax] = wanted[ax][x];
        source[ay] = wanted[ay][y];
        source[az] = wanted[az][z];
        if (!real(source)) continue;
        images = {};
        make(source, images);
        const std::int64_t first = points_.input_number(points_.around(grown_.centre(source))) * most_;
        for (std::size_t k = 0; k < images.size(); ++k)
          if (const Cell cell = grown_.around(images.position[k]); box.holds(cell))
            visit({cell, source, first + static_cast<std::int64_t>(k)}, images, k);
      }
}

std::vector<LatticeImages::OneImage> LatticeImages::in(const CellBox& box) const {
  std::vector<OneImage> found;
  over(box, [&](const OneImage& image, const Images&, std::size_t) { found.push_back(image); });
  return found;
}

std::vector<LatticeImages::Cell> LatticeImages::of(const Cell& source) const {
  std::vector<Cell> cells;
  const auto moved = [&](std::size_t a) { return !along_[a][static_cast<std::size_t>(source[a] - box_.low[a])].empty(); };
  if (!moved(0) && !moved(1) && !moved(2)) return cells;
  Images images;
  make(source, images);
  for (const Point& x : images.position) cells.push_back(grown_.around(x));
  return cells;
}

Images LatticeImages::of_part(const Body& part) const {
  Images found;
  found.cracks = part.cracks();
  const Lattice& lattice = *part.lattice();
  CellBox box{lattice.first, lattice.first};
  for (std::size_t a = 0; a < 3; ++a) box.high[a] += lattice.extent[a];
  over(box, [&](const OneImage& image, const Images& of_source, std::size_t k) {
    const auto here = [&](const Cell& cell) { return part.at_place(grown_.index(cell[0], cell[1], cell[2])); };
    const std::int32_t p = here(image.cell);
    if (p < 0 || !part.image(static_cast<std::size_t>(p))) return;
    append_image(of_source, k, part.input_of(static_cast<std::size_t>(here(image.source))), found);
  });
  return found;
}

}  // namespace perikit
