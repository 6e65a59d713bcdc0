#pragma once
/// A pack of doubles that fills one SIMD register of the target, and the few operations that kernels and laws need.
/// GCC/Clang vector extensions underneath; width 8 (AVX-512), 4 (AVX) or 2 (SSE2, NEON).

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <type_traits>
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
typedef std::uint64_t UnsignedBits __attribute__((vector_size(8 * pack_width)));
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

/// Result of a lane-wise comparison: in each lane, whether it holds. Masks are joined by & and | and negated by !; select(mask, a, b) chooses.
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
  // Conditions that are the same in all lanes.
  template <std::same_as<bool> B>
  friend PackMask operator&(PackMask a, B b) noexcept { return b ? a : PackMask{}; }
  template <std::same_as<bool> B>
  friend PackMask operator&(B a, PackMask b) noexcept { return b & a; }
  template <std::same_as<bool> B>
  friend PackMask operator|(PackMask a, B b) noexcept { return b ? !PackMask{} : a; }
  template <std::same_as<bool> B>
  friend PackMask operator|(B a, PackMask b) noexcept { return b | a; }

  /// There is none: the points of a pack may answer differently. Says so where a mask stands in `if`, `?:`, `&&`, `||` or a bool.
  template <std::same_as<bool> B>
  operator B() const noexcept {
    static_assert(!std::same_as<B, bool>,
                  "a comparison of packs has an answer for each point: instead of if, ?:, && and || write select(a < b, x, y), & and |; "
                  "any(mask) and all(mask) are bools");
    return false;
  }
};

struct Product;

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

  inline Pack& operator+=(Pack b) noexcept;
  inline Pack& operator-=(Pack b) noexcept;
  inline Pack& operator+=(const Product& p) noexcept;
  inline Pack& operator-=(const Product& p) noexcept;
  inline Pack& operator*=(Pack b) noexcept;
  inline Pack& operator/=(Pack b) noexcept;
};

inline Pack operator+(Pack a, Pack b) noexcept {
  detail::count(pack_width);
  return {a.v + b.v};
}
inline Pack operator-(Pack a, Pack b) noexcept {
  detail::count(pack_width);
  return {a.v - b.v};
}
inline Pack operator/(Pack a, Pack b) noexcept {
  detail::count(pack_width);
  return {a.v / b.v};
}
inline Pack operator-(Pack a) noexcept { return {-a.v}; }

/// a b + c, rounded once where the level has an instruction for it (x86-64-v3 and -v4, aarch64), else twice. What the compiler would fuse by itself
/// is not fused (-ffp-contract=off): it takes one product in one copy of a loop, and another one or none in the next.
inline Pack multiply_add(Pack a, Pack b, Pack c) noexcept {
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
/// a b - c, likewise.
inline Pack multiply_subtract(Pack a, Pack b, Pack c) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  detail::count(2 * pack_width);
  return {reinterpret_cast<detail::Lanes>(_mm512_fmsub_pd(reinterpret_cast<__m512d>(a.v), reinterpret_cast<__m512d>(b.v), reinterpret_cast<__m512d>(c.v)))};
#elif defined(__AVX__) && defined(__FMA__)
  detail::count(2 * pack_width);
  return {reinterpret_cast<detail::Lanes>(_mm256_fmsub_pd(reinterpret_cast<__m256d>(a.v), reinterpret_cast<__m256d>(b.v), reinterpret_cast<__m256d>(c.v)))};
#else
  return multiply_add(a, b, -c);
#endif
}
/// c - a b, likewise.
inline Pack subtract_product(Pack a, Pack b, Pack c) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  detail::count(2 * pack_width);
  return {reinterpret_cast<detail::Lanes>(_mm512_fnmadd_pd(reinterpret_cast<__m512d>(a.v), reinterpret_cast<__m512d>(b.v), reinterpret_cast<__m512d>(c.v)))};
