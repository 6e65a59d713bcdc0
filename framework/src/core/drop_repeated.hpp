#pragma once
#include <algorithm>
#include <functional>
#include <vector>

namespace perikit {

/// Of values that follow each other and have an equal `by`, keeps the first.
template <class T, class Projection = std::identity>
void drop_repeated(std::vector<T>& values, const Projection& by = {}) {
  values.erase(std::unique(values.begin(), values.end(), [&](const T& a, const T& b) { return std::invoke(by, a) == std::invoke(by, b); }), values.end());
}

}  // namespace perikit
