#pragma once

namespace perikit {

/// A fragment that failed bonds have left with less of its uncut shape tensor than this (shape_support) has no gradient: its bonds lie almost on a line,
/// and would magnify what they see ten to a thousand times, as long as they fade or for good where they may not fail. With more it keeps its gradient
/// while they fade: in nearly incompressible bodies what jumps costs more than it held.
inline constexpr double needle_support = 0.01;

}  // namespace perikit
