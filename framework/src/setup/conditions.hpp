#pragma once
/// From [[boundary]], [[load]] and [initial] to the values of a problem.

#include <string>
#include <vector>

#include "perikit/problem/constraints.hpp"
#include "perikit/problem/loads.hpp"
#include "perikit/problem/state.hpp"
#include "scene/scene.hpp"
#include "terms/terms.hpp"

namespace perikit {

/// The time of the last loads and boundaries: the end of the run where its integrator says so, of the load parameter in quasi-static runs; else 0.
double end_of(const Scene& scene, bool quasi_static);

/// The value of one key. In quasi-static runs it ramps as the scene says, else where it does not mention t.
SpaceTimeFunction function_of(const Expression& expression, const RampDescription& ramp, bool quasi_static);

/// Throws InputError where a run without load parameter says how values ramp. key: of the boundary or load.
void refuse_ramp(const RampDescription& ramp, const std::string& key, bool quasi_static);

/// Of points and of the images that faces have. Throws InputError for prescribed velocities in quasi-static runs, and for points at a held
/// face that are held themselves.
Constraints build_constraints(const Scene& scene, const Body& body, const Images& images, std::vector<FaceMotion> motions, bool quasi_static);

/// On the owned points of the body; of a part of a body totals are those of all ranks, which must all call it. parts: of the terms,
/// whose kinematics say what area a point has of a face. images: of the body (null: none). Throws InputError for faces without
/// points.
Loads build_loads(const Scene& scene, const TermParts& parts, const ImageMap* images, bool quasi_static);

/// Displacements and velocities at the start, of images as the constraints have them. Throws InputError where an earlier run does
/// not hold them.
void set_initial_state(const Scene& scene, const Body& body, const Constraints& constraints, bool quasi_static, State& state);

}  // namespace perikit
