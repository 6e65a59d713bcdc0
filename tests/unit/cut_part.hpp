#pragma once
/// A rank's part of a body, cut out of the whole body with all of it at hand: what the parts that ranks place by themselves must be like.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <tuple>
#include <utility>
#include <vector>

#include "body/partition/block_colours.hpp"
#include "body/partition/lattice_shares.hpp"
#include "body/partition/partition.hpp"
#include "body/points/cell_mask.hpp"
#include "body/points/curve.hpp"
#include "perikit/body/body.hpp"
#include "perikit/body/images.hpp"

namespace perikit::test {

/// Who owns the points of a body, by input number: whole blocks, of points and images.
inline std::vector<int> owners(const Body& whole, int ranks) {
  std::vector<int> owner;
  if (const Lattice* const lattice = whole.lattice()) {
    const LatticeTiling tiling(*lattice);
    std::vector<std::int64_t> points(static_cast<std::size_t>(tiling.tiles()), 0);
    for (const std::int32_t p : whole.owned()) ++points[static_cast<std::size_t>(tiling.number(tiling.of(lattice->cell(p))))];
    const LatticeShares shares(*lattice, std::move(points), ranks);
    for (const std::int32_t p : whole.internal()) owner.push_back(shares.owner(lattice->cell(p)));
  } else {
    const CurveShares pieces(static_cast<std::int64_t>(whole.points()), ranks);
    for (const std::int32_t p : whole.internal()) owner.push_back(pieces.owner(p));
  }
  return owner;
}

/// What the points of a body, and its images, are to a rank, by input number.
class CutRoles {
 public:
  /// sources: of the images, which have the last input numbers.
  CutRoles(const Body& whole, const std::vector<int>& owner, int rank, const Partition::Reach& reach, const std::vector<std::int32_t>& sources)
      : whole_(whole), sources_(sources), roles_(whole.points(), Role::absent) {
    for (std::size_t n = 0; n < owner.size(); ++n)
      if (owner[n] == rank) roles_[n] = Role::own;
    // Forces on images are forces on their sources.
    over_images([&](std::size_t image, std::size_t source) {
      if (roles_[source] == Role::own) roles_[image] = std::max(roles_[image], Role::image);
    });
    whole.lattice() ? keep_cells(reach) : keep_families(reach);
  }

  const std::vector<Role>& roles() const noexcept { return roles_; }
  /// Of a lattice: the box around all that is there, in whole chunks.
  const CellBox& box() const noexcept { return box_; }

 private:
  template <class Visit>
  void over_images(Visit&& visit) const {
    const std::size_t real = whole_.points() - sources_.size();
    for (std::size_t k = 0; k < sources_.size(); ++k) visit(real + k, static_cast<std::size_t>(sources_[k]));
  }

  /// Cells within reach of the box of the owned ones and of the images of these.
  void keep_cells(const Partition::Reach& reach) {
    const Lattice& lattice = *whole_.lattice();
    const LatticeTiling tiling(lattice);
    const auto group = static_cast<std::int64_t>(padding);
    const auto cell = [&](std::size_t n) { return lattice.cell(whole_.internal()[n]); };
    CellMask mask({}, lattice.extent);
    CellBox own{lattice.extent, {}};
    for (std::size_t n = 0; n < roles_.size(); ++n) {
      if (roles_[n] != Role::own) continue;
      const auto k = cell(n);
      for (std::size_t a = 0; a < 3; ++a) own.low[a] = std::min(own.low[a], k[a]), own.high[a] = std::max(own.high[a], k[a] + 1);
    }
    mask.add(own.low, own.high);
    for (std::size_t n = 0; n < roles_.size(); ++n)
      if (roles_[n] == Role::image) mask.add(cell(n));
    const auto bond = static_cast<std::int64_t>(std::floor(whole_.horizon() / lattice.spacing * (1 + 1e-10)));
    const auto grow = [&](std::int64_t by) {
      for (std::size_t a = 0; a < static_cast<std::size_t>(lattice.dimension); ++a) mask.grow(a, by);
    };
    const auto keep = [&](Role role) {
      for (std::size_t n = 0; n < roles_.size(); ++n)
        if (mask.holds(cell(n))) roles_[n] = std::max(roles_[n], role);
    };
    // Of images that are there, the sources are, too.
    const auto add_sources = [&] {
      over_images([&](std::size_t image, std::size_t source) {
        if (mask.holds(cell(image))) mask.add(cell(source));
      });
    };
    grow((reach.bonds - 1) * bond);
    if (reach.blocks) mask.fill({tiling.size[0] * group, tiling.size[1], tiling.size[2]});
    if (reach.sources) add_sources();
    keep(Role::near);
    grow(bond);
    mask.fill({group, 1, 1});
    add_sources();
    keep(Role::far);
    std::tie(box_.low, box_.high) = mask.bounds();
    box_.low[0] = box_.low[0] / group * group;
    box_.high[0] = std::min(lattice.extent[0], (box_.high[0] + group - 1) / group * group);
  }

