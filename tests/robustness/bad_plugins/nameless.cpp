#include "perikit/influence.hpp"

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.summary = "a part without a name", .examples = {""}},
                      [](const perikit::ParameterValues&, const perikit::PartFactory&) { return nullptr; });
}
