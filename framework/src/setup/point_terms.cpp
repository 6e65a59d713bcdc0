#include "setup/point_terms.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "families/families.hpp"
#include "setup/numeric_values.hpp"

namespace perikit {

namespace {

/// out <- the constants at x and time.
void find_constants(const PointTerm& term, const PartValues& part, const NumericValues& values, const Point& x, double time, double* out) {
  const MaterialInput input{[&](std::string_view key) { return values.contains(key); },
                            [&](std::string_view key) {
                              const auto value = values.find(key);
                              if (value == values.end()) throw std::logic_error(fmt::format("asked for the parameter '{}', which it does not have as a number", key));
                              return value->second(x, time);
                            }};
  const auto where = [&] { return fmt::format(", at ({:.6g}, {:.6g}, {:.6g}), t = {:.6g}", x[0], x[1], x[2], time); };
  make_constants(part, "term", values, where, [&] { term.constants(input, out); });
}

void refuse(const Scene& scene, const PartValues& part, const TermTraits& traits, const IntegratorTraits& integrator) {
  const auto refused = [&](const std::string& found, const std::string& allowed) {
    throw part.values.error("type", fmt::format("found \"{}\", {}; allowed: {}", part.type, found, allowed));
  };
  if (traits.velocity && !integrator.dynamic)
    refused(fmt::format("whose forces depend on the velocity, with integrator \"{}\", whose states have none", scene.integrator->type), "an explicit integrator, or another term");
  if (!traits.conservative && integrator.quasi_static && scene.damage)
    refused(fmt::format("whose forces have no energy, with [damage] and integrator \"{}\", which takes for dissipated what energies fall by as bonds fail",
                        scene.integrator->type),
            "an explicit integrator, or another term");
}

}  // namespace

std::vector<PointTermPart> point_term_parts(const Scene& scene, const PartFactory& factory, const IntegratorTraits& integrator) {
  std::vector<PointTermPart> parts;
  for (const TermDescription& description : scene.terms) {
    const std::shared_ptr<const PartValues> part = description.part;
    const std::shared_ptr<const PointTerm> term = factory.term(*part);
    refuse(scene, *part, term->traits(), integrator);
    auto values = std::make_shared<const NumericValues>(numeric_values(*part, scene.constants, true));
    const auto some = [&](auto&& depends) { return std::ranges::any_of(*values, [&](const auto& value) { return depends(value.second); }); };
    parts.push_back({.term = term,
                     .name = part->type,
                     .set = description.set,
                     .constants = [term, part, values](const Point& x, double time, double* out) { find_constants(*term, *part, *values, x, time, out); },
                     .constants_vary_in_space = some([](const Expression& value) { return value.depends_on_position(); }),
                     .constants_vary_in_time = some([](const Expression& value) { return value.depends_on_time(); })});
  }
  return parts;
}

TermMaker build_point_terms(const Scene& scene, const PartFactory& factory, const IntegratorTraits& integrator) {
  if (scene.terms.empty()) return {};
  const ParameterValues& run = scene.integrator->values;
  const double end = integrator.quasi_static ? 1.0 : run.has("end_time") ? run.number("end_time") : 0.0;
  return [parts = point_term_parts(scene, factory, integrator), end](const TermParts& of) { return std::make_unique<PointTerms>(of.families->body(), parts, end); };
}

}  // namespace perikit
