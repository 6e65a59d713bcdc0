#include "perikit/influence.hpp"

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "typed", .summary = "an example that holds the type", .examples = {"type = \"typed\""}},
                      [](const perikit::ParameterValues&, const perikit::PartFactory&) { return nullptr; });
}
