#pragma once
/// Bonds that weaken from one equilibrium to the next at the same load.

#include <map>
#include <vector>

#include "families/bonds.hpp"

namespace perikit {

/// Weakened bonds let equilibrium move, which weakens them again, by less each time: integrities fall as b* + c rho^n, and near
/// the limit of stability rho is close to 1. Once a bond has fallen twice, by ratio rho < 1, half of what is still to come,
/// rho/(1 - rho) times the last fall, is taken at once [Aitken]. Where several such series add up, their ratio grows from fall to
/// fall, so that this is less than what is to come; integrities never rise, and what is taken too much would be lost.
class AitkenAcceleration {
 public:
  /// Share of an integrity that a forecast leaves at least: no bond fails by one.
  static constexpr double least_left = 0.5;

  /// The bonds that fell in this round, to what: some of them fall further. from: their integrity before it.
  void accelerate(std::vector<BondChange>& changes, const std::vector<double>& from);
  /// Those of them whose falls form such a series and leave something: how far it goes is for others to say.
  std::vector<BondId> settling(const std::vector<BondChange>& changes, const std::vector<double>& from);
  void forget() {
    last_.clear();
    rounds_ = 0;
  }

 private:
  /// Falls over those in the last round, which these are from now on; 1 where a bond did not fall in it.
  std::vector<double> ratios(const std::vector<BondChange>& changes, const std::vector<double>& from);

  /// Slower series may be none that ends.
  double most_ratio() const noexcept;

  std::map<BondId, double> last_;  ///< fall in the last round, of bonds that fell undisturbed
  int rounds_ = 0;                 ///< at this load
};

}  // namespace perikit
