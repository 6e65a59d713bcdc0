#include "perikit/influence.hpp"

PERIKIT_PLUGIN(registrar) {
  perikit::ParameterTable table;
  table.number("", "-", "Width of the bell.").by_default("1");
  registrar.influence({.name = "bell", .summary = "a parameter without a name", .parameters = table, .examples = {""}},
                      [](const perikit::ParameterValues&, const perikit::PartFactory&) { return nullptr; });
}
