#pragma once
/// The part of a body where bonds fail.

#include "perikit/core/evaluation_status.hpp"
#include "perikit/core/field.hpp"
#include "perikit/model/configuration.hpp"

namespace perikit {

/// Points whose bonds failed or weakened in the last update: what that did to the stiffness, it did at them. Of bodies with images all points.
/// Its tangent costs as much of that of the body as it is of the body, and the families around it.
class DamagedPart {
 public:
  virtual ~DamagedPart() = default;
  /// 1 on the components of its points, 0 elsewhere.
  virtual ConstFieldView inside() const = 0;
  /// Kw <- -d(force)/du . w [N] on its points, bit for bit as Problem::tangent_action has it, of a w that is 0 on all others; anything
  /// elsewhere.
  virtual EvaluationStatus tangent_action(const Configuration& at, ConstFieldView w, FieldView Kw) = 0;
};

}  // namespace perikit
