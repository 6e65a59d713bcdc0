#pragma once
/// Vector operations on whole fields, on all threads and all ranks of the communicator, with exact sums, which depend on the
/// number of neither. Fields have equal shapes.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "perikit/core/exact_sum.hpp"
#include "perikit/core/field.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

/// body(begin, end) over [0, n) in blocks of a fixed size, a multiple of `padding`, in any order; those of a part of [0, n) on the same thread in
/// every loop.
template <class Body>
void over_blocks(std::size_t n, Body&& body) {
  constexpr std::size_t block = 1024;
  parallel_for((n + block - 1) / block, [&](std::size_t b) { body(b * block, std::min(n, (b + 1) * block)); }, {}, Sharing::keep);
}

/// The same over the values of a field, those of one point on one thread whatever their component.
template <class Body>
void over_values(ConstFieldView x, Body&& body) {
  over_blocks(x.stride, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = 0; c < static_cast<std::size_t>(x.components); ++c) body(c * x.stride + begin, c * x.stride + end);
  });
}

/// The exact sum of term(k) over [0, n) on this rank, on all threads.
template <class Term>
ExactSum exact_sum(std::size_t n, Term&& term) {
  std::vector<ExactSum> parts(static_cast<std::size_t>(thread_count()));
  over_blocks(n, [&](std::size_t begin, std::size_t end) {
    ExactSum::Group terms;
    for (std::size_t first = begin; first < end; first += terms.size()) {
      const std::size_t count = std::min(terms.size(), end - first);
      for (std::size_t k = 0; k < count; ++k) terms[k] = term(first + k);
      std::fill(terms.begin() + static_cast<std::ptrdiff_t>(count), terms.end(), 0.0);
      parts[static_cast<std::size_t>(thread_index())].add(terms);
    }
  });
  for (std::size_t t = 1; t < parts.size(); ++t) parts[0].add(parts[t]);
  return parts[0];
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
/// Where the points of a part of a body lie in the fields of the whole one; `place` is empty where the part is the whole.
struct Places {
  std::span<const std::int64_t> place;
  std::size_t stride = 0;
};
/// Fills x with fixed noise in [-1, 1), a hash of the index in the whole body and of the seed, where mask is not 0.
void fill_with_noise(ConstFieldView mask, std::uint64_t seed, const Places& places, FieldView x);

}  // namespace perikit
