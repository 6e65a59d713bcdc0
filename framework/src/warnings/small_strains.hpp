#pragma once
/// Laws for small strains, and penalties that do not turn with the body, in bodies that leave small strains and rotations: such a run
/// adds up and is wrong. Frames are looked at, and the run warns.

#include <string>
#include <vector>

#include "output_fields/point_fields.hpp"
#include "perikit/plugin/part.hpp"
#include "scene/scene.hpp"

namespace perikit {

class SmallStrains {
 public:
  SmallStrains(const Scene& scene, const PartFactory& factory, const BodyProblem& problem);

  /// Whether a law or a penalty of the problem is for small strains or rotations only.
  bool watched() const noexcept { return !parts_.empty(); }
  /// Warnings have what the parts state of their limits.
  void tell_limits(PartCatalogue& parts);
  /// Looks at the deformation gradients of the present state; all ranks must call it. Returns a warning where they are the first that
  /// are no longer small, else nothing.
  std::string look(PointFields& fields, double time);
  /// A warning that says of how many frames that was so, and how far it went; nothing where it never was.
  std::string closing() const;

 private:
  const BodyProblem& problem_;
  struct Part {
    Kind kind;
    std::string type, limits;
    bool operator==(const Part&) const = default;
  };
  /// With what it is that strains and rotations are too large.
  std::string with() const;

  std::vector<Part> parts_;   ///< those that are for small strains or rotations only, each once
  bool penalty_ = false;      ///< rotations count at all points
  int frames_ = 0, beyond_ = 0;
  double worst_ = 0, worst_time_ = 0;
};

}  // namespace perikit
