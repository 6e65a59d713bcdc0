#pragma once
/// What a run of a cracked plate shows: where the crack is in each frame, where it branches, how fast it runs, where the energy
/// went.

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace perikit::fracture {

/// Point damage beyond which a point lies at the crack. A lip has lost 0.3 to 0.45, by the influence function.
inline constexpr double cracked = 0.25;

/// Damage of the layer of points with the largest z, by column of equal x and row of equal y, ascending.
struct Layer {
  std::vector<double> x, y;
  std::vector<double> damage;  ///< [column * rows + row]
  double at(std::size_t column, std::size_t row) const { return damage[column * y.size() + row]; }
};

struct Crack {
  double end = 0;           ///< time of the last frame [s]
  bool ended = false;       ///< the run came to its end
  Layer layer;              ///< of the last frame
  double tip = 0;           ///< largest x of a cracked point [m]
  double branch = -1;       ///< smallest x from which on every column shows two arms or more up to the tip [m]; -1: none
  int arms = 0;             ///< in the column two spacings behind the tip
  double stray = 0;         ///< largest |y| of a cracked point [m]
  double speed = 0;         ///< steepest rise of the tip over a tenth of the plate's length [m/s]; 0: it did not run so far
  double displacement = 0;  ///< largest |u| of a point that still has bonds (damage < 0.9) [m]
  double fragments = 0;     ///< largest |u| of all points [m]
  double dissipated = 0;    ///< [J]
  double balance =
      0;  ///< largest |work - strain - kinetic - dissipated| relative to the largest work so far, after an eighth of the run
};

/// Of the folder of a run of a plate whose edges are parallel to the axes. Throws InputError.
Crack measure(const std::filesystem::path& run);

}  // namespace perikit::fracture
