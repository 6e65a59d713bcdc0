#pragma once
/// Packs of single precision numbers, twice as many as of doubles, for products whose result is looked at again in doubles: they pass half of the bytes and take half of the instructions.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "families/cloud/cloud_row_simd.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

inline constexpr int single_width = 2 * pack_width;

namespace detail {
typedef float SingleLanes __attribute__((vector_size(4 * single_width)));
typedef float UnalignedSingles __attribute__((vector_size(4 * single_width), aligned(4), may_alias));
typedef std::int32_t SingleBits __attribute__((vector_size(4 * single_width)));
typedef float PairOfFours __attribute__((vector_size(32)));
}  // namespace detail
/// Four numbers of a point.
typedef float FourSingles __attribute__((vector_size(16)));
typedef double FourDoubles __attribute__((vector_size(32)));

struct SinglePack {
  detail::SingleLanes v;

  SinglePack() noexcept : v{} {}
  SinglePack(float a) noexcept : v(a - detail::SingleLanes{}) {}
  SinglePack(double a) noexcept : SinglePack(static_cast<float>(a)) {}
  SinglePack(detail::SingleLanes lanes) noexcept : v(lanes) {}
  /// p need not be aligned.
  static SinglePack load(const float* p) noexcept { return {*reinterpret_cast<const detail::UnalignedSingles*>(p)}; }
  void store(float* p) const noexcept { *reinterpret_cast<detail::UnalignedSingles*>(p) = v; }
  float operator[](int lane) const noexcept { return v[lane]; }
  SinglePack& operator*=(SinglePack b) noexcept {
    v *= b.v;
    return *this;
  }
  SinglePack& operator+=(SinglePack b) noexcept {
    v += b.v;
    return *this;
  }
};
inline SinglePack operator+(SinglePack a, SinglePack b) noexcept { return {a.v + b.v}; }
inline SinglePack operator-(SinglePack a, SinglePack b) noexcept { return {a.v - b.v}; }
inline SinglePack operator*(SinglePack a, SinglePack b) noexcept { return {a.v * b.v}; }
inline SinglePack operator/(SinglePack a, SinglePack b) noexcept { return {a.v / b.v}; }
/// a b + c, rounded once where the level has an instruction for it.
inline SinglePack multiply_add(SinglePack a, SinglePack b, SinglePack c) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  return {reinterpret_cast<detail::SingleLanes>(_mm512_fmadd_ps(reinterpret_cast<__m512>(a.v), reinterpret_cast<__m512>(b.v), reinterpret_cast<__m512>(c.v)))};
#elif defined(__AVX__) && defined(__FMA__)
  return {reinterpret_cast<detail::SingleLanes>(_mm256_fmadd_ps(reinterpret_cast<__m256>(a.v), reinterpret_cast<__m256>(b.v), reinterpret_cast<__m256>(c.v)))};
#elif defined(__aarch64__)
  return {reinterpret_cast<detail::SingleLanes>(vfmaq_f32(reinterpret_cast<float32x4_t>(c.v), reinterpret_cast<float32x4_t>(a.v), reinterpret_cast<float32x4_t>(b.v)))};
#else
  return {a.v * b.v + c.v};
#endif
}
inline SinglePack sqrt(SinglePack a) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  return {reinterpret_cast<detail::SingleLanes>(_mm512_maskz_sqrt_ps(0xffff, reinterpret_cast<__m512>(a.v)))};
#elif defined(__AVX__)
  return {reinterpret_cast<detail::SingleLanes>(_mm256_sqrt_ps(reinterpret_cast<__m256>(a.v)))};
#elif defined(__SSE2__)
  return {reinterpret_cast<detail::SingleLanes>(_mm_sqrt_ps(reinterpret_cast<__m128>(a.v)))};
#elif defined(__aarch64__)
  return {reinterpret_cast<detail::SingleLanes>(vsqrtq_f32(reinterpret_cast<float32x4_t>(a.v)))};
#else
  SinglePack r;
  for (int i = 0; i < single_width; ++i) r.v[i] = std::sqrt(a.v[i]);
  return r;
#endif
}
inline SinglePack max(SinglePack a, SinglePack b) noexcept { return {a.v > b.v ? a.v : b.v}; }
inline SinglePack min(SinglePack a, SinglePack b) noexcept { return {a.v < b.v ? a.v : b.v}; }
/// The first n lanes, zero elsewhere.
inline SinglePack keep_first(int n, SinglePack a) noexcept {
  constexpr auto lane = []<std::size_t... I>(std::index_sequence<I...>) { return detail::SingleBits{static_cast<std::int32_t>(I)...}; }(std::make_index_sequence<single_width>());
  return {lane < n ? a.v : detail::SingleLanes{}};
}

