#pragma once
/// Points that have come through the faces of a crack. Bonds that failed or that a pre-crack cuts resist nothing, neither opening nor closing, so
/// that faces that are pressed together pass through each other.

#include "families/families.hpp"

namespace perikit {

struct CrossedFaces {
  std::int64_t points = 0;   ///< owned ones
  double deepest = 0;        ///< the largest closing, over the distance of both sides at rest
};

/// u: with the values of ghosts and images. A point is looked at where it has lost a quarter of its family or more; its lost bonds and those that are
/// left show where both sides are. It counts where these have come closer by more than a hundredth of their distance, beyond twice the largest
/// compression of a bond that is left. Rigid motion, sliding along the face and the strain of the body are no closing.
CrossedFaces find_crossed_faces(const Families& families, ConstFieldView u);

}  // namespace perikit
