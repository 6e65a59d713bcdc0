#include "perikit/core/field_operations.hpp"

#include <cmath>
#include <vector>

#include "perikit/core/communicator.hpp"
#include "perikit/core/power_of_two.hpp"

namespace perikit {

namespace {

constexpr std::size_t sum_block = 16384;
/// Sums of squares beyond have lost digits, or terms.
constexpr double smallest_square = 1e-270, largest_square = 1e300;

}  // namespace

double dot(ConstFieldView a, ConstFieldView b) {
  return total_over_ranks(exact_sum(a.size(), [&](std::size_t k) { return a.data[k] * b.data[k]; }));
}

double norm(ConstFieldView a) {
  const double squares = dot(a, a);
  if (squares > smallest_square && squares < largest_square) return std::sqrt(squares);
  const double unit = power_of_two(largest_magnitude(a));
  return unit * std::sqrt(total_over_ranks(exact_sum(a.size(), [&](std::size_t k) { return (a.data[k] / unit) * (a.data[k] / unit); })));
}

double largest_magnitude(ConstFieldView a) {
  std::vector<double> most((a.size() + sum_block - 1) / sum_block, 0.0);
  parallel_for(most.size(), [&](std::size_t b) {
    for (std::size_t k = b * sum_block; k < std::min(a.size(), (b + 1) * sum_block); ++k) most[b] = std::max(most[b], std::abs(a.data[k]));
  });
  return communicator().largest(most.empty() ? 0.0 : *std::max_element(most.begin(), most.end()));
}

void combine(double a, ConstFieldView x, double b, ConstFieldView y, FieldView sum) {
  over_values(sum, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) sum.data[k] = a * x.data[k] + b * y.data[k];
  });
}

void copy(ConstFieldView from, FieldView to) {
  over_values(to, [&](std::size_t begin, std::size_t end) { std::copy(from.data + begin, from.data + end, to.data + begin); });
}

void fill(double value, FieldView x) {
  over_values(x, [&](std::size_t begin, std::size_t end) { std::fill(x.data + begin, x.data + end, value); });
}

void mask(ConstFieldView mask, FieldView x) {
  over_values(x, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) x.data[k] *= mask.data[k];
  });
}

void fill_with_noise(ConstFieldView mask, std::uint64_t seed, const Places& places, FieldView x) {
  const std::size_t stride = places.place.empty() ? x.stride : places.stride;
  for (std::size_t c = 0; c < static_cast<std::size_t>(x.components); ++c)
    over_blocks(x.stride, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        const std::size_t i = c * x.stride + p, at = places.place.empty() ? p : static_cast<std::size_t>(places.place[p]);
        std::uint64_t k = c * stride + at + seed;
        k = (k ^ (k >> 30)) * 0xbf58476d1ce4e5b9ULL;
        k = (k ^ (k >> 27)) * 0x94d049bb133111ebULL;
        x.data[i] = mask.data[i] != 0 ? static_cast<double>((k ^ (k >> 31)) >> 11) * 0x1.0p-52 - 1.0 : 0.0;
      }
    });
}

}  // namespace perikit
