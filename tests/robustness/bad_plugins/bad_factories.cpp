#include <stdexcept>

#include "perikit/influence.hpp"

using namespace perikit;

/// Good descriptions, factories that fail.
PERIKIT_PLUGIN(registrar) {
  using Result = std::unique_ptr<InfluenceFunction>;
  registrar.influence({.name = "throws", .summary = "throws", .examples = {""}},
                      [](const ParameterValues&, const PartFactory&) -> Result { throw std::runtime_error("table not found"); });
  registrar.influence({.name = "null", .summary = "returns null", .examples = {""}},
                      [](const ParameterValues&, const PartFactory&) -> Result { return nullptr; });
  registrar.influence(
      {.name = "explains", .summary = "names the place itself", .examples = {""}},
      [](const ParameterValues&, const PartFactory&) -> Result { throw InputError("scene.toml:3:1: its own text"); });
}
