#include "perikit/problem/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "perikit/core/communicator.hpp"
#include "perikit/core/exact_sum.hpp"
#include "perikit/core/field_operations.hpp"

namespace perikit {

namespace {

template <int D>
ExactSum kinetic_energy_of(std::span<const double> masses, ConstFieldView velocity) {
  std::array<const double*, D> v;
  for (int c = 0; c < D; ++c) v[static_cast<std::size_t>(c)] = velocity.component(c);
  return exact_sum(masses.size(), [v, m = masses.data()](std::size_t p) {
    double v2 = 0;
    for (const double* const component : v) v2 += component[p] * component[p];
    return 0.5 * m[p] * v2;
  });
}

}  // namespace

double kinetic_energy(const Problem& problem, ConstFieldView velocity) {
  const std::span<const double> masses = problem.masses().by_point();
  switch (velocity.components) {
    case 1: return total_over_ranks(kinetic_energy_of<1>(masses, velocity));
    case 2: return total_over_ranks(kinetic_energy_of<2>(masses, velocity));
    default: return total_over_ranks(kinetic_energy_of<3>(masses, velocity));
  }
}

Field accelerations(Problem& problem, double t) {
  Field a = problem.make_field();
  const std::span<const double> masses = problem.masses().by_point();
  const ConstFieldView internal = problem.state().internal_force();
  const FieldView external = problem.loads().any() ? problem.state().external_force() : FieldView{};
  for (int c = 0; c < problem.dimension(); ++c)
    for (const std::int32_t index : problem.points().owned()) {
      const auto p = static_cast<std::size_t>(index);
      a.component(c)[p] = (internal.component(c)[p] + (external.data ? external.component(c)[p] : 0.0)) / masses[p];
    }
  problem.constraints().prescribe_acceleration(t, a);
  return a;
}

Field reactions(Problem& problem, bool dynamic, double t, Field memory) {
  Field r = std::move(memory);
  if (r.size() == 0)
    r = problem.make_field();
  else
    r.fill(0.0);
  if (!problem.constraints().any() && !problem.images()) return r;
  const ConstFieldView internal = problem.state().internal_force();
  const FieldView external = problem.loads().any() ? problem.state().external_force() : FieldView{};
  const double* const masses = dynamic ? problem.masses().by_point().data() : nullptr;  // statics may have none
  if (dynamic) problem.constraints().prescribe_acceleration(t, r);
  for (const std::int64_t dof : problem.constraints().dofs()) {
    const double inertia = masses ? masses[static_cast<std::size_t>(dof) % r.stride()] * r.data()[dof] : 0.0;
    r.data()[dof] = -internal.data[dof] - (external.data ? external.data[dof] : 0.0) + inertia;
  }
  if (problem.images()) problem.images()->gather(r);
  return r;
}

Field reaction_couples(Problem& problem, Field memory) {
  const Points& points = problem.points();
  Field couples = std::move(memory);
  if (couples.size() == 0)
    couples = points.make_field(points.dimension() == 3 ? 3 : 1);
  else
    couples.fill(0.0);
  if (!problem.images()) return couples;
  // Images have no mass: what acts on them goes to their plane.
  Field u = problem.make_field(), on_images = problem.make_field();
  const ConstFieldView internal = problem.state().internal_force(), displacement = problem.state().displacement();
  const FieldView external = problem.loads().any() ? problem.state().external_force() : FieldView{};
  for (const std::int32_t p : points.live())
    for (int c = 0; c < points.dimension(); ++c) {
      u.component(c)[p] = displacement.component(c)[p];
      if (points.image(static_cast<std::size_t>(p))) on_images.component(c)[p] = -internal.component(c)[p] - (external.data ? external.component(c)[p] : 0.0);
    }
  problem.share(u);
  problem.images()->extend(u);
  problem.images()->add_couples(on_images, u, couples);
  return couples;
}

std::vector<Field> rigid_motions(const Points& points, ConstFieldView u) {
  const int d = points.dimension();
  Point middle{};
  for (std::size_t c = 0; c < 3; ++c) {
    ExactSum sum;
    for (const std::int32_t p : points.owned()) sum.add(points.position(static_cast<std::size_t>(p))[c]);
    middle[c] = total_over_ranks(sum) / static_cast<double>(points.size_on_all_ranks());
  }
  double size = points.spacing();
  for (const std::int32_t p : points.owned())
    for (std::size_t c = 0; c < 3; ++c)
      size = std::max(size, std::abs(points.position(static_cast<std::size_t>(p))[c] - middle[c]));
  size = communicator().largest(size);
  std::vector<Field> motions;
  for (int k = 0; k < d * (d + 1) / 2; ++k) motions.push_back(points.make_field(d));
  for (const std::int32_t index : points.live()) {
    const auto p = static_cast<std::size_t>(index);
    Point y = points.position(p);
    for (int c = 0; c < d; ++c) {
      y[static_cast<std::size_t>(c)] += u.component(c)[p] - middle[static_cast<std::size_t>(c)];
      motions[static_cast<std::size_t>(c)].component(c)[p] = 1;
    }
    std::size_t k = static_cast<std::size_t>(d);
    for (int a = 0; a < d; ++a)
      for (int b = a + 1; b < d; ++b, ++k) {
        motions[k].component(a)[p] = -y[static_cast<std::size_t>(b)] / size;
        motions[k].component(b)[p] = y[static_cast<std::size_t>(a)] / size;
      }
  }
  return motions;
}

}  // namespace perikit
