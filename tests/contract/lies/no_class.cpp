#include <memory>

#include "perikit/kinematics.hpp"
#include "perikit/sdk/projected_bond.hpp"

using namespace perikit;

namespace {

class Unclassed final : public Kinematics {};

class Gradients final : public PointKinematics {
 public:
  int order() const noexcept override { return 1; }
};

class Map final : public MappedKinematics {
 public:
  explicit Map(std::unique_ptr<Kinematics> base) : base_(std::move(base)) {}
  GradientMap map() const noexcept override { return GradientMap::selective; }
  const Kinematics& base() const noexcept override { return *base_; }

 private:
  std::unique_ptr<Kinematics> base_;
};

template <class Base, class... Options>
std::unique_ptr<Map> map_over(Options... options) {
  return std::make_unique<Map>(std::make_unique<Base>(std::move(options)...));
}

template <class Make>
void add(Registrar& registrar, const char* name, const char* summary, Make make) {
  registrar.kinematics({.name = name, .summary = summary, .parameters = {}, .examples = {""}},
                       [make](const ParameterValues&, const PartFactory&) -> std::unique_ptr<Kinematics> { return make(); });
}

}  // namespace

/// Kinematics that are none of what a kinematics can be.
PERIKIT_PLUGIN(registrar) {
  add(registrar, "unclassed", "none of the classes", [] { return std::make_unique<Unclassed>(); });
  add(registrar, "mapped_points", "a map over point gradients", [] { return map_over<Gradients>(); });
  add(registrar, "mapped_twice", "a map over a map", [] {
    return map_over<Map>(map_over<ProjectedBond>(BondBase::own, BondWeight::volume, 1));
  });
}
