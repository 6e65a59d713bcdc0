// Cost of one stress P and of one tangent A per evaluation point, for every law and space, in batches of 128 through the virtual
// call, on one thread: time, evaluations per second, counted operations (what components and columns share once) and the share of
// this machine's measured multiply-add peak. Markdown. Plane and uniaxial stress are solved by iteration: their operations depend
// on the point and are not counted.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "materials/hencky/law.hpp"
#include "materials/hypoelastic/law.hpp"
#include "materials/linear_elastic/law.hpp"
#include "materials/mooney_rivlin/law.hpp"
#include "materials/neo_hookean/law.hpp"
#include "materials/saint_venant_kirchhoff/law.hpp"
#include "output/machine_limits.hpp"
#include "perikit/core/field.hpp"
#include "perikit/sdk/law_material.hpp"
#include "tests/benchmarks/counted.hpp"

using namespace perikit;

namespace {

constexpr int points = 128;

/// Best of several runs [s] per point.
double time_per_point(const Material& material, Space space, const MaterialBatch& batch) {
  using Clock = std::chrono::steady_clock;
  double best = 1e30;
  for (int run = 0; run < 15; ++run) {
    constexpr int repeats = 200;
    const auto start = Clock::now();
    for (int i = 0; i < repeats; ++i)
      if (!material.evaluate(space, batch).ok()) std::abort();
    best = std::min(best, std::chrono::duration<double>(Clock::now() - start).count() / (repeats * points));
  }
  return best;
}

struct Operations {
  std::int64_t stress = 0, tangent = 0;  ///< 0: not counted
};

/// Different operations that `what` asks for at a point of no particular symmetry.
template <class S, class Law, class What>
std::int64_t count(const Law& law, What&& what) {
  using H = Tensor<Counted, S>;
  const auto variables = [] { return H::map([](int c) { return Counted::variable(0.02 * (c + 1) - 0.05 * (c % 2)); }); };
  std::array<Counted, Law::traits.constants> k;
  for (std::size_t i = 0; i < k.size(); ++i) k[i] = Counted::variable(0.7 + 0.4 * static_cast<double>(i));
  const auto measure = [&](const auto& step) {
    Counted::forget();
    what(step, variables, k);
    return Counted::operations();
  };
  if constexpr (HasHistory<Law>) {
    std::array<Counted, state_size<Law, S>()> state;
    for (Counted& x : state) x = Counted::variable(0.01);
    return measure(law.template after<S>(state));
  } else {
    return measure(law);
  }
}

/// The stress at deformations of `Confined`, and all columns of the tangent, which no law restricts.
template <class Confined, class S, class Law>
Operations count(const Law& law) {
  return {count<Confined>(law, [](const auto& step, const auto& variables, const auto& k) { stress(step, variables(), k); }),
          count<S>(law, [](const auto& step, const auto& variables, const auto& k) {
            const auto action = tangent(step, variables(), k);
            for (int c = 0; c < S::components; ++c) action(variables());
          })};
}

template <class Law>
Operations count(const Law& law, Space space) {
  switch (space) {
    case Space::solid:
      return count<Solid, Solid>(law);
    case Space::plane_strain:
      return count<ConfinedPlane, Plane>(law);
    case Space::line_strain:
      return count<ConfinedLine, Line>(law);
    default:
      return {};
  }
}

struct Cost {
  double stress, tangent;  ///< [s] per point
};

Cost measure(const Material& material, Space space, const double* constants) {
  const int components = tensor_components(space);
  Field H(components, points), P(components, points), A(components * components, points),
      old(material.state_components(space), points), end(material.state_components(space), points);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-0.1, 0.1);
  for (int c = 0; c < components; ++c)
    for (int p = 0; p < points; ++p) H.component(c)[p] = uniform(random);
  const bool confined = space == Space::plane_strain || space == Space::line_strain;
  for (int c = gradient_components(dimension(space)); confined && c < components; ++c) std::fill_n(H.component(c), points, 0.0);
  MaterialBatch batch{.n = points, .stride = points, .confined = confined, .H = H.data(), .constants = constants};
  if (old.components() > 0) batch.state_old = old.data(), batch.state_stride = points;
  MaterialBatch stress = batch, tangent = batch;
  stress.P = P.data();
  if (old.components() > 0) stress.state_new = end.data();
  tangent.A = A.data();
  return {time_per_point(material, space, stress), time_per_point(material, space, tangent)};
}

std::string columns(double seconds, std::int64_t operations, double peak) {
  const std::string rate = fmt::format("{:.1f} | {:.0f}", 1e9 * seconds, 1e-6 / seconds);
  if (operations == 0) return rate + " | - | -";
  return fmt::format("{} | {} | {:.0f} %", rate, operations, 100e-9 * static_cast<double>(operations) / seconds / peak);
}

template <class Law>
void report(const char* name, const Law& law, const std::vector<double>& constants, double peak) {
  const LawMaterial<Law> material(law);
  double solid = 0;
  for (const Space space : {Space::solid, Space::plane_strain, Space::plane_stress, Space::line_strain, Space::line_stress}) {
    const Cost cost = measure(material, space, constants.data());
    const Operations operations = count(law, space);
    if (space == Space::solid) solid = cost.stress;
    fmt::print("| {} | {} | {} | {:.2f} | {} |\n", name, perikit::name(space), columns(cost.stress, operations.stress, peak),
               cost.stress / solid, columns(cost.tangent, operations.tangent, peak));
  }
}

}  // namespace

int main() {
  const double peak = measure_machine_limits().multiply_add_one;
  fmt::print("Peak of one thread: {:.1f} GFLOP/s; packs of {}.\n\n", peak, pack_width);
  fmt::print(
      "| law | space | P [ns] | P [10^6/s] | P ops | of peak | of solid | A [ns] | A [10^6/s] | A ops | of peak |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n");
  report("linear_elastic", LinearElastic(), {1.2, 0.8}, peak);
  report("saint_venant_kirchhoff", SaintVenantKirchhoff(), {1.2, 0.8}, peak);
  report("neo_hookean", NeoHookean(), {0.8, 80.0}, peak);
  report("mooney_rivlin", MooneyRivlin(), {0.3, 0.1, 80.0}, peak);
  report("hencky", Hencky(), {1.2, 0.8}, peak);
  report("hypoelastic", Hypoelastic(), {1.2, 0.8}, peak);
}
