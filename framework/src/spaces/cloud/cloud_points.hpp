#pragma once
#include "body/partition/block_colours.hpp"
#include "spaces/cloud/cloud_gradient.hpp"
#include "spaces/evaluation_space.hpp"

namespace perikit {

/// Evaluation points at the points of a cloud, point gradients of order 1: gradient, law and Q of one block after the other, then forces,
/// gathered from both ends of each bond.
template <int D>
class CloudPoints final : public EvaluationSpace {
 public:
  explicit CloudPoints(const SpaceParts& parts);

  void run(Pass& pass) override;
  void complete(GroupMarks& marks) const override { mark_whole_runs(batch_points / padding, marks); }
  std::size_t numbers() const noexcept override { return padded(points_); }
  PointNumbers number_of(std::int32_t p, std::int32_t, int) const noexcept override { return {p, p}; }
  void bonds_changed(std::span<const std::int32_t> points) override;
  void shift_gradients(ConstFieldView lambda) override;
  void report(ModelReport& report) const override;

 private:
  void block(std::size_t b, Pass& pass);

  const CloudFamilies& families_;
  const Laws& laws_;
  std::size_t points_;
  CloudBlocks blocks_;
  const Row* position_;                        ///< {x, y, z, V}
  CloudGradient<D> gradient_;
  ArrivingPieces pieces_;
  BlockSequence sequence_;
  AlignedVector<Row> u_, w_;          ///< mirrors
  AlignedVector<Row> flux_, stress_;  ///< Q, D rows a point
  ScratchPool scratch_;
};

}  // namespace perikit
