#include "run/doubts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "perikit/core/communicator.hpp"

namespace perikit {

std::vector<std::string> doubts(const Scene& scene, const BodyProblem& problem) {
  std::vector<std::string> lines;
  const Body& body = problem.body();
  if (scene.random_points() && !scene.consistent.value_or(true) && problem.terms().has_gradients())
    lines.push_back(
        "a cloud with consistent = false in [family]: a constant stress is not in equilibrium on points that lie at random, and "
        "the body is too soft by 1 to 12 %, however fine it is");
  double farthest = 0;
  for (const std::int32_t p : body.internal())
    for (const double x : body.position(static_cast<std::size_t>(p))) farthest = std::max(farthest, std::abs(x));
  farthest = communicator().largest(farthest);
  const double rounding = std::numeric_limits<double>::epsilon() * farthest / body.spacing();
  if (scene.random_points() && rounding > 1e-8)
    lines.push_back(
        fmt::format("points {:.3g} m away from the origin: the position of a point rounds to {:.2g} of the spacing; allowed: points "
                    "near the origin",
                    farthest, rounding));
  for (int a = 0; a < body.dimension(); ++a) {
    const auto c = static_cast<std::size_t>(a);
    double low = body.position(static_cast<std::size_t>(body.internal()[0]))[c],
           high = low;  // with images, which go on behind sides
    for (const std::int32_t p : body.internal()) {
      low = std::min(low, body.position(static_cast<std::size_t>(p))[c]);
      high = std::max(high, body.position(static_cast<std::size_t>(p))[c]);
    }
    low = -communicator().largest(-low);
    high = communicator().largest(high);
    const double extent = high - low + body.spacing();
    if (extent >= body.horizon()) continue;
    lines.push_back(
        fmt::format("the body is {:.6g} m thick along {}, less than the horizon, {:.6g} m: no point has half of a family across",
                    extent, "xyz"[a], body.horizon()));
  }
  return lines;
}

}  // namespace perikit
