#include "families/regular_family.hpp"

#include <algorithm>
#include <cmath>

#include "body/family_limit.hpp"

namespace perikit {

FamilyArrays regular_family(const Families& families) {
  const Body& body = families.body();
  const auto d = static_cast<std::size_t>(body.dimension());
  Lattice lattice;
  lattice.dimension = body.dimension();
  lattice.spacing = body.spacing();
  for (std::size_t a = 0; a < 3; ++a) lattice.extent[a] = a < d ? std::int64_t{1} << 20 : 1;
  const auto offsets = family_offsets(lattice, body.horizon());
  FamilyArrays family;
  family.resize(body.dimension(), static_cast<int>(offsets.size()));
  std::vector<double> r, omega(offsets.size(), 1.0);
  for (std::size_t k = 0; k < offsets.size(); ++k) {
    double square = 0;
    for (std::size_t a = 0; a < d; ++a) {
      family.xi[a][k] = offsets[k][a] * body.spacing();
      square += family.xi[a][k] * family.xi[a][k];
    }
    family.length[k] = std::sqrt(square);
    family.volume[k] = body.section() * std::pow(body.spacing(), body.dimension());
    r.push_back(relative_length(family.length[k], body.horizon()));
  }
  if (families.needs().influence) families.influence()->evaluate(r, omega);
  std::ranges::copy(omega, family.omega.begin());
  return family;
}

}  // namespace perikit
