#pragma once
#include <string>
#include <vector>

#include "plugin/registry.hpp"

namespace perikit::app {

struct BenchOptions {
  std::vector<std::string> kinematics;                          ///< with a stabilization as "conventional+silling"; empty: all known ones
  std::vector<std::string> materials = {"saint_venant_kirchhoff"};
  std::vector<int> dimensions = {3};
  std::vector<std::string> lateral = {"strain"};                ///< of planes and lines: "strain", "stress", what is zero across them
  std::vector<int> cells = {32};                                ///< points along each side, or along x, y and z
  int threads = 1;
  bool threads_model = false;                                   ///< what measured blocks would take on more threads, instead of the table
  bool assembly = false;                                        ///< time the assembly of the tangent too: it may need much memory
  std::string json;                                             ///< file that the figures are written to as well
  /// File of operations a point and step, see Operations; empty: the one that comes with perikit. A program that counts them writes it.
  std::string operations;
};

/// Prints the limits of this machine, then for each kinematics, material and space, on a lattice and on a jittered cloud: time
/// per point of an explicit step (everything in it, no output), of the set-up and of the tangent action, and bytes per point; the traffic and the
/// arithmetic of a step against the limits. With `threads_model` the same rows with the efficiency of a step on 2 to 64 threads: the blocks of
/// each loop are timed one by one on one thread, and handed out to the threads as a run would. A program with PERIKIT_COUNT_OPERATIONS prints the operations of a step instead.
void bench(Registry& registry, const BenchOptions& options);

}  // namespace perikit::app
