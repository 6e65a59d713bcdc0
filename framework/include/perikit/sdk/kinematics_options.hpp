#pragma once
/// Parameters that kinematics share.

#include <string>

#include "perikit/model/kinematics.hpp"
#include "perikit/plugin/parameters.hpp"

namespace perikit {

/// weight = "kernel" | "volume": the share of a bond in its point's volume.
inline void add_bond_weight(ParameterTable& table, BondWeight usual) {
  const std::string first = usual == BondWeight::kernel ? "kernel" : "volume", second = usual == BondWeight::kernel ? "volume" : "kernel";
  table.choice("weight", {first, second}, "share of a bond in its point's volume: by " + std::string(usual == BondWeight::kernel ? "omega V or by V" : "V or by omega V"))
      .by_default("\"" + first + "\"");
}

inline BondWeight bond_weight(const ParameterValues& values) {
  return values.text("weight") == "kernel" ? BondWeight::kernel : BondWeight::volume;
}

/// order = 1 ... 8 of the point gradient. Roy Chowdhury et al. go to 8, where the moment matrices of whole families of five spacings lie just above the
/// limit below which a family takes a lower order: in 3D by a factor of 2 to 3.
inline void add_gradient_order(ParameterTable& table) {
  table.integer("order", "order of the point gradient: exact for polynomials up to this degree; families too small for it take a lower one")
      .by_default("1")
      .at_least(1)
      .at_most(8);
}

inline int gradient_order(const ParameterValues& values) {
  return static_cast<int>(values.integer("order"));
}

/// force_state = "variational" | "local".
inline void add_force_state(ParameterTable& table) {
  table.choice("force_state", {"variational", "local"}, "forces: the derivative of the energy, or the bond's own force state alone (not conservative, for comparison)")
      .by_default("\"variational\"");
}

inline ForceState force_state(const ParameterValues& values) {
  return values.text("force_state") == "local" ? ForceState::local : ForceState::variational;
}

}  // namespace perikit
