/// Batches with points of several materials: each law answers for its own points only.

#include "perikit/operators/laws.hpp"

#include <doctest/doctest.h>

#include "materials/linear_elastic/law.hpp"
#include "materials/neo_hookean/law.hpp"
#include "perikit/sdk/law_material.hpp"

using namespace perikit;

namespace {

template <class Law>
MaterialRecord record(double youngs_modulus) {
  MaterialRecord r;
  r.material = std::make_shared<LawMaterial<Law>>();
  r.traits = r.material->traits();
  r.constants.resize(static_cast<std::size_t>(r.traits.constants));
  const MaterialInput input{[](std::string_view key) { return key == "youngs_modulus" || key == "poisson_ratio"; },
                            [=](std::string_view key) { return key == "youngs_modulus" ? youngs_modulus : 0.3; }};
  r.material->constants(input, r.constants.data());
  return r;
}

struct Batch {
  alignas(64) double H[9 * batch_points] = {};
  alignas(64) double P[9 * batch_points] = {};
  alignas(64) double lateral[batch_points] = {};
  std::int32_t points[batch_points] = {};
  LawScratch scratch;

  Status evaluate(const Laws& laws, int n) {
    laws.prepare(scratch, false);
    LawBatch batch;
    batch.n = n;
    batch.H = H;
    batch.points = points;
    batch.P = P;
    batch.lateral = lateral;
    return laws.evaluate(batch, scratch);
  }
};

}  // namespace

TEST_CASE("what one law accepts another may refuse") {
  const std::vector<std::uint16_t> ids{0, 1};   // a small-strain law takes every H, a finite one needs det F > 0
  const Laws laws(Space::solid, {record<LinearElastic>(1.0), record<NeoHookean>(1.0)}, ids, 8);
  auto batch = std::make_unique<Batch>();
  batch->points[1] = 1;
  batch->H[0] = -2;                             // xx of point 0: inside out
  CHECK(batch->evaluate(laws, 2).ok());
  CHECK(batch->P[0] != 0);
  batch->H[0] = 0;
  batch->H[1] = -2;                             // of point 1
  CHECK(batch->evaluate(laws, 2).inadmissible == 1);
}

TEST_CASE("the stretch across the plane is that of each point's own law") {
  const std::vector<std::uint16_t> ids{0, 1};
  const Laws laws(Space::plane_stress, {record<LinearElastic>(1.0), record<NeoHookean>(1.0)}, ids, 8);
  auto mixed = std::make_unique<Batch>();
  mixed->points[1] = 1;
  mixed->H[0] = mixed->H[1] = 0.2;
  REQUIRE(mixed->evaluate(laws, 2).ok());
  for (int p = 0; p < 2; ++p) {
    auto alone = std::make_unique<Batch>();
    alone->points[0] = p;
    alone->H[0] = 0.2;
    REQUIRE(alone->evaluate(laws, 1).ok());
    CHECK(mixed->lateral[p] == alone->lateral[0]);
  }
  CHECK(mixed->lateral[0] != mixed->lateral[1]);
}
