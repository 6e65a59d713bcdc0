#include "size_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "perikit/core/memory.hpp"

namespace perikit {

namespace {

constexpr double most_points = 2.0e9;   // indices are 32 bit
constexpr double most_bonds = 65535;    // of one lattice family: slots are 16 bit

// The least that any model needs.
constexpr double bytes_a_lattice_point = 100, bytes_a_cloud_point = 200, bytes_a_cloud_bond = 4;

const char* key_of(const Scene& scene) { return scene.body.lattice ? "body.lattice" : "body.points"; }

}  // namespace

void check_index(const Scene& scene, double cells) {
  if (cells > most_points) {
    throw InputError(scene.body.position, key_of(scene), fmt::format("about {:.3g} points; at most {:.3g} are possible", cells, most_points));
  }
}

void check_memory(const Scene& scene, double cells, double ratio, bool cloud) {
  const std::array<double, 3> ball{2 * ratio, std::numbers::pi * ratio * ratio, 4.0 / 3.0 * std::numbers::pi * ratio * ratio * ratio};
  // Near surfaces families are smaller: an eighth at a corner.
  const double whole = std::min(ball[static_cast<std::size_t>(scene.body.dimension - 1)], cells - 1), family = cloud ? whole / 8 : whole;
  if (!cloud && whole > most_bonds) {
    throw InputError(scene.body.position, "family", fmt::format("a horizon of {:.4g} spacings gives families of about {:.3g} bonds; at most {:.0f} are possible on a lattice", ratio, whole, most_bonds));
  }
  const double bytes = cells * (cloud ? bytes_a_cloud_point + family * bytes_a_cloud_bond : bytes_a_lattice_point), limit = memory_limit();
  if (bytes > limit) {
    throw InputError(scene.body.position, key_of(scene), fmt::format("about {:.3g} points with a horizon of {:.4g} spacings need {:.3g} GB or more; this machine offers {:.3g} GB",
                                                           cells, ratio, bytes / 1e9, limit / 1e9));
  }
}

}  // namespace perikit
