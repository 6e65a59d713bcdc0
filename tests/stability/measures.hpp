#pragma once
/// How stable and how exact a kinematics is on a small body: eigenvalues of its tangent at rest, explicit runs beside the true
/// limit of the step, gradients of polynomial fields.

#include <memory>
#include <string>
#include <vector>

#include "plugin/registry.hpp"
#include "run/simulation.hpp"

namespace perikit::stability {

/// One combination. The body is a line of 40, a square of 11 x 11 or a cube of 5 x 5 x 5 points, free on all sides; uniaxial or
/// plane strain.
struct Setting {
  std::string label;       ///< "conventional + wan"
  std::string kinematics;  ///< its TOML table
  std::string influence;
  double horizon_ratio = 3.015, jitter = 0;
  int dimension = 3;
  int side = 0;  ///< points along each axis; 0: as above
};

/// Every kinematics with its first example, conventional with every stabilization, all influence functions, and the horizon
/// ratios and jitters of the suite in 1D, 2D and 3D.
std::vector<Setting> all_settings(Registry& registry);

/// Eigenvalues are those of the tangent at rest over the mass, to the largest one; rigid motions are left out.
struct Spectrum {
  double largest = 0;  ///< [1/s^2]
  double lowest = 0;
  double roughness = 0;         ///< of the lowest mode: 0 smooth, 1 neighbours move in opposite directions
  double lowest_rough = 0;      ///< lowest one of the modes of roughness 0.35 and more; 1 where there is none
  double estimate = 0;          ///< largest eigenvalue as `verlet` estimates it, over the true one
  std::size_t zero_modes = 0;   ///< relative eigenvalue below 1e-10
  std::size_t poor_points = 0;  ///< without a gradient of their own
};

/// Largest error of the gradient at points, relative to the gradient of the affine field, and to the second gradient times the
/// spacing. -1 for pair laws, which have none.
struct Accuracy {
  double affine = -1, quadratic_centre = -1, quadratic_surface = -1;
};

/// Total energy over a long run.
struct Drift {
  double largest_deviation = 0;  ///< from its mean over the first tenth of the run, relative
  double drift = 0;              ///< mean over the last tenth less that over the first one, relative
};

class Specimen {
 public:
  Specimen(Registry& registry, const Setting& setting);
  Spectrum spectrum();
  Accuracy accuracy();
  /// Largest kinetic energy over that at the start in an explicit run of `steps` steps of `share` of the true limit
  /// 2/sqrt(largest), from random velocities; infinite where the run fails.
  double growth(double largest, double share, std::int64_t steps) const;
  /// The total energy of such a run, which may fail: RunError.
  Drift endure(double largest, double share, std::int64_t steps) const;

 private:
  std::unique_ptr<Simulation> make(const std::string& integrator) const;
  std::unique_ptr<Simulation> shaken(double largest, double share, std::int64_t steps) const;
  Registry& registry_;
  Setting setting_;
  std::unique_ptr<Simulation> simulation_;
};

/// What `endure` is for: every kinematics at a ratio of 3.015 with gaussian influence, lattices and clouds of jitter 0.3; 40, 7 x
/// 7 and 4 x 4 x 4 points.
std::vector<Setting> long_settings(Registry& registry);

/// A bar of 40 points that is held at one end, pulled and let go: a strain of 1 % in its first mode.
struct Vibration : Drift {
  double periods = 0;  ///< sign changes of the end's displacement, halved
};
Vibration vibrate(Registry& registry, const std::string& kinematics, std::int64_t steps);

}  // namespace perikit::stability
