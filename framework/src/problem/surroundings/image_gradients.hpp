#pragma once
/// Deformation gradients of images, which follower pressures near sides of a body need.

#include "families/families.hpp"
#include "perikit/problem/image_map.hpp"

namespace perikit {

/// H at images, in the components of the space. Behind planes of symmetry and periodic sides it follows from H of the source. Behind faces and surfaces
/// that are held the displacement of an image depends on what is prescribed along the side, so that H is the gradient of the displacements u in the
/// family of the image, H = sum over its bonds of omega V u (x) K^-1 xi. u: as the terms see it.
void continue_gradients(const Families& families, const ImageMap& images, ConstFieldView u, FieldView H);

}  // namespace perikit
