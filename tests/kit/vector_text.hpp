#pragma once
/// Vectors in texts of scenes.

#include <fmt/format.h>

namespace perikit::test {

/// "[x, y, z]", of which as many as there are dimensions.
template <class X, class Y, class Z>
std::string vector_text(int dimension, const X& x, const Y& y, const Z& z) {
  return dimension == 3 ? fmt::format("[{}, {}, {}]", x, y, z) : dimension == 2 ? fmt::format("[{}, {}]", x, y) : fmt::format("[{}]", x);
}

}  // namespace perikit::test
