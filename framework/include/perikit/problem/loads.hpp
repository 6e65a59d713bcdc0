#pragma once
/// External forces on points.

#include <cstdint>
#include <vector>

#include "perikit/problem/image_map.hpp"
#include "perikit/problem/space_time_function.hpp"

namespace perikit {

/// Values by component on points that share them: force on a point = share * value.
struct Load {
  struct Component {
    int component = 0;
    SpaceTimeFunction value;
  };
  std::vector<Component> components;
  std::vector<std::int32_t> points;  ///< internal indices
  std::vector<double> share;         ///< of each point [N / unit of the value]
};

/// A pressure p on the deformed surface: force on a point = -p cof F area, F its deformation gradient and area its outward area
/// vector in the reference (Nanson's formula: n da = cof F N dA).
struct FollowingPressure {
  SpaceTimeFunction value;           ///< [Pa]
  std::vector<std::int32_t> points;  ///< internal indices
  std::vector<Point> area;           ///< of each point [m^2]
};

class Loads {
 public:
  /// `body` and `images` (null: none) must outlive the loads. What falls on images acts on their sources too, with their sign.
  Loads(const Body& body, std::vector<Load> loads, std::vector<FollowingPressure> pressures = {},
        const ImageMap* images = nullptr);

  bool any() const noexcept { return !loads_.empty() || follow(); }
  bool depend_on_time() const noexcept;
  /// Whether they depend on the displacement.
  bool follow() const noexcept { return !pressures_.empty(); }
  /// force <- loads at time (or load parameter) t [N], fully overwritten. H: gradients F - I by point (PointSamples); needed
  /// where loads follow.
  void evaluate(double t, FieldView force, const Field* H = nullptr) const;

 private:
  void add_pressures(double t, const Field& H, FieldView force) const;

  const Body* body_;
  std::vector<Load> loads_;
  std::vector<FollowingPressure> pressures_;
  const ImageMap* images_;
};

}  // namespace perikit
