// Voronoi cells of points that no rank has as a whole. Points go to those who own their places along a curve. A rank knows what
// lies no farther than some spacings from its own points, which is enough for most cells. Cells at holes and at the sides of a
// body reach far: of these, cut by what is known, ranks are asked which of their points might cut them, too.
#include <algorithm>
#include <limits>
#include <utility>

#include "body/partition/cloud_shares.hpp"
#include "body/partition/near_ranks.hpp"
#include "body/points/cell_search.hpp"
#include "body/voronoi/voronoi.hpp"

namespace perikit {

namespace {

/// All points no farther than this from those of the rank, which come first. All ranks must call it.
VoronoiPoints points_around(const CloudShares& shares, double known) {
  VoronoiPoints points;
  const auto add = [&](std::span<const CloudShares::OnePoint> more) {
    for (const CloudShares::OnePoint& point : more) {
      points.x.push_back(point.x);
      points.number.push_back(point.number);
    }
  };
  add(shares.own());
  std::vector<std::int64_t> blocks = shares.blocks_around(shares.own(), known);
  std::erase_if(blocks, [&](std::int64_t block) { return shares.pieces().owner_of_block(block) == communicator().rank(); });
  for (const auto& [block, of_block] : shares.fetch(blocks)) add(of_block);
  return points;
}

/// A cell as ranks are asked about it: which one it is, its point, and its corners, in a row of numbers.
void append_cell(std::size_t n, const Point& x, const VoronoiCell& cell, std::vector<double>& to) {
  to.push_back(static_cast<double>(n));
  to.push_back(static_cast<double>(cell.corners().size()));
  to.insert(to.end(), x.begin(), x.end());
  for (const VoronoiCell::Corner& corner : cell.corners())
    to.insert(to.end(), corner.from_point.begin(), corner.from_point.end());
}

/// A point that might cut the n-th cell of another rank.
struct Further {
  std::int64_t n, number;
  Point x;
};

class SharedSearch {
 public:
  SharedSearch(const VoronoiBox& box, const CloudShares& shares, double known)
      : box_(box),
        known_(known),
        count_(shares.own().size()),
        points_(points_around(shares, known)),
        tree_(points_.x),
        bounds_(told_to_all(bounds_of_own())) {}

  SharedCells find(bool neighbours) {
    VoronoiCells cells = room_for_cells(count_, neighbours);
    std::vector<std::uint8_t> unsure(count_, 0);
    with_searches(
        count_,
        [&](CellSearch& search, std::size_t n) {
          VoronoiCell& cell = search.find(static_cast<std::int32_t>(n));
          unsure[n] = search.unsure(cell);
          if (!unsure[n]) keep_cell(cell, n, cells);
        },
        box_, points_, tree_, known_);
    std::vector<std::size_t> again;
    for (std::size_t n = 0; n < count_; ++n)
      if (unsure[n]) again.push_back(n);
    find_further(again, cells);
    return {std::move(cells), std::move(points_.x), std::move(points_.number)};
  }

 private:
  std::vector<Bounds> bounds_of_own() const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    Bounds bounds;
    bounds.low.fill(infinity);
    bounds.high.fill(-infinity);
    for (std::size_t n = 0; n < count_; ++n) bounds.add(points_.x[n]);
    return gathered<Bounds>({&bounds, 1});
  }

  /// The cells that what lies farther away might cut.
  void find_further(const std::vector<std::size_t>& again, VoronoiCells& cells) {
    std::vector<Further> further = answers(questions(again));
    std::ranges::stable_sort(further, {}, &Further::n);
    std::vector<std::int32_t> numbers;
    for (const Further& one : further) {
      numbers.push_back(static_cast<std::int32_t>(points_.x.size()));
      points_.x.push_back(one.x);
      points_.number.push_back(one.number);
    }
    with_searches(
        again.size(),
        [&](CellSearch& search, std::size_t k) {
          const auto n = static_cast<std::int64_t>(again[k]);
          const auto first = std::ranges::lower_bound(further, n, {}, &Further::n), last = std::ranges::upper_bound(further, n, {}, &Further::n);
          const auto of_cell = std::span(numbers).subspan(static_cast<std::size_t>(first - further.begin()),
                                                          static_cast<std::size_t>(last - first));
          keep_cell(search.find(static_cast<std::int32_t>(n), of_cell), again[k], cells);
        },
        box_, points_, tree_, known_);
  }

  /// By rank: the cells that points there might cut.
  std::vector<std::vector<double>> questions(const std::vector<std::size_t>& again) const {
    struct Question {
      std::vector<double> cell;
      std::vector<std::size_t> ranks;
    };
    std::vector<Question> questions(again.size());
    with_searches(
        again.size(),
        [&](CellSearch& search, std::size_t k) {
          const VoronoiCell& cell = search.find(static_cast<std::int32_t>(again[k]));
          for (std::size_t r = 0; r < bounds_.size(); ++r)
            if (cell.cut_from(bounds_[r].low, bounds_[r].high)) questions[k].ranks.push_back(r);
          append_cell(again[k], points_.x[again[k]], cell, questions[k].cell);
        },
        box_, points_, tree_, known_);
    std::vector<std::vector<double>> asked(bounds_.size());
    for (const Question& question : questions)
      for (const std::size_t r : question.ranks) asked[r].insert(asked[r].end(), question.cell.begin(), question.cell.end());
    return asked;
  }

  /// From all ranks.
  std::vector<Further> answers(const std::vector<std::vector<double>>& asked) const {
    const CellSearch search(box_, points_, tree_, known_);
    std::vector<std::vector<Further>> found(asked.size());
    const std::vector<std::vector<double>> asked_here = exchanged(asked);
    for (std::size_t r = 0; r < found.size(); ++r) answer(search, asked_here[r], found[r]);
    std::vector<Further> all;
    for (const std::vector<Further>& of_rank : exchanged(found)) all.insert(all.end(), of_rank.begin(), of_rank.end());
    return all;
  }

  void answer(const CellSearch& search, const std::vector<double>& asked, std::vector<Further>& found) const {
    VoronoiCell cell(box_.dimension, box_.lower, box_.upper, box_.unit);
    std::vector<std::int32_t> points;
    for (auto next = asked.begin(); next != asked.end();) {
      const auto n = static_cast<std::int64_t>(*next++);
      std::vector<Point> corners(static_cast<std::size_t>(*next++));
      const auto read = [&](Point& x) {
        for (double& value : x) value = *next++;
      };
      Point x{};
      read(x);
      std::ranges::for_each(corners, read);
      cell.begin(x, corners);
      points.clear();
      search.over_further(x, cell, static_cast<std::int32_t>(count_), points);
      for (const std::int32_t p : points)
        found.push_back({n, points_.number[static_cast<std::size_t>(p)], points_.x[static_cast<std::size_t>(p)]});
    }
  }

  VoronoiBox box_;
  double known_;
  std::size_t count_;  ///< of the rank's own points
  VoronoiPoints points_;
  PlaceTree tree_;
  std::vector<Bounds> bounds_;  ///< of the points of each rank
};

}  // namespace

SharedCells shared_voronoi_cells(const std::vector<Point>& run, int dimension, const Point& lower, const Point& upper,
                                 bool neighbours) {
  const VoronoiBox box(dimension, lower, upper, counted(std::ssize(run)).all);
  constexpr double most = 3;  // spacings; of points that are spread evenly nothing farther away cuts any
  const double known = most * box.unit;
  const SharedCloud shares({run, std::vector<double>(run.size(), 0.0)}, known);
  return SharedSearch(box, shares, known).find(neighbours);
}

}  // namespace perikit
