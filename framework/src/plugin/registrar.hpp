#pragma once
/// Collects what one library registers, checked; nothing is known to the registry before the whole library is accepted.

#include <filesystem>
#include <functional>
#include <memory>
#include <string_view>
#include <variant>
#include <vector>

#include "perikit/plugin/part.hpp"

namespace perikit {

/// Names of parts: registered ones and those in manifests.
bool is_snake_case(std::string_view text);
inline constexpr std::string_view snake_case_rule = "snake_case (a-z, 0-9, single _ between them)";

/// In the order of Kind.
using AnyFactory = std::variant<Factory<Kinematics>, Factory<Stabilization>, Factory<Material>, Factory<Damage>,
                                Factory<InfluenceFunction>, Factory<PointTerm>, Factory<Integrator>>;

struct RegisteredPart {
  PartDescription description;
  AnyFactory factory;
  Kind kind() const noexcept { return static_cast<Kind>(factory.index()); }
};

class PartCollector final : public Registrar {
 public:
  /// The library that already brings a part, or an empty path.
  using Owner = std::function<std::filesystem::path(Kind, std::string_view)>;
  explicit PartCollector(Owner owner) : owner_(std::move(owner)) {}

  void kinematics(PartDescription d, Factory<Kinematics> f) override { add({std::move(d), std::move(f)}); }
  void stabilization(PartDescription d, Factory<Stabilization> f) override { add({std::move(d), std::move(f)}); }
  void material(PartDescription d, Factory<Material> f) override { add({std::move(d), std::move(f)}); }
  void damage(PartDescription d, Factory<Damage> f) override { add({std::move(d), std::move(f)}); }
  void influence(PartDescription d, Factory<InfluenceFunction> f) override { add({std::move(d), std::move(f)}); }
  void term(PartDescription d, Factory<PointTerm> f) override { add({std::move(d), std::move(f)}); }
  void integrator(PartDescription d, Factory<Integrator> f) override { add({std::move(d), std::move(f)}); }

  std::vector<std::shared_ptr<const RegisteredPart>> parts;

 private:
  void add(RegisteredPart part);

  Owner owner_;
};

}  // namespace perikit
