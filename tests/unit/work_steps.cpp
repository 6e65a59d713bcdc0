#include "core/threads/work_steps.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

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

TEST_CASE("the share of a step that is done is shown, not more than a few times a second") {
  std::vector<std::string> shown;
  WorkSteps steps([&](const std::string& step) { shown.push_back(step); });
  steps.share_done(0.5);   // of no step
  steps.begin("weights");
  steps.share_done(0.1);
  std::this_thread::sleep_for(std::chrono::milliseconds(310));
  steps.share_done(0.4);
  steps.share_done(0.41);
  CHECK(shown == std::vector<std::string>{"weights", "weights, 40 %"});
}
