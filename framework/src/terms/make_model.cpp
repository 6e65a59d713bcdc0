#include "spaces/cloud_model.hpp"
#include "spaces/lattice_model.hpp"
#include "spaces/local_force_model.hpp"
#include "terms/pair_model.hpp"
#include "terms/stabilized_model.hpp"
#include "spaces/weighted_model.hpp"

namespace perikit {

namespace {

/// A model, and its zero-energy penalty where there is one.
template <int D, class Base>
std::unique_ptr<Model> make_stabilized(const ModelParts& parts) {
  auto model = std::make_unique<Base>(parts);
  if (!parts.stabilization) return model;
  std::unique_ptr<ZeroEnergyPenalty> penalty;
  if constexpr (std::is_same_v<Base, WeightedModel<D>>)
    penalty = make_stencil_penalty<D>(parts);
  else
    penalty = make_penalty<D>(parts, *model);
  model->watch_bonds_of(*penalty);
  return std::make_unique<StabilizedModel>(std::move(model), std::move(penalty));
}

template <int D>
std::unique_ptr<Model> make(const ModelParts& parts) {
  const Formulation& formulation = parts.formulation;
  if (formulation.pairs) return std::make_unique<PairModel<D>>(parts);
  if (formulation.force_state == ForceState::local)
    return std::make_unique<LocalForceModel<D>>(parts, std::make_unique<WeightedModel<D>>(parts));
  // Point gradients of higher order are stencils like any other.
  if (formulation.weighted || (formulation.point && formulation.order > 1))
    return make_stabilized<D, WeightedModel<D>>(parts);
  if (parts.body->lattice()) return make_stabilized<D, LatticeModel<D>>(parts);
  return make_stabilized<D, CloudModel<D>>(parts);
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
