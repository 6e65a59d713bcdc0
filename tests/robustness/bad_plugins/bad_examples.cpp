#include "perikit/influence.hpp"

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "unexampled", .summary = "no example"},
                      [](const perikit::ParameterValues&, const perikit::PartFactory&) { return nullptr; });
}
