#pragma once
/// A pack of doubles that fills one SIMD register of the target, and the few operations that kernels and laws need.
/// GCC/Clang vector extensions underneath; width 8 (AVX-512), 4 (AVX) or 2 (SSE2, NEON).

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#if defined(__SSE2__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace perikit {

#if defined(__AVX512F__) && defined(__AVX512DQ__)
inline constexpr int pack_width = 8;
#elif defined(__AVX__)
inline constexpr int pack_width = 4;
#else
inline constexpr int pack_width = 2;
#endif

/// Packs that the registers of the target hold, for loops whose sums are to stay in them.
#if defined(__aarch64__)
inline constexpr int pack_registers = 32;
#else
inline constexpr int pack_registers = pack_width == 8 ? 32 : 16;
#endif

namespace detail {
typedef double Lanes __attribute__((vector_size(8 * pack_width)));
typedef double UnalignedLanes __attribute__((vector_size(8 * pack_width), aligned(8), may_alias));
typedef std::int64_t Bits __attribute__((vector_size(8 * pack_width)));
#if defined(PERIKIT_COUNT_OPERATIONS)
extern std::uint64_t operations;
inline void count(int n) noexcept { operations += static_cast<std::uint64_t>(n); }
#else
inline constexpr std::uint64_t operations = 0;
inline void count(int) noexcept {}
#endif
}  // namespace detail

/// A build with PERIKIT_COUNT_OPERATIONS counts additions, multiplications, divisions and roots of Packs, one each lane (a fused multiply-add is
/// two), and those of the rows that loops over clouds work on; loops then run on one thread. Other builds pay nothing for it.
#if defined(PERIKIT_COUNT_OPERATIONS)
inline constexpr bool counts_operations = true;
#else
inline constexpr bool counts_operations = false;
#endif
/// Operations so far; 0 where they are not counted.
inline std::uint64_t counted_operations() noexcept { return detail::operations; }

/// Result of a lane-wise comparison: in each lane, whether it holds.
struct PackMask {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  __mmask8 v;
  static constexpr __mmask8 everywhere = 0xff;
  bool operator[](int lane) const noexcept { return (v >> lane & 1) != 0; }
#else
  detail::Bits v;   // all bits set where it holds
  static constexpr std::int64_t everywhere = -1;
  bool operator[](int lane) const noexcept { return v[lane] != 0; }
#endif
  friend PackMask operator&(PackMask a, PackMask b) noexcept { return {static_cast<decltype(v)>(a.v & b.v)}; }
  friend PackMask operator|(PackMask a, PackMask b) noexcept { return {static_cast<decltype(v)>(a.v | b.v)}; }
  friend PackMask operator!(PackMask a) noexcept { return {static_cast<decltype(v)>(a.v ^ everywhere)}; }
  PackMask& operator&=(PackMask b) noexcept { return *this = *this & b; }
  PackMask& operator|=(PackMask b) noexcept { return *this = *this | b; }
};

struct Pack {
  detail::Lanes v;

  Pack() noexcept : v{} {}
  Pack(double a) noexcept : v(a - detail::Lanes{}) {}   // a - 0 is a, also for -0
  Pack(detail::Lanes lanes) noexcept : v(lanes) {}

  /// p need not be aligned.
  static Pack load(const double* p) noexcept { return {*reinterpret_cast<const detail::UnalignedLanes*>(p)}; }
  void store(double* p) const noexcept { *reinterpret_cast<detail::UnalignedLanes*>(p) = v; }
  /// The first n lanes from p, zero in the rest.
  static Pack load_first(const double* p, int n) noexcept {
    Pack r;
    for (int i = 0; i < n; ++i) r.v[i] = p[i];
    return r;
  }
  void store_first(double* p, int n) const noexcept {
    for (int i = 0; i < n; ++i) p[i] = v[i];
  }
  double operator[](int lane) const noexcept { return v[lane]; }

