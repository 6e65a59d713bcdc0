#include "perikit/kinematics.hpp"

#include <memory>
#include <string>

#include "perikit/core/simd.hpp"

using namespace perikit;

namespace {

/// 1 on the positive side of a dividing plane, 1/2 on it, 0 behind it: a bond on a plane belongs to both sides in equal parts.
Pack side(Pack distance, Pack length) {
  return select(abs(distance) <= 1e-10 * length, Pack(0.5), select(distance > Pack(0.0), Pack(1.0), Pack(0.0)));
}

/// One gradient per half, quadrant or octant of the family.
class SubHorizon final : public WeightedKinematics {
 public:
  explicit SubHorizon(const ParameterValues& options) : options_(options) {}

  WeightedTraits traits() const noexcept override {
    return {.part_weight = options_.text("weights") == "volume" ? PartWeight::volume : PartWeight::equal};
  }

  int parts(int dimension) const override {
    const int orthants = 1 << dimension;
    if (!options_.has("parts") || options_.integer("parts") == orthants) return orthants;
    if (options_.integer("parts") == 1 || (dimension == 1 && options_.integer("parts") == 4)) return static_cast<int>(options_.integer("parts"));
    throw options_.error("parts", "found " + std::to_string(options_.integer("parts")) + " in a body of dimension " +
                                      std::to_string(dimension) +
                                      "; allowed: 1" + (dimension == 1 ? ", 2 or 4" : " or " + std::to_string(orthants)));
  }

  void weights(const FamilyView& family, double* omega, std::size_t stride) const noexcept override {
    const std::int64_t chosen = options_.has("parts") ? options_.integer("parts") : 0;
    if (family.dimension == 1 && chosen == 4) return quarters(family, omega, stride);
    if (chosen == 1) {
      for (int k = 0; k < family.bonds; k += pack_width) Pack::load(family.omega + k).store(omega + k);
      return;
    }
    for (int k = 0; k < family.bonds; k += pack_width) {
      const Pack length = Pack::load(family.length + k);
      Pack share[8] = {Pack::load(family.omega + k)};
      for (int a = 0; a < family.dimension; ++a) {
        const Pack xi = Pack::load(family.xi[a] + k), front = side(xi, length), back = side(-xi, length);
        for (int q = 0; q < 1 << a; ++q) {
          share[q + (1 << a)] = share[q] * back;
          share[q] *= front;
        }
      }
      for (std::size_t q = 0; q < std::size_t{1} << family.dimension; ++q) share[q].store(omega + q * stride + k);
    }
  }

 private:
  /// The line cut at -delta/2, 0 and delta/2.
  static void quarters(const FamilyView& family, double* omega, std::size_t stride) noexcept {
    const Pack half(0.5 * family.horizon);
    for (int k = 0; k < family.bonds; k += pack_width) {
      const Pack length = Pack::load(family.length + k), xi = Pack::load(family.xi[0] + k);
      for (std::size_t q = 0; q < 4; ++q) {
        const bool outer = q == 0 || q == 3;
        const Pack along = q < 2 ? -xi : xi;
        (Pack::load(family.omega + k) * side(along, length) * side(outer ? along - half : half - along, half))
            .store(omega + q * stride + k);
      }
    }
  }

  ParameterValues options_;
};

PartDescription description() {
  PartDescription part{
      .name = "sub_horizon",
      .summary = "a gradient for each half, quadrant or octant of the family; no zero-energy modes",
      .parameters = {},
      .examples = {"", "weights = \"volume\""},
      .equations =
          "F_a = (sum_j s_a omega V_j y_ij (x) xi_ij) (sum_j s_a omega V_j xi_ij (x) xi_ij)^-1,  a = 1 ... 2^dimension\n"
          "s_a: share of the bond in part a, 1 inside, halved by every dividing plane that it lies on\n"
          "W_a = V_i / (number of admissible parts)  (weights = \"equal\"),  V_i V_a / sum_b V_b  (\"volume\")",
      .source =
          "Roy Chowdhury, Roy, Roy and Reddy, A simple alteration of the peridynamics correspondence principle to "
          "eliminate zero-energy deformation, eqs. 19-31",
      .limits =
          "parts without a gradient of their own (surfaces, cracks) are dropped; the result depends on how the "
          "axes lie in the body"};
  part.parameters
      .integer("parts", "number of parts: 2 (1D), 4 (2D) or 8 (3D) unless given; 1D also has 4, cut at half the horizon; 1: the whole family, as `conventional`")
      .at_least(1)
      .at_most(8);
  part.parameters
      .choice("weights", {"equal", "volume"}, "share of a part in its point's volume: all the same, or by the part's volume")
      .by_default("\"equal\"");
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(),
                       [](const ParameterValues& values, const PartFactory&) { return std::make_unique<SubHorizon>(values); });
}
