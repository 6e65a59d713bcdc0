#include "perikit/influence.hpp"

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "CamelCase", .summary = "a name that is not snake_case", .examples = {""}},
                      [](const perikit::ParameterValues&, const perikit::PartFactory&) { return nullptr; });
}
