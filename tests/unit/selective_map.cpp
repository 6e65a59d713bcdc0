/// The selective map of laws that are evaluated once for both ends of a bond, against the same laws evaluated at every mapped gradient.

#include "maps/selective_map.hpp"

#include <doctest/doctest.h>

#include <memory>
#include <random>

#include "materials/hencky/law.hpp"
#include "materials/mooney_rivlin/law.hpp"
#include "materials/neo_hookean/law.hpp"
#include "materials/saint_venant_kirchhoff/law.hpp"
#include "operators/batch.hpp"
#include "perikit/sdk/law_material.hpp"
#include "setup/materials.hpp"

using namespace perikit;

namespace {

/// A law that says nothing of growth.
class Undeclared final : public Material {
 public:
  explicit Undeclared(std::shared_ptr<const Material> law) : law_(std::move(law)) {}
  MaterialTraits traits() const noexcept override {
    MaterialTraits traits = law_->traits();
    traits.green_linear = false;
    return traits;
  }
  void constants(const MaterialInput& input, double* out) const override { law_->constants(input, out); }
  Moduli small_strain(const double* k) const noexcept override { return law_->small_strain(k); }
  Status evaluate(Space space, const MaterialBatch& batch) const noexcept override { return law_->evaluate(space, batch); }

 private:
  std::shared_ptr<const Material> law_;
};

struct Case {
  Space space;
  int ends;
  bool whole;
  Work work;
};

/// What a batch of bonds gives: W P summed over ends, pressures and their rates by end, energy, what screens bonds, and the first bad lane.
struct Outcome {
  std::vector<double> P, pressure, rate, highest;
  double energy = 0;
  int bad = -1;
};

constexpr int bonds = 40;   // padded to the same

struct Bonds {
  std::vector<double> Ht, dHt, Hbar, dHbar, weight, share;

