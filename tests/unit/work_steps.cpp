#include "perikit/core/work_steps.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <thread>

using namespace perikit;

TEST_CASE("work steps: each is shown as it begins, and the long ones are in the summary") {
  std::string shown;
  WorkSteps steps([&](const std::string& step) { shown += step + ";"; });
  CHECK(steps.summary().empty());
  steps.begin("points");
  steps.begin("families");
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  steps.begin("loads");
  steps.end();
  CHECK(shown == "points;families;loads;");
  CHECK(steps.seconds() >= 0.06);
  CHECK(steps.summary().starts_with("families 0.0"));
  CHECK(steps.summary().find("points") == std::string::npos);
  CHECK(steps.summary().find("loads") == std::string::npos);
}