namespace detail {
/// Of four lanes each: {a[0], b[0], a[1], b[1]} or, from 2 on, {a[2], b[2], a[3], b[3]}.
template <int from, std::size_t... J>
[[gnu::always_inline]] inline SingleLanes interleave(SingleLanes a, SingleLanes b, std::index_sequence<J...>) noexcept {
  return __builtin_shufflevector(a, b, (static_cast<int>(J) / 4 * 4 + from + static_cast<int>(J) % 4 / 2 + (J % 2 ? single_width : 0))...);
}
/// {a[from], a[from + 1], b[from], b[from + 1]}
template <int from, std::size_t... J>
[[gnu::always_inline]] inline SingleLanes halves(SingleLanes a, SingleLanes b, std::index_sequence<J...>) noexcept {
  return __builtin_shufflevector(a, b, (static_cast<int>(J) / 4 * 4 + from + static_cast<int>(J) % 2 + (J % 4 >= 2 ? single_width : 0))...);
}
/// rows[i][j] <-> rows[j][i] within each four lanes.
[[gnu::always_inline]] inline void transpose_fours(SinglePack (&rows)[4]) noexcept {
  constexpr auto lanes = std::make_index_sequence<single_width>();
  const SingleLanes a = interleave<0>(rows[0].v, rows[1].v, lanes), b = interleave<2>(rows[0].v, rows[1].v, lanes), c = interleave<0>(rows[2].v, rows[3].v, lanes),
                    d = interleave<2>(rows[2].v, rows[3].v, lanes);
  rows[0].v = halves<0>(a, c, lanes);
  rows[1].v = halves<2>(a, c, lanes);
  rows[2].v = halves<0>(b, d, lanes);
  rows[3].v = halves<2>(b, d, lanes);
}
}  // namespace detail

/// Lane l of columns[c]: rows[stride at[l]][c].
[[gnu::always_inline]] inline void load_columns(const FourSingles* rows, const std::int32_t* at, std::size_t stride, SinglePack (&columns)[4]) noexcept {
  const auto row = [&](int l) { return rows[stride * static_cast<std::size_t>(at[l])]; };
  PERIKIT_UNROLL for (int m = 0; m < 4; ++m) {
#if !defined(__AVX__)
    columns[m].v = row(m);
#elif !(defined(__AVX512F__) && defined(__AVX512DQ__))
    columns[m].v = __builtin_shufflevector(row(m), row(m + 4), 0, 1, 2, 3, 4, 5, 6, 7);
#else
    const detail::PairOfFours low = __builtin_shufflevector(row(m), row(m + 4), 0, 1, 2, 3, 4, 5, 6, 7), high = __builtin_shufflevector(row(m + 8), row(m + 12), 0, 1, 2, 3, 4, 5, 6, 7);
    columns[m].v = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
#endif
  }
  detail::transpose_fours(columns);
}

/// The same of doubles.
[[gnu::always_inline]] inline void load_columns(const FourDoubles* rows, const std::int32_t* at, std::size_t stride, Pack (&columns)[4]) noexcept {
  const RowColumns loaded = RowColumns::load(reinterpret_cast<const Row*>(rows), at, stride);
  PERIKIT_UNROLL for (int c = 0; c < 4; ++c) columns[c] = loaded[c];
}
inline Pack keep_first(int n, Pack a) noexcept { return keep(first_lanes(n), a); }

/// What packs of either hold.
template <class P>
struct LanesOf {
  using Number = double;
  using Four = FourDoubles;
  static constexpr int width = pack_width, parts = 8 / width;
};
template <>
struct LanesOf<SinglePack> {
  using Number = float;
  using Four = FourSingles;
  static constexpr int width = single_width, parts = 16 / width;
};

// Sums have eight lanes of doubles and sixteen of singles, in so many parts as packs need for them, and the same bits whatever the width of a pack is.
/// The sum over the lanes of all parts, of each of four columns: lane 0 + lane 1 + ...
[[gnu::always_inline]] inline FourDoubles sums_of_lanes(const Pack (&columns)[LanesOf<Pack>::parts][4]) noexcept {
  FourDoubles sums{};
  for (int c = 0; c < 4; ++c) {
    double sum = 0;
    for (const Pack(&part)[4] : columns)
      for (int l = 0; l < pack_width; ++l) sum += part[c][l];
    sums[c] = sum;
  }
  return sums;
}
/// With q_0 ... q_3 the sums (lane 0 + lane 1) + (lane 2 + lane 3) of four lanes each: (q_0 + q_2) + (q_1 + q_3).
[[gnu::always_inline]] inline FourSingles sums_of_lanes(const SinglePack (&columns)[LanesOf<SinglePack>::parts][4]) noexcept {
  SinglePack quads[LanesOf<SinglePack>::parts];
  for (int part = 0; part < LanesOf<SinglePack>::parts; ++part) {
    SinglePack by_lane[4] = {columns[part][0], columns[part][1], columns[part][2], columns[part][3]};
    detail::transpose_fours(by_lane);
    quads[part] = (by_lane[0] + by_lane[1]) + (by_lane[2] + by_lane[3]);
  }
#if !defined(__AVX__)
  return (quads[0].v + quads[2].v) + (quads[1].v + quads[3].v);
#else
#if !(defined(__AVX512F__) && defined(__AVX512DQ__))
  const detail::PairOfFours half = quads[0].v + quads[1].v;
#else
  const detail::PairOfFours half = __builtin_shufflevector(quads[0].v, quads[0].v, 0, 1, 2, 3, 4, 5, 6, 7) + __builtin_shufflevector(quads[0].v, quads[0].v, 8, 9, 10, 11, 12, 13, 14, 15);
#endif
  return __builtin_shufflevector(half, half, 0, 1, 2, 3) + __builtin_shufflevector(half, half, 4, 5, 6, 7);
#endif
}

}  // namespace perikit
