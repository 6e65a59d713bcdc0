#pragma once
/// Finds the bonds that a criterion lets fail.

#include <cstddef>
#include <span>
#include <vector>

#include "families/bonds.hpp"
#include "perikit/model/configuration.hpp"

namespace perikit {

class BondFinder {
 public:
  virtual ~BondFinder() = default;
  /// Bonds whose integrity is lower here than it is now, in a fixed order. To be called in every step.
  virtual std::vector<BondChange> find(const Configuration& at) = 0;
  /// values[k] <- what the criterion compares with the limits of bonds[k], which are as they are now. Anywhere; with
  /// the very field of the last `find`, unchanged since, they are known.
  virtual void values(std::span<const BondId> bonds, const Configuration& at, std::span<double> values) = 0;
  /// Forgets what it knows of bonds that are far from failing: bonds were restored.
  virtual void forget() noexcept = 0;
  /// Groups of eight points that could be looked at in each step, and how many were in all of them.
  virtual std::size_t groups() const noexcept = 0;
  virtual std::size_t checked() const noexcept = 0;
  virtual std::size_t bytes() const noexcept = 0;
};

}  // namespace perikit
