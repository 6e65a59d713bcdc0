#include "body/near_ranks.hpp"

namespace perikit {

Bounds bounds_of(const Body& body) {
  const Point first = body.position(static_cast<std::size_t>(body.internal().front()));
  Bounds bounds{first, first};
  for (const std::int32_t p : body.internal()) {
    const Point x = body.position(static_cast<std::size_t>(p));
    for (std::size_t a = 0; a < 3; ++a) {
      bounds.low[a] = std::min(bounds.low[a], x[a]);
      bounds.high[a] = std::max(bounds.high[a], x[a]);
    }
  }
  return bounds;
}

double total_of(const Body& body, const ExactSum& sum) {
  return body.part() ? total_over_ranks(sum) : sum.value();
}

}  // namespace perikit
