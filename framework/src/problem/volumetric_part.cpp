#include "perikit/problem/volumetric_part.hpp"

#include "assembly/volumetric_rows.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/problem/body_problem.hpp"

namespace perikit {

namespace {

/// Rows over all points that the terms see, between displacements and forces of the problem.
class SeenVolumes final : public VolumetricPart {
 public:
  SeenVolumes(const Terms& terms, std::unique_ptr<VolumetricRows> rows, const ImageMap* images, Field seen)
      : terms_(terms), rows_(std::move(rows)), images_(images), seen_(std::move(seen)) {}

  EvaluationStatus linearise(ConstFieldView u) override { return terms_.status(rows_->linearise(seen(u))); }
  void rates(ConstFieldView w, FieldView q) const override { rows_->rates(seen(w), q); }
  void forces(ConstFieldView q, FieldView f) const override {
    rows_->forces(q, f);
    if (images_) images_->fold(f);
  }
  void squares(ConstFieldView c, FieldView q) const override { rows_->squares(c, q); }
  ConstFieldView logarithms() const override { return rows_->logarithms(); }
  ConstFieldView stiffness() const override { return rows_->stiffness(); }

 private:
  ConstFieldView seen(ConstFieldView u) const {
    if (!images_) return u;
    copy(u, seen_);
    images_->extend(seen_);
    return seen_;
  }

  const Terms& terms_;
  std::unique_ptr<VolumetricRows> rows_;
  const ImageMap* images_;
  mutable Field seen_;
};

}  // namespace

std::unique_ptr<VolumetricPart> BodyProblem::volumetric_part() {
  if (parts_.partition) return nullptr;
  std::unique_ptr<VolumetricRows> rows = terms().volumetric_rows();
  if (!rows) return nullptr;
  return std::make_unique<SeenVolumes>(terms(), std::move(rows), images(), images() ? make_field() : Field());
}

}  // namespace perikit
