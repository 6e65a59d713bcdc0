#include "perikit/influence.hpp"

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "silent", .examples = {""}},
                      [](const perikit::ParameterValues&, const perikit::PartFactory&) { return nullptr; });
}
