#include "perikit/sdk/plastic.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace perikit {

void refuse_parameter(std::string_view name, double value, std::string_view allowed) {
  throw std::domain_error(fmt::format("found {} = {}; allowed: {}", name, value, allowed));
}

}  // namespace perikit
