#pragma once
/// A problem that passes every operation on to another one: for those that look on or interfere in one place.

#include "perikit/problem/problem.hpp"

namespace perikit::contract {

class ForwardingProblem : public Problem {
 public:
  explicit ForwardingProblem(Problem& of) : Problem(of), of_(of) {}

  void share(FieldView field) override { of_.share(field); }
  EvaluationStatus evaluate_forces(const Configuration& at, FieldView force, double* energy) override {
    return of_.evaluate_forces(at, force, energy);
  }
  EvaluationStatus external_forces(const Configuration& at, FieldView force) override {
    return of_.external_forces(at, force);
  }
  EvaluationStatus add_load_stiffness(const Configuration& at, ConstFieldView w, FieldView Kw) override {
    return of_.add_load_stiffness(at, w, Kw);
  }
  EvaluationStatus tangent_action(const Configuration& at, ConstFieldView w, FieldView Kw) override {
    return of_.tangent_action(at, w, Kw);
  }
  EvaluationStatus assemble_tangent(const Configuration& at, BlockMatrix& K) override { return of_.assemble_tangent(at, K); }
  AssembledSize assembled_size() override { return of_.assembled_size(); }
  void assemble_companion(ConstFieldView u, BlockMatrix& K, double most_bulk) override { of_.assemble_companion(u, K, most_bulk); }
  std::unique_ptr<VolumetricPart> volumetric_part() override { return of_.volumetric_part(); }
  bool constant_stiffness() const noexcept override { return of_.constant_stiffness(); }
  void accept() override { of_.accept(); }
  void revert() override { of_.revert(); }
  bool update_bonds(const Configuration& at, double elapsed, FieldView velocity) override { return of_.update_bonds(at, elapsed, velocity); }
  std::unique_ptr<WeakeningBonds> weakening_bonds() override { return of_.weakening_bonds(); }
  std::unique_ptr<DamagedPart> damaged_part() override { return of_.damaged_part(); }
  StretchRange stretches(ConstFieldView u) override { return of_.stretches(u); }
  std::vector<std::byte> bonds() const override { return of_.bonds(); }
  void restore_bonds(std::span<const std::byte> bonds) override { of_.restore_bonds(bonds); }

 protected:
  Problem& of_;
};

}  // namespace perikit::contract
