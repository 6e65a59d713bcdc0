#include "setup/point_terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "families/families.hpp"

namespace perikit {

namespace {

using Values = std::map<std::string, Expression, std::less<>>;

Values values_of(const PartValues& part, const Constants& constants) {
  Values values;
  for (const std::string& key : part.values.keys()) {
    const ParameterValue* value = part.values.find(key);
    if (const auto* number = std::get_if<double>(value)) values.emplace(key, Expression(*number));
    else if (const auto* text = std::get_if<std::string>(value); text && part.values.is_expression(key))
      values.emplace(key, Expression(*text, constants, true, part.values.position(key), part.values.path() + "." + key));
  }
  return values;
}

/// out <- the constants at x and time. What the part says of a parameter, it says as it knows it: "found NAME = ...".
void find_constants(const PointTerm& term, const PartValues& part, const Values& values, const Point& x, double time, double* out) {
  const MaterialInput input{[&](std::string_view key) { return values.contains(key); },
                            [&](std::string_view key) {
                              const auto value = values.find(key);
                              if (value == values.end()) throw std::logic_error(fmt::format("asked for the parameter '{}', which it does not have as a number", key));
                              return value->second(x, time);
                            }};
  const auto failed = [&](const std::string& what) {
    return InputError(part.values.position(""), part.values.path(), fmt::format("term '{}' failed: {}", part.type, what));
  };
  try {
    term.constants(input, out);
  } catch (const std::domain_error& error) {
    const std::string text = fmt::format("{}, at ({:.6g}, {:.6g}, {:.6g}), t = {:.6g}", error.what(), x[0], x[1], x[2], time);
    for (const auto& [key, value] : values)
      if (text.starts_with(fmt::format("found {} = ", key))) throw part.values.error(key, text);
    throw InputError(part.values.position(""), part.values.path(), text);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    throw failed(error.what());
  } catch (...) {
    throw failed("it threw something that is no std::exception");
  }
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
    auto values = std::make_shared<const Values>(values_of(*part, scene.constants));
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
