#pragma once
/// Factors f_ij on the bonds of a pair law, the same seen from both ends. A pair law counts on integrals over its family and has a sum over few bonds: with
/// f = 1 its stiffness is off inside of a lattice and near surfaces, and on a cloud a uniform strain is not in equilibrium. See 0033-bond-factors.md.

#include <cstdint>
#include <memory>
#include <vector>

#include "families/families.hpp"
#include "families/family_arrays.hpp"
#include "model/formulation.hpp"
#include "operators/report.hpp"
#include "perikit/model/kinematics.hpp"
#include "perikit/operators/laws.hpp"
#include "terms/pairs/point_copies.hpp"

namespace perikit {

struct BondFactors {
  /// Lattices: f [slot][lane of a group of eight points], and which of these tables each group has.
  std::vector<AlignedVector<double>> tables;
  std::vector<std::int32_t> table_of;
  std::vector<double> regular;      ///< by bond of a whole family of a regular lattice
  /// Clouds: f in the order of the lists of families.
  AlignedVector<double> by_bond;
  bool of_dilatation = false;       ///< weights of dilatations are omega f, too

  // What was found. Of all ranks.
  std::int64_t points = 0, off = 0, far_off = 0;   ///< points whose moments were asked for, those that do not have them, and those that are off by more than 1 %
  double inside = 0;                  ///< largest error of a moment inside of a lattice, over the weighted volume: what bonds so few and short can do
  double worst = 0;                   ///< largest error of a moment, over the weighted volume of a whole family
  Point where{};                      ///< there
  double smallest = 1, largest = 1;   ///< f of the bonds between points of the body
  int iterations = 0;
  double seconds = 0;

  bool empty() const noexcept { return tables.empty() && by_bond.empty(); }
  /// f of a bond that the set-up left; 1 without factors, and on clouds of bonds that a pre-crack cuts.
  double of(const Families& families, std::size_t p, std::size_t far) const;
  /// f of the bonds of a whole family of a regular lattice, in their order, of which a narrow body has some; 1 on clouds.
  double of_regular(std::size_t k) const noexcept { return regular.empty() ? 1.0 : regular[k]; }
  /// m_i = sum f omega |xi|^2 V over what is left of the bonds, without f where factors are not of the dilatation.
  double weighted_volume(const Families& families, std::size_t p, const FamilyArrays& family) const;
  /// Whether two points with equal families have equal factors for certain.
  bool same(std::size_t p, std::size_t q) const noexcept {
    return !tables.empty() && table_of[p / padding] == table_of[q / padding] && (table_of[p / padding] == 0 || p % padding == q % padding);
  }
  std::size_t bytes() const noexcept;
  void report(ModelReport& report) const;
};

/// Those that a pair law asks for (PairTraits::factors), without any where it asks for none. All ranks must call it.
std::shared_ptr<const BondFactors> find_bond_factors(const Formulation& formulation, const Families& families, const Laws& laws, const PointCopies& copies);

/// m = sum omega |xi|^2 V over what is left of the bonds, or over whole ones.
double weighted_volume(const FamilyArrays& family, bool whole);

/// f_ij >= floor so near 1 as fourth moments allow, and third ones inside of a cloud. All ranks must call it.
template <int D>
BondFactors moment_factors(const Families& families, const PairKinematics& law, const PointCopies& copies);

/// f_ij = sum_a n_a^2 (G_a,i + G_a,j)/2, G_a,i the stiffness of a whole family of a regular lattice against a homogeneous stretch along axis a over that of the family of i.
template <int D>
BondFactors energy_factors(const Families& families, const PairKinematics& law, const Laws& laws);

}  // namespace perikit
