#include "perikit/body/body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <stdexcept>

#include "body/points/curve.hpp"
#include "perikit/body/images.hpp"

namespace perikit {

Body::Body(BodyFrame frame, const Lattice& lattice, std::vector<std::int32_t> cells)
    : frame_(std::move(frame)), internal_(std::move(cells)) {
  number_lattice(lattice, std::pow(frame_.spacing, dimension()) * frame_.section);
  points_of_all_ranks_ = points();
}

Body::Body(BodyFrame frame, const std::vector<Point>& positions, const std::vector<double>& volumes) : frame_(std::move(frame)) {
  place_cloud(positions, volumes);
  points_of_all_ranks_ = points();
}

Body::Body(BodyFrame frame, const Lattice& whole, LatticePart part, std::uint16_t far_material)
    : frame_(std::move(frame)),
      points_of_all_ranks_(static_cast<std::size_t>(part.points_of_all_ranks)),
      numbers_(std::move(part.numbers)),
      stride_of_whole_(static_cast<std::size_t>(whole.cells)),
      whole_lattice_(whole) {
  const Lattice lattice = box_of(whole, part.first, part.last, frame_.horizon);
  internal_.reserve(part.places.size());
  for (const std::int64_t place : part.places) {
    const auto k = whole.cell(place);
    internal_.push_back(
        static_cast<std::int32_t>(lattice.index(k[0] - part.first[0], k[1] - part.first[1], k[2] - part.first[2])));
  }
  number_lattice(lattice, std::pow(frame_.spacing, dimension()) * frame_.section);
  keep_places(part.places, part.roles);
  keep_far_material(part.roles, far_material);
}

Body::Body(BodyFrame frame, CloudPart part, std::uint16_t far_material)
    : frame_(std::move(frame)),
      stride_(padded(part.places.size())),
      positions_(std::move(part.rows)),
      points_of_all_ranks_(static_cast<std::size_t>(part.points_of_all_ranks)),
      stride_of_whole_(padded(static_cast<std::size_t>(part.places_of_all_ranks))) {
  internal_.resize(part.places.size());
  std::iota(internal_.begin(), internal_.end(), 0);
  const auto by_point = [](const auto& values) { return [&](std::int32_t p) { return values[static_cast<std::size_t>(p)]; }; };
  std::ranges::sort(internal_, {}, by_point(part.numbers));
  std::vector<std::int64_t> places;
  std::vector<Role> roles;
  std::ranges::transform(internal_, std::back_inserter(numbers_), by_point(part.numbers));
  std::ranges::transform(internal_, std::back_inserter(places), by_point(part.places));
  std::ranges::transform(internal_, std::back_inserter(roles), by_point(part.roles));
  number_cloud();
  keep_places(places, roles);
  keep_far_material(roles, far_material);
}

/// Of a part without materials, by its own input numbers; also which points it owns.
void Body::keep_far_material(const std::vector<Role>& roles, std::uint16_t far_material) {
  material_ids_.assign(stride_, 0);
  for (std::size_t n = 0; n < internal_.size(); ++n) {
    if (roles[n] == Role::own && !image(static_cast<std::size_t>(internal_[n]))) owned_.push_back(internal_[n]);
    if (roles[n] == Role::far) material_ids_[static_cast<std::size_t>(internal_[n])] = far_material;
  }
}

/// Of a part, by its own input numbers: where its points lie in the whole body, and what they are to the rank.
void Body::keep_places(const std::vector<std::int64_t>& places, const std::vector<Role>& roles) {
  places_.assign(stride_, 0);
  own_.assign(stride_, 0);
  for (std::size_t n = 0; n < places.size(); ++n) {
    const auto p = static_cast<std::size_t>(internal_[n]);
    places_[p] = places[n];
    own_[p] = roles[n] == Role::own;
    if (roles[n] >= Role::image) complete_.push_back(internal_[n]);
  }
}

std::int32_t Body::at_place(std::int64_t place) const noexcept {
  if (!lattice_) {  // points keep their order
    const auto end = places_.begin() + static_cast<std::ptrdiff_t>(points());
    const auto found = std::lower_bound(places_.begin(), end, place);
    return found != end && *found == place ? static_cast<std::int32_t>(found - places_.begin()) : -1;
  }
  std::array<std::int64_t, 3> k = whole_lattice_->cell(place);
  for (std::size_t a = 0; a < 3; ++a) {
    k[a] -= lattice_->first[a];
    if (k[a] < 0 || k[a] >= lattice_->extent[a]) return -1;
  }
  const std::int64_t index = lattice_->index(k[0], k[1], k[2]);
  return alive(static_cast<std::size_t>(index)) ? static_cast<std::int32_t>(index) : -1;
}

std::vector<std::int64_t> Body::numbers(std::span<const std::int32_t> points) const {
  std::vector<std::int64_t> numbers;
  numbers.reserve(points.size());
  for (const std::int32_t p : points) numbers.push_back(number(static_cast<std::size_t>(p)));
  return numbers;
}

std::int32_t Body::find(std::int64_t number) const noexcept {
  if (numbers_.empty()) return number >= 0 && number < std::ssize(internal_) ? internal_[static_cast<std::size_t>(number)] : -1;
  const auto found = std::ranges::lower_bound(numbers_, number);
  return found != numbers_.end() && *found == number ? internal_[static_cast<std::size_t>(found - numbers_.begin())] : -1;
}

Body::Body(const Body& whole, const Images& images, std::uint16_t image_material)
    : frame_(whole.frame_), points_of_all_ranks_(whole.points()) {
  frame_.cracks = images.cracks;
  std::vector<Point> positions;
  for (const std::int32_t p : whole.internal_) positions.push_back(whole.position(static_cast<std::size_t>(p)));
  positions.insert(positions.end(), images.position.begin(), images.position.end());
  if (whole.lattice_) {
    place_on_lattice(*images.lattice, whole.uniform_volume_, positions);
  } else {
    std::vector<double> volumes;
    for (const std::int32_t p : whole.internal_) volumes.push_back(whole.volume(static_cast<std::size_t>(p)));
    for (std::size_t k = 0; k < images.size(); ++k) volumes.push_back(images.volume[k] * volumes[static_cast<std::size_t>(images.source[k])]);
    place_cloud(positions, volumes);
  }
  std::vector<std::int32_t> place(whole.stride_, -1);
  for (std::size_t n = 0; n < whole.points(); ++n) place[static_cast<std::size_t>(whole.internal_[n])] = internal_[n];
  copy_sets(whole, place, image_material);
}

/// Sets and materials of the points that have a place here, by internal index of `whole`; all other points have the material `others`. Dead
/// cells look like points of the first one, so that most groups of eight have one law.
void Body::copy_sets(const Body& whole, const std::vector<std::int32_t>& place, std::uint16_t others) {
  material_ids_.assign(stride_, 0);
  for (const std::int32_t p : internal_) material_ids_[static_cast<std::size_t>(p)] = others;
  const auto placed = [&](const std::vector<std::int32_t>& points) {
    std::vector<std::int32_t> here;
    for (const std::int32_t p : points)
      if (place[static_cast<std::size_t>(p)] >= 0) here.push_back(place[static_cast<std::size_t>(p)]);
    return here;
  };
  owned_ = placed(whole.owned());
  for (const auto& [name, members] : whole.sets_) sets_[name] = placed(members);
  for (const std::int32_t p : whole.internal_) {
    const std::int32_t own = place[static_cast<std::size_t>(p)];
    if (own >= 0) material_ids_[static_cast<std::size_t>(own)] = whole.material_ids_.empty() ? std::uint16_t{0} : whole.material_ids_[static_cast<std::size_t>(p)];
  }
}

/// These positions are places of the lattice.
void Body::place_on_lattice(const Lattice& lattice, double volume, const std::vector<Point>& positions) {
  std::vector<bool> taken(static_cast<std::size_t>(lattice.cells), false);
  internal_.clear();
  for (const Point& x : positions) {
    const std::array<std::int64_t, 3> k = lattice.around(x);
    const std::int64_t index = lattice.index(k[0], k[1], k[2]);
    if (taken[static_cast<std::size_t>(index)]) throw OverlappingImage(x);
    taken[static_cast<std::size_t>(index)] = true;
    internal_.push_back(static_cast<std::int32_t>(index));
  }
  number_lattice(lattice, volume);
}

/// What follows from the lattice and the cells that are kept.
void Body::number_lattice(const Lattice& lattice, double volume) {
  stride_ = static_cast<std::size_t>(lattice.cells);
  uniform_volume_ = volume;
  lattice_ = lattice;
  input_.assign(stride_, -1);
  alive_.assign(stride_ / 8, 0);
  for (std::size_t p = 0; p < internal_.size(); ++p) {
    const auto index = static_cast<std::size_t>(internal_[p]);
    input_[index] = static_cast<std::int32_t>(p);
    alive_[index / 8] |= static_cast<std::uint8_t>(1u << (index % 8));
  }
}

void Body::place_cloud(const std::vector<Point>& positions, const std::vector<double>& volumes) {
  const std::vector<std::int32_t> order = curve_order(positions, frame_.horizon);
  stride_ = padded(positions.size());
  internal_.resize(positions.size());
  positions_.assign(4 * stride_, 0.0);
  for (std::size_t p = 0; p < order.size(); ++p) {
    const auto from = static_cast<std::size_t>(order[p]);
    internal_[from] = static_cast<std::int32_t>(p);
    for (std::size_t c = 0; c < 3; ++c) positions_[4 * p + c] = positions[from][c];
    positions_[4 * p + 3] = volumes[from];
  }
  number_cloud();
}

/// What follows from the order of the points.
void Body::number_cloud() {
  input_.assign(stride_, -1);
  alive_.assign(stride_ / 8, 0);
  for (std::size_t n = 0; n < internal_.size(); ++n) {
    const auto p = static_cast<std::size_t>(internal_[n]);
    input_[p] = static_cast<std::int32_t>(n);
    alive_[p / 8] |= static_cast<std::uint8_t>(1u << (p % 8));
  }
}

std::int32_t Body::input_of(std::size_t internal_index) const noexcept { return input_[internal_index]; }

Point Body::position(std::size_t p) const noexcept {
  if (lattice_) return lattice_->position(static_cast<std::int64_t>(p));
  return {positions_[4 * p], positions_[4 * p + 1], positions_[4 * p + 2]};
}

bool Body::cut(const Point& a, const Point& b) const noexcept {
  return std::ranges::any_of(frame_.cracks, [&](const Crack& crack) { return crack.cuts(a, b); });
}

std::size_t Body::bytes() const noexcept {
  return (internal_.size() + input_.size() + complete_.size() + owned_.size()) * sizeof(std::int32_t) +
         (places_.size() + numbers_.size()) * sizeof(std::int64_t) + own_.size() + positions_.size() * sizeof(double) +
         alive_.size() + material_ids_.size() * sizeof(std::uint16_t);
}

}  // namespace perikit