  Bonds(Space space, double strain, std::mt19937_64& random) {
    std::uniform_real_distribution<double> one(-1, 1);
    const auto fill = [&](std::vector<double>& x, int components, int lanes, double size, double offset = 0) {
      x.resize(static_cast<std::size_t>(components) * batch_points);
      for (int c = 0; c < components; ++c)
        for (int l = 0; l < lanes; ++l) x[static_cast<std::size_t>(c * batch_points + l)] = offset + size * one(random);
    };
    const int components = gradient_components(dimension(space));
    fill(Ht, components, bonds, strain);
    fill(dHt, components, bonds, 1);
    fill(Hbar, components, 2 * bonds, strain);
    fill(dHbar, components, 2 * bonds, 1);
    fill(weight, 1, 2 * bonds, 0.4, 1);
    fill(share, 1, 2 * bonds, 0.5, 0.5);
  }
};

MaterialRecord record_of(std::shared_ptr<const Material> material, const std::vector<double>& constants) {
  MaterialRecord record;
  record.traits = material->traits();
  record.material = std::move(material);
  record.constants.assign(constants.begin(), constants.end());
  return record;
}

/// point[lane], point[bonds + lane]: the ends of the bonds, whose laws are ids[point]; none: one law everywhere.
Outcome evaluate(const Case& of, const Bonds& in, std::vector<MaterialRecord> records, const std::vector<std::uint16_t>& ids = {},
                 const std::vector<std::int32_t>& point = {}) {
  const Laws laws(of.space, std::move(records), ids, padded(ids.size()));
  ScratchPool pool;
  pool.prepare(laws);
  BatchScratch& s = pool.mine();
  if (!ids.empty()) {
    std::copy_n(point.begin(), bonds, s.owner);
    std::copy_n(point.begin() + bonds, bonds, s.far);
  }
  const std::size_t components = static_cast<std::size_t>(gradient_components(dimension(of.space))) * batch_points;
  std::copy_n(in.Ht.begin(), components, s.Ht);
  std::copy_n(in.dHt.begin(), components, s.dHt);
  std::copy_n(in.weight.begin(), bonds, s.weight);
  std::copy_n(in.weight.begin() + bonds, bonds, s.far_weight);
  alignas(64) double Hbar[9 * batch_points] = {}, dHbar[9 * batch_points] = {};
  std::copy_n(in.Hbar.begin(), components, Hbar);
  std::copy_n(in.dHbar.begin(), components, dHbar);
  owner_volume(of.space, {2 * bonds, batch_points, Hbar, of.work == Work::tangent ? dHbar : nullptr}, s.volume, batch_points);
  std::copy_n(in.share.begin(), 2 * bonds, s.volume + volume_share * batch_points);
  for (std::size_t g = 0; g < std::size(s.volume_group); ++g) s.volume_group[g] = static_cast<std::int64_t>(g * padding);
  s.owner_volumes = {s.volume, batch_points, s.volume_group, of.whole};
  BondScreen screen;
  const BatchWork work(laws, {.work = of.work, .energy = true, .selective = true, .screen = of.work == Work::force ? &screen : nullptr});
  GroupEnergy energy;
  Outcome out;
  out.bad = work.evaluate(bonds, s, of.ends == 2, &energy);
  if (out.bad >= 0) return out;
  work.weigh_stress(bonds, s);
  out.energy = energy.stored;
  for (int c = 0; c < gradient_components(dimension(of.space)); ++c) out.P.insert(out.P.end(), s.P + c * batch_points, s.P + c * batch_points + bonds);
  out.pressure.assign(s.pressure, s.pressure + of.ends * bonds);
  if (of.work == Work::tangent) out.rate.assign(s.pressure_rate, s.pressure_rate + of.ends * bonds);
  else out.highest.assign(s.highest, s.highest + of.ends * bonds);
  return out;
}
Outcome evaluate(const Case& of, const Bonds& in, std::shared_ptr<const Material> material, const std::vector<double>& constants) {
  return evaluate(of, in, {record_of(std::move(material), constants)});
}

double largest(const std::vector<double>& x) {
  double most = 0;
  for (const double a : x) most = std::max(most, std::abs(a));
  return most;
}

void near(const char* what, const std::vector<double>& found, const std::vector<double>& expected, double tolerance) {
  REQUIRE(found.size() == expected.size());
  double error = 0;
  for (std::size_t i = 0; i < found.size(); ++i) error = std::max(error, std::abs(found[i] - expected[i]));
  CHECK_MESSAGE(error <= tolerance, what, ": error ", error, " of ", largest(expected));
}

struct Subject {
  const char* name;
  std::shared_ptr<const Material> material;
  std::vector<double> constants;
};

/// With shear moduli of 1.
std::vector<Subject> subjects(double kappa) {
  return {{"neo_hookean, quadratic", std::make_shared<LawMaterial<NeoHookean>>(NeoHookean{Volumetric::quadratic}), {1.0, kappa}},
          {"neo_hookean, logarithmic", std::make_shared<LawMaterial<NeoHookean>>(NeoHookean{Volumetric::logarithmic}), {1.0, kappa}},
          {"mooney_rivlin", std::make_shared<LawMaterial<MooneyRivlin>>(MooneyRivlin{Volumetric::quadratic}), {0.3, 0.2, kappa}},
          {"saint_venant_kirchhoff", std::make_shared<LawMaterial<SaintVenantKirchhoff>>(), {kappa - 2.0 / 3, 1.0}},
          {"hencky", std::make_shared<LawMaterial<Hencky>>(), {kappa - 2.0 / 3, 1.0}}};
}

constexpr Space spaces[] = {Space::line_strain, Space::plane_strain, Space::solid};

template <class Check>
void for_every_case(const Check& check) {
  for (const Space space : spaces)
    for (const int ends : {1, 2})
      for (const bool whole : {true, false})
        for (const Work work : {Work::force, Work::tangent}) {
          INFO(name(space), ", ends: ", ends, ", shares whole: ", whole, ", tangent: ", work == Work::tangent);
          check(Case{space, ends, whole, work});
        }
}

}  // namespace

