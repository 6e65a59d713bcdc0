#include <csignal>

#include "perikit/influence.hpp"

using namespace perikit;

/// Registers well, and crashes where it is used.
struct Crasher final : InfluenceFunction {
  void evaluate(std::span<const double>, std::span<double>) const override { std::raise(SIGSEGV); }
};

PERIKIT_PLUGIN(registrar) {
  registrar.influence({.name = "crasher", .summary = "crashes", .examples = {""}},
                      [](const ParameterValues&, const PartFactory&) { return std::make_unique<Crasher>(); });
}