#elif defined(__AVX__) && defined(__FMA__)
  detail::count(2 * pack_width);
  return {reinterpret_cast<detail::Lanes>(_mm256_fnmadd_pd(reinterpret_cast<__m256d>(a.v), reinterpret_cast<__m256d>(b.v), reinterpret_cast<__m256d>(c.v)))};
#else
  return multiply_add(-a, b, c);
#endif
}

/// A product that is not rounded yet. A sum or a difference with it is rounded once: `a * b + c` is multiply_add(a, b, c), wherever it stands, at
/// every level and whatever the compiler does. Of `a * b + c * d` the second product is rounded by itself, and so is every product that is used as a Pack.
struct Product {
  Pack a, b;

  operator Pack() const noexcept {
    detail::count(pack_width);
    return {a.v * b.v};
  }
  void store(double* p) const noexcept { Pack(*this).store(p); }
  void store_first(double* p, int n) const noexcept { Pack(*this).store_first(p, n); }
  double operator[](int lane) const noexcept { return a.v[lane] * b.v[lane]; }
};
inline Product operator*(Pack a, Pack b) noexcept { return {a, b}; }
inline Product operator-(const Product& p) noexcept { return {-p.a, p.b}; }
inline Pack operator+(const Product& p, Pack c) noexcept { return multiply_add(p.a, p.b, c); }
inline Pack operator+(Pack c, const Product& p) noexcept { return multiply_add(p.a, p.b, c); }
inline Pack operator+(const Product& p, const Product& q) noexcept { return multiply_add(p.a, p.b, Pack(q)); }
inline Pack operator-(const Product& p, Pack c) noexcept { return multiply_subtract(p.a, p.b, c); }
inline Pack operator-(Pack c, const Product& p) noexcept { return subtract_product(p.a, p.b, c); }
inline Pack operator-(const Product& p, const Product& q) noexcept { return multiply_subtract(p.a, p.b, Pack(q)); }

inline Pack& Pack::operator+=(Pack b) noexcept { return *this = *this + b; }
inline Pack& Pack::operator-=(Pack b) noexcept { return *this = *this - b; }
inline Pack& Pack::operator+=(const Product& p) noexcept { return *this = *this + p; }
inline Pack& Pack::operator-=(const Product& p) noexcept { return *this = *this - p; }
inline Pack& Pack::operator*=(Pack b) noexcept { return *this = *this * b; }
inline Pack& Pack::operator/=(Pack b) noexcept { return *this = *this / b; }

#if defined(__AVX512F__) && defined(__AVX512DQ__)
namespace detail {
template <int predicate>
PackMask compare(Pack a, Pack b) noexcept {
  return {_mm512_cmp_pd_mask(reinterpret_cast<__m512d>(a.v), reinterpret_cast<__m512d>(b.v), predicate)};
}
}  // namespace detail
inline PackMask operator<(Pack a, Pack b) noexcept { return detail::compare<_CMP_LT_OQ>(a, b); }
inline PackMask operator<=(Pack a, Pack b) noexcept { return detail::compare<_CMP_LE_OQ>(a, b); }
inline PackMask operator==(Pack a, Pack b) noexcept { return detail::compare<_CMP_EQ_OQ>(a, b); }
#else
inline PackMask operator<(Pack a, Pack b) noexcept { return {a.v < b.v}; }
inline PackMask operator<=(Pack a, Pack b) noexcept { return {a.v <= b.v}; }
inline PackMask operator==(Pack a, Pack b) noexcept { return {a.v == b.v}; }
#endif
inline PackMask operator>(Pack a, Pack b) noexcept { return b < a; }
inline PackMask operator>=(Pack a, Pack b) noexcept { return b <= a; }
inline PackMask operator!=(Pack a, Pack b) noexcept { return !(a == b); }

inline Pack select(PackMask m, Pack a, Pack b) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  return {reinterpret_cast<detail::Lanes>(_mm512_mask_blend_pd(m.v, reinterpret_cast<__m512d>(b.v), reinterpret_cast<__m512d>(a.v)))};
#else
  return {m.v ? a.v : b.v};
