#pragma once
/// External forces on points.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "perikit/problem/image_map.hpp"
#include "perikit/problem/space_time_function.hpp"
#include "perikit/problem/surface_rule.hpp"

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
  std::shared_ptr<const SurfaceRule> rule = nullptr;  ///< of the same points and shares, where they share out a surface
};

/// A pressure p on a surface: force on a point = -p area, area its outward area vector in the reference. Where it follows the
/// deformed surface: -p cof F area, F the deformation gradient of the point (Nanson's formula: n da = cof F N dA).
struct Pressure {
  SpaceTimeFunction value;           ///< [Pa]
  std::vector<std::int32_t> points;  ///< internal indices
  std::vector<Point> area;           ///< of each point [m^2]
  bool follows = false;
  std::array<std::shared_ptr<const SurfaceRule>, 3> rules{};  ///< of the same points and one component of `area` each; null: p(x) area
};

class Loads {
 public:
  /// `body` and `images` (null: none) must outlive the loads. What falls on images acts on their sources too, with their sign.
  Loads(const Body& body, std::vector<Load> loads, std::vector<Pressure> pressures = {},
        const ImageMap* images = nullptr);

  bool any() const noexcept { return !loads_.empty() || !pressures_.empty(); }
  bool depend_on_time() const noexcept;
  /// Whether they depend on the displacement.
  bool follow() const noexcept;
  /// force <- loads at time (or load parameter) t [N], fully overwritten. H: gradients F - I by point (PointSamples); needed
  /// where loads follow.
  void evaluate(double t, FieldView force, const Field* H = nullptr) const;

 private:
  void add_following(const Pressure& pressure, std::span<const Point> reference, const Field& H, FieldView force) const;

  const Body* body_;
  std::vector<Load> loads_;
  std::vector<Pressure> pressures_;
  const ImageMap* images_;
};

}  // namespace perikit
