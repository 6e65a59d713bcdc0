#include <stdexcept>
#include <string>
#include <utility>

#include "model/kinematics_class.hpp"

namespace perikit {

namespace {

void read_traits(Formulation& f) {
  if (f.point) f.order = f.point->order();
  if (f.bond) {
    const BondTraits traits = f.bond->traits();
    f.order = traits.order;
    f.far_share = traits.base == BondBase::own ? 0.0 : traits.base == BondBase::mean ? 0.5 : traits.far_share;
    if (!(f.far_share >= 0 && f.far_share <= 1)) throw std::invalid_argument("its far_share is not between 0 and 1");
    if (traits.pair_symmetric && f.far_share != 0.5)
      throw std::invalid_argument("it is pair_symmetric with another base than the mean of both ends");
    f.weight = traits.weight;
    f.pair_symmetric = traits.pair_symmetric;
    f.g_from_xi_only = traits.g_from_xi_only;
  }
  if (f.weighted) {
    const WeightedTraits traits = f.weighted->traits();
    f.weight = traits.weight;
    f.part_weight = traits.part_weight;
    f.force_state = traits.force_state;
  }
  if (f.pairs) {
    f.pair_traits = f.pairs->traits();
    f.dilatation = f.pairs->dilatation();
  }
}

}  // namespace

Formulation kinematics_class(const Kinematics& kinematics) {
  Formulation f;
  const auto* const mapped = dynamic_cast<const MappedKinematics*>(&kinematics);
  if (mapped) f.map = mapped->map();
  const Kinematics& base = mapped ? mapped->base() : kinematics;
  f.point = dynamic_cast<const PointKinematics*>(&base);
  f.bond = dynamic_cast<const BondKinematics*>(&base);
  f.weighted = dynamic_cast<const WeightedKinematics*>(&base);
  f.pairs = dynamic_cast<const PairKinematics*>(&base);
  if (mapped && !f.bond && !f.weighted)
    throw std::invalid_argument("the base that it maps is neither a BondKinematics nor a WeightedKinematics");
  const int classes = (f.point != nullptr) + (f.bond != nullptr) + (f.weighted != nullptr) + (f.pairs != nullptr);
  if (classes != 1)
    throw std::invalid_argument(std::string(classes == 0 ? "it is none of" : "it is several of") +
                                " PointKinematics, BondKinematics, WeightedKinematics, PairKinematics and MappedKinematics");
  return f;
}

Formulation make_formulation(std::shared_ptr<const Kinematics> kinematics) {
  Formulation f = kinematics_class(*kinematics);
  read_traits(f);
  f.kinematics = std::move(kinematics);
  return f;
}

}  // namespace perikit
