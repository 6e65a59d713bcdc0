#pragma once
/// Warnings have names, by which a scene turns them off: [run] silence = ["locking"]. A line that begins with "warning" ends with the name of its kind in brackets.

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace perikit {

struct WarningKind {
  std::string_view name;
  std::string_view about;   ///< one sentence without a full stop, for the reference
};

/// All kinds, by name.
inline constexpr std::array warning_kinds = {
    WarningKind{"balance", "clouds that are not in equilibrium under a constant stress"},
    WarningKind{"box", "a box of [body.lattice] that is no whole number of spacings"},
    WarningKind{"contact", "faces of a crack that pass through each other"},
    WarningKind{"crack", "cracks that cut no bond"},
    WarningKind{"crack_cost", "cracks that cost more than Gc"},
    WarningKind{"energy", "energies that do not add up"},
    WarningKind{"first_step", "initial values, boundaries and loads that do not fit each other at the start"},
    WarningKind{"forces", "forces that are not the derivative of the energy"},
    WarningKind{"held_load", "loads on points that are held in their direction"},
    WarningKind{"horizon", "a horizon below two spacings"},
    WarningKind{"influence", "an influence function that leaves out the nearest neighbours"},
    WarningKind{"inside_out", "points that failing bonds turned inside out"},
    WarningKind{"interface_stress", "criteria by stress where unlike materials meet"},
    WarningKind{"libraries", "libraries of parts that were refused"},
    WarningKind{"locking", "nearly incompressible bodies without selective"},
    WarningKind{"lone_points", "points whose families are too poor for a gradient, or that have no bonds"},
    WarningKind{"loose_pieces", "pieces that only weak springs hold"},
    WarningKind{"not_finite", "fields that are not finite somewhere"},
    WarningKind{"nothing_acts", "bodies at rest on which nothing acts"},
    WarningKind{"origin", "clouds so far from the origin that their positions are rounded"},
    WarningKind{"output_times", "frames that are asked for after the end of the run"},
    WarningKind{"pair_law", "moduli that a pair law cannot have"},
    WarningKind{"replaced_run", "results of a stopped run that are replaced"},
    WarningKind{"second_law", "bonds whose failure would create energy"},
    WarningKind{"set", "sets that are a single layer of points, or none"},
    WarningKind{"singular", "tangents that are nearly singular"},
    WarningKind{"small_strains", "laws for small strains in bodies that leave them"},
    WarningKind{"thin", "bodies thinner than a horizon, and pieces that are one point thick"},
    WarningKind{"threads", "more threads than cores"},
    WarningKind{"time_step", "time steps above the stable one"},
    WarningKind{"unstable", "an equilibrium that is not stable"},
    WarningKind{"unused_constant", "constants that the scene does not use"},
    WarningKind{"volumes", "volumes that alternate from point to point"},
    WarningKind{"zero_energy", "one gradient per point without a stabilization"},
};

/// A name of warning_kinds; another one does not compile.
class WarningName {
 public:
  consteval WarningName(const char* name) : name_(name) {   // NOLINT(google-explicit-constructor)
    if (std::ranges::find(warning_kinds, name_, &WarningKind::name) == warning_kinds.end()) throw "no such kind of warning";
  }
  constexpr std::string_view text() const noexcept { return name_; }

 private:
  std::string_view name_;
};

/// A warning with its name: "TEXT [NAME]".
std::string named(WarningName name, std::string_view text);
/// The name at the end of a warning; empty where it has none.
std::string_view warning_name(std::string_view warning) noexcept;
/// Without the warnings of the silenced kinds.
std::vector<std::string> without_silenced(std::vector<std::string> warnings, std::span<const std::string> silence);

}  // namespace perikit
