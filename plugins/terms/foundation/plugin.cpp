#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "perikit/sdk/law_term.hpp"
#include "perikit/term.hpp"

using namespace perikit;

namespace {

/// Springs that pull every point back to where it was: e = k |u|^2 / 2, or k (n . u)^2 / 2.
struct Foundation {
  static constexpr TermTraits traits{.constants = 1, .constant_tangent = true};

  Vector<double, 3> normal{};
  bool along_normal = false;

  void constants(const MaterialInput& input, double* k) const {
    k[0] = input.value("stiffness");
    if (!(k[0] >= 0)) throw std::domain_error(fmt::format("found stiffness = {:.6g}; allowed: a number >= 0 [N/m^4]", k[0]));
  }

  template <class T, std::size_t d, class K>
  T energy(const Vector<T, d>& u, const Vector<Pack, d>& /*x*/, double /*time*/, const K& k) const noexcept {
    if (!along_normal) return 0.5 * k[0] * dot(u, u);
    T across = 0.0;
    for (std::size_t c = 0; c < d; ++c) across += normal[c] * u[c];
    return 0.5 * k[0] * across * across;
  }
};

std::unique_ptr<PointTerm> make(const ParameterValues& values) {
  Foundation law;
  if (values.has("normal")) {
    const std::vector<double>& given = values.numbers("normal");
    double square = 0;
    for (const double n : given) square += n * n;
    if (!(square > 0) || !std::isfinite(square)) throw values.error("normal", "found a vector without a direction; allowed: a vector of some length");
    for (std::size_t c = 0; c < given.size() && c < 3; ++c) law.normal[c] = given[c] / std::sqrt(square);
    law.along_normal = true;
  }
  return std::make_unique<LawTerm<Foundation>>(law);
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  ParameterTable table;
  table.expression("stiffness", "N/m^4", "Force per volume and displacement.").require().at_least(0).with_time();
  table.add(ParameterType::numbers, "normal", "-", "Only displacements along it are resisted; without it all are.").one_per_axis();
  registrar.term({.name = "foundation",
                  .summary = "elastic foundation: springs that pull every point back to where it was",
                  .parameters = std::move(table),
                  .examples = {"stiffness = 2.0", "stiffness = \"1 + x^2 + t\"", "stiffness = 2.0\nnormal = [1, 2]", "stiffness = 2.0\nnormal = [0, 0, 1]"},
                  .equations = "e = k |u|^2 / 2, f = -k u; along a normal n: e = k (n.u)^2 / 2, f = -k (n.u) n",
                  .source = "Winkler, Die Lehre von der Elasticitaet und Festigkeit (1867)",
                  .limits = "Pulls as well as it pushes: no contact."},
                 [](const ParameterValues& values, const PartFactory&) { return make(values); });
}
