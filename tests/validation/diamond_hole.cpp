/// Plate with a diamond-shaped hole of Roy Chowdhury et al., section 5.2: who oscillates along the line AB.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/validation/quasi_static.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// High-frequency part of u_x along AB: root mean square of (u_(k-1) - 2 u_k + u_(k+1))/4, which keeps a sawtooth and drops what
/// is smooth, over the displacement of the edges.
double roughness(const std::string& kinematics, double ratio, int points) {
  const auto simulation = load(
      "chowdhury/diamond_hole.toml",
      {"kinematics.type=" + kinematics, fmt::format("family.horizon_ratio={}", ratio), fmt::format("constants.n={}", points)});
  CHECK(run(*simulation).reports.back().residual <= 1e-8);
  const double* u = simulation->problem().state().displacement().component(0);
  const std::vector<std::int32_t>& line = simulation->problem().body().set("AB");
  double sum = 0;
  for (std::size_t k = 1; k + 1 < line.size(); ++k) {
    const double part = (u[line[k + 1]] - 2 * u[line[k]] + u[line[k - 1]]) / 4;
    sum += part * part;
  }
  return std::sqrt(sum / static_cast<double>(line.size() - 2)) / 1e-8;
}

}  // namespace

TEST_CASE("diamond hole: sub_horizon is smooth along AB, conventional is not") {
  struct Row {
    double ratio;               // horizon over the diagonal of a cell
    double smooth, oscillates;  // bounds of the high-frequency part: of our own, as the paper's Fig. 9 has curves only
  };
  for (const Row row : {Row{1.1, 0.0015, 0.008}, Row{2.1, 0.005, 0.5}, Row{3.1, 0.005, 0.5}}) {
    INFO("horizon over the diagonal of a cell ", row.ratio);
    const double sub = roughness("sub_horizon", row.ratio * std::sqrt(2.0), 40),
                 conventional = roughness("conventional", row.ratio * std::sqrt(2.0), 40);
    CHECK_MESSAGE(sub < row.smooth, "sub_horizon ", sub);
    CHECK_MESSAGE(conventional > row.oscillates, "conventional ", conventional);
  }
}
