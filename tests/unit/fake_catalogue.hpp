#pragma once
// A catalogue with a few descriptions and no code, for tests of the scene reader.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "perikit/plugin/part.hpp"
#include "tests/kit/messages.hpp"

namespace perikit::test {

class FakeCatalogue final : public PartCatalogue {
 public:
  FakeCatalogue() {
    ParameterTable order;
    order.integer("order", "Order of the gradient.").at_least(1).at_most(2).by_default("1");
    add(Kind::kinematics, "conventional", order);
    add(Kind::kinematics, "baqp", order);
    ParameterTable non_spherical;
    non_spherical.number("n1", "-", "First exponent.").at_least(0).by_default("1.0");
    non_spherical.number("n2", "-", "Second exponent.").at_least(0).by_default("2.0");
    add(Kind::kinematics, "non_spherical", non_spherical);
    ParameterTable selective;
    selective.part("base", Kind::kinematics, "Bond-level kinematics.").require();
    add(Kind::kinematics, "selective", selective);

    ParameterTable silling;
    silling.number("coefficient", "-", "Strength.").positive().by_default("0.5");
    add(Kind::stabilization, "silling", silling);
    add(Kind::stabilization, "wan", {});

    add(Kind::material, "saint_venant_kirchhoff", elastic_parameters());
    add(Kind::material, "neo_hookean", rubber_parameters());

    ParameterTable stretch;
    stretch.number("energy_release_rate", "J/m^2", "Gc.").positive();
    stretch.number("stretch", "-", "Critical stretch.").positive();
    stretch.exactly(1, {"energy_release_rate", "stretch"});
    add(Kind::damage, "critical_stretch", stretch);

    add(Kind::influence, "constant", {});
    add(Kind::influence, "gaussian", {});
    ParameterTable expression;
    expression.string("omega", "A string in r.").require();
    add(Kind::influence, "expression", expression);

    ParameterTable verlet;
    verlet.number("end_time", "s", "End of the run.").require().positive();
    verlet.number("time_step", "s", "Fixed step.").positive();
    verlet.number("safety", "-", "Share of the stable step.").positive().at_most(1).by_default("0.8");
    verlet.at_most_of(1, {"time_step", "safety"});
    add(Kind::integrator, "verlet", verlet);
    ParameterTable newton;
    newton.integer("steps", "Load steps.").at_least(1).by_default("10");
    newton.number("tolerance", "-", "Relative residual.").positive().by_default("1e-10");
    add(Kind::integrator, "newton", newton);
    add(Kind::integrator, "evaluate", {});
  }

  const PartDescription& describe(Kind kind, std::string_view name) override {
    const auto found = parts_.find({kind, std::string(name)});
    if (found != parts_.end()) return found->second;
    const auto all = names(kind);
    throw InputError(fmt::format("found the unknown {} '{}'; allowed: {}{}", perikit::name(kind), name, fmt::join(all, ", "),
                                 did_you_mean(name, all)));
  }
  std::vector<std::string> names(Kind kind) const override {
    std::vector<std::string> all;
    for (const auto& [key, part] : parts_) {
      if (key.first == kind) all.push_back(key.second);
    }
    return all;
  }
  bool known(Kind kind, std::string_view name) const override { return parts_.contains({kind, std::string(name)}); }
  void open(const std::filesystem::path& library) override {
    if (library.filename() == "broken.so") throw InputError("broken.so: not a shared library");
    opened.push_back(library);
  }

  void add(Kind kind, const std::string& name, ParameterTable table) {
    PartDescription description;
    description.name = name;
    description.parameters = std::move(table);
    parts_[{kind, name}] = std::move(description);
  }

  std::vector<std::filesystem::path> opened;

 private:
  std::map<std::pair<Kind, std::string>, PartDescription> parts_;
};

}  // namespace perikit::test
