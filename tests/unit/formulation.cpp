#include "model/formulation.hpp"

#include <doctest/doctest.h>

#include <stdexcept>
#include <string>

#include "tests/kit/messages.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

class PointSet : public PointKinematics {
 public:
  int order() const noexcept override { return 3; }
};

class Bonds final : public BondKinematics {
 public:
  BondTraits traits() const noexcept override {
    return {.order = 2, .base = BondBase::mean, .weight = BondWeight::kernel, .pair_symmetric = true, .g_from_xi_only = true};
  }
  void correction(const FamilyView&, double*, std::size_t) const noexcept override {}
};

class Parts final : public WeightedKinematics {
 public:
  WeightedTraits traits() const noexcept override {
    return {.weight = BondWeight::kernel, .part_weight = PartWeight::volume, .force_state = ForceState::local};
  }
  int parts(int dimension) const override { return 2 * dimension; }
  void weights(const FamilyView&, double*, std::size_t) const noexcept override {}
};

class NoDilatation final : public DilatationLaw {
 public:
  void evaluate(const DilatationBatch&) const noexcept override {}
};

class Pairs : public PairKinematics {
 public:
  PairTraits traits() const noexcept override { return {.influence = false, .constant_moduli = true, .factors = BondFactorsOf::energy}; }
  PairModuli moduli(const PairPoint&) const noexcept override { return {}; }
  std::string warning(const PairPoint&) const override { return {}; }
  void bond_law(const BondBatch&) const noexcept override {}
  const DilatationLaw* dilatation() const noexcept override { return &law_; }

 private:
  NoDilatation law_;
};

template <class Base>
class Mapped final : public MappedKinematics {
 public:
  GradientMap map() const noexcept override { return GradientMap::selective; }
  const Kinematics& base() const noexcept override { return base_; }

 private:
  Base base_;
};

class Unclassed final : public Kinematics {};
class PointsAndPairs final : public PointSet, public Pairs {};

std::string refusal(std::shared_ptr<const Kinematics> kinematics) {
  return message_of<std::invalid_argument>([&] { make_formulation(std::move(kinematics)); });
}

int classes(const Formulation& f) { return !!f.point + !!f.bond + !!f.weighted + !!f.pairs; }

}  // namespace

TEST_CASE("formulation: each class of kinematics is known by what it states") {
  const Formulation points = make_formulation(std::make_shared<PointSet>()), bonds = make_formulation(std::make_shared<Bonds>());
  const Formulation parts = make_formulation(std::make_shared<Parts>()), pairs = make_formulation(std::make_shared<Pairs>());
  for (const Formulation* f : {&points, &bonds, &parts, &pairs}) {
    CHECK(classes(*f) == 1);
    CHECK(!f->selective());
  }
  REQUIRE(points.point);
  CHECK(points.order == 3);
  CHECK(points.parts(2) == 1);
  REQUIRE(bonds.bond);
  CHECK(bonds.order == 2);
  CHECK(bonds.far_share == 0.5);
  CHECK(bonds.weight == BondWeight::kernel);
  CHECK(bonds.pair_symmetric);
  CHECK(bonds.g_from_xi_only);
  CHECK(bonds.parts(2) == 0);
  REQUIRE(parts.weighted);
  CHECK(parts.order == 1);
  CHECK(parts.weight == BondWeight::kernel);
  CHECK(parts.part_weight == PartWeight::volume);
  CHECK(parts.force_state == ForceState::local);
  CHECK(parts.parts(3) == 6);
  REQUIRE(pairs.pairs);
  CHECK(pairs.dilatation == pairs.pairs->dilatation());
  CHECK(!pairs.pair_traits.influence);
  CHECK(pairs.pair_traits.constant_moduli);
  CHECK(pairs.pair_traits.factors == BondFactorsOf::energy);
}

TEST_CASE("formulation: a map shows its base") {
  const auto mapped = std::make_shared<Mapped<Bonds>>();
  const Formulation f = make_formulation(mapped);
  CHECK(f.selective());
  CHECK(classes(f) == 1);
  CHECK(f.bond == &mapped->base());
  CHECK(f.order == 2);
  CHECK(f.kinematics == mapped);
  CHECK(make_formulation(std::make_shared<Mapped<Parts>>()).force_state == ForceState::local);
}

TEST_CASE("formulation: what is none of the classes, or several, and maps over anything else are refused") {
  const std::string classes = " PointKinematics, BondKinematics, WeightedKinematics, PairKinematics and MappedKinematics";
  CHECK(refusal(std::make_shared<Unclassed>()) == "it is none of" + classes);
  const auto both = std::make_shared<PointsAndPairs>();
  CHECK(refusal(std::shared_ptr<const Kinematics>(both, static_cast<const PointSet*>(both.get()))) == "it is several of" + classes);
  const std::string bad_base = "the base that it maps is neither a BondKinematics nor a WeightedKinematics";
  CHECK(refusal(std::make_shared<Mapped<PointSet>>()) == bad_base);
  CHECK(refusal(std::make_shared<Mapped<Pairs>>()) == bad_base);
  CHECK(refusal(std::make_shared<Mapped<Unclassed>>()) == bad_base);
  CHECK(refusal(std::make_shared<Mapped<Mapped<Bonds>>>()) == bad_base);
}

TEST_CASE("the formulas by which public headers say where a value is stored") {
  std::vector<double> stored(64);
  for (std::size_t k = 0; k < stored.size(); ++k) stored[k] = static_cast<double>(k);
  FamilyView family;
  family.inverse_shape = stored.data();
  CHECK(family.shape(2, 5) == 2);  // one owner: the bond does not matter
  family.inverse_shape_stride = 8;
  CHECK(family.shape(2, 5) == 21);  // component by component, 8 bonds each
  MaterialBatch batch;
  batch.constants = stored.data();
  CHECK(batch.constant(3, 4) == 3);
  batch.constant_stride = 16;
  CHECK(batch.constant(3, 4) == 52);
}

TEST_CASE("a base may give the far end any share, and only the mean of both ends is the same from both") {
  struct Blend final : BondKinematics {
    double far_share;
    bool symmetric;
    Blend(double share, bool both) : far_share(share), symmetric(both) {}
    BondTraits traits() const noexcept override {
      return {.base = BondBase::blend, .far_share = far_share, .pair_symmetric = symmetric};
    }
    void correction(const FamilyView&, double*, std::size_t) const noexcept override {}
  };
  CHECK(make_formulation(std::make_shared<Blend>(0.3, false)).far_share == 0.3);
  CHECK(make_formulation(std::make_shared<Blend>(0.5, true)).far_share == 0.5);
  CHECK_THROWS_AS(make_formulation(std::make_shared<Blend>(0.3, true)), std::invalid_argument);
  CHECK_THROWS_AS(make_formulation(std::make_shared<Blend>(-0.1, false)), std::invalid_argument);
}

TEST_CASE("formulation: a blend that states no share is the mean of both ends") {
  class Blend final : public BondKinematics {
   public:
    BondTraits traits() const noexcept override { return {.base = BondBase::blend}; }
    void correction(const FamilyView&, double*, std::size_t) const noexcept override {}
  };
  CHECK(make_formulation(std::make_shared<Blend>()).far_share == 0.5);
}