  friend Pack operator+(Pack a, Pack b) noexcept {
    detail::count(pack_width);
    return {a.v + b.v};
  }
  friend Pack operator-(Pack a, Pack b) noexcept {
    detail::count(pack_width);
    return {a.v - b.v};
  }
  friend Pack operator*(Pack a, Pack b) noexcept {
    detail::count(pack_width);
    return {a.v * b.v};
  }
  friend Pack operator/(Pack a, Pack b) noexcept {
    detail::count(pack_width);
    return {a.v / b.v};
  }
  friend Pack operator-(Pack a) noexcept { return {-a.v}; }
  Pack& operator+=(Pack b) noexcept { return *this = *this + b; }
  Pack& operator-=(Pack b) noexcept { return *this = *this - b; }
  Pack& operator*=(Pack b) noexcept { return *this = *this * b; }
  Pack& operator/=(Pack b) noexcept { return *this = *this / b; }

  /// a b + c, fused where the target can. Of operators the compiler fuses what it likes, in one copy of a loop a product, in the next one another
  /// or none: this is for loops of which several must give the same bits.
  friend Pack multiply_add(Pack a, Pack b, Pack c) noexcept {
    detail::count(2 * pack_width);
#if defined(__AVX512F__) && defined(__AVX512DQ__)
    return {reinterpret_cast<detail::Lanes>(_mm512_fmadd_pd(reinterpret_cast<__m512d>(a.v), reinterpret_cast<__m512d>(b.v), reinterpret_cast<__m512d>(c.v)))};
#elif defined(__AVX__) && defined(__FMA__)
    return {reinterpret_cast<detail::Lanes>(_mm256_fmadd_pd(reinterpret_cast<__m256d>(a.v), reinterpret_cast<__m256d>(b.v), reinterpret_cast<__m256d>(c.v)))};
#elif defined(__aarch64__)
    return {reinterpret_cast<detail::Lanes>(vfmaq_f64(reinterpret_cast<float64x2_t>(c.v), reinterpret_cast<float64x2_t>(a.v), reinterpret_cast<float64x2_t>(b.v)))};
#elif defined(__FP_FAST_FMA)
    for (int i = 0; i < pack_width; ++i) c.v[i] = __builtin_fma(a.v[i], b.v[i], c.v[i]);
    return c;
#else
    return {a.v * b.v + c.v};
#endif
  }

#if defined(__AVX512F__) && defined(__AVX512DQ__)
  friend PackMask operator<(Pack a, Pack b) noexcept { return compare<_CMP_LT_OQ>(a, b); }
  friend PackMask operator<=(Pack a, Pack b) noexcept { return compare<_CMP_LE_OQ>(a, b); }
  friend PackMask operator==(Pack a, Pack b) noexcept { return compare<_CMP_EQ_OQ>(a, b); }
  template <int predicate>
  static PackMask compare(Pack a, Pack b) noexcept {
    return {_mm512_cmp_pd_mask(reinterpret_cast<__m512d>(a.v), reinterpret_cast<__m512d>(b.v), predicate)};
  }
#else
  friend PackMask operator<(Pack a, Pack b) noexcept { return {a.v < b.v}; }
  friend PackMask operator<=(Pack a, Pack b) noexcept { return {a.v <= b.v}; }
  friend PackMask operator==(Pack a, Pack b) noexcept { return {a.v == b.v}; }
#endif
  friend PackMask operator>(Pack a, Pack b) noexcept { return b < a; }
  friend PackMask operator>=(Pack a, Pack b) noexcept { return b <= a; }
};

inline Pack select(PackMask m, Pack a, Pack b) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  return {reinterpret_cast<detail::Lanes>(_mm512_mask_blend_pd(m.v, reinterpret_cast<__m512d>(b.v), reinterpret_cast<__m512d>(a.v)))};
#else
  return {m.v ? a.v : b.v};
#endif
}
inline double select(bool m, double a, double b) noexcept { return m ? a : b; }

inline bool any(PackMask m) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  return m.v != 0;
#elif defined(__AVX__)
  return _mm256_movemask_pd(reinterpret_cast<__m256d>(m.v)) != 0;
#elif defined(__aarch64__)
  return vpaddd_s64(reinterpret_cast<int64x2_t>(m.v)) != 0;   // minus the number of lanes where it holds
#else
  std::int64_t r = 0;
  for (int i = 0; i < pack_width; ++i) r |= m.v[i];
  return r != 0;
