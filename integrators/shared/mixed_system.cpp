#include "mixed_system.hpp"

#include "perikit/core/field_operations.hpp"

namespace perikit {

bool MixedSystem::linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) {
  if (!linearise_volumes(equilibrium, u, failure)) return false;
  return cycle_->prepare(equilibrium, u, failure);
}

bool MixedSystem::linearise_volumes(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) {
  problem_.assemble_companion(u, springs_, VolumeEquations::ordinary);
  const EvaluationStatus status = volumes_.linearise(u, springs_, equilibrium.free());
  if (!status.ok()) failure = status.description;
  return status.ok();
}

bool MixedSystem::multiply(const Product& K, FieldView x, FieldView y) {
  const FieldView p = pressure(x), force = displacement(y), volume = pressure(y);
  if (!K(displacement(x), force)) return false;
  volumes_.rates(displacement(x), rate_);
  const ConstFieldView W = volumes_.stiffness(), inverse_W = volumes_.compliance(), scale = volumes_.row_scales(),
                       active = volumes_.active();
  over_blocks(p.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const double Bu = rate_.data()[k];
      excess_.data()[k] = active.data[k] * p.data[k] - W.data[k] * Bu;
      // Points without a pressure: 1 p = 0.
      volume.data[k] = active.data[k] != 0 ? scale.data[k] * (Bu - inverse_W.data[k] * p.data[k]) : p.data[k];
    }
  });
  volumes_.forces(excess_, force_);
  combine(1, force, 1, force_, force);
  return true;
}

bool MixedSystem::multiply_without_volumes(const Product& K, ConstFieldView w, FieldView Aw) {
  if (!K(w, Aw)) return false;
  volumes_.rates(w, rate_);
  mask(volumes_.stiffness(), rate_);
  volumes_.forces(rate_, force_);
  combine(1, Aw, -1, force_, Aw);
  return true;
}

std::pair<double, double> MixedSystem::correct(ConstFieldView u, FieldView solution, double enough, FieldView du) {
  const ConstFieldView p = pressure(solution), inverse_W = volumes_.compliance();
  combine(1, du, -1, displacement(solution), force_);
  volumes_.rates(force_, rate_);
  copy(p, excess_);
  mask(inverse_W, excess_);
  combine(1, rate_, 1, excess_, rate_);
  return volumes_.correct(u, rate_, enough, du);
}

std::pair<double, double> MixedSystem::keep_volumes(ConstFieldView u, FieldView du) {
  fill(0.0, rate_);
  return volumes_.correct(u, rate_, 0.0, du);
}

void MixedSystem::precondition(FieldView r, FieldView z) {
  const FieldView volume = pressure(r), p = pressure(z), u = displacement(z);
  const ConstFieldView scale = volumes_.row_scales(), active = volumes_.active();
  const auto over_points = [&](auto&& body) {
    over_blocks(volume.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) body(k);
    });
  };
  invert_companion(displacement(r), force_);
  volumes_.rates(force_, rate_);
  over_points(
      [&](std::size_t k) { rate_.data()[k] = active.data[k] != 0 ? rate_.data()[k] - volume.data[k] / scale.data[k] : 0.0; });
  volumes_.solve_schur(rate_, excess_);
  volumes_.forces(excess_, force_);
  combine(1, displacement(r), -1, force_, force_);
  over_points([&](std::size_t k) { p.data[k] = active.data[k] != 0 ? excess_.data()[k] : volume.data[k]; });
  invert_companion(force_, u);
}

void MixedSystem::invert_companion(ConstFieldView r, FieldView z) {
  cycle_->apply(r, z);
  const ConstFieldView inverse_D = volumes_.inverse_diagonal();
  over_blocks(r.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) z.data[k] += inverse_D.data[k] * r.data[k];
  });
}

}  // namespace perikit
