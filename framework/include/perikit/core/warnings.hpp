#pragma once
/// Warnings have names, by which a scene turns them off: [run] silence = ["locking"]. A line that begins with "warning" ends with the name of its kind in brackets.

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace perikit {

/// All kinds, by name; the page of refusals (framework/docs/refusals.md) says what each is about.
inline constexpr auto warning_kinds = std::to_array<std::string_view>({
    "balance",
    "box",
    "contact",
    "crack",
    "crack_cost",
    "energy",
    "first_step",
    "forces",
    "held_load",
    "horizon",
    "influence",
    "inside_out",
    "interface_stress",
    "libraries",
    "locking",
    "lone_points",
    "loose_pieces",
    "not_finite",
    "nothing_acts",
    "origin",
    "output_times",
    "pair_law",
    "replaced_run",
    "second_law",
    "set",
    "singular",
    "small_strains",
    "softening",
    "stairs",
    "thickness",
    "thin",
    "threads",
    "time_step",
    "unstable",
    "unused_constant",
    "volumes",
    "zero_energy",
});

/// A name of warning_kinds; another one does not compile.
class WarningName {
 public:
  consteval WarningName(const char* name) : name_(name) {   // NOLINT(google-explicit-constructor)
    if (std::ranges::find(warning_kinds, name_) == warning_kinds.end()) throw "no such kind of warning";
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
