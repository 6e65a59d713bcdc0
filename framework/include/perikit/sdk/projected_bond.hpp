#pragma once
/// Bond kinematics that are exact along each bond:
///   F_b = Fa + (y - Fa xi) (x) xi/|xi|^2,   Fa = (F_i + F_j)/2 or F_i, F_i the point gradient of order n.

#include <memory>

#include "perikit/core/simd.hpp"
#include "perikit/sdk/kinematics_options.hpp"

namespace perikit {

class ProjectedBond final : public BondKinematics {
 public:
  ProjectedBond(BondBase base, BondWeight weight, int order) : base_(base), weight_(weight), order_(order) {}

  BondTraits traits() const noexcept override {
    return {.order = order_,
            .base = base_,
            .weight = weight_,
            .pair_symmetric = base_ == BondBase::mean,
            .g_from_xi_only = true};
  }

  void correction(const FamilyView& family, double* g, std::size_t stride) const noexcept override {
    for (int k = 0; k < family.bonds; k += pack_width) {
      const Pack length = Pack::load(family.length + k), scale = 1.0 / (length * length);
      for (int c = 0; c < family.dimension; ++c) (Pack::load(family.xi[c] + k) * scale).store(g + static_cast<std::size_t>(c) * stride + k);
    }
  }

 private:
  BondBase base_;
  BondWeight weight_;
  int order_;
};

inline void add_projected_bond(ParameterTable& table, BondWeight usual) {
  add_gradient_order(table);
  add_bond_weight(table, usual);
}

inline std::unique_ptr<Kinematics> make_projected_bond(BondBase base, const ParameterValues& values) {
  return std::make_unique<ProjectedBond>(base, bond_weight(values), gradient_order(values));
}

}  // namespace perikit
