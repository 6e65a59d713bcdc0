#pragma once
/// B of VolumetricPart, for lattices and clouds.

#include <memory>
#include <vector>

#include "assembly/block_rows.hpp"
#include "assembly/tangent_batch.hpp"
#include "perikit/core/evaluation_status.hpp"

namespace perikit {

/// Row i of B: b_ij = Fbar_i^-T g_ij by neighbour and b_ii = -sum_j b_ij, g_ij the stencil of the point gradient. Lattices need not store
/// them; elsewhere entries are of single precision, since products with them are limited by memory. B^T has the same numbers, so that both
/// remain adjoint.
class VolumetricRows {
 public:
  virtual ~VolumetricRows() = default;
  /// Field index of the first inadmissible point, or -1.
  virtual std::int64_t linearise(ConstFieldView u) = 0;
  virtual void rates(ConstFieldView w, FieldView q) const = 0;
  virtual void forces(ConstFieldView q, FieldView f) const = 0;
  virtual void squares(ConstFieldView c, FieldView q) const = 0;
  virtual ConstFieldView logarithms() const = 0;
  virtual ConstFieldView stiffness() const = 0;
};

/// For selective kinematics. What `parts` and `laws` refer to must outlive the rows.
std::unique_ptr<VolumetricRows> make_volumetric_rows(const SpaceParts& parts, const LawsOfSpace& laws);

}  // namespace perikit
