#include "spaces/cloud/cloud_bonds.hpp"
#include "spaces/cloud/cloud_points.hpp"
#include "spaces/lattice/lattice_bonds.hpp"
#include "spaces/lattice/lattice_points.hpp"
#include "spaces/weighted/weighted.hpp"

namespace perikit {

template <int D>
std::unique_ptr<EvaluationSpace> make_space(const SpaceParts& parts) {
  const bool lattice = parts.families.lattice() != nullptr;
  if (parts.formulation.bond) {
    if (lattice) return std::make_unique<LatticeBonds<D>>(parts);
    return std::make_unique<CloudBonds<D>>(parts);
  }
  // Point gradients of higher order are stencils like any other.
  if (parts.formulation.weighted || parts.formulation.order > 1) return std::make_unique<Weighted<D>>(parts);
  if (lattice) return std::make_unique<LatticePoints<D>>(parts);
  return std::make_unique<CloudPoints<D>>(parts);
}

template std::unique_ptr<EvaluationSpace> make_space<1>(const SpaceParts&);
template std::unique_ptr<EvaluationSpace> make_space<2>(const SpaceParts&);
template std::unique_ptr<EvaluationSpace> make_space<3>(const SpaceParts&);

}  // namespace perikit
