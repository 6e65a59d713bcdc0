#include <stdexcept>

#include "perikit/influence.hpp"

using namespace perikit;

/// Its first part is sound, and must not stay.
PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "left_over", .summary = "registered before the throw", .examples = {""}},
                      [](const ParameterValues&, const PartFactory&) { return std::unique_ptr<InfluenceFunction>(); });
  throw std::runtime_error("licence server unreachable");
}
