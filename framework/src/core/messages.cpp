#include "core/messages.hpp"

#include <cstdio>

namespace perikit {

void tell(std::string_view text) noexcept {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

}  // namespace perikit
