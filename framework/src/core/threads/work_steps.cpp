#include "core/threads/work_steps.hpp"

#include <fmt/format.h>

namespace perikit {

void WorkSteps::begin(std::string step) {
  end();
  if (show_) show_(step);
  steps_.emplace_back(std::move(step), 0.0);
  began_ = told_ = std::chrono::steady_clock::now();
  open_ = true;
}

void WorkSteps::share_done(double share) {
  const auto now = std::chrono::steady_clock::now();
  if (!show_ || !open_ || now - told_ < std::chrono::milliseconds(300)) return;
  told_ = now;
  show_(fmt::format("{}, {:.0f} %", steps_.back().first, 100 * share));
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
