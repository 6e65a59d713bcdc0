#include "perikit/core/work_steps.hpp"

#include <fmt/format.h>

namespace perikit {

void WorkSteps::begin(std::string step) {
  end();
  if (show_) show_(step);
  steps_.emplace_back(std::move(step), 0.0);
  began_ = std::chrono::steady_clock::now();
  open_ = true;
}

void WorkSteps::end() {
  if (!open_) return;
  steps_.back().second = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  open_ = false;
}

double WorkSteps::seconds() const noexcept {
  double all = 0;
  for (const auto& [step, seconds] : steps_) all += seconds;
  return all;
}

std::string WorkSteps::summary() const {
  const double all = seconds();
  std::string text;
  for (const auto& [step, seconds] : steps_)
    if (seconds >= 0.05 * all) text += fmt::format("{}{} {:.2f} s", text.empty() ? "" : ", ", step, seconds);
  return text;
}

}  // namespace perikit
