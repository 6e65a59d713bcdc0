#include "setup/body/partial_cells.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "setup/body/scene_lattice.hpp"
#include "setup/body/volumes.hpp"

namespace perikit {

namespace {

/// Cells with less of their volume inside have no point.
constexpr double least_share = 0.5;

class Cells {
 public:
  Cells(const Expression& inside, const Lattice& lattice, const Run& layers)
      : lattice_(lattice), cells_(input_cells(lattice)), layers_(layers), dimension_(lattice.dimension) {
    // What a layer gets from its neighbours they may give to theirs, too.
    const auto last = static_cast<std::size_t>(dimension_ - 1);
    high_ = cells_;
    low_[last] = std::max<std::int64_t>(0, layers.first - 2);
    high_[last] = std::min(cells_[last], layers.last + 2);
    each([&](const Index& k) { parts_.push_back(part_inside(inside, centre(k), lattice.spacing, dimension_)); });
  }

  PartialCells points() {
    const std::vector<PartOfCell> own = parts_;
    each([&](const Index& k) {
      const PartOfCell& part = own[at(k)];
      if (part.share == 0 || part.share >= least_share) return;
      const std::vector<std::size_t> heirs = nearest_points(own, k, part.centroid);
      for (const std::size_t heir : heirs) add(parts_[heir], {part.share / static_cast<double>(heirs.size()), part.centroid});
    });
    PartialCells points;
    each([&](const Index& k) {
      const std::int64_t layer = k[static_cast<std::size_t>(dimension_ - 1)];
      if (own[at(k)].share < least_share || layer < layers_.first || layer >= layers_.last) return;
      points.position.push_back(parts_[at(k)].centroid);
      points.volume.push_back(parts_[at(k)].share);
    });
    return points;
  }

 private:
  using Index = std::array<std::int64_t, 3>;

  /// In input order: x fastest.
  template <class Visit>
  void each(Visit&& visit) const {
    Index k{};
    for (k[2] = low_[2]; k[2] < high_[2]; ++k[2])
      for (k[1] = low_[1]; k[1] < high_[1]; ++k[1])
        for (k[0] = low_[0]; k[0] < high_[0]; ++k[0]) visit(k);
  }
  std::size_t at(const Index& k) const {
    const Index along{high_[0] - low_[0], high_[1] - low_[1], high_[2] - low_[2]};
    return static_cast<std::size_t>(((k[2] - low_[2]) * along[1] + k[1] - low_[1]) * along[0] + k[0] - low_[0]);
  }
  Point centre(const Index& k) const {
    std::array<std::int64_t, 3> inner{};
    for (std::size_t a = 0; a < 3; ++a) inner[a] = k[static_cast<std::size_t>(lattice_.axis[a])];
    return lattice_.position(lattice_.index(inner[0], inner[1], inner[2]));
  }

  /// Of the cells around that have a point, those whose parts lie nearest: several where rounding would choose among them.
  std::vector<std::size_t> nearest_points(const std::vector<PartOfCell>& own, const Index& k, const Point& x) const {
    struct Heir {
      std::size_t cell;
      double square;
    };
    std::vector<Heir> around;
    const auto ring = [&](int axis) { return axis < dimension_ ? 1 : 0; };
    for (std::int64_t dz = -ring(2); dz <= ring(2); ++dz)
      for (std::int64_t dy = -ring(1); dy <= ring(1); ++dy)
        for (std::int64_t dx = -ring(0); dx <= ring(0); ++dx) {
          const Index j{k[0] + dx, k[1] + dy, k[2] + dz};
          bool there = true;
          for (std::size_t a = 0; a < 3; ++a) there = there && j[a] >= low_[a] && j[a] < high_[a];
          if (!there || own[at(j)].share < least_share) continue;
          double square = 0;
          for (std::size_t c = 0; c < 3; ++c) square += (own[at(j)].centroid[c] - x[c]) * (own[at(j)].centroid[c] - x[c]);
          around.push_back({at(j), square});
        }
    std::vector<std::size_t> nearest;
    const double tie = 1e-6 * lattice_.spacing * lattice_.spacing;
    for (const Heir& heir : around)
      if (std::ranges::all_of(around, [&](const Heir& other) { return heir.square <= other.square + tie; })) nearest.push_back(heir.cell);
    return nearest;
  }

  static void add(PartOfCell& to, const PartOfCell& part) {
    const double sum = to.share + part.share;
    for (std::size_t c = 0; c < 3; ++c) to.centroid[c] += part.share / sum * (part.centroid[c] - to.centroid[c]);
    to.share = sum;
  }

  const Lattice& lattice_;
  Index cells_, low_{}, high_{};  ///< along the axes of the input: of the lattice, and those that are looked at
  Run layers_;
  int dimension_;
  std::vector<PartOfCell> parts_;
};

}  // namespace

PartialCells cells_inside(const Expression& inside, const Lattice& lattice, const Run& layers) {
  return Cells(inside, lattice, layers).points();
}

}  // namespace perikit
