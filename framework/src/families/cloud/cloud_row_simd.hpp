#pragma once
/// Rows of four numbers, one a point, in packs: what loops over the bonds of a point of a cloud work on.

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "families/cloud/cloud_families.hpp"
#include "families/cloud/cloud_rows.hpp"
#include "perikit/core/simd.hpp"
#include "perikit/core/tensor.hpp"

namespace perikit {

/// After the parameters of a lambda.
#define PERIKIT_INLINE __attribute__((always_inline))

/// Bits of the first n lanes of a pack.
constexpr std::uint8_t first_lanes(int n) noexcept {
  return static_cast<std::uint8_t>((1u << (n < 0 ? 0 : n > pack_width ? pack_width : n)) - 1);
}

inline const double* numbers(const Row& row) noexcept { return reinterpret_cast<const double*>(&row); }

/// The four numbers of these packs from this one on, a multiple of 4.
inline Row row_at(const Pack* packs, int first) noexcept {
#if defined(__AVX512F__) && defined(__AVX512DQ__) && !defined(PERIKIT_COUNT_OPERATIONS)
  const __m512d pack = reinterpret_cast<__m512d>(packs->v);
  return reinterpret_cast<Row>(first == 0 ? _mm512_maskz_extractf64x4_pd(0xf, pack, 0) : _mm512_maskz_extractf64x4_pd(0xf, pack, 1));
#else
  Row r{};
  for (int c = 0; c < 4; ++c) r[c] = packs[(first + c) / pack_width].v[(first + c) % pack_width];
  return r;
#endif
}

#if defined(__AVX512F__) && defined(__AVX512DQ__)
/// Four numbers from each place, aligned as rows are.
inline Pack load_fours(const double* first, const double* second) noexcept {
  return {reinterpret_cast<detail::Lanes>(_mm512_maskz_insertf64x4(0xff, _mm512_castpd256_pd512(_mm256_load_pd(first)), _mm256_load_pd(second), 1))};
}
#endif

/// Two rows side by side, those of two bonds of a family. They fill a register of eight numbers, two of four or four of two.
class TwoRows {
 public:
  TwoRows() = default;  ///< zero

  static TwoRows load(const Row& first, const Row& second) noexcept {
    TwoRows r;
#if defined(__AVX512F__) && defined(__AVX512DQ__)
    r.part_[0] = load_fours(numbers(first), numbers(second));
#else
    PERIKIT_UNROLL for (int i = 0; i < packs / 2; ++i) {
      r.part_[i] = Pack::load(numbers(first) + i * pack_width);
      r.part_[packs / 2 + i] = Pack::load(numbers(second) + i * pack_width);
    }
#endif
    return r;
  }
  /// The first number everywhere in the first row, the second one in the second row.
  static TwoRows fill(double first, double second) noexcept {
    TwoRows r;
#if defined(__AVX512F__) && defined(__AVX512DQ__)
    r.part_[0].v = reinterpret_cast<detail::Lanes>(_mm512_mask_broadcastsd_pd(_mm512_set1_pd(first), 0xf0, _mm_set_sd(second)));
#else
    PERIKIT_UNROLL for (int i = 0; i < packs / 2; ++i) {
      r.part_[i] = Pack(first);
      r.part_[packs / 2 + i] = Pack(second);
    }
#endif
    return r;
  }

  /// Component c of each row, everywhere in it.
  template <int c>
  TwoRows spread() const noexcept {
    TwoRows r;
    PERIKIT_UNROLL for (int i = 0; i < packs; ++i) {
      const Pack& from = pack_width > 2 ? part_[i] : part_[i / 2 * 2 + c / 2];
      r.part_[i].v = spread_lanes<c>(from.v, std::make_index_sequence<pack_width>());
    }
    return r;
  }
  /// The sum of both rows.
  Row sum() const noexcept { return row_at(part_, 0) + row_at(part_, 4); }

  friend TwoRows operator+(const TwoRows& a, const TwoRows& b) noexcept {
    TwoRows r;
    PERIKIT_UNROLL for (int i = 0; i < packs; ++i) r.part_[i] = a.part_[i] + b.part_[i];
    return r;
  }
  friend TwoRows operator-(const TwoRows& a, const TwoRows& b) noexcept {
    TwoRows r;
    PERIKIT_UNROLL for (int i = 0; i < packs; ++i) r.part_[i] = a.part_[i] - b.part_[i];
    return r;
  }
  friend TwoRows operator*(const TwoRows& a, const TwoRows& b) noexcept {
    TwoRows r;
    PERIKIT_UNROLL for (int i = 0; i < packs; ++i) r.part_[i] = a.part_[i] * b.part_[i];
    return r;
  }
  /// *this += a b
  void add_product(const TwoRows& a, const TwoRows& b) noexcept {
    PERIKIT_UNROLL for (int i = 0; i < packs; ++i) part_[i] = multiply_add(a.part_[i], b.part_[i], part_[i]);
  }

 private:
  static constexpr int packs = 8 / pack_width;

  template <int c, std::size_t... lane>
  static detail::Lanes spread_lanes(detail::Lanes v, std::index_sequence<lane...>) noexcept {
    return __builtin_shufflevector(v, v, ((static_cast<int>(lane) / 4 * 4 + c) % pack_width)...);
  }

