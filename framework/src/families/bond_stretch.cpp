#include "families/bond_stretch.hpp"

#include <cmath>

namespace perikit {

double bond_stretch(const Body& body, ConstFieldView u, BondId bond) noexcept {
  const auto p = static_cast<std::size_t>(bond.point), q = static_cast<std::size_t>(bond.far);
  const Point x = body.position(p), y = body.position(q);
  double square = 0, change = 0;  // as in Stretch: e = (|y|^2 - |xi|^2)/(|y| + |xi|)
  for (int c = 0; c < u.components; ++c) {
    const double xi = y[static_cast<std::size_t>(c)] - x[static_cast<std::size_t>(c)], du = u.component(c)[q] - u.component(c)[p];
    square += xi * xi;
    change += du * (xi + xi + du);
  }
  const double length = std::sqrt(square);
  return change / (std::sqrt(square + change) + length) / length;
}

double bond_stretch(const FamilyArrays& family, std::size_t k, std::size_t point, ConstFieldView u) noexcept {
  const auto far = static_cast<std::size_t>(family.far[k]);
  double change = 0;
  for (int c = 0; c < u.components; ++c) {
    const double xi = family.xi[c][k], du = u.component(c)[far] - u.component(c)[point];
    change += du * (xi + xi + du);
  }
  const double length = family.length[k];
  return change / (std::sqrt(length * length + change) + length) / length;
}

}  // namespace perikit