TEST_CASE("selective map: one evaluation is the law at the mapped gradients") {
  std::mt19937_64 random(20261127);
  for (const double kappa : {2.0, 1e4})
    for (const double strain : {1e-3, 0.2})
      for (const Subject& law : subjects(kappa))
        for_every_case([&](const Case& of) {
          INFO(law.name, ", kappa/mu ", kappa, ", strain ", strain);
          const Bonds in(of.space, strain, random);
          const Outcome apart = evaluate(of, in, law.material, law.constants), mapped = evaluate(of, in, std::make_shared<Undeclared>(law.material), law.constants);
          REQUIRE(apart.bad < 0);
          REQUIRE(mapped.bad < 0);
          // Stresses of the law at mapped gradients have the rounding of their pressure.
          const double scale = 1e-13 * (kappa + 4.0 / 3);
          near("W dpsi/dFt", apart.P, mapped.P, scale * (of.work == Work::tangent ? 40 : 10));
          near("pressures", apart.pressure, mapped.pressure, scale * 10);
          near("rates of pressures", apart.rate, mapped.rate, scale * 40);
          near("what screens bonds", apart.highest, mapped.highest, scale);
          CHECK(std::abs(apart.energy - mapped.energy) <= scale * bonds);
        });
}

TEST_CASE("selective map: whole shares are shares of one") {
  std::mt19937_64 random(8);
  for (const Subject& law : subjects(20.0))
    for_every_case([&](Case of) {
      INFO(law.name);
      Bonds in(of.space, 0.2, random);
      in.share.assign(in.share.size(), 1.0);
      of.whole = true;
      const Outcome whole = evaluate(of, in, law.material, law.constants);
      of.whole = false;
      const Outcome shares = evaluate(of, in, law.material, law.constants);
      near("W dpsi/dFt", whole.P, shares.P, 1e-11);
      near("pressures", whole.pressure, shares.pressure, 1e-11);
      near("rates of pressures", whole.rate, shares.rate, 1e-10);
    });
}

TEST_CASE("selective map: a bond or an owner turned inside out is named") {
  std::mt19937_64 random(9);
  for (const Subject& law : subjects(20.0))
    for_every_case([&](const Case& of) {
      INFO(law.name);
      const int d = dimension(of.space);
      for (const bool owner : {true, false}) {
        Bonds in(of.space, 0.1, random);
        (owner ? in.Hbar : in.Ht)[static_cast<std::size_t>(of.ends == 2 && owner ? bonds + 17 : 17)] = -2;
        if (d > 1) (owner ? in.Hbar : in.Ht)[static_cast<std::size_t>(batch_points + (of.ends == 2 && owner ? bonds + 17 : 17))] = 0;
        CHECK(evaluate(of, in, law.material, law.constants).bad == 17);
        CHECK(evaluate(of, in, std::make_shared<Undeclared>(law.material), law.constants).bad == 17);
      }
    });
}

