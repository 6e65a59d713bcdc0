#pragma once
#include "assembly/assembly.hpp"
#include "families/cloud/cloud_rows.hpp"
#include "terms/penalty/penalty_element.hpp"

namespace perikit {

/// K += sum_i M_i (x) N_i over the families of points, whose penalty is quadratic: the same at every u.
template <int D>
class PenaltyAssembly final : public Assembly {
 public:
  PenaltyAssembly(const PenaltyParts& parts, const BlockRows& rows);

  std::int64_t add(const Configuration& at, BlockMatrix& K) override;
  void bonds_changed() override {}
  std::size_t bytes() const noexcept override { return 0; }

 private:
  struct Memory {
    PenaltyElement<D> element;
    std::vector<std::int32_t> nodes;
    std::vector<double> N;
  };
  void add_row(std::size_t row, BlockMatrix& K, Memory& m) const;

  PenaltyParts parts_;
  const BlockRows& rows_;
  CloudBlocks blocks_;
  Colouring colouring_;
  PerThread<Memory> memory_;
};

}  // namespace perikit
