// Time of one stress (and of one tangent) per evaluation point, for every law and space, in batches of 128 through the virtual
// call.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <random>

#include "materials/hencky/law.hpp"
#include "materials/linear_elastic/law.hpp"
#include "materials/mooney_rivlin/law.hpp"
#include "materials/neo_hookean/law.hpp"
#include "materials/saint_venant_kirchhoff/law.hpp"
#include "perikit/core/field.hpp"
#include "perikit/sdk/law_material.hpp"

using namespace perikit;

namespace {

constexpr int points = 128;

/// Best of several runs, ns per point.
double time_per_point(const Material& material, Space space, const MaterialBatch& batch) {
  using Clock = std::chrono::steady_clock;
  double best = 1e30;
  for (int run = 0; run < 15; ++run) {
    constexpr int repeats = 200;
    const auto start = Clock::now();
    for (int i = 0; i < repeats; ++i)
      if (!material.evaluate(space, batch).ok()) std::abort();
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    best = std::min(best, 1e9 * seconds / (repeats * points));
  }
  return best;
}

void report(const char* name, const Material& material, const double* constants) {
  for (const Space space : {Space::solid, Space::plane_strain, Space::plane_stress, Space::line_strain, Space::line_stress}) {
    const int components = tensor_components(space);
    Field H(components, points), P(components, points), psi(1, points), A(components * components, points);
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> uniform(-0.1, 0.1);
    for (int c = 0; c < components; ++c)
      for (int p = 0; p < points; ++p) H.component(c)[p] = uniform(random);
    MaterialBatch batch{.n = points, .stride = points, .H = H.data(), .constants = constants};
    MaterialBatch stress = batch, energy = batch, tangent = batch;
    stress.P = P.data();
    energy.psi = psi.data();
    tangent.A = A.data();
    std::printf("%-24s %-16s %8.2f %8.2f %8.2f\n", name, std::string(perikit::name(space)).c_str(),
                time_per_point(material, space, stress), time_per_point(material, space, energy),
                time_per_point(material, space, tangent));
  }
}

}  // namespace

int main() {
  std::printf("ns per point             space                   P      psi        A\n");
  const double elastic[] = {1.2, 0.8}, rubber[] = {0.8, 80.0}, mooney[] = {0.3, 0.1, 80.0};
  report("linear_elastic", LawMaterial<LinearElastic>(), elastic);
  report("saint_venant_kirchhoff", LawMaterial<SaintVenantKirchhoff>(), elastic);
  report("neo_hookean", LawMaterial<NeoHookean>(), rubber);
  report("mooney_rivlin", LawMaterial<MooneyRivlin>(), mooney);
  report("hencky", LawMaterial<Hencky>(), elastic);
}
