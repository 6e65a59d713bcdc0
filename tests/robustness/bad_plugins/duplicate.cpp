#include "perikit/influence.hpp"

using namespace perikit;

/// "sound" is the name that good.cpp brings.
PERIKIT_PLUGIN(registrar) {
  const Factory<InfluenceFunction> none = [](const ParameterValues&, const PartFactory&) { return nullptr; };
  registrar.influence({.name = "before_sound", .summary = "a part of its own", .examples = {""}}, none);
  registrar.influence({.name = "sound", .summary = "a name that is taken", .examples = {""}}, none);
}