#endif
}
// Numbers with a mask are packs. (Without these two, a mask and a number would be as far from the one as from the other overload.)
inline Pack select(PackMask m, double a, double b) noexcept { return select(m, Pack(a), Pack(b)); }
inline Pack select(bool m, Pack a, Pack b) noexcept { return m ? a : b; }

/// Numbers of the language, of which two have a common type.
template <class T>
concept Number = std::is_arithmetic_v<T>;
template <std::integral M, Number A, Number B>
std::common_type_t<A, B> select(M m, A a, B b) noexcept { return m ? std::common_type_t<A, B>(a) : std::common_type_t<A, B>(b); }

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
inline bool all(bool m) noexcept { return m; }
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
// Reciprocals and roots begin with a guess from the bits of the number: an exponent and digits that are subtracted from a constant are about the
// logarithm with another sign. Estimates by instructions (vrcp14pd, vrsqrt14pd) would be other numbers at other levels and by other makers.
/// 1/a for normal a and 1/a, to about one unit in the last place.
inline Pack reciprocal(Pack a) noexcept {
  Pack r = {reinterpret_cast<detail::Lanes>(0x7fde663822fc16e6 - reinterpret_cast<detail::UnsignedBits>(a.v))};  // to 1/20
  r = r * (Pack(2.0013) - a * r);           // to 1/769: 2 + the square of the error, halved, leaves errors of either sign
  r = r * (Pack(2.0000008455) - a * r);     // to 2^-20
  const Pack e = Pack(1.0) - a * r;
  return r + r * (e + e * e);
}
/// 1/sqrt(a) for normal a > 0, to about one unit in the last place. It says nothing where a is 0, and is not a number where a is infinite.
inline Pack reciprocal_root(Pack a) noexcept {
  Pack r = {reinterpret_cast<detail::Lanes>(0x5fe4075000000000 - (reinterpret_cast<detail::UnsignedBits>(a.v) >> 1))};
  const Pack t = (a * r) * r;  // 0.7517 to 0.8458, for which the polynomial is 1/sqrt(t) to 2^-16
  r *= Pack(2.0998561) + t * (Pack(-1.7546571) + t * Pack(0.65922143));
  const Pack e = Pack(1.0) - (a * r) * r;
  return r + (r * e) * (Pack(0.5) + e * (Pack(0.375) + Pack(0.3125) * e));
}
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
  _Pragma("GCC unroll 8") for (int i = 0; i < Rows; ++i) {
    if ((i & Step) != 0) continue;
    const Lanes a = rows[i].v, b = rows[i + Step].v;
    rows[i].v = __builtin_shufflevector(a, b, ((J & Step) != 0 ? pack_width + static_cast<int>(J) - Step : static_cast<int>(J))...);
    rows[i + Step].v = __builtin_shufflevector(a, b, ((J & Step) != 0 ? pack_width + static_cast<int>(J) : static_cast<int>(J) + Step)...);
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

/// A sum over eight lanes at a time, whatever the width of a pack is: sums over points and bonds, with the same bits at every width.
class EightSums {
 public:
  EightSums() noexcept = default;
  /// The part that lanes l ... of an array go to, l a multiple of pack_width.
  Pack& at(int l) noexcept { return part_[l % 8 / pack_width]; }
  friend EightSums operator+(const EightSums& a, const EightSums& b) noexcept {
    EightSums r;
    for (int i = 0; i < packs; ++i) r.part_[i] = a.part_[i] + b.part_[i];
    return r;
  }
  /// ((lane 0 + lane 1) + lane 2) + ...
  double total() const noexcept {
    detail::count(8);
    double r = 0;
    for (int i = 0; i < 8; ++i) r += part_[i / pack_width].v[i % pack_width];
    return r;
  }

 private:
  static constexpr int packs = 8 / pack_width;
  Pack part_[packs];
};

}  // namespace perikit
