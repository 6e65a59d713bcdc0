#pragma once
#include <array>

#include "body/partition/lattice_shares.hpp"
#include "perikit/body/body.hpp"
#include "perikit/core/rank_values.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// Refuses keys about volumes that would change nothing. Throws InputError.
void check_volumes(const Scene& scene);
/// The horizon of a scene for points so far apart [m].
double scene_horizon(const Scene& scene, double spacing);
/// What the scene says of its body beside the points.
BodyFrame scene_frame(const Scene& scene, double spacing);
/// The lattice of a scene that has one, before `inside`. Throws InputError where there is no room for a point, and for families
/// that are too large.
Lattice scene_lattice(const Scene& scene);

/// What the scene keeps of its lattice, which must outlive it.
Inside inside_of(const Scene& scene);

/// About so many cells the lattice of a scene has, before anything of their number is made.
double estimated_cells(const Scene& scene);
[[noreturn]] void refuse_empty_lattice(const LatticeDescription& description);
/// Whether points fill so little of the box of a lattice that dead cells would dominate.
bool sparse(double points, const Lattice& lattice);

/// Cells of the lattice along the axes of the input.
std::array<std::int64_t, 3> input_cells(const Lattice& lattice);
/// visit(index) for those of a run of the cells in input order, x fastest, that the scene keeps.
template <class Visit>
void over_kept_cells(const LatticeDescription& description, const Lattice& lattice, const Run& run, Visit&& visit) {
  const std::array<std::int64_t, 3> cells = input_cells(lattice);
  std::array<std::int64_t, 3> k{run.first % cells[0], run.first / cells[0] % cells[1], run.first / cells[0] / cells[1]};
  for (std::int64_t left = run.last - run.first; left > 0; --left) {
    const std::array<std::int64_t, 3> inner{k[static_cast<std::size_t>(lattice.axis[0])],
                                            k[static_cast<std::size_t>(lattice.axis[1])],
                                            k[static_cast<std::size_t>(lattice.axis[2])]};
    const std::int64_t index = lattice.index(inner[0], inner[1], inner[2]);
    if (!description.inside || (*description.inside)(lattice.position(index)) != 0.0) visit(index);
    for (std::size_t a = 0; a < 3 && ++k[a] == cells[a] && a < 2; ++a) k[a] = 0;
  }
}

}  // namespace perikit
