#include "perikit/influence.hpp"

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "private_", .summary = "a name that ends in an underscore", .examples = {""}},
                      [](const perikit::ParameterValues&, const perikit::PartFactory&) { return nullptr; });
}
