/// Partition of a cloud that no rank has as a whole.

#include <algorithm>

#include "body/family_limit.hpp"
#include "body/images/cloud_images.hpp"
#include "body/partition/block_colours.hpp"
#include "body/partition/partition.hpp"
#include "core/each_once.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

/// Blocks that a rank has, with a mark for each point.
class KeptBlocks {
 public:
  using Marks = std::vector<std::uint8_t>;  ///< by point, along the curve

  /// The rank's own blocks.
  KeptBlocks(const BodyFrame& frame, const CloudShares& shares) : frame_(frame), shares_(shares) {
    const std::span<const CloudShares::OnePoint> own = shares.own();
    const auto size = static_cast<std::size_t>(shares.pieces().block());
    std::int64_t number = shares.pieces().block_of(shares.first_own());
    for (std::size_t at = 0; at < own.size(); at += size) {
      const auto block = own.subspan(at, std::min(size, own.size() - at));
      blocks_.emplace(number++, CloudShares::Points(block.begin(), block.end()));
    }
    put_in_order();
  }

  /// Also the blocks of whatever may lie within a radius of the marked points. All ranks must call it.
  void fetch_around(double radius, Marks& marks) {
    CloudShares::Points points;
    over_points([&](std::size_t p, std::int64_t, const CloudShares::OnePoint& point) {
      if (marks[p]) points.push_back(point);
    });
    fetch_around(points, radius, marks);
  }
  /// The same of other points. Marks points with these numbers, which ascend.
  void fetch(const CloudShares::Points& points, std::vector<std::int64_t> numbers, Marks& marks) {
    // Cubes around a place may begin a rounding away.
    fetch_around(points, 1e-6 * frame_.horizon, marks);
    std::ranges::sort(numbers);
    over_points([&](std::size_t p, std::int64_t, const CloudShares::OnePoint& point) {
      if (std::ranges::binary_search(numbers, point.number)) marks[p] = 1;
    });
  }
  void fetch_around(const CloudShares::Points& points, double radius, Marks& marks) {
    std::vector<std::int64_t> missing = shares_.blocks_around(points, radius);
    std::erase_if(missing, [&](std::int64_t block) { return blocks_.contains(block); });
    std::map<std::int64_t, Marks> of_block;
    std::size_t p = 0;
    for (const auto& [number, of] : blocks_) {
      const auto begin = marks.begin() + static_cast<std::ptrdiff_t>(p);
      of_block.emplace(number, Marks(begin, begin + std::ssize(of)));
      p += of.size();
    }
    blocks_.merge(shares_.fetch(missing));
    marks.clear();
    for (const auto& [number, of] : blocks_) {
      const auto known = of_block.find(number);
      const Marks here = known == of_block.end() ? Marks(of.size(), 0) : known->second;
      marks.insert(marks.end(), here.begin(), here.end());
    }
    put_in_order();
  }
  /// Lets go of blocks without a marked point.
  void keep(const Marks& marks) {
    std::size_t p = 0;
    std::erase_if(blocks_, [&](const auto& block) {
      const auto begin = marks.begin() + static_cast<std::ptrdiff_t>(p), end = begin + std::ssize(block.second);
      p += block.second.size();
      return std::find(begin, end, 1) == end;
    });
    put_in_order();
  }
  /// Marks of points that are marked, or in the family of one that is.
  Marks with_families(Marks marks) const {
    return perikit::with_families(rows_, points_, dimension(frame_.space), frame_.horizon, std::move(marks));
  }
  /// visit(p, place, point) along the curve.
  template <class Visit>
  void over_points(Visit&& visit) const {
    std::size_t p = 0;
    for (const auto& [number, of] : blocks_) {
      std::int64_t place = number * shares_.pieces().block();
      for (const CloudShares::OnePoint& point : of) visit(p++, place++, point);
    }
  }
  std::size_t points() const noexcept { return points_; }
  const AlignedVector<double>& rows() const noexcept { return rows_; }

