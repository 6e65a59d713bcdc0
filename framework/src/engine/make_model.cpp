#include "cloud_model.hpp"
#include "lattice_model.hpp"
#include "pair_model.hpp"
#include "weighted_model.hpp"

namespace perikit {

namespace {

template <int D>
std::unique_ptr<Model> make(const ModelParts& parts) {
  const KinematicsTraits traits = parts.kinematics->traits();
  if (traits.at == EvaluationPoints::pairs) return std::make_unique<PairModel<D>>(parts);
  // Point gradients of higher order are stencils like any other.
  if (traits.at == EvaluationPoints::weighted || (traits.at == EvaluationPoints::points && traits.order > 1)) return std::make_unique<WeightedModel<D>>(parts);
  if (parts.body->lattice()) return std::make_unique<LatticeModel<D>>(parts);
  return std::make_unique<CloudModel<D>>(parts);
}

}  // namespace

std::unique_ptr<Model> make_model(const ModelParts& parts) {
  switch (parts.body->dimension()) {
    case 1: return make<1>(parts);
    case 2: return make<2>(parts);
    default: return make<3>(parts);
  }
}

}  // namespace perikit