#endif
}
inline bool any(bool m) noexcept { return m; }
inline bool all(PackMask m) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  return m.v == PackMask::everywhere;
#elif defined(__aarch64__)
  return vpaddd_s64(reinterpret_cast<int64x2_t>(m.v)) == -pack_width;
#else
  return !any(!m);
#endif
}

/// Bit l: whether it holds in lane l.
inline std::uint32_t lane_bits(PackMask m) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  return m.v;
#elif defined(__AVX__)
  return static_cast<std::uint32_t>(_mm256_movemask_pd(reinterpret_cast<__m256d>(m.v)));
#else
  std::uint32_t bits = 0;
  for (int i = 0; i < pack_width; ++i) bits |= static_cast<std::uint32_t>(m.v[i] & 1) << i;
  return bits;
#endif
}

// Where an instruction for AVX-512 has a form with a mask, that one is taken with a full mask: it is the same instruction, and its intrinsic does not begin with
// an undefined register, which g++ 12 takes for a value that was forgotten.
inline Pack sqrt(Pack a) noexcept {
  detail::count(pack_width);
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  return {reinterpret_cast<detail::Lanes>(_mm512_maskz_sqrt_pd(0xff, reinterpret_cast<__m512d>(a.v)))};
#elif defined(__AVX__)
  return {reinterpret_cast<detail::Lanes>(_mm256_sqrt_pd(reinterpret_cast<__m256d>(a.v)))};
#elif defined(__SSE2__)
  return {reinterpret_cast<detail::Lanes>(_mm_sqrt_pd(reinterpret_cast<__m128d>(a.v)))};
#elif defined(__aarch64__)
  return {reinterpret_cast<detail::Lanes>(vsqrtq_f64(reinterpret_cast<float64x2_t>(a.v)))};
#else
  Pack r;
  for (int i = 0; i < pack_width; ++i) r.v[i] = std::sqrt(a.v[i]);
  return r;
#endif
}
/// 1/a for normal a > 0 to about one unit in the last place; not a number for 0 and infinity where it comes from an estimate.
inline Pack reciprocal(Pack a) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  Pack r = {reinterpret_cast<detail::Lanes>(_mm512_maskz_rcp14_pd(0xff, reinterpret_cast<__m512d>(a.v)))};
  r = r + r * (Pack(1.0) - a * r);
  return r + r * (Pack(1.0) - a * r);
#else
  return Pack(1.0) / a;
#endif
}
/// 1/sqrt(a) and 1/(sqrt(a) + b) of normal a > 0 and b >= 0, to one and four units in the last place. The root is not finite where a is 0; neither
/// is above 0 where it is infinite. With estimates the second begins from a first guess of the root, so that a loop waits less for each.
struct ReciprocalRootAndSum {
  Pack root, sum;
  ReciprocalRootAndSum(Pack a, Pack b) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
    root = {reinterpret_cast<detail::Lanes>(_mm512_maskz_rsqrt14_pd(0xff, reinterpret_cast<__m512d>(a.v)))};
    const Pack half = Pack(0.5) * a;
    root = root * (Pack(1.5) - half * root * root);
    const Pack guess = a * root + b;  // to 27 bits
    sum = {reinterpret_cast<detail::Lanes>(_mm512_maskz_rcp14_pd(0xff, reinterpret_cast<__m512d>(guess.v)))};
    sum = sum + sum * (Pack(1.0) - guess * sum);
    root = root + root * (Pack(0.5) - half * root * root);
    sum = sum + sum * (Pack(1.0) - (a * root + b) * sum);
#else
    const Pack length = sqrt(a);
    root = reciprocal(length);
    sum = reciprocal(length + b);
#endif
  }
};
/// a in the lanes whose bit is set, zero elsewhere (bits: of a group of eight, shifted so that lane 0 is bit 0).
inline Pack keep(std::uint8_t bits, Pack a) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  return {reinterpret_cast<detail::Lanes>(_mm512_maskz_mov_pd(bits, reinterpret_cast<__m512d>(a.v)))};
#elif defined(__aarch64__)
  constexpr uint64x2_t bit_of_lane = {1, 2};
  return {reinterpret_cast<detail::Lanes>(reinterpret_cast<uint64x2_t>(a.v) & vtstq_u64(vdupq_n_u64(bits), bit_of_lane))};
