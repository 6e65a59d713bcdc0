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
  std::vector<std::int32_t> points;      ///< internal indices
  std::vector<double> share;             ///< of each point [N / unit of the value]
};

class Loads {
 public:
  /// `body` and `images` (null: none) must outlive the loads. What falls on images acts on their sources too, with their sign.
  Loads(const Body& body, std::vector<Load> loads, const ImageMap* images = nullptr);

  bool any() const noexcept { return !loads_.empty(); }
  bool depend_on_time() const noexcept;
  /// force <- loads at time (or load parameter) t [N], fully overwritten.
  void evaluate(double t, FieldView force) const;

 private:
  const Body* body_;
  std::vector<Load> loads_;
  const ImageMap* images_;
};

}  // namespace perikit
