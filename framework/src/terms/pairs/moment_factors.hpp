#pragma once
#include <algorithm>

#include "terms/pairs/bond_factors.hpp"

namespace perikit {

/// What is asked of fourth moments: sum_j V_j w_ij f_ij n (x) n (x) n (x) n is isotropic and has the trace t at all points. w(|xi|, omega) is omega |xi|^2 where the
/// law has a dilatation, of springs alone w''(0) |xi|^2 with unit modulus.
struct MomentTarget {
  std::vector<double> weight;   ///< w of the bonds of a whole family of a regular lattice [m^2 times the units of either]
  double trace = 0;             ///< t
};

/// w of n bonds, from arrays that can be read up to padded(n); weight is written so far too.
void moment_weights(const PairKinematics& law, bool dilates, int n, const double* length, const double* omega, double* weight);

template <int D>
void lattice_factors(const Families& families, const MomentTarget& target, const PointCopies& copies, BondFactors& out);
template <int D>
void cloud_factors(const Families& families, const PairKinematics& law, const MomentTarget& target, const PointCopies& copies, BondFactors& out);

/// No bond has less than this share of its stiffness: points that hang by few bonds stay where they are, and bonds whose failure is watched hold something.
inline constexpr double least_factor = 0.1;
/// Nor more than this on clouds and where several sides of a lattice meet: no positive factors give such points their moments, and the stiff bonds that come nearest shorten stable steps to half.
/// One flat side of a lattice takes what it needs, 4.5 to 26, as it has its moments then.
inline constexpr double most_factor = 10;
/// Of the method of multipliers, over curvatures: of the first step, which tells points that can have their moments from those that cannot, and of the later ones.
inline constexpr double first_multiplier_shift = 1e-2, later_multiplier_shift = 1e-6;
/// Points whose moments are still off by more than this after the first step cannot have them, and sites of lattices that are off by more than the second after a later one.
inline constexpr double first_allowed = 5e-2, later_allowed = 1e-3;
/// Points whose moments are off by more than this are counted.
inline constexpr double moment_tolerance = 1e-9;

/// Points whose moments are off by more than this are worth a word.
inline constexpr double moment_doubt = 1e-2;

/// What this rank found of its points.
struct FactorsFound {
  std::int64_t points = 0, off = 0, far_off = 0;
  double worst = 0, smallest = 1, largest = 1;
  std::int32_t where = -1;
  void add(std::int32_t point, double error) noexcept {
    ++points;
    off += error > moment_tolerance;
    far_off += error > moment_doubt;
    if (error <= worst) return;
    worst = error;
    where = point;
  }
  void add(double factor) noexcept {
    smallest = std::min(smallest, factor);
    largest = std::max(largest, factor);
  }
};
/// The same of all ranks, which must all call it.
void judge_factors(const Body& body, const FactorsFound& found, BondFactors& out);

}  // namespace perikit
