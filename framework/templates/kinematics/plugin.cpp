#include <memory>

#include "perikit/core/simd.hpp"
#include "perikit/kinematics.hpp"

using namespace perikit;

namespace {

/// YOUR PHYSICS: the stencil of a formulation with one evaluation point per bond,
///   H_b = A_b + (u_b - A_b xi) (x) g_b,   A_b = (Hbar_i + Hbar_j)/2 (BondBase::mean) or Hbar_i (BondBase::own).
/// The engine makes gradients, forces -dE/du and tangents of it. A kinematics can be one of three other classes instead
/// (perikit/model/kinematics.hpp), each with what it must state:
///
///   class PartName final : public PointKinematics {        // H_i = Hbar_i
///     int order() const noexcept override;                 // of the point gradient
///   };
///   class PartName final : public WeightedKinematics {     // H_q = (sum_k omega_q(k) V_k u_k (x) xi_k) K_q^-1
///     WeightedTraits traits() const noexcept override;
///     int parts(int dimension) const override;             // evaluation points per point; 0: one per bond
///     void weights(const FamilyView& family, double* omega, std::size_t stride) const noexcept override;   // omega_q(k)
///   };
///   class PartName final : public PairKinematics {         // E = sum V_i V_j w(e) + sum V_i phi(theta)
///     PairTraits traits() const noexcept override;
///     PairModuli moduli(const PairPoint& point) const noexcept override;      // from the small strain of the material
///     std::string warning(const PairPoint& point) const override;            // what the law cannot represent there, or nothing
///     void bond_law(const BondBatch& batch) const noexcept override;          // w and its derivatives
///     const DilatationLaw* dilatation() const noexcept override;              // phi and its derivatives; null: none
///   };
class PartName final : public BondKinematics {
 public:
  explicit PartName(BondWeight weight) : weight_(weight) {}

  BondTraits traits() const noexcept override {
    // pair_symmetric: g is odd in xi and the same for ij and ji; g_from_xi_only: it reads nothing else of the family.
    return {.base = BondBase::mean, .weight = weight_, .pair_symmetric = true, .g_from_xi_only = true};
  }

  /// Default: g = xi/|xi|^2, which makes the gradient exact along the bond.
  void correction(const FamilyView& family, double* g, std::size_t stride) const noexcept override {
    for (int k = 0; k < family.bonds; k += pack_width) {
      const Pack length = Pack::load(family.length + k), scale = 1.0 / (length * length);
      for (int c = 0; c < family.dimension; ++c) (Pack::load(family.xi[c] + k) * scale).store(g + c * stride + k);
    }
  }

 private:
  BondWeight weight_;
};

ParameterTable parameters() {
  ParameterTable table;
  table.choice("weight", {"kernel", "volume"}, "Share of a bond in its point's volume: by omega V or by V.").by_default("\"kernel\"");
  return table;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics({.name = "part_name",
                        .summary = "one line: what it is",
                        .parameters = parameters(),
                        // Every example is built and tested by the contract suite.
                        .examples = {"", "weight = \"volume\""},
                        .equations = "F_ij = Fa + (y_ij - Fa xi) (x) xi/|xi|^2, Fa = (F_i + F_j)/2",
                        .source = "the paper, with the number of the equation",
                        .limits = "where it must not be used"},
                       [](const ParameterValues& values, const PartFactory&) {
                         return std::make_unique<PartName>(values.text("weight") == "kernel" ? BondWeight::kernel : BondWeight::volume);
                       });
}