/// Other bonds of the batch, owners that no one asks for among them, and shares elsewhere that are not whole change no bit.
TEST_CASE("selective map: a bond gives the same bits in any company") {
  std::mt19937_64 random(10);
  const auto soft = std::make_shared<LawMaterial<NeoHookean>>(NeoHookean{Volumetric::quadratic});
  const auto green = std::make_shared<LawMaterial<SaintVenantKirchhoff>>();
  const auto other = std::make_shared<Undeclared>(soft);
  MaterialRecord silent = silent_record(), far = silent;
  far.incomplete = true;
  const std::vector<MaterialRecord> known{record_of(soft, {1.0, 50.0}), record_of(green, {30.0, 1.0}), record_of(soft, {2.0, 90.0}), record_of(other, {1.5, 70.0})};
  std::vector<MaterialRecord> records = known, undeclared = known;
  for (MaterialRecord& record : undeclared) record.material = std::make_shared<Undeclared>(record.material), record.traits.green_linear = false;
  for (auto* all : {&records, &undeclared}) all->insert(all->end(), {silent, far});
  std::vector<std::uint16_t> ids(2 * bonds);
  std::vector<std::int32_t> point(2 * bonds);
  for (int p = 0; p < 2 * bonds; ++p) point[static_cast<std::size_t>(p)] = p;
  for (const int laws : {3, 4, 6})
    for_every_case([&](Case of) {
      INFO("records: ", laws);
      Bonds in(of.space, 0.2, random);
      if (!of.whole)
        for (int at = 0; at < 2 * bonds; at += 3) in.share[static_cast<std::size_t>(at)] = 1.0;
      for (std::size_t p = 0; p < ids.size(); ++p) ids[p] = static_cast<std::uint16_t>(p >= bonds && random() % 2 == 0 ? ids[p - bonds] : random() % static_cast<unsigned>(laws));
      // Owners that store nothing may have no volume.
      for (std::size_t p = 0; p < ids.size(); ++p)
        if (ids[p] > 3) in.Hbar[p] = -3;
      const Outcome mixed = evaluate(of, in, records, ids, point), mapped = evaluate(of, in, undeclared, ids, point);
      REQUIRE(mixed.bad < 0);
      REQUIRE(mapped.bad < 0);
      near("W dpsi/dFt", mixed.P, mapped.P, 1e-10);
      near("pressures", mixed.pressure, mapped.pressure, 1e-10);
      near("rates of pressures", mixed.rate, mapped.rate, 1e-9);
      near("what screens bonds", mixed.highest, mapped.highest, 1e-11);
      CHECK(std::abs(mixed.energy - mapped.energy) <= 1e-10 * bonds);
      Bonds calm = in;
      for (std::size_t p = 0; p < ids.size(); ++p)
        if (ids[p] > 3) calm.Hbar[p] = 0;
      for (std::size_t id = 0; id < 3; ++id) {
        const Outcome alone = evaluate(of, calm, {known[id]});
        REQUIRE(alone.bad < 0);
        for (std::size_t l = 0; l < bonds; ++l) {
          if (ids[l] != id || (of.ends == 2 && ids[bonds + l] != id)) continue;
          bool same = true;
          for (std::size_t c = 0; c < mixed.P.size() / bonds; ++c) same &= mixed.P[c * bonds + l] == alone.P[c * bonds + l];
          for (std::size_t end = 0; end < static_cast<std::size_t>(of.ends); ++end) {
            same &= mixed.pressure[end * bonds + l] == alone.pressure[end * bonds + l];
            if (!mixed.rate.empty()) same &= mixed.rate[end * bonds + l] == alone.rate[end * bonds + l];
            if (!mixed.highest.empty()) same &= mixed.highest[end * bonds + l] == alone.highest[end * bonds + l];
          }
          CHECK_MESSAGE(same, "bond ", l, " of law ", id);
        }
      }
    });
  for_every_case([&](Case of) {
    if (!of.whole) return;
    Bonds in(of.space, 0.2, random);
    in.share.assign(in.share.size(), 1.0);
    in.share[5] = 0.5;
    for (std::size_t id = 0; id < 3; ++id) {
      of.whole = true;
      const Outcome whole = evaluate(of, in, {known[id]});
      of.whole = false;
      const Outcome torn = evaluate(of, in, {known[id]});
      for (std::size_t at = 0; at < whole.P.size(); ++at)
        if (at % bonds != 5) CHECK(whole.P[at] == torn.P[at]);
      for (std::size_t at = 0; at < whole.pressure.size(); ++at)
        if (at != 5) CHECK(whole.pressure[at] == torn.pressure[at]);
      for (std::size_t at = 0; at < whole.rate.size(); ++at)
        if (at != 5) CHECK(whole.rate[at] == torn.rate[at]);
    }
  });
}
