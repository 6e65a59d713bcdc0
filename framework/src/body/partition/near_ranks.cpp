#include "body/partition/near_ranks.hpp"

namespace perikit {

Bounds bounds_of(const Body& body) {
  const Point first = body.position(static_cast<std::size_t>(body.internal().front()));
  Bounds bounds{first, first};
  for (const std::int32_t p : body.internal()) bounds.add(body.position(static_cast<std::size_t>(p)));
  return bounds;
}

double total_of(const Body& body, const ExactSum& sum) {
  return body.part() ? total_over_ranks(sum) : sum.value();
}

}  // namespace perikit
