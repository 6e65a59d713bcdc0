#pragma once
/// Who is in whose family. Every search for members asks here, so that a bond as long as the horizon is a bond everywhere.

namespace perikit {

/// A bond belongs to a family where its length is at most this [m]: the horizon, and as much more as rounding of places may take away.
constexpr double family_limit(double horizon) noexcept { return horizon * (1 + 1e-10); }
/// r in (0, 1], of which influence is a function: 1 for a bond that is as long as the horizon but for rounding, which may then be without influence.
constexpr double relative_length(double length, double horizon) noexcept { return family_limit(length) >= horizon ? 1.0 : length / horizon; }
/// Places that are searched within this radius [m] hold all members of a family.
constexpr double search_radius(double horizon) noexcept { return horizon * (1 + 1e-9); }

}  // namespace perikit
