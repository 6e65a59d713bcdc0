#include "mixed_system.hpp"

#include "perikit/core/field_operations.hpp"
#include "perikit/problem/motion.hpp"

namespace perikit {

bool MixedSystem::linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) {
  if (!linearise_volumes(equilibrium, u, failure)) return false;
  multigrid_.make(springs_, equilibrium.free(), rigid_motions(problem_.body(), u));
  return true;
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
  const ConstFieldView W = volumes_.stiffness(), inverse_W = volumes_.compliance(), size = volumes_.row_norms(),
                       active = volumes_.active();
  over_blocks(p.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const double Bu = rate_.data()[k];
      excess_.data()[k] = active.data[k] * p.data[k] - W.data[k] * Bu;
      // Points without a pressure: 1 p = 0.
      volume.data[k] = active.data[k] != 0 ? W.data[k] * size.data[k] * (Bu - inverse_W.data[k] * p.data[k]) : p.data[k];
    }
  });
  volumes_.forces(excess_, force_);
  combine(1, force, 1, force_, force);
  return true;
}

void MixedSystem::precondition(FieldView r, FieldView z) {
  const FieldView volume = pressure(r), p = pressure(z), u = displacement(z);
  const ConstFieldView inverse_W = volumes_.compliance(), size = volumes_.row_norms(), active = volumes_.active();
  const auto over_points = [&](auto&& body) {
    over_blocks(volume.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) body(k);
    });
  };
  over_points(
      [&](std::size_t k) { rate_.data()[k] = active.data[k] != 0 ? -inverse_W.data[k] / size.data[k] * volume.data[k] : 0.0; });
  volumes_.solve_schur(rate_, excess_);
  volumes_.forces(excess_, force_);
  combine(1, displacement(r), -1, force_, force_);
  over_points([&](std::size_t k) { p.data[k] = active.data[k] != 0 ? excess_.data()[k] : volume.data[k]; });
  multigrid_.apply(force_, u);
}

}  // namespace perikit
