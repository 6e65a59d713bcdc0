#pragma once
/// What lies around the points that a problem has here: ghosts, which other ranks own, and images beyond its sides. Fields of the problem are zero at
/// ghosts and hold what sides prescribe at images (ImageMap); terms see the values of both, and leave forces on both.

#include <functional>
#include <optional>

#include "perikit/core/block_matrix.hpp"
#include "perikit/core/evaluation_status.hpp"
#include "perikit/model/configuration.hpp"
#include "perikit/problem/image_map.hpp"
#include "problem/ghosts.hpp"

namespace perikit {

/// A field as terms see it, as long as this lives. Values of ghosts lie in the field itself meanwhile, and are zero again, as they are in all fields of a
/// problem, after it; none of an owner changes, so that a field that its caller may only read is taken as well.
class Seen {
 public:
  Seen(ConstFieldView field, const Ghosts* ghosts) : field_(field), ghosts_(ghosts) {}
  Seen(const Seen&) = delete;
  Seen& operator=(const Seen&) = delete;
  ~Seen() {
    if (ghosts_) ghosts_->clear(writable(field_));
  }
  operator ConstFieldView() const noexcept { return field_; }
  static FieldView writable(ConstFieldView u) noexcept { return {const_cast<double*>(u.data), u.stride, u.components}; }

 private:
  ConstFieldView field_;
  const Ghosts* ghosts_;   ///< null where there is nothing to clear
};

class Surroundings {
 public:
  /// Of a body in space with so many components. partition: null where one rank has it; images: null without. Both must outlive this.
  Surroundings(const Partition* partition, const ImageMap* images, int dimension);

  /// Null where one rank has the whole body.
  const Ghosts* ghosts() const noexcept { return ghosts_ ? &*ghosts_ : nullptr; }
  const ImageMap* images() const noexcept { return images_; }
  bool any() const noexcept { return ghosts_ || images_; }

  /// Values of owners -> ghosts. All ranks must call it, and what follows.
  void share(FieldView field);
  /// u with the values of ghosts and, where there are images, of these in `memory`, which is made at the first call.
  Seen seen(ConstFieldView u, Field& memory);
  /// A field with the values of ghosts, without images.
  Seen shared(ConstFieldView field);
  /// evaluate(at) with the displacements as terms see them; those of ghosts arrive meanwhile.
  template <class Evaluate>
  EvaluationStatus arriving(const Configuration& at, Field& memory, Evaluate&& evaluate);

  /// Forces of the terms -> those of the problem: of images they go to where they belong, those on ghosts are nobody's.
  void settle(FieldView force) const;
  /// A failure on one rank becomes one on all of them, which say the same: that of the inadmissible point that comes first, else the shortest step that a law asks for.
  void agree(EvaluationStatus& status) const;
  /// Ends an evaluation: one status for all ranks, and forces of the problem.
  void finish(FieldView force, EvaluationStatus& status) const;
  /// fill(K) makes a matrix over all points that terms see, in `full` where these are more than the problem has; K <- the one that the problem has of it.
  template <class Fill>
  void fold(BlockMatrix& K, BlockMatrix& full, Fill&& fill) const;

 private:
  EvaluationStatus extending(const Configuration& at, Field& memory, const std::function<EvaluationStatus(const Configuration&)>& evaluate);

  std::optional<Ghosts> ghosts_;
  const ImageMap* images_;
};

template <class Evaluate>
EvaluationStatus Surroundings::arriving(const Configuration& at, Field& memory, Evaluate&& evaluate) {
  if (!any()) return evaluate(at);
  const ConstFieldView u = at.unfinished();
  if (!ghosts_) return evaluate(at.seen_as(seen(u, memory)));
  if (images_) return extending(at, memory, evaluate);
  ghosts_->start(Seen::writable(u));
  return evaluate(at.seen_as(Seen(u, ghosts())).arriving(*ghosts_));
}

template <class Fill>
void Surroundings::fold(BlockMatrix& K, BlockMatrix& full, Fill&& fill) const {
  if (!images_) return fill(K);
  full.convex = K.convex;
  fill(full);
  images_->fold(full, K);
}

}  // namespace perikit
