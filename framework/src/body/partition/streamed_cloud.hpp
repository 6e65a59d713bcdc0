#pragma once
/// A cloud for a rank without others that cannot have all of its points: it goes through them again and again, and keeps its own
/// piece of the curve.

#include <functional>

#include "body/partition/cloud_shares.hpp"

namespace perikit {

/// All points of a cloud, or those of a rank, in the order of the input; as often as it is called. Images come after their sources.
using PointStream = std::function<void(const std::function<void(const CloudShares::OnePoint&)>& visit)>;

struct CloudExtent {
  std::int64_t points = 0;
  Point lower{}, upper{};
  double volume = 0;
};
CloudExtent extent_of(const PointStream& all);

class StreamedCloud final : public CloudShares {
 public:
  StreamedCloud(PointStream all, const CloudExtent& extent, double cube);

  std::span<const OnePoint> own() const noexcept override { return own_; }
  std::map<std::int64_t, Points> fetch(const std::vector<std::int64_t>& blocks) const override;

 private:
  std::vector<std::int64_t> blocks_with(const std::vector<std::uint64_t>& keys) const override;
  /// visit(key, point) in the order of the input.
  template <class Visit>
  void over_points(Visit&& visit) const;
  /// The cubes that hold two places of the curve, and how many points come before them.
  struct Holder {
    std::int64_t place;
    std::uint64_t key = 0;
    std::int64_t before = 0;
  };
  void find_cubes(std::uint64_t largest, std::array<Holder, 2>& wanted) const;

  PointStream all_;
  Points own_;
  // The curve is cut at the cubes that were asked for last: slot 2 k + 1 is that of cube k, slot 2 k what lies before it.
  mutable std::vector<std::uint64_t> keys_;          ///< of these cubes
  mutable std::vector<std::int64_t> first_of_slot_;  ///< a place; of the slot after the last: how many points there are
};

}  // namespace perikit
