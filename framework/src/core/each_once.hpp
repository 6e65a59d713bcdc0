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

/// Puts the values in the order of `by` and keeps one of each.
template <class T, class Projection = std::identity>
void keep_each_once(std::vector<T>& values, const Projection& by = {}) {
  std::ranges::sort(values, {}, by);
  drop_repeated(values, by);
}

}  // namespace perikit