  /// Points that bonds lead to, in whole blocks.
  void keep_families(const Partition::Reach& reach) {
    std::vector<std::uint8_t> reached(whole_.points(), 0);  // by internal index
    const auto at = [&](std::size_t n) -> std::uint8_t& { return reached[static_cast<std::size_t>(whole_.internal()[n])]; };
    const auto mark = [&](Role role) {
      for (std::size_t n = 0; n < roles_.size(); ++n)
        if (at(n)) roles_[n] = std::max(roles_[n], role);
    };
    const auto step = [&] {
      reached = with_families(whole_.rows(), whole_.points(), whole_.dimension(), whole_.horizon(), std::move(reached));
    };
    for (std::size_t n = 0; n < roles_.size(); ++n) at(n) = roles_[n] >= Role::image;
    for (int k = 1; k < reach.bonds; ++k) step();
    if (reach.blocks) fill_blocks(whole_.block_points(), reached);
    // Of images that are there, the sources are, too. Whether any were not.
    const auto add_sources = [&] {
      bool more = false;
      over_images([&](std::size_t image, std::size_t source) {
        if (!at(image) || at(source)) return;
        at(source) = 1;
        more = true;
      });
      return more;
    };
    if (reach.sources) add_sources();
    mark(Role::near);
    step();
    do fill_blocks(whole_.block_points(), reached);
    while (add_sources());
    mark(Role::far);
  }

  const Body& whole_;
  const std::vector<std::int32_t>& sources_;
  std::vector<Role> roles_;
  CellBox box_;
};

/// The points with these roles; far ones have a material of their own, sets keep the rank's own points.
inline Body cut_body(const Body& whole, const CutRoles& cut, std::uint16_t far_material) {
  const std::vector<Role>& roles = cut.roles();
  LocalPart part;
  part.points_of_all_ranks = static_cast<std::int64_t>(whole.points_of_all_ranks());
  std::vector<std::int64_t> numbers;
  for (std::size_t n = 0; n < roles.size(); ++n)
    if (roles[n] != Role::absent) numbers.push_back(static_cast<std::int64_t>(n));
  const auto place = [&](std::int64_t n) { return whole.internal()[static_cast<std::size_t>(n)]; };
  if (!whole.lattice()) std::ranges::sort(numbers, {}, place);
  for (const std::int64_t n : numbers) {
    part.places.push_back(place(n));
    part.roles.push_back(roles[static_cast<std::size_t>(n)]);
  }
  part.numbers = numbers;
  const auto made = [&] {
    if (whole.lattice()) return Body(whole.frame(), *whole.lattice(), LatticePart{part, cut.box().low, cut.box().high}, far_material);
    AlignedVector<double> rows(4 * padded(numbers.size()), 0.0);
    for (std::size_t p = 0; p < numbers.size(); ++p) std::copy_n(&whole.rows()[4 * static_cast<std::size_t>(part.places[p])], 4, &rows[4 * p]);
    return Body(whole.frame(), CloudPart{part, std::move(rows), static_cast<std::int64_t>(whole.points())}, far_material);
  };
  Body body = made();
  std::vector<std::uint16_t> materials(body.material_ids().begin(), body.material_ids().end());
  for (const std::int32_t p : body.internal()) {
    const auto n = static_cast<std::size_t>(body.number(static_cast<std::size_t>(p)));
    if (roles[n] >= Role::near && !whole.material_ids().empty())
      materials[static_cast<std::size_t>(p)] = whole.material_ids()[static_cast<std::size_t>(whole.internal()[n])];
  }
  body.set_materials(std::move(materials));
  for (const auto& [name, members] : whole.sets()) {
    std::vector<std::int32_t> here;
    std::vector<std::int64_t> order;
    for (const std::int32_t p : members) {
      order.push_back(whole.input_of(static_cast<std::size_t>(p)));
      if (roles[static_cast<std::size_t>(order.back())] == Role::own) here.push_back(body.find(order.back()));
    }
    if (std::ranges::is_sorted(order)) order.clear();
    body.add_set(name, std::move(here), std::move(order));
  }
  return body;
}

/// A rank's part with its borders, as Partition has them.
struct CutPart {
  Body body;
  std::vector<std::int64_t> points;                       ///< of each rank, without images
  std::vector<std::vector<std::int32_t>> lent, borrowed;  ///< internal indices, by rank
};

/// The parts of all ranks. The whole body and the sources of its images must outlive it.
class Cut {
 public:
  Cut(const Body& whole, int ranks, const Partition::Reach& reach, const std::vector<std::int32_t>& sources) : whole_(whole), owner_(owners(whole, ranks)) {
    for (int rank = 0; rank < ranks; ++rank) roles_.emplace_back(whole, owner_, rank, reach, sources);
  }

  CutPart part(int rank, std::uint16_t far_material) const {
    const auto ranks = roles_.size();
    CutPart part{cut_body(whole_, roles_[static_cast<std::size_t>(rank)], far_material), std::vector<std::int64_t>(ranks, 0),
                 std::vector<std::vector<std::int32_t>>(ranks), std::vector<std::vector<std::int32_t>>(ranks)};
    for (std::size_t n = 0; n < owner_.size(); ++n) {
      const auto of = static_cast<std::size_t>(owner_[n]);
      const std::int32_t p = part.body.find(static_cast<std::int64_t>(n));
      part.points[of] += n < whole_.points_of_all_ranks();
      if (owner_[n] != rank && p >= 0) part.borrowed[of].push_back(p);
      for (std::size_t other = 0; owner_[n] == rank && other < ranks; ++other)
        if (other != of && roles_[other].roles()[n] != Role::absent) part.lent[other].push_back(p);
    }
    return part;
  }

 private:
  const Body& whole_;
  std::vector<int> owner_;
  std::vector<CutRoles> roles_;
};

/// Those of the images of the whole body that a part of it has, by the numbers of the part.
inline Images images_of_part(const Images& images, const Body& part) {
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
  for (HeldPoint held : images.held) {
    held.point = here[static_cast<std::size_t>(held.point)];
    if (std::ranges::find(found.source, held.point) != found.source.end()) found.held.push_back(held);
  }
  return found;
}

}  // namespace perikit::test
