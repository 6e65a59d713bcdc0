#pragma once
#include <type_traits>

namespace perikit {

/// f(std::integral_constant<int, d>()) for d = 1, 2 or 3: from a number to a template argument.
template <class F>
decltype(auto) with_dimension(int d, F&& f) {
  switch (d) {
    case 1: return f(std::integral_constant<int, 1>());
    case 2: return f(std::integral_constant<int, 2>());
    default: return f(std::integral_constant<int, 3>());
  }
}

}  // namespace perikit
