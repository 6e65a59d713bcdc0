#include "perikit/influence.hpp"

PERIKIT_PLUGIN(registrar) {
  perikit::ParameterTable table;
  table.integer("order", "first").by_default("1");
  table.integer("order", "second").by_default("1");
  registrar.influence({.name = "twice", .summary = "one parameter, two declarations", .parameters = table, .examples = {""}},
                      [](const perikit::ParameterValues&, const perikit::PartFactory&) { return nullptr; });
}
