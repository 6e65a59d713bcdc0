#pragma once
/// A problem that passes everything on to another one, and looks on whenever bonds are about to fail.

#include <functional>

#include "perikit/problem/body_problem.hpp"

namespace perikit::contract {

class WitnessProblem final : public Problem {
 public:
  explicit WitnessProblem(BodyProblem& other) : other_(other) {}
  std::function<void()> before, after;  ///< of advance_history

  bool advance_history(double time_step, ConstFieldView velocity) override {
    if (before) before();
    const bool changed = other_.advance_history(time_step, velocity);
    if (after) after();
    return changed;
  }
  int dimension() const noexcept override { return other_.dimension(); }
  std::size_t stride() const noexcept override { return other_.stride(); }
  std::size_t points() const noexcept override { return other_.points(); }
  double spacing() const noexcept override { return other_.spacing(); }
  Field make_field(int components) const override { return other_.make_field(components); }
  FieldView displacement() noexcept override { return other_.displacement(); }
  FieldView velocity() noexcept override { return other_.velocity(); }
  FieldView internal_force() noexcept override { return other_.internal_force(); }
  FieldView external_force() noexcept override { return other_.external_force(); }
  FieldView declare(const std::string& name, int components) override { return other_.declare(name, components); }
  std::span<double> declare_numbers(const std::string& name, std::size_t count) override {
    return other_.declare_numbers(name, count);
  }
  double& time() noexcept override { return other_.time(); }
  std::int64_t& step() noexcept override { return other_.step(); }
  Energies& energies() noexcept override { return other_.energies(); }
  std::vector<std::byte> snapshot() const override { return other_.snapshot(); }
  void restore(std::span<const std::byte> bytes) override { other_.restore(bytes); }
  void assemble_companion(ConstFieldView u, BlockMatrix& K) override { other_.assemble_companion(u, K); }
  std::vector<Field> rigid_motions(ConstFieldView u) override { return other_.rigid_motions(u); }
  std::span<const double> mass() override { return other_.mass(); }
  double uniform_mass() override { return other_.uniform_mass(); }
  EvaluationStatus evaluate_forces(ConstFieldView u, FieldView force, double* energy, double time_step) override {
    return other_.evaluate_forces(u, force, energy, time_step);
  }
  EvaluationStatus tangent_action(ConstFieldView u, ConstFieldView w, FieldView Kw) override {
    return other_.tangent_action(u, w, Kw);
  }
  EvaluationStatus assemble_tangent(ConstFieldView u, BlockMatrix& K) override { return other_.assemble_tangent(u, K); }
  AssembledSize assembled_size() override { return other_.assembled_size(); }
  void evaluate_loads(double t, FieldView force) override { other_.evaluate_loads(t, force); }
  bool any_load() const noexcept override { return other_.any_load(); }
  bool loads_depend_on_time() const noexcept override { return other_.loads_depend_on_time(); }
  std::vector<std::byte> bonds() const override { return other_.bonds(); }
  void restore_bonds(std::span<const std::byte> bonds) override { other_.restore_bonds(bonds); }
  bool any_constraint() const noexcept override { return other_.any_constraint(); }
  std::span<const std::int64_t> constrained() const noexcept override { return other_.constrained(); }
  ConstFieldView free_mask() const noexcept override { return other_.free_mask(); }
  void prescribe_half_step_velocity(double t_begin, double t_end, FieldView v) override {
    other_.prescribe_half_step_velocity(t_begin, t_end, v);
  }
  void prescribe_velocity(double t, FieldView v) override { other_.prescribe_velocity(t, v); }
  void prescribe_displacement(double t, FieldView u) override { other_.prescribe_displacement(t, u); }
  double largest_eigenvalue(ConstFieldView u) override { return other_.largest_eigenvalue(u); }
  double bond_based_time_step() const override { return other_.bond_based_time_step(); }
  bool constant_stiffness() const noexcept override { return other_.constant_stiffness(); }

 private:
  BodyProblem& other_;
};

}  // namespace perikit::contract