  Pack part_[packs];
};

/// visit(e) for e = 0 ... D - 1, which are constants there.
template <int D, class Visit>
[[gnu::always_inline]] inline void over_components(Visit&& visit) noexcept {
  visit(std::integral_constant<int, 0>());
  if constexpr (D > 1) visit(std::integral_constant<int, 1>());
  if constexpr (D > 2) visit(std::integral_constant<int, 2>());
}

/// Asks for the lists of the bonds first ... last - 1 before they are read. Those of a large cloud come from memory, and loops over one half of each
/// family leave gaps that the processor does not foresee.
inline void expect_bonds(const CloudFamilies& families, std::int64_t first, std::int64_t last) noexcept {
  const std::int32_t* const neighbour = families.lists().neighbour.data();
  for (std::int64_t k = first; k < last; k += 16) __builtin_prefetch(neighbour + k);
  if (const double* const omega = families.whole_omegas())
    for (std::int64_t k = first; k < last; k += 8) __builtin_prefetch(omega + k);
}

/// use(j, l, omega) for the bonds of p to j and l, two at a time, with their b omega by row. The last of an odd number goes with p itself, whose
/// omega is 0. Like over_components, for lambdas that are PERIKIT_INLINE, so that sums stay in registers.
template <class Use>
[[gnu::always_inline]] inline void over_bonds(const CloudFamilies& families, std::size_t p, Use&& use) noexcept {
  const std::int32_t* const neighbour = families.lists().neighbour.data();
  const double* const omega = families.omegas();
  const auto end = static_cast<std::size_t>(families.lists().first[p + 1]);
  for (auto k = static_cast<std::size_t>(families.lists().first[p]); k < end; k += 2) {
    const bool two = k + 1 < end;
    use(static_cast<std::size_t>(neighbour[k]), two ? static_cast<std::size_t>(neighbour[k + 1]) : p, TwoRows::fill(omega[k], two ? omega[k + 1] : 0.0));
  }
}

/// As many rows as a pack has lanes, by component: lane l of [c] is component c of row l.
class RowColumns {
 public:
  RowColumns() = default;  ///< zero
  /// Row l: rows[stride at[l]].
  [[gnu::always_inline]] static RowColumns load(const Row* rows, const std::int32_t* at, std::size_t stride = 1) noexcept {
    const auto row = [&](int l) { return numbers(rows[stride * static_cast<std::size_t>(at[l])]); };
    RowColumns r;
#if defined(__AVX512F__) && defined(__AVX512DQ__)
    PERIKIT_UNROLL for (int i = 0; i < 4; ++i) r.column_[i] = load_fours(row(i), row(i + 4));
#else
    PERIKIT_UNROLL for (int i = 0; i < 4; ++i) r.column_[i] = Pack::load(row(i % pack_width) + i / pack_width * pack_width);
#endif
    transpose_fours(r.column_);
    return r;
  }

  const Pack& operator[](int c) const noexcept { return column_[c]; }
  Pack& operator[](int c) noexcept { return column_[c]; }

  /// rows[stride at[l]] += row l, for the first n lanes, whose rows are different ones.
  [[gnu::always_inline]] void add_to(Row* rows, const std::int32_t* at, int n, std::size_t stride = 1) const noexcept {
    const RowColumns by_row(*this, transposed);
    PERIKIT_UNROLL for (int l = 0; l < pack_width; ++l)
      if (l < n) rows[stride * static_cast<std::size_t>(at[l])] += by_row.row(l);
  }
  /// r plus the rows, one after the other.
  [[gnu::always_inline]] Row sum_after(Row r) const noexcept {
    const RowColumns by_row(*this, transposed);
    PERIKIT_UNROLL for (int l = 0; l < pack_width; ++l) r += by_row.row(l);
    return r;
  }

 private:
  static constexpr struct Transposed {
  } transposed{};
  /// Number by number: the compiler moves whole objects through memory.
  [[gnu::always_inline]] RowColumns(const RowColumns& columns, Transposed) noexcept {
    PERIKIT_UNROLL for (int i = 0; i < 4; ++i) column_[i] = columns.column_[i];
    transpose_fours(column_);
  }
  /// Row l, once transposed: rows l and l + 4 share a pack of eight, and a row takes two packs of two.
  Row row(int l) const noexcept {
    if constexpr (pack_width == 2) {
      const Pack halves[] = {column_[l], column_[l + 2]};
      return row_at(halves, 0);
    } else {
      return row_at(column_ + l % 4, l / 4 * 4);
    }
  }

  Pack column_[4];
};

/// Sums over rows, eight at a time whatever the width of a pack is (EightSums).
class EightRows {
 public:
  /// The part that lanes l ... of an array go to, l a multiple of pack_width.
  RowColumns& at(int l) noexcept { return part_[l % 8 / pack_width]; }
  /// ((row 0 + row 1) + row 2) + ...
  [[gnu::always_inline]] Row sum() const noexcept {
    Row r{};
    for (const RowColumns& part : part_) r = part.sum_after(r);
    return r;
  }

 private:
  RowColumns part_[8 / pack_width];
};

}  // namespace perikit
