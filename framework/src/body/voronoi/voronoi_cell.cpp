#include "body/voronoi/voronoi_cell.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <voro++/voro++.hh>

namespace perikit {

VoronoiCell::VoronoiCell(int dimension, const Point& lower, const Point& upper, double unit)
    : dimension_(dimension), lower_(lower), upper_(upper), unit_(unit) {
  if (dimension > 1) cell_ = std::make_unique<voro::voronoicell_neighbor>();
}

VoronoiCell::~VoronoiCell() = default;

void VoronoiCell::begin(const Point& x) {
  point_ = x;
  begin_ = lower_[0];
  end_ = upper_[0];
  before_ = behind_ = -1;
  if (cell_) {
    Point low{-0.5, -0.5, -0.5}, high{0.5, 0.5, 0.5};
    for (std::size_t c = 0; c < static_cast<std::size_t>(dimension_); ++c) {
      low[c] = (lower_[c] - x[c]) / unit_;
      high[c] = (upper_[c] - x[c]) / unit_;
    }
    cell_->init(low[0], high[0], low[1], high[1], low[2], high[2]);
  }
  find_corners();
}

void VoronoiCell::begin(const Point& x, std::span<const Point> corners) {
  point_ = x;
  clear();
  for (const Point& corner : corners) add_corner(corner);
}

void VoronoiCell::add_corner(const Point& v) {
  corners_.push_back({v, v[0] * v[0] + v[1] * v[1] + v[2] * v[2]});
  farthest_ = std::max(farthest_, corners_.back().square);
}

void VoronoiCell::clear() {
  corners_.clear();
  farthest_ = 0;
}

void VoronoiCell::find_corners() {
  clear();
  if (!cell_) {
    add_corner({(begin_ - point_[0]) / unit_, 0, 0});
    add_corner({(end_ - point_[0]) / unit_, 0, 0});
    return;
  }
  cell_->vertices(vertices_);
  for (std::size_t v = 0; v + 2 < vertices_.size(); v += 3) {
    // The lower side of the slab is as the upper one.
    if (dimension_ == 2 && vertices_[v + 2] < 0) continue;
    add_corner({vertices_[v], vertices_[v + 1], dimension_ == 2 ? 0.0 : vertices_[v + 2]});
  }
}

bool VoronoiCell::cut_by(const Point& y) const noexcept {
  Point d{};
  double square = 0;
  for (std::size_t c = 0; c < static_cast<std::size_t>(dimension_); ++c) {
    d[c] = (y[c] - point_[c]) / unit_;
    square += d[c] * d[c];
  }
  return std::ranges::any_of(corners_, [&](const Corner& corner) {
    const Point& v = corner.from_point;
    return 2 * (v[0] * d[0] + v[1] * d[1] + v[2] * d[2]) > square;
  });
}

/// A point cuts the cell where it lies nearer to a corner than the cell's own point does.
bool VoronoiCell::cut_from(const Point& low, const Point& high) const noexcept {
  Point from{}, to{};
  for (std::size_t c = 0; c < static_cast<std::size_t>(dimension_); ++c) {
    from[c] = (low[c] - point_[c]) / unit_;
    to[c] = (high[c] - point_[c]) / unit_;
  }
  return std::ranges::any_of(corners_, [&](const Corner& corner) {
    double square = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double gap = std::max({0.0, from[c] - corner.from_point[c], corner.from_point[c] - to[c]});
      square += gap * gap;
    }
    return square <= corner.square * (1 + 1e-9);
  });
}

void VoronoiCell::cut(const Point& y, std::int32_t number) {
  if (!cut_by(y)) return;
  if (!cell_) {
    const double middle = 0.5 * (point_[0] + y[0]);
    if (y[0] > point_[0])
      end_ = middle, behind_ = number;
    else
      begin_ = middle, before_ = number;
    find_corners();
    return;
  }
  Point d{};
  for (std::size_t c = 0; c < static_cast<std::size_t>(dimension_); ++c) d[c] = (y[c] - point_[c]) / unit_;
  if (cell_->nplane(d[0], d[1], d[2], d[0] * d[0] + d[1] * d[1] + d[2] * d[2], number))
    find_corners();
  else
    clear();
}

double VoronoiCell::size() {
  if (corners_.empty()) return 0;
  return cell_ ? cell_->volume() * std::pow(unit_, dimension_) : end_ - begin_;
}

std::vector<std::int32_t> VoronoiCell::neighbours() {
  std::vector<std::int32_t> numbers;
  if (corners_.empty()) return numbers;
  std::vector<int> across{before_, behind_};
  if (cell_) cell_->neighbors(across);
  std::ranges::copy_if(across, std::back_inserter(numbers),
                       [](int other) { return other >= 0; });  // sides of the box have negative numbers
  return numbers;
}

}  // namespace perikit
