#include <memory>

#include "perikit/sdk/law_term.hpp"
#include "perikit/term.hpp"

using namespace perikit;

namespace {

/// YOUR PHYSICS: what acts on each point beside the formulation, as an energy per volume of the displacement u, the place x and the time. Force and
/// tangent follow by exact differentiation. A force that has no energy, or needs the velocity: perikit/sdk/law_term.hpp.
/// T holds several points at once: a law branches by select(a < b, x, y), and sqrt, max and their like are written without std::
/// (framework/docs/scalars.md).
struct PartName {
  static constexpr TermTraits traits{.constants = 2};

  /// What energy reads, from the parameters at one point and one time; std::domain_error says what is wrong with them.
  void constants(const MaterialInput& input, double* k) const {
    k[0] = input.value("stiffness");
    k[1] = input.value("length");
  }

  /// Default: springs to where the point was, twice as stiff once they have gone as far as `length`.
  template <class T, std::size_t d, class K>
  T energy(const Vector<T, d>& u, const Vector<Pack, d>& /*x*/, double /*time*/, const K& k) const noexcept {
    const T square = dot(u, u);
    return 0.5 * k[0] * square * (1.0 + 0.5 * square / (k[1] * k[1]));
  }
};

/// Keys of the scene; expressions may depend on x, y, z and t.
ParameterTable parameters() {
  ParameterTable table;
  table.expression("stiffness", "N/m^4", "Force per volume and displacement of a short way.").require().at_least(0).with_time();
  table.number("length", "m", "How far a spring goes until it is twice as stiff.").by_default("1.0").positive();
  return table;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.term({.name = "part_name",
                  .summary = "one line: what it is",
                  .parameters = parameters(),
                  // Every example is built and tested by the contract suite.
                  .examples = {"stiffness = 0.3", "stiffness = \"0.3*(1 + x + t)\"\nlength = 0.5"},
                  .equations = "e = k |u|^2/2 (1 + |u|^2/(2 l^2)), f = -de/du",
                  .source = "the paper, with the number of the equation",
                  .limits = "where it must not be used"},
                 [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawTerm<PartName>>(); });
}