 private:
  void put_in_order() {
    points_ = 0;
    for (const auto& [number, of] : blocks_) points_ += of.size();
    rows_.assign(4 * padded(points_), 0.0);
    over_points([&](std::size_t p, std::int64_t, const CloudShares::OnePoint& point) {
      std::ranges::copy(point.x, &rows_[4 * p]);
      rows_[4 * p + 3] = point.volume;
    });
  }

  const BodyFrame& frame_;
  const CloudShares& shares_;
  std::map<std::int64_t, CloudShares::Points> blocks_;
  std::size_t points_ = 0;
  AlignedVector<double> rows_;
};

}  // namespace

Partition::Partition(const BodyFrame& frame, const CloudShares& shares, const Reach& reach, const CloudImages* images) : frame_(frame) {
  const CurveShares& pieces = shares.pieces();
  for (int r = 0; r < communicator().size(); ++r) points_.push_back(pieces.first(r + 1) - pieces.first(r));
  const auto image = [&](const CloudShares::OnePoint& point) { return images && images->image(point.number); };
  const std::int64_t own_images = std::ranges::count_if(shares.own(), image);
  if (images && communicator().complete()) {
    std::ranges::fill(points_, 0);
    points_[static_cast<std::size_t>(communicator().rank())] = std::ssize(shares.own()) - own_images;
    communicator().sum(points_);
  }
  check_shares(static_cast<std::size_t>(images ? images->points() : pieces.points()));
  images_ = static_cast<std::size_t>(counted(own_images).all);
  KeptBlocks blocks(frame, shares);
  KeptBlocks::Marks reached(blocks.points(), 1);
  std::vector<std::int64_t> of_own;  // numbers of the images of own points
  if (images) {
    CloudShares::Points places;
    for (const CloudShares::OnePoint& point : shares.own())
      if (!image(point)) images->add(point, places);
    for (const CloudShares::OnePoint& place : places) of_own.push_back(place.number);
    std::ranges::sort(of_own);
    blocks.fetch(places, of_own, reached);
  }
  const double bond = search_radius(frame.horizon);
  // Of images that are there, the sources are, too. Whether any rank had to fetch some.
  const auto add_sources = [&] {
    if (!images) return false;
    std::vector<std::int64_t> here, sources, missing;
    blocks.over_points([&](std::size_t p, std::int64_t, const CloudShares::OnePoint& point) {
      if (reached[p]) image(point) ? sources.push_back(images->source(point.number)) : here.push_back(point.number);
    });
    std::ranges::sort(here);
    keep_each_once(sources);
    std::ranges::set_difference(sources, here, std::back_inserter(missing));
    blocks.fetch(images->sources(missing), missing, reached);
    return communicator().largest(missing.empty() ? 0 : 1) > 0;
  };
  const auto size = static_cast<std::size_t>(pieces.block());
  blocks.fetch_around((reach.bonds - 1) * bond, reached);
  for (int k = 1; k < reach.bonds; ++k) reached = blocks.with_families(std::move(reached));
  if (reach.blocks) fill_blocks(size, reached);
  if (reach.sources) add_sources();
  blocks.fetch_around(bond, reached);
  CloudPart& part = cloud_part_;
  std::vector<std::int64_t> near;  // places, ascending
  blocks.over_points([&](std::size_t p, std::int64_t place, const CloudShares::OnePoint&) {
    if (reached[p]) near.push_back(place);
  });
  reached = blocks.with_families(std::move(reached));
  do fill_blocks(size, reached);
  while (add_sources());
  blocks.keep(reached);
  part.places_of_all_ranks = pieces.points();
  part.points_of_all_ranks = images ? images->points() : pieces.points();
  blocks.over_points([&](std::size_t, std::int64_t place, const CloudShares::OnePoint& point) {
    part.places.push_back(place);
    part.numbers.push_back(point.number);
    part.roles.push_back(pieces.owner(place) == communicator().rank()             ? Role::own
                         : std::ranges::binary_search(of_own, point.number)       ? Role::image
                         : std::ranges::binary_search(near, place)                ? Role::near
                                                                                  : Role::far);
  });
  part.rows = blocks.rows();
}

}  // namespace perikit
