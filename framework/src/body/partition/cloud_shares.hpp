#pragma once
/// A cloud that no rank has as a whole, as a rank sees it that is to have a piece of the curve and what lies around it.

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "body/points/curve.hpp"
#include "body/points/point_file.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

class CloudShares {
 public:
  struct OnePoint {
    Point x;
    double volume;
    std::int64_t number;  ///< of the input
  };
  using Points = std::vector<OnePoint>;

  virtual ~CloudShares() = default;
  // All ranks must call what is here.
  const CurveShares& pieces() const noexcept { return pieces_; }
  /// The rank's own points in the order of the curve, and where they begin on it.
  virtual std::span<const OnePoint> own() const noexcept = 0;
  std::int64_t first_own() const noexcept { return pieces_.first(communicator().rank()); }
  /// The blocks, on whatever rank, that hold points of the cubes that a sphere around one of the points meets. Each once.
  std::vector<std::int64_t> blocks_around(std::span<const OnePoint> points, double radius) const;
  /// The points of blocks, whoever owns them: some of those that `blocks_around` has found last.
  virtual std::map<std::int64_t, Points> fetch(const std::vector<std::int64_t>& blocks) const = 0;

 protected:
  CloudShares(const CurveShares& pieces, const Curve& curve) : pieces_(pieces), curve_(curve) {}
  /// The blocks that hold points of cubes, by their keys, which ascend. Each once.
  virtual std::vector<std::int64_t> blocks_with(const std::vector<std::uint64_t>& keys) const = 0;

  CurveShares pieces_;
  Curve curve_;
};

/// Ranks bring points in the order of the input, and get those of their pieces of the curve.
class SharedCloud final : public CloudShares {
 public:
  /// mine: this rank's run of the points in the order of the input, after those of lower ranks, and then images with these numbers,
  /// which ascend. A rank without others brings all of them.
  SharedCloud(PointCloud mine, double cube, std::vector<std::int64_t> images = {});

  std::span<const OnePoint> own() const noexcept override;
  std::map<std::int64_t, Points> fetch(const std::vector<std::int64_t>& blocks) const override;

 private:
  std::vector<std::int64_t> blocks_with(const std::vector<std::uint64_t>& keys) const override;
  /// Where a piece begins.
  struct Start {
    std::uint64_t key;
    std::int64_t number;
  };
  struct Sorted;
  std::vector<Start> find_starts(const Sorted& mine) const;
  /// Who has the points from here on; a rank without others has all.
  std::size_t holder(const Start& at) const noexcept;
  std::size_t holder_of_block(std::int64_t block) const noexcept;
  std::span<const OnePoint> held_block(std::int64_t block) const noexcept;

  std::vector<Start> starts_;  ///< by rank
  // In the order of the curve: the rank's own points, or all where the others are not there.
  std::int64_t first_held_ = 0;
  Points held_;
  std::vector<std::uint64_t> keys_;
};

}  // namespace perikit
