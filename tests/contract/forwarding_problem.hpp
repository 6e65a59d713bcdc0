#pragma once
/// A problem that passes everything on to another one: for those that look on or interfere in one place.

#include "perikit/problem/integrator.hpp"

namespace perikit::contract {

class ForwardingProblem : public Problem {
 public:
  explicit ForwardingProblem(Problem& of) : of_(of) {}

  EvaluationStatus evaluate_forces(ConstFieldView u, FieldView force, double* energy, double time_step) override {
    return of_.evaluate_forces(u, force, energy, time_step);
  }
  EvaluationStatus tangent_action(ConstFieldView u, ConstFieldView w, FieldView Kw) override { return of_.tangent_action(u, w, Kw); }
  EvaluationStatus assemble_tangent(ConstFieldView u, BlockMatrix& K) override { return of_.assemble_tangent(u, K); }
  void assemble_companion(ConstFieldView u, BlockMatrix& K) override { of_.assemble_companion(u, K); }
  int dimension() const noexcept override { return of_.dimension(); }
  std::size_t stride() const noexcept override { return of_.stride(); }
  std::size_t points() const noexcept override { return of_.points(); }
  double spacing() const noexcept override { return of_.spacing(); }
  Field make_field(int components) const override { return of_.make_field(components); }
  FieldView displacement() noexcept override { return of_.displacement(); }
  FieldView velocity() noexcept override { return of_.velocity(); }
  FieldView internal_force() noexcept override { return of_.internal_force(); }
  FieldView external_force() noexcept override { return of_.external_force(); }
  FieldView declare(const std::string& name, int components) override { return of_.declare(name, components); }
  std::span<double> declare_numbers(const std::string& name, std::size_t count) override {
    return of_.declare_numbers(name, count);
  }
  double& time() noexcept override { return of_.time(); }
  std::int64_t& step() noexcept override { return of_.step(); }
  Energies& energies() noexcept override { return of_.energies(); }
  std::vector<std::byte> snapshot() const override { return of_.snapshot(); }
  void restore(std::span<const std::byte> bytes) override { of_.restore(bytes); }
  std::span<const double> mass() override { return of_.mass(); }
  double uniform_mass() override { return of_.uniform_mass(); }
  AssembledSize assembled_size() override { return of_.assembled_size(); }
  std::vector<Field> rigid_motions(ConstFieldView u) override { return of_.rigid_motions(u); }
  void evaluate_loads(double t, FieldView force) override { of_.evaluate_loads(t, force); }
  bool any_load() const noexcept override { return of_.any_load(); }
  bool loads_depend_on_time() const noexcept override { return of_.loads_depend_on_time(); }
  bool advance_history(double time_step, ConstFieldView velocity) override { return of_.advance_history(time_step, velocity); }
  std::vector<std::byte> bonds() const override { return of_.bonds(); }
  void restore_bonds(std::span<const std::byte> bonds) override { of_.restore_bonds(bonds); }
  bool any_constraint() const noexcept override { return of_.any_constraint(); }
  std::span<const std::int64_t> constrained() const noexcept override { return of_.constrained(); }
  ConstFieldView free_mask() const noexcept override { return of_.free_mask(); }
  void prescribe_half_step_velocity(double t_begin, double t_end, FieldView v) override {
    of_.prescribe_half_step_velocity(t_begin, t_end, v);
  }
  void prescribe_velocity(double t, FieldView v) override { of_.prescribe_velocity(t, v); }
  void prescribe_displacement(double t, FieldView u) override { of_.prescribe_displacement(t, u); }
  double largest_eigenvalue(ConstFieldView u) override { return of_.largest_eigenvalue(u); }
  double bond_based_time_step() const override { return of_.bond_based_time_step(); }
  bool constant_stiffness() const noexcept override { return of_.constant_stiffness(); }

 protected:
  Problem& of_;
};

}  // namespace perikit::contract
