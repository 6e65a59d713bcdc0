#include <memory>

#include "perikit/core/simd.hpp"
#include "perikit/kinematics.hpp"
#include "perikit/sdk/kinematics_options.hpp"

using namespace perikit;

namespace {

/// Position of (a, b) in the symmetric storage xx | xx yy xy | xx yy zz xy xz yz.
constexpr int symmetric_index(int dimension, int a, int b) noexcept { return a == b ? a : dimension + a + b - 1; }

/// Least squares in which the bond itself counts lambda times. The changed shape tensor K + c xi (x) xi is inverted by the
/// Sherman-Morrison formula, so that only the point's K^-1 is needed.
class BondAugmented final : public BondKinematics {
 public:
  BondAugmented(double lambda, BondWeight weight) : lambda_(lambda), weight_(weight) {}

  BondTraits traits() const noexcept override { return {.base = BondBase::own, .weight = weight_}; }

  void correction(const FamilyView& family, double* g, std::size_t stride) const noexcept override {
    switch (family.dimension) {
      case 1: return correction<1>(family, g, stride);
      case 2: return correction<2>(family, g, stride);
      default: return correction<3>(family, g, stride);
    }
  }

 private:
  /// g = c k / (1 + c xi . k),  c = (lambda - 1) omega V,  k = K^-1 xi
  template <int D>
  void correction(const FamilyView& family, double* g, std::size_t stride) const noexcept {
    const auto inverse = [&](int a, int b, int bond) {
      const double* shape = family.shape_of(symmetric_index(D, a, b), bond);
      return family.inverse_shape_stride == 0 ? Pack(*shape) : Pack::load(shape);
    };
    for (int bond = 0; bond < family.bonds; bond += pack_width) {
      Pack xi[D], k[D], projection(0.0);
      for (int e = 0; e < D; ++e) xi[e] = Pack::load(family.xi[e] + bond);
      for (int a = 0; a < D; ++a) {
        for (int b = 0; b < D; ++b) k[a] += inverse(a < b ? a : b, a < b ? b : a, bond) * xi[b];
        projection += xi[a] * k[a];
      }
      const Pack c = (lambda_ - 1.0) * Pack::load(family.omega + bond) * Pack::load(family.volume + bond);
      const Pack scale = c / (1.0 + c * projection);
      for (int a = 0; a < D; ++a) (scale * k[a]).store(g + static_cast<std::size_t>(a) * stride + bond);
    }
  }

  double lambda_;
  BondWeight weight_;
};

PartDescription description() {
  PartDescription part{.name = "bond_augmented",
                       .summary = "least squares per bond in which the bond itself counts lambda times",
                       .parameters = {},
                       .examples = {"", "lambda = 100.0\nweight = \"kernel\""},
                       .equations = "F_ij = (sum_k w_k V_k y_ik (x) xi_ik) (sum_k w_k V_k xi_ik (x) xi_ik)^-1,  w_k = lambda omega (k = j), omega (else)\n"
                                    "evaluated as F_i + (y_ij - F_i xi) (x) c K_i^-1 xi / (1 + c xi . K_i^-1 xi),  c = (lambda - 1) omega V_j\n"
                                    "W_ij = V_i V_j / sum_j V_j  (weight = \"volume\"),  V_i omega V_j / sum_j omega V_j  (\"kernel\")",
                       .source = "Hou and Zhang, Eng. Fract. Mech. 307 (2024) 110276; "
                                 "Hu et al., A unified framework of bond-associated correspondence models, eqs. 10-17, 32",
                       .limits = "lambda = 1 is `conventional` with its zero-energy modes; small lambda suppresses them weakly"};
  part.parameters.number("lambda", "-", "factor on the influence of the bond itself").by_default("10.0").at_least(1.0);
  add_bond_weight(part.parameters, BondWeight::volume);
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<BondAugmented>(values.number("lambda"), bond_weight(values));
  });
}
