#pragma once
/// Algebraic multigrid for stiffness matrices of nearest neighbours.

#include <functional>
#include <memory>
#include <vector>

#include "free_matrix.hpp"
#include "perikit/core/block_matrix.hpp"
#include "perikit/core/field.hpp"

namespace perikit {

/// One V-cycle of smoothed aggregation [Vanek, Mandel, Brezina 1996]: an approximate inverse of a symmetric, positive definite K
/// on its free components, at a cost in time and memory that is proportional to the points. Aggregates are points with all their
/// neighbours; on each of them coarse functions are the rigid motions, so that bending and rotation of slender bodies are coarse
/// too. Smoothers are Chebyshev polynomials of D^-1 K [Adams et al. 2003]. The numbers are the same for any number of threads.
class Multigrid {
 public:
  Multigrid();
  ~Multigrid();
  Multigrid(Multigrid&&) noexcept;
  Multigrid& operator=(Multigrid&&) noexcept;

  /// Asked while levels are made: whether the run goes on.
  void watch(std::function<bool()> goes_on);
  /// free: 1 on free components. rigid: d (d + 1)/2 motions of the body as a whole, d components each. Where the run is to end before that is done, it is of
  /// no use, and nothing may be asked of it any more.
  void make(const BlockMatrix& K, ConstFieldView free, const std::vector<Field>& rigid);
  /// z <- M^-1 r on free components, 0 elsewhere. r and z may be the same field.
  void apply(ConstFieldView r, FieldView z);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace perikit
