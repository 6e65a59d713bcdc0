#pragma once
/// Places in a tree of boxes, each as small as what it holds allows.

#include <cstdint>
#include <span>
#include <vector>

#include "perikit/body/body.hpp"

namespace perikit {

class PlaceTree {
 public:
  struct Node {
    Point low, high;
    std::int32_t first, last;  ///< of the places that it holds
    std::int32_t second;       ///< child; the first one comes after the node itself. 0: it has none
  };
  explicit PlaceTree(std::span<const Point> places);

  /// The root comes first; none where there is no place.
  const std::vector<Node>& nodes() const noexcept { return nodes_; }
  /// Which of the places a node holds.
  std::span<const std::int32_t> places(const Node& node) const noexcept {
    return std::span(order_).subspan(static_cast<std::size_t>(node.first), static_cast<std::size_t>(node.last - node.first));
  }

 private:
  void add(std::span<const Point> places, std::int32_t first, std::int32_t last);

  std::vector<std::int32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace perikit
