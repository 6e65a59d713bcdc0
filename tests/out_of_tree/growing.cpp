// A term that nobody in perikit foresaw: ground that creeps over the body and sets, whose springs grow with the time since the front has passed.
#include <memory>

#include "perikit/sdk/law_term.hpp"
#include "perikit/term.hpp"

using namespace perikit;

namespace {

struct Ground {
  static constexpr TermTraits traits{.constants = 2, .time = true, .constant_tangent = true};

  void constants(const MaterialInput& input, double* k) const {
    k[0] = input.value("growth");
    k[1] = input.value("front");
  }

  template <class T, std::size_t d, class K>
  T energy(const Vector<T, d>& u, const Vector<Pack, d>& x, double time, const K& k) const noexcept {
    const Pack since = max(time - x[0] / k[1], Pack(0.0));
    return 0.5 * k[0] * since * dot(u, u);
  }
};

}  // namespace

PERIKIT_PLUGIN(registrar) {
  ParameterTable table;
  table.expression("growth", "N/(m^4 s)", "How fast the stiffness grows.").require();
  table.number("front", "m/s", "How fast the front moves along x.").require().positive();
  registrar.term({.name = "growing", .summary = "ground that sets", .parameters = std::move(table), .examples = {"growth = 2.0\nfront = 8.0", "growth = \"2 + y\"\nfront = 8.0"}},
                 [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawTerm<Ground>>(); });
}
