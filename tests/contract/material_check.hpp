#pragma once
/// What the material suites share: one material in one space, random points, comparisons that say what they compared.
/// Differences are compared with a tolerance times a stated magnitude: `stress scale` = largest |A| times (1 + largest |H|) at
/// the point, where a condensed A (plane and uniaxial stress) counts at least lambda + 2 mu.

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <sstream>
#include <string>

#include "tests/contract/material_batch.hpp"

namespace perikit::contract {

struct MaterialOptions {
  std::string law;                                 ///< name for messages
  double least_stretch = 0.2, most_stretch = 5.0;  ///< of the random deformations, where all stretches are given
  double least_free = 0.8, most_free = 1.2;        ///< the same where a stretch is free (some laws have no solution far out)
  double smallest_strain = 1e-10;                  ///< that P and psi keep eight digits of; larger for laws written in F
  std::vector<bool> moduli = {};                   ///< which constants are moduli [Pa]; empty: all
  std::uint64_t seed = 20240229;
};

/// Base of the suites.
class MaterialCheck {
 public:
  MaterialCheck(const Material& material, std::vector<double> constants, Space space, MaterialOptions options)
      : material_(material),
        traits_(material.traits()),
        constants_(std::move(constants)),
        space_(space),
        options_(std::move(options)),
        components_(tensor_components(space)),
        random_(options_.seed) {}

 protected:
  std::string label() const {
    std::ostringstream s;
    s << options_.law << ", " << name(space_) << ", constants";
    for (const double k : constants_) s << ' ' << k;
    s << ", seed " << options_.seed << ": ";
    return s.str();
  }

  /// |found - expected| <= tolerance * scale in every entry, reported once with the worst entry.
  void near(const std::string& identity, const Values& found, const Values& expected, double tolerance, double scale) const {
    std::size_t worst = 0;
    double error = -1;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const double e = std::abs(found[i] - expected[i]);
      if (!(e <= error)) worst = i, error = e;
      if (std::isnan(e)) break;
    }
    CHECK_MESSAGE(error <= tolerance * scale, label(), identity, ": component ", worst, " is ", found[worst], ", expected ",
                  expected[worst], ", error ", error, " > ", tolerance, " * ", scale);
  }
  void same_bits(const std::string& identity, const Values& found, const Values& expected) const {
    std::size_t i = 0;
    while (i < found.size() && std::bit_cast<std::uint64_t>(found[i]) == std::bit_cast<std::uint64_t>(expected[i])) ++i;
    if (i == found.size()) return;
    CHECK_MESSAGE(i == found.size(), label(), identity, ": value ", i, " is ", found[i], ", expected ", expected[i]);
  }

  Values gradient(const Matrix& F) const {
    Values H = restrict_to(space_, F);
    std::size_t c = 0;
    for (const int k : places(space_)) H[c++] -= identity[k];
    return H;
  }
  Matrix deformation(const Values& H) const {
    Matrix F = extend(space_, H);
    for (int i = 0; i < 3; ++i) F[4 * i] += 1;
    return F;
  }
  Matrix random_F() {
    const bool free = free_stretch(space_);
    return random_deformation(random_, space_, free ? options_.least_free : options_.least_stretch,
                              free ? options_.most_free : options_.most_stretch);
  }
  std::vector<Values> random_points(int n) {
    std::vector<Values> r;
    for (int p = 0; p < n; ++p) r.push_back(gradient(random_F()));
    return r;
  }
  std::vector<Values> random_directions(int n) {
    std::vector<Values> r;
    for (int p = 0; p < n; ++p) r.push_back(random_direction(random_, space_));
    return r;
  }
  Evaluation evaluate(const std::vector<Values>& points, const std::vector<Values>& directions = {}) const {
    return {material_, space_, constants_, points, directions};
  }
  /// Largest stiffness; a condensed one is a difference of uncondensed ones, of the size of lambda + 2 mu.
  double stiffness_scale(const Values& A) const {
    const Moduli m = material_.small_strain(constants_.data());
    return free_stretch(space_) ? std::max(largest(A), m.lambda + 2 * m.mu) : largest(A);
  }
  double stress_scale(const Evaluation& e, int p) const { return stiffness_scale(e.at(e.A, p)) * (1 + largest(e.at(e.H, p))); }

  /// C : a with the small-strain moduli, condensed where stretches are free.
  Values linear_stress(const Values& a) const {
    const Moduli m = material_.small_strain(constants_.data());
    const int d = dimension(space_);
    const bool free = free_stretch(space_);
    const double lambda = !free ? m.lambda : d == 2 ? 2 * m.lambda * m.mu / (m.lambda + 2 * m.mu) : m.youngs() - 2 * m.mu;
    Matrix full = extend(space_, a);
    if (free)
      for (int i = d; i < 3; ++i) full[4 * i] = 0;
    const double trace = full[0] + full[4] + full[8];
    Matrix s{};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) s[3 * i + j] = m.mu * (full[3 * i + j] + full[3 * j + i]) + (i == j ? lambda * trace : 0.0);
    if (free)
      for (int i = d; i < 3; ++i) s[4 * i] = 0;
    return restrict_to(space_, s);
  }

  const Material& material_;
  MaterialTraits traits_;
  std::vector<double> constants_;
  Space space_;
  MaterialOptions options_;
  int components_;
  Random random_;
};

}  // namespace perikit::contract
