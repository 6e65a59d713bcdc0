#include "operators/report.hpp"

#include <fmt/format.h>

namespace perikit {

SkipNote second_evaluation(std::size_t bonds, std::string why) {
  return {"second evaluation of each bond", std::move(why), fmt::format("{} of {} evaluations", bonds / 2, bonds)};
}

std::string megabytes(double bytes) { return fmt::format("{:.3g} MB", bytes / 1e6); }

}  // namespace perikit
