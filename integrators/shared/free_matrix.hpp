#pragma once
/// The free part of a block matrix as compressed columns.

#include <cstdint>
#include <vector>

#include "perikit/core/block_matrix.hpp"

namespace perikit {

/// Numbers the free components of a block matrix and writes its columns: unknown k is the k-th free component, by block row, then component.
class FreeMatrix {
 public:
  using Index = std::int64_t;

  FreeMatrix() = default;
  FreeMatrix(const BlockMatrix& K, ConstFieldView free);

  std::size_t unknowns() const noexcept { return place_.size(); }
  /// Of unknown k: where its component lies in a field.
  std::size_t place(std::size_t k) const noexcept { return place_[k]; }
  /// Unknown of component a of block row r, -1 where it is not free.
  Index unknown(std::size_t r, int a) const noexcept { return unknown_[r * static_cast<std::size_t>(dimension_) + static_cast<std::size_t>(a)]; }

  /// Column pointers and rows of the upper triangle (upper) or of the whole matrix; rows ascend.
  void pattern(const BlockMatrix& K, bool upper, std::vector<Index>& first, std::vector<Index>& row) const;
  /// The values for that pattern, on all threads. The upper triangle of a symmetric K is read from its rows.
  void values(const BlockMatrix& K, bool upper, const std::vector<Index>& first, std::vector<double>& value) const;

 private:
  template <class Visit>
  void visit_column(const BlockMatrix& K, std::size_t r, int a, bool upper, Visit&& visit) const;

  int dimension_ = 0;
  std::vector<Index> unknown_;
  std::vector<std::size_t> place_;
};

}  // namespace perikit
