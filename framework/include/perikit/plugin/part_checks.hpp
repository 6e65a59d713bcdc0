#pragma once
/// What is wrong with the class of a part, or with the function that makes it, in one line each: asked where a library registers the part.

#include <concepts>
#include <cstddef>
#include <memory>
#include <type_traits>

namespace perikit {

class ParameterValues;
class PartFactory;
class Kinematics;
class PointKinematics;
class BondKinematics;
class WeightedKinematics;
class PairKinematics;
class MappedKinematics;
class Stabilization;
class Material;
class Damage;
class InfluenceFunction;
class PointTerm;
class Integrator;

namespace detail {

template <class T, class... Others>
concept OneOf = (std::same_as<T, Others> || ...);

/// A class of a part, of the interface that it is registered for. The messages name the functions that each interface asks for.
template <class Interface, class Part>
consteval bool check_part() {
  constexpr bool derived = std::is_base_of_v<Interface, Part>;
  static_assert(derived || !std::same_as<Interface, Material>,
                "the class is no Material: a law becomes one as std::make_unique<LawMaterial<MyLaw>>() (perikit/sdk/law_material.hpp)");
  static_assert(derived || !std::same_as<Interface, PointTerm>,
                "the class is no PointTerm: a law becomes one as std::make_unique<LawTerm<MyLaw>>() (perikit/sdk/law_term.hpp)");
  static_assert(derived || std::same_as<Interface, Material> || std::same_as<Interface, PointTerm>,
                "the class is no part of the kind that it is registered as: derive it, as in class PartName final : public InfluenceFunction");
  if constexpr (derived) {
    constexpr bool whole = !std::is_abstract_v<Part>;
    if constexpr (std::same_as<Interface, Kinematics>) {
      constexpr bool point = std::is_base_of_v<PointKinematics, Part>, bond = std::is_base_of_v<BondKinematics, Part>,
                     weighted = std::is_base_of_v<WeightedKinematics, Part>, pair = std::is_base_of_v<PairKinematics, Part>,
                     mapped = std::is_base_of_v<MappedKinematics, Part>;
      static_assert(point || bond || weighted || pair || mapped,
                    "a kinematics is derived from PointKinematics, BondKinematics, WeightedKinematics, PairKinematics or MappedKinematics, "
                    "not from Kinematics itself");
      static_assert(whole || !point, "a PointKinematics needs `int order() const noexcept override`");
      static_assert(whole || !bond,
                    "a BondKinematics needs `BondTraits traits() const noexcept override` and "
                    "`void correction(const FamilyView& family, double* g, std::size_t stride) const noexcept override`");
      static_assert(whole || !weighted,
                    "a WeightedKinematics needs `WeightedTraits traits() const noexcept override`, `int parts(int dimension) const override` and "
                    "`void weights(const FamilyView& family, double* omega, std::size_t stride) const noexcept override`");
      static_assert(whole || !pair,
                    "a PairKinematics needs `PairTraits traits() const noexcept override`, `PairModuli moduli(const PairPoint& point) const noexcept override`, "
                    "`std::string warning(const PairPoint& point) const override`, `void bond_law(const BondBatch& batch) const noexcept override` and "
                    "`const DilatationLaw* dilatation() const noexcept override`");
      static_assert(whole || !mapped,
                    "a MappedKinematics needs `GradientMap map() const noexcept override` and `const Kinematics& base() const noexcept override`");
    }
    static_assert(whole || !std::same_as<Interface, Stabilization>,
                  "a stabilization needs `StabilizationTraits traits() const noexcept override` and "
                  "`void penalty(const PenaltyPoint& point, double* M) const noexcept override`; forces and tangent follow from them");
    static_assert(whole || !std::same_as<Interface, Material>,
                  "a Material leaves out a function of perikit/model/material.hpp, or has it with other arguments or without const");
    static_assert(whole || !std::same_as<Interface, Damage>,
                  "a damage criterion needs `DamageTraits traits() const noexcept override`, `DamageLimits limits(const DamagePoint& point) const override` and "
                  "`void integrity(const IntegrityBatch& batch) const noexcept override`");
    static_assert(whole || !std::same_as<Interface, InfluenceFunction>,
                  "an influence function needs `void evaluate(std::span<const double> r, std::span<double> omega) const override`");
    static_assert(whole || !std::same_as<Interface, PointTerm>,
                  "a term needs `TermTraits traits() const noexcept override` and "
                  "`Status evaluate(int dimension, const TermBatch& batch) const noexcept override`");
    static_assert(whole || !std::same_as<Interface, Integrator>,
                  "an integrator needs `IntegratorTraits traits() const noexcept override` and `void run(Problem& problem, Observer& observer) override`");
  }
  return true;
}

/// What a function that makes parts returns: a pointer to a class of a part, to an interface, or none.
template <class Interface, class Made>
struct MadePart {
  static_assert(std::convertible_to<Made, std::unique_ptr<Interface>>, "the function that makes a part returns std::make_unique<PartName>(...)");
  static constexpr bool checked = true;
};
template <class Interface, class Part>
struct MadePart<Interface, std::unique_ptr<Part>> {
  static constexpr bool interface = OneOf<Part, Interface, PointKinematics, BondKinematics, WeightedKinematics, PairKinematics, MappedKinematics>;
  static constexpr bool checked = [] {
    if constexpr (interface) return true;
    else return check_part<Interface, Part>();
  }();
};
template <class Interface>
struct MadePart<Interface, std::nullptr_t> {
  static constexpr bool checked = true;
};

template <class Interface, class Function>
struct CheckedFunction {
  static constexpr bool callable = std::is_invocable_v<Function&, const ParameterValues&, const PartFactory&>;
  static_assert(callable, "the function that makes a part takes (const ParameterValues& values, const PartFactory& parts)");
  static constexpr bool checked = [] {
    if constexpr (callable) return MadePart<Interface, std::invoke_result_t<Function&, const ParameterValues&, const PartFactory&>>::checked;
    else return false;
  }();
};

}  // namespace detail
}  // namespace perikit
