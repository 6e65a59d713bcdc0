#pragma once
/// What a shared library says about the parts it brings, and how it hands them over.

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "perikit/plugin/parameters.hpp"
#include "perikit/plugin/part_checks.hpp"

namespace perikit {

/// Creates the nested parts of a part (the base of `selective`, the influence function of a family).
class PartFactory {
 public:
  virtual ~PartFactory() = default;
  virtual std::unique_ptr<Kinematics> kinematics(const PartValues&) const = 0;
  virtual std::unique_ptr<Stabilization> stabilization(const PartValues&) const = 0;
  virtual std::unique_ptr<Material> material(const PartValues&) const = 0;
  virtual std::unique_ptr<Damage> damage(const PartValues&) const = 0;
  virtual std::unique_ptr<InfluenceFunction> influence(const PartValues&) const = 0;
  virtual std::unique_ptr<PointTerm> term(const PartValues&) const = 0;
  virtual std::unique_ptr<Integrator> integrator(const PartValues&) const = 0;
};

/// Everything about a part but its code.
struct PartDescription {
  std::string name{};                    ///< snake_case, unique within its kind
  std::string summary{};                 ///< one line
  ParameterTable parameters{};
  std::vector<std::string> examples{};   ///< TOML tables without `type`, at least one: "order = 1"; "" when nothing is required
  std::string equations{};               ///< a few lines of plain text
  std::string source{};                  ///< citation
  std::string limits{};                  ///< where it must not be used
};

template <class Interface>
class Factory;
namespace detail {
template <class Function>
inline constexpr bool is_factory = false;
template <class Interface>
inline constexpr bool is_factory<Factory<Interface>> = true;
}  // namespace detail

/// The function that makes a part: [](const ParameterValues& values, const PartFactory& parts) { return std::make_unique<PartName>(...); }
template <class Interface>
class Factory final : public std::function<std::unique_ptr<Interface>(const ParameterValues&, const PartFactory&)> {
  using Base = std::function<std::unique_ptr<Interface>(const ParameterValues&, const PartFactory&)>;

 public:
  Factory() = default;
  template <class Function>
  requires(!detail::is_factory<Function> && detail::CheckedFunction<Interface, Function>::checked)
  Factory(Function function) : Base(std::move(function)) {}
};

/// Where the scene reader looks parts up. Implemented by Registry.
class PartCatalogue {
 public:
  virtual ~PartCatalogue() = default;
  /// Throws InputError for an unknown name, with the nearest and the known ones.
  virtual const PartDescription& describe(Kind kind, std::string_view name) = 0;
  virtual std::vector<std::string> names(Kind kind) const = 0;
  virtual bool known(Kind kind, std::string_view name) const = 0;
  /// Registers one more library. Throws InputError with file and reason when it is refused.
  virtual void open(const std::filesystem::path& library) = 0;
};

/// Handed to a library's registration function. Throws std::invalid_argument for a bad or duplicate description.
class Registrar {
 public:
  virtual ~Registrar() = default;
  virtual void kinematics(PartDescription, Factory<Kinematics>) = 0;
  virtual void stabilization(PartDescription, Factory<Stabilization>) = 0;
  virtual void material(PartDescription, Factory<Material>) = 0;
  virtual void damage(PartDescription, Factory<Damage>) = 0;
  virtual void influence(PartDescription, Factory<InfluenceFunction>) = 0;
  virtual void term(PartDescription, Factory<PointTerm>) = 0;
  virtual void integrator(PartDescription, Factory<Integrator>) = 0;
};

}  // namespace perikit
