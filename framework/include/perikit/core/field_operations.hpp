#pragma once
/// Vector operations on whole fields, on all threads, with sums that do not depend on their number, over all
/// ranks of the communicator. Fields have equal shapes.

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "perikit/core/field.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

/// body(begin, end) over [0, n) in blocks of a fixed size, a multiple of `padding`, in any order.
template <class Body>
void over_blocks(std::size_t n, Body&& body) {
  constexpr std::size_t block = 4096;
  parallel_for((n + block - 1) / block, [&](std::size_t b) { body(b * block, std::min(n, (b + 1) * block)); });
}

/// Sum of a . b over all components.
double dot(ConstFieldView a, ConstFieldView b);
/// Euclidean norm over all components.
double norm(ConstFieldView a);
/// Largest absolute value.
double largest_magnitude(ConstFieldView a);
/// sum <- a x + b y; sum may be x or y.
void combine(double a, ConstFieldView x, double b, ConstFieldView y, FieldView sum);
/// to <- from.
void copy(ConstFieldView from, FieldView to);
/// x <- value.
void fill(double value, FieldView x);
/// x <- x * mask, componentwise.
void mask(ConstFieldView mask, FieldView x);
/// Fills x with fixed noise in [-1, 1), a hash of index and seed, where mask is not 0.
void fill_with_noise(ConstFieldView mask, std::uint64_t seed, FieldView x);

}  // namespace perikit
