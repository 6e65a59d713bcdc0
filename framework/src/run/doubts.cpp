#include "run/doubts.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace perikit {

std::vector<std::string> doubts(const Scene& scene, const BodyProblem& problem) {
  std::vector<std::string> lines;
  const Body& body = problem.whole();
  if (scene.random_points() && !scene.consistent.value_or(true) && problem.terms().has_gradients())
    lines.push_back(
        "a cloud with consistent = false in [family]: a constant stress is not in equilibrium on points that lie at random, and "
        "the body is too soft by 1 to 12 %, however fine it is");
  for (int a = 0; a < body.dimension(); ++a) {
    const auto c = static_cast<std::size_t>(a);
    double low = body.position(static_cast<std::size_t>(body.internal()[0]))[c],
           high = low;  // with images, which go on behind sides
    for (const std::int32_t p : body.internal()) {
      low = std::min(low, body.position(static_cast<std::size_t>(p))[c]);
      high = std::max(high, body.position(static_cast<std::size_t>(p))[c]);
    }
    const double extent = high - low + body.spacing();
    if (extent >= body.horizon()) continue;
    lines.push_back(
        fmt::format("the body is {:.6g} m thick along {}, less than the horizon, {:.6g} m: no point has half of a family across",
                    extent, "xyz"[a], body.horizon()));
  }
  return lines;
}

}  // namespace perikit
