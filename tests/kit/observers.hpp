#pragma once
/// Who looks on while a scene runs.

#include "perikit/problem/integrator.hpp"

namespace perikit::test {

/// Samples nothing, keeps nothing, and lets runs come to their end: others say where they differ.
class Silent : public Observer {
 public:
  bool wants_sample(std::int64_t, double) override { return false; }
  void step_done(const StepReport&) override {}
  void log(std::string_view) override {}
};

}  // namespace perikit::test
