#include "setup/gradient_order.hpp"

#include <fmt/format.h>

#include <optional>

#include "families/family_arrays.hpp"
#include "families/reproducing_kernel.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

void refuse_order(const Scene& scene, const Formulation& formulation, const Families& families) {
  if (formulation.order < 2) return;
  const Body& body = families.body();
  FamilyArrays family, largest;
  families.each_class([&](std::span<const std::int32_t> points) {
    families.load(static_cast<std::size_t>(points.front()), BondsOf::set_up, family);
    if (family.bonds > largest.bonds) std::swap(family, largest);
  });
  std::vector<double> g;
  const int supported = largest.bonds > 0 ? point_gradient(largest, body.horizon(), formulation.order, g) : 0;
  const int highest = static_cast<int>(communicator().largest(supported));
  const int bonds = static_cast<int>(communicator().largest(largest.bonds));
  if (highest >= formulation.order || highest == 0) return;  // 0: bodies without gradients have their own warning
  const ParameterValues* values = &scene.kinematics->values;
  if (!values->has("order") && values->has("base")) values = &values->part("base").values;
  throw InputError(values->position("order"), values->path() + ".order",
                   fmt::format("found {}, for which a family needs {} bonds and more; the largest one here has {} and supports "
                               "order {}; allowed: 1 to {}, or a wider horizon",
                               formulation.order, monomials(body.dimension(), formulation.order), bonds, highest, highest));
}

void set_cell_moments(const Scene& scene, const Body& body, Formulation& formulation) {
  const std::optional<bool> wanted = formulation.point ? formulation.point->cell_moments() : false;
  const bool possible = formulation.order > 1 && body.lattice();
  if (wanted.value_or(false) && !possible) {
    const ParameterValues& values = scene.kinematics->values;
    throw InputError(values.position("cell_moments"), values.path() + ".cell_moments",
                     formulation.order < 2 ? "found true with order = 1, whose gradient is the same everywhere in the cell of a point; allowed: order = 2 or more, or false"
                                           : "found true on points that are no lattice, the moments of whose cells are not known; allowed: [body.lattice] without jitter and "
                                             "partial_volume, or false");
  }
  if (wanted.value_or(possible)) formulation.cell = body.lattice()->spacing;
}

}  // namespace perikit
