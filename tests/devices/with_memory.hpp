#pragma once
#include <vector>

#include "perikit/core/tensor.hpp"
#include "perikit/model/material.hpp"

namespace perikit {

/// A law that asks for memory, which no device can give.
struct WithMemory {
  static constexpr MaterialTraits traits{.constants = 1};
  void constants(const MaterialInput& input, double* k) const { k[0] = input.value("modulus"); }
  Moduli small_strain(const double* k) const noexcept { return {0, k[0]}; }
  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    std::vector<T> squares;
    for (int c = 0; c < S::components; ++c) squares.push_back(H[c] * H[c]);
    T sum = 0.0;
    for (const T& square : squares) sum += square;
    return k[0] * sum;
  }
};

}  // namespace perikit
