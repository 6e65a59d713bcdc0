#include "perikit/influence.hpp"

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "unreadable", .summary = "an example that is no TOML", .examples = {"", "order = = 1"}},
                      [](const perikit::ParameterValues&, const perikit::PartFactory&) { return nullptr; });
}
