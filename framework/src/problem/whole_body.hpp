#pragma once
#include <memory>

#include "families/families.hpp"
#include "perikit/problem/constraints.hpp"
#include "perikit/problem/image_map.hpp"

namespace perikit {

/// The body of all ranks with what holds it, on the first one of several; for what no rank can see of its own part.
struct WholeBody {
  std::unique_ptr<Families> families;      ///< with all bonds as they are, whoever holds them
  std::unique_ptr<const ImageMap> images;  ///< null without
  Constraints constraints;
};

}  // namespace perikit
