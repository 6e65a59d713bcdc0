#include "assembly/block_rows.hpp"

#include "families/cloud/cloud_families.hpp"
#include "families/lattice/lattice_families.hpp"

namespace perikit {

BlockRows::BlockRows(const Families& families) : families_(families) {
  for (std::size_t p = 0; p < body().stride(); ++p)
    if (body().alive(p)) point_.push_back(static_cast<std::int32_t>(p));
  if (const CloudFamilies* cloud = families.cloud()) {
    cloud_lists_ = &cloud->lists();   // clouds have no padding in between: rows are field indices
    return;
  }
  const LatticeFamilies& f = *families.lattice();
  std::vector<std::int32_t> row_of(body().stride(), -1);
  for (std::size_t r = 0; r < size(); ++r) row_of[point(r)] = static_cast<std::int32_t>(r);
  lattice_lists_.first.push_back(0);
  for (const std::int32_t p : point_) {
    const LatticePattern& pattern = f.set_up_pattern(f.tiles.chunks[static_cast<std::size_t>(f.tiles.chunk_of(p))]);
    for (const std::uint16_t slot : f.slots.ascending)
      if (pattern.intact(slot, p % chunk_points)) lattice_lists_.neighbour.push_back(row_of[static_cast<std::size_t>(p + f.slots.shifts[slot])]);
    whole_.push_back(lattice_lists_.neighbour.size() - static_cast<std::size_t>(lattice_lists_.first.back()) == f.slots.size());
    lattice_lists_.first.push_back(static_cast<std::int64_t>(lattice_lists_.neighbour.size()));
  }
}

std::size_t BlockRows::bytes() const noexcept {
  return size() * sizeof(std::int32_t) + lattice_lists_.neighbour.size() * sizeof(std::int32_t) + lattice_lists_.first.size() * sizeof(std::int64_t) +
         whole_.size();
}

}  // namespace perikit
