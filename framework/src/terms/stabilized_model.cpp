#include "terms/stabilized_model.hpp"

namespace perikit {

EvaluationStatus StabilizedModel::forces(ConstFieldView u, FieldView force, double* energy) {
  EvaluationStatus status = base_->forces(u, force, energy);
  if (status.ok()) penalty_->add_forces(u, 1.0, force, energy);
  return status;
}

EvaluationStatus StabilizedModel::tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) {
  EvaluationStatus status = base_->tangent(u, w, Kw);
  if (status.ok()) penalty_->add_forces(w, -1.0, Kw, nullptr);
  return status;
}

EvaluationStatus StabilizedModel::sample(ConstFieldView u, PointSamples& samples) {
  EvaluationStatus status = base_->sample(u, samples);
  if (status.ok()) penalty_->add_density(u, samples.strain_energy_density.data());
  return status;
}

ModelReport StabilizedModel::report() const {
  ModelReport report = base_->report();
  report.bytes += penalty_->bytes();
  if (!penalty_->simple_force()) return report;
  report.skips.push_back({"adjoint of the penalty through the point gradient", "it vanishes: sum of omega z (x) xi V = 0 (order 1, same omega)",
                          "a gradient and a divergence"});
  return report;
}

}  // namespace perikit