#else
  constexpr auto bit_of_lane = []<std::size_t... I>(std::index_sequence<I...>) { return detail::Bits{(1 << I)...}; }(std::make_index_sequence<pack_width>());
  const detail::Bits kept = ((detail::Bits{} + bits) & bit_of_lane) == bit_of_lane;
  return {reinterpret_cast<detail::Lanes>(reinterpret_cast<detail::Bits>(a.v) & kept)};
#endif
}
/// p[lane] -= a[lane] where the bit of the lane is set; nothing else is written.
inline void subtract_at(double* p, std::uint8_t bits, Pack a) noexcept {
  detail::count(pack_width);
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  const __m512d old = _mm512_maskz_loadu_pd(bits, p);
  _mm512_mask_storeu_pd(p, bits, _mm512_sub_pd(old, reinterpret_cast<__m512d>(a.v)));
#else
  for (int i = 0; i < pack_width; ++i)
    if (bits >> i & 1) p[i] -= a.v[i];
#endif
}
/// Lane i: p[at[i]].
inline Pack gather(const double* p, const std::int32_t* at) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  const __m256i index = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(at));
  return {reinterpret_cast<detail::Lanes>(_mm512_mask_i32gather_pd(_mm512_setzero_pd(), 0xff, index, p, 8))};
#else
  Pack r;
  for (int i = 0; i < pack_width; ++i) r.v[i] = p[at[i]];
  return r;
#endif
}
inline Pack abs(Pack a) noexcept {
  return {reinterpret_cast<detail::Lanes>(reinterpret_cast<detail::Bits>(a.v) & std::int64_t{0x7fffffffffffffff})};
}
inline Pack min(Pack a, Pack b) noexcept { return select(a < b, a, b); }
inline Pack max(Pack a, Pack b) noexcept { return select(a > b, a, b); }

namespace detail {
/// Rows i and i + Step change places of their blocks of Step lanes off the diagonal.
template <int Step, int Rows, std::size_t... J>
[[gnu::always_inline]] inline void transpose_blocks(Pack (&rows)[Rows], std::index_sequence<J...>) noexcept {
  constexpr Bits low = {((J & Step) != 0 ? pack_width + static_cast<int>(J) - Step : static_cast<int>(J))...};
  constexpr Bits high = {((J & Step) != 0 ? pack_width + static_cast<int>(J) : static_cast<int>(J) + Step)...};
  _Pragma("GCC unroll 8") for (int i = 0; i < Rows; ++i) {
    if ((i & Step) != 0) continue;
    const Lanes a = rows[i].v, b = rows[i + Step].v;
    rows[i].v = __builtin_shuffle(a, b, low);
    rows[i + Step].v = __builtin_shuffle(a, b, high);
  }
}
}  // namespace detail

/// rows[i][j] <-> rows[j][i]
inline void transpose(Pack (&rows)[pack_width]) noexcept {
  constexpr auto lanes = std::make_index_sequence<pack_width>();
  detail::transpose_blocks<1>(rows, lanes);
  if constexpr (pack_width > 2) detail::transpose_blocks<2>(rows, lanes);
  if constexpr (pack_width > 4) detail::transpose_blocks<4>(rows, lanes);
}

/// rows[i][j] <-> rows[j][i] within each four lanes; in packs of two lanes within the first two rows and the other two.
[[gnu::always_inline]] inline void transpose_fours(Pack (&rows)[4]) noexcept {
  constexpr auto lanes = std::make_index_sequence<pack_width>();
  detail::transpose_blocks<1>(rows, lanes);
  if constexpr (pack_width > 2) detail::transpose_blocks<2>(rows, lanes);
}

/// Sum of the lanes, always in the same order.
inline double sum(Pack a) noexcept {
  detail::count(pack_width);
  double r = 0;
  for (int i = 0; i < pack_width; ++i) r += a.v[i];
  return r;
}

}  // namespace perikit
