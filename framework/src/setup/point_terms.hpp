#pragma once
/// From [[term]] to a term of the body.

#include "perikit/problem/integrator.hpp"
#include "scene/scene.hpp"
#include "terms/point_terms.hpp"
#include "terms/terms.hpp"

namespace perikit {

/// The parts with what the scene says of them. Throws InputError for terms that need what runs of the integrator do not have.
std::vector<PointTermPart> point_term_parts(const Scene& scene, const PartFactory& factory, const IntegratorTraits& integrator);
/// One term of all of them; null without any.
TermMaker build_point_terms(const Scene& scene, const PartFactory& factory, const IntegratorTraits& integrator);

}  // namespace perikit
