#pragma once
/// Areas of cracks from bonds that have failed.

#include <cstddef>
#include <vector>

namespace perikit {

class Families;

/// A plane cut through the inside of a body takes from each point near it a share s of the influence of its family, and the integral of s over the
/// body, per area of the cut, is c times the mean length of bonds, weighted by their influence: c is the mean of |cos| between a bond and the normal, 1
/// in one dimension, 2/pi in two and 1/2 in three. So failed bonds have made cracks of the area
///   A = sum V_i s_i / (c l_i),
/// with the share s_i that point i has lost in the run, its family without pre-cracks as the whole, and the mean length l_i in that family. What
/// pre-cracks took does not count. Needs no direction and no mesh of the crack; a cut along a lattice plane is off by as much as the family's bonds
/// are not spread evenly over all directions.
class CrackAreas {
 public:
  explicit CrackAreas(const Families& families);
  /// The part of point p, internal index [m^2], thickness and cross section included.
  double of(std::size_t p) const;

 private:
  const Families* families_;
  std::vector<double> factors_;   ///< by internal index: the area where all bonds that the set-up left have failed
};

}  // namespace perikit
