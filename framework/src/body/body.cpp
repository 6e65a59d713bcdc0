#include "perikit/body/body.hpp"

#include <algorithm>
#include <cmath>

namespace perikit {

Body::Body(BodyFrame frame, const Lattice& lattice, std::vector<std::int32_t> cells)
    : frame_(std::move(frame)), internal_(std::move(cells)) {
  number_lattice(lattice, std::pow(frame_.spacing, dimension()) * frame_.section);
  sets_["all"] = internal_;
  points_of_all_ranks_ = points();
}

Body::Body(BodyFrame frame, const std::vector<Point>& positions, const std::vector<double>& volumes) : frame_(std::move(frame)) {
  place_cloud(positions, volumes);
  sets_["all"] = internal_;
  points_of_all_ranks_ = points();
}

Body::Body(const Body& whole, const std::vector<bool>& owned, const std::vector<bool>& kept, std::uint16_t ghost_material)
    : frame_(whole.frame_), margin_(whole.margin_), points_of_all_ranks_(whole.points_of_all_ranks_) {
  std::vector<std::int32_t> place(whole.stride_, -1);   // by internal index of the whole body, kept points
  if (whole.lattice_) {
    for (std::size_t n = 0; n < kept.size(); ++n)
      if (kept[n]) internal_.push_back(whole.internal_[n]);
    number_lattice(*whole.lattice_, whole.uniform_volume_);
    for (const std::int32_t p : internal_) place[static_cast<std::size_t>(p)] = p;
  } else {
    std::vector<Point> positions;
    std::vector<double> volumes;
    std::vector<std::int32_t> from;
    for (std::size_t n = 0; n < kept.size(); ++n) {
      if (!kept[n]) continue;
      const auto p = static_cast<std::size_t>(whole.internal_[n]);
      from.push_back(whole.internal_[n]);
      positions.push_back(whole.position(p));
      volumes.push_back(whole.volume(p));
    }
    place_cloud(positions, volumes);
    for (std::size_t n = 0; n < from.size(); ++n) place[static_cast<std::size_t>(from[n])] = internal_[n];
  }
  const auto is_owned = [&](std::int32_t p) { return owned[static_cast<std::size_t>(whole.input_of(static_cast<std::size_t>(p)))]; };
  for (const auto& [name, members] : whole.sets_)
    for (const std::int32_t p : members)
      if (is_owned(p)) sets_[name].push_back(place[static_cast<std::size_t>(p)]);
      else sets_[name];
  material_ids_.assign(stride_, ghost_material);
  for (const std::int32_t p : whole.internal_) {
    if (is_owned(p))
      material_ids_[static_cast<std::size_t>(place[static_cast<std::size_t>(p)])] =
          whole.material_ids_.empty() ? std::uint16_t{0} : whole.material_ids_[static_cast<std::size_t>(p)];
  }
}

/// What follows from the lattice and the cells that are kept.
void Body::number_lattice(const Lattice& lattice, double volume) {
  stride_ = static_cast<std::size_t>(lattice.cells);
  margin_ = padding;
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
  const std::vector<std::int32_t> order = morton_order(positions, frame_.horizon);
  const std::size_t n = positions.size();
  stride_ = padded(n);
  margin_ = padding;
  internal_.resize(n);
  input_.assign(stride_, -1);
  alive_.assign(stride_ / 8, 0);
  positions_.assign(4 * stride_, 0.0);
  for (std::size_t p = 0; p < n; ++p) {
    const auto from = static_cast<std::size_t>(order[p]);
    internal_[from] = static_cast<std::int32_t>(p);
    input_[p] = order[p];
    alive_[p / 8] |= static_cast<std::uint8_t>(1u << (p % 8));
    for (std::size_t c = 0; c < 3; ++c) positions_[4 * p + c] = positions[from][c];
    positions_[4 * p + 3] = volumes[from];
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
  return (internal_.size() + input_.size()) * sizeof(std::int32_t) + positions_.size() * sizeof(double) +
         alive_.size() + material_ids_.size() * sizeof(std::uint16_t);
}

}  // namespace perikit
