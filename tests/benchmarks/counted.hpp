#pragma once
/// A number that counts the operations done with it, to find out how many a law needs. Each operation on the same operands counts
/// once, as compilers see to it: what two components or two columns of a tangent share is computed once.

#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <tuple>

namespace perikit {

class Counted {
 public:
  Counted() : Counted(0.0) {}
  /// A constant.
  Counted(double v) noexcept : value_(v), name_(name({'c', std::bit_cast<std::int64_t>(v), 0}, 0)), constant_(true) {}
  /// An input: like no other number.
  static Counted variable(double v) noexcept { return {v, ++last_name_}; }

  static std::int64_t operations() noexcept { return operations_; }
  /// Begins to count anew.
  static void forget() {
    results_.clear();
    operations_ = 0;
  }

  friend Counted operator+(Counted a, Counted b) noexcept { return commutative(a.value_ + b.value_, '+', a, b); }
  friend Counted operator-(Counted a, Counted b) noexcept { return operation(a.value_ - b.value_, 1, '-', a, b); }
  friend Counted operator-(Counted a) noexcept {
    return operation(-a.value_, 0, 'n', a, a);
  }  // taken into the operation that follows
  friend Counted operator*(Counted a, Counted b) noexcept { return commutative(a.value_ * b.value_, '*', a, b); }
  friend Counted operator/(Counted a, Counted b) noexcept { return operation(a.value_ / b.value_, 1, '/', a, b); }
  Counted& operator+=(Counted b) noexcept { return *this = *this + b; }
  Counted& operator-=(Counted b) noexcept { return *this = *this - b; }
  Counted& operator*=(Counted b) noexcept { return *this = *this * b; }
  friend bool operator<(Counted a, Counted b) noexcept { return a.value_ < b.value_; }
  friend bool operator>(Counted a, Counted b) noexcept { return a.value_ > b.value_; }

  // Elementary functions count as what their SIMD versions do (perikit/core/simd_math.hpp); choices count nothing.
  friend Counted sqrt(Counted a) noexcept { return operation(std::sqrt(a.value_), 1, 's', a, a); }
  friend Counted log1p(Counted a) noexcept { return operation(std::log1p(a.value_), 48, 'l', a, a); }
  friend Counted cbrt(Counted a) noexcept { return operation(std::cbrt(a.value_), 46, 'r', a, a); }
  friend Counted reciprocal_cbrt(Counted a) noexcept { return operation(1 / std::cbrt(a.value_), 30, 'i', a, a); }
  friend Counted abs(Counted a) noexcept { return operation(std::abs(a.value_), 0, 'a', a, a); }
  friend Counted min(Counted a, Counted b) noexcept { return a.value_ < b.value_ ? a : b; }
  friend Counted max(Counted a, Counted b) noexcept { return a.value_ > b.value_ ? a : b; }
  friend Counted select(bool m, Counted a, Counted b) noexcept { return m ? a : b; }

 private:
  using Key = std::tuple<char, std::int64_t, std::int64_t>;

  Counted(double v, std::int64_t n) noexcept : value_(v), name_(n) {}

  /// The name of the result of an operation; one that is new costs something.
  static std::int64_t name(Key key, int cost) {
    const auto [entry, fresh] = results_.try_emplace(key, last_name_ + 1);
    if (!fresh) return entry->second;
    operations_ += cost;
    return ++last_name_;
  }
  static Counted operation(double v, int cost, char what, Counted a, Counted b) {
    if (a.constant_ && b.constant_) return {v};
    return {v, name({what, a.name_, b.name_}, cost)};
  }
  static Counted commutative(double v, char what, Counted a, Counted b) {
    if (what == '*' && a.constant_ && a.value_ == 1) return b;
    if (what == '*' && b.constant_ && b.value_ == 1) return a;
    return a.name_ < b.name_ ? operation(v, 1, what, a, b) : operation(v, 1, what, b, a);
  }

  double value_;
  std::int64_t name_;
  bool constant_ = false;
  static inline std::map<Key, std::int64_t> results_;
  static inline std::int64_t operations_ = 0, last_name_ = 0;
};

}  // namespace perikit
