#include "setup/body/size_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "perikit/core/memory.hpp"

namespace perikit {

namespace {

constexpr double most_points = 2.0e9;   // indices are 32 bit
constexpr double most_bonds = 65535;    // of one lattice family: slots are 16 bit
constexpr double largest_ball = 1.0e7;  // cells within the horizon, also of a body that is smaller than it

// The least that any model needs.
constexpr double bytes_a_shared_point = 130;  // while it is put in order
constexpr double bytes_a_lattice_point = 100, bytes_a_cloud_point = 200, bytes_a_cloud_bond = 4;

// What `conventional` takes, with the fields of an explicit run.
constexpr double bytes_a_likely_lattice_point = 330, bytes_a_likely_cloud_bond = 22;

/// Cells within the horizon.
double ball(int dimension, double ratio) {
  if (dimension == 1) return 2 * ratio;
  return dimension == 2 ? std::numbers::pi * ratio * ratio : 4.0 / 3.0 * std::numbers::pi * ratio * ratio * ratio;
}

const char* key_of(const Scene& scene) {
  return scene.body.lattice ? "body.lattice" : "body.points";
}

}  // namespace

void check_index(const Scene& scene, double cells) {
  if (cells > most_points) {
    throw InputError(
        scene.body.position, key_of(scene),
        fmt::format(
            "found about {:.3g} points; allowed: at most {:.3g} on a rank; explicit runs share it out (mpirun -np N perikit run)",
            cells, most_points));
  }
}

void check_horizon(const Scene& scene, double ratio) {
  const double cells = ball(scene.body.dimension, ratio);
  if (cells <= largest_ball) return;
  throw InputError(scene.body.position, "family",
                   fmt::format("found a horizon of {:.4g} spacings, about {:.3g} points within it; allowed: at most {:.3g}",
                               ratio, cells, largest_ball));
}

void check_memory(const Scene& scene, double cells, double ratio, bool cloud, bool part) {
  // Near surfaces families are smaller: an eighth at a corner.
  const double whole = std::min(ball(scene.body.dimension, ratio), cells - 1), family = cloud ? whole / 8 : whole;
  if (!cloud && whole > most_bonds) {
    throw InputError(scene.body.position, "family",
                     fmt::format("found a horizon of {:.4g} spacings, which gives families of about {:.3g} bonds; allowed: at "
                                 "most {:.0f} on a lattice",
                                 ratio, whole, most_bonds));
  }
  const double bytes = cells * (cloud ? bytes_a_cloud_point + family * bytes_a_cloud_bond : bytes_a_lattice_point),
               limit = memory_limit();
  if (bytes > limit) {
    throw InputError(scene.body.position, key_of(scene),
                     fmt::format("found about {:.3g} points{} with a horizon of {:.4g} spacings, which need {:.3g} GB or more; "
                                 "allowed: the {:.3g} GB that this machine offers",
                                 cells, part ? " on a rank" : "", ratio, bytes / 1e9, limit / 1e9));
  }
}

bool likely_held(int dimension, double cells, double ratio, bool cloud) {
  const double of_point =
      cloud ? std::min(ball(dimension, ratio), cells - 1) * bytes_a_likely_cloud_bond : bytes_a_likely_lattice_point;
  return cells * of_point <= memory_limit();
}

bool lone_rank_orders(double points) {
  return points * bytes_a_shared_point <= memory_limit();
}

}  // namespace perikit
