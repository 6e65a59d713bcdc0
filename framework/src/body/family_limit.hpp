#pragma once
/// Who is in whose family. Every search for members asks here, so that a bond as long as the horizon is a bond everywhere.

namespace perikit {

/// A bond belongs to a family where its length is at most this [m]: the horizon, and as much more as rounding of places may take away.
constexpr double family_limit(double horizon) noexcept { return horizon * (1 + 1e-10); }
/// Places that are searched within this radius [m] hold all members of a family.
constexpr double search_radius(double horizon) noexcept { return horizon * (1 + 1e-9); }

}  // namespace perikit
