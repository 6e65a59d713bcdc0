#pragma once
#include "assembly/assembly.hpp"
#include "assembly/tangent_batch.hpp"
#include "spaces/local_force_point.hpp"

namespace perikit {

/// sum of V over the whole family of each block row.
std::vector<double> family_volumes(const Body& body, const InfluenceFunction& influence);

/// K = -df/du of local force states (LocalForceModel): the rows of both ends of a bond depend on the family of its owner.
/// Not symmetric. Row by row on one thread.
template <int D>
class LocalForceAssembly final : public Assembly {
 public:
  explicit LocalForceAssembly(const ModelParts& parts);

 private:
  std::int64_t fill(ConstFieldView u, BlockMatrix& K) override;
  void add_lanes(std::size_t row, ConstFieldView u);
  /// K of the force t on both ends of bond k of the row: dt = sum_l B[l] (u_l - u_i), B[l * D * D ...] row-major.
  void couple(std::size_t row, std::size_t k, const std::vector<double>& B, BlockMatrix& K) const;

  Formulation formulation_;
  bool selective_;
  std::vector<double> family_volume_;
  LocalForcePoint<D> point_;
  TangentBatch<D> batch_;
};

}  // namespace perikit
