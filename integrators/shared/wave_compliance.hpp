#pragma once
/// Compliance of volumes against short waves of pressure alone.

#include <vector>

#include "perikit/core/block_matrix.hpp"
#include "perikit/problem/problem.hpp"

namespace perikit {

/// R, symmetric and positive definite where W^-1 is: about W^-1 for waves of a few points and, as a Laplacian, ever less for
/// longer ones,
///
///   (R p)_i = sum_j e_ij (p_i - p_j) + W_i^-1 p_i/100,   e_ij = t_ij sqrt(W_i^-1 W_j^-1/(t_i t_j)),   t_ij = -tr C_ij,   t_i =
///   sum_j t_ij,
///
/// C_ij the blocks of a companion. The last term holds pressures that are the same everywhere in a body whose whole surface is
/// prescribed.
class WaveCompliance {
 public:
  /// `problem` must outlive it.
  explicit WaveCompliance(Problem& problem);
  /// inverse_W: 0 where a point has no pressure. `companion` is the problem's and must outlive R. All ranks must call it.
  void make(const BlockMatrix& companion, ConstFieldView inverse_W);
  /// Rp <- R p on the points of the companion, 0 at ghosts. All ranks must call it.
  void multiply(ConstFieldView p, FieldView Rp);

 private:
  Problem& problem_;
  Field seen_;  ///< p with the values of ghosts; empty where there are none
  const BlockMatrix* companion_ = nullptr;
  std::vector<double> weight_;  ///< e_ij by block; 0 for j = i
  std::vector<double> least_;   ///< W_i^-1/100 by row
};

}  // namespace perikit
