#pragma once
/// Component-major, 64-byte aligned, padded arrays: component c at point p is data[c * stride + p].

#include <cstddef>
#include <algorithm>
#include <new>
#include <span>
#include <string>
#include <vector>

namespace perikit {

namespace detail {
/// 64-byte aligned memory; large pieces ask for huge pages, for lattices jump by whole planes and clouds at random. Throws std::bad_alloc.
void* allocate_aligned(std::size_t bytes);
void free_aligned(void* memory) noexcept;
}  // namespace detail

template <class T>
struct AlignedAllocator {
  using value_type = T;
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) noexcept {}
  T* allocate(std::size_t n) { return static_cast<T*>(detail::allocate_aligned(n * sizeof(T))); }
  void deallocate(T* p, std::size_t) noexcept { detail::free_aligned(p); }
  bool operator==(const AlignedAllocator&) const = default;
};

template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

/// Points are counted in multiples of this, whatever the width of a SIMD register.
inline constexpr std::size_t padding = 8;

constexpr std::size_t padded(std::size_t n) noexcept { return (n + padding - 1) / padding * padding; }

/// A view of a field that somebody else owns. `stride` points per component (a multiple of `padding`).
struct FieldView {
  double* data = nullptr;
  std::size_t stride = 0;
  int components = 0;
  double* component(int c) const noexcept { return data + static_cast<std::size_t>(c) * stride; }
  std::size_t size() const noexcept { return stride * static_cast<std::size_t>(components); }
};

struct ConstFieldView {
  const double* data = nullptr;
  std::size_t stride = 0;
  int components = 0;
  ConstFieldView() = default;
  ConstFieldView(const double* d, std::size_t s, int c) : data(d), stride(s), components(c) {}
  ConstFieldView(const FieldView& v) : data(v.data), stride(v.stride), components(v.components) {}
  const double* component(int c) const noexcept { return data + static_cast<std::size_t>(c) * stride; }
  std::size_t size() const noexcept { return stride * static_cast<std::size_t>(components); }
};

/// An owned field, zero on creation. `margin` extra zero points lie before and after every component, so that kernels may
/// read beyond the ends without a test.
class Field {
 public:
  Field() = default;
  Field(int components, std::size_t stride, std::size_t margin = 0)
      : components_(components), stride_(stride), margin_(padded(margin)),
        data_(2 * margin_ + stride * static_cast<std::size_t>(components), 0.0) {}
  FieldView view() noexcept { return {data(), stride_, components_}; }
  ConstFieldView view() const noexcept { return {data(), stride_, components_}; }
  operator FieldView() noexcept { return view(); }
  operator ConstFieldView() const noexcept { return view(); }
  double* data() noexcept { return data_.data() + margin_; }
  const double* data() const noexcept { return data_.data() + margin_; }
  double* component(int c) noexcept { return data() + static_cast<std::size_t>(c) * stride_; }
  const double* component(int c) const noexcept { return data() + static_cast<std::size_t>(c) * stride_; }
  int components() const noexcept { return components_; }
  std::size_t stride() const noexcept { return stride_; }
  std::size_t size() const noexcept { return stride_ * static_cast<std::size_t>(components_); }
  std::size_t bytes() const noexcept { return data_.size() * sizeof(double); }
  void fill(double value) { std::fill(data(), data() + size(), value); }

 private:
  int components_ = 0;
  std::size_t stride_ = 0;
  std::size_t margin_ = 0;
  AlignedVector<double> data_;
};

}  // namespace perikit
