#pragma once
#include <optional>

#include "assembly/assembly.hpp"
#include "assembly/point_element.hpp"
#include "assembly/tangent_batch.hpp"
#include "families/cloud/cloud_rows.hpp"
#include "spaces/evaluation_space.hpp"

namespace perikit {

/// Point and weighted shapes: everything that a point owns depends on its family, so that K is a sum of one dense matrix per point.
template <int D>
class ElementAssembly final : public Assembly {
 public:
  ElementAssembly(const SpaceParts& parts, const LawsOfSpace& laws, const BlockRows& rows);

  std::int64_t add(const Configuration& at, BlockMatrix& K) override;
  /// Elements of points that are not whole are made anew each time.
  void bonds_changed() override {}
  std::size_t bytes() const noexcept override { return 0; }

 private:
  /// Memory of one thread.
  struct Memory {
    Memory(const SpaceParts& parts, const LawsOfSpace& laws) : points(parts), batch(laws, parts.formulation.selective()) {}
    EvaluationPoints<D> points;
    TangentBatch<D> batch;
    ElementScratch<D> scratch;
    std::vector<PointElement<D>> elements;          ///< of points that are not whole
    std::vector<const PointElement<D>*> of_row;
    std::vector<std::int32_t> nodes;
    AlignedVector<double> u;
  };

  /// Rows [first, last) at once. Returns the field index of an inadmissible point or -1.
  std::int64_t fill_rows(std::size_t first, std::size_t last, const Configuration& at, BlockMatrix& K, Memory& m) const;
  void add_lanes(std::size_t row, const PointElement<D>& element, ConstFieldView u, Memory& m) const;

  SpaceParts parts_;
  LawsOfSpace laws_;
  const BlockRows& rows_;
  const Formulation& formulation_;
  std::optional<PointElement<D>> whole_;  ///< of rows with the whole family
  CloudBlocks blocks_;
  Colouring colouring_;
  PerThread<Memory> memory_;
};

}  // namespace perikit
