#include "perikit/core/spectral.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "tests/contract/material_batch.hpp"

using namespace perikit;

// Wrong where two or three eigenvalues are equal, nearly equal or nothing but rounding errors of each other.
TEST_CASE("symmetric tensors are taken apart and put together for every distance of the eigenvalues") {
  contract::Random random(5);
  for (int trial = 0; trial < 4000; ++trial) {
    const double size = std::pow(10.0, contract::uniform(random, -120, 120));
    const double gap = std::pow(10.0, contract::uniform(random, -17, 1)),
                 other = trial % 2 ? std::pow(10.0, contract::uniform(random, -17, 1)) : 0.0;
    const contract::Matrix Q = trial % 7 ? contract::random_rotation(random, Space::solid) : contract::identity;
    const double l[3] = {size, size * (1 + gap), size * (1 - other)};
    Tensor<Pack, Solid> a = Tensor<Pack, Solid>::build_symmetric([&](int i, int j) {
      double r = 0;
      for (int k = 0; k < 3; ++k) r += Q[3 * i + k] * l[k] * Q[3 * j + k];
      return Pack(trial == 0 ? 0.0 : r);
    });
    const Spectral<Pack, Solid> s = spectral(a);
    const Tensor<Pack, Solid> again = compose(s.vectors, s.values), unit = gram(s.vectors);
    for (int c = 0; c < 9; ++c) {
      CHECK_MESSAGE(std::abs(again[c][0] - a[c][0]) <= 1e-14 * size * (2 + gap), "trial ", trial, ", gaps ", gap, " ", other,
                    ", component ", c);
      CHECK_MESSAGE(std::abs(unit[c][0] - (c % 4 == 0)) <= 1e-15 * 3, "not orthonormal: trial ", trial, ", gaps ", gap, " ",
                    other);
    }
  }
}

TEST_CASE("a plane tensor keeps its out-of-plane eigenvalue apart") {
  contract::Random random(6);
  for (int trial = 0; trial < 500; ++trial) {
    const double gap = std::pow(10.0, contract::uniform(random, -20, 1)), x = contract::uniform(random, -1, 1);
    const Tensor<double, Plane> a{{x, gap, gap, trial % 3 ? x : x - gap, 7.0}};
    const Spectral<double, Plane> s = spectral(a);
    const Tensor<double, Plane> again = compose(s.vectors, s.values);
    CHECK(s.values[2] == 7.0);
    for (int c = 0; c < 5; ++c) CHECK(std::abs(again[c] - a[c]) <= 1e-15 * (2 + 4 * gap) * (c == 4 ? 7 : 1));
  }
}
