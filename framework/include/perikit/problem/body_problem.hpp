#pragma once
/// The Problem of one body: model, loads, constraints and state.

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "perikit/body/partition.hpp"
#include "perikit/terms/model.hpp"
#include "perikit/problem/ghosts.hpp"
#include "perikit/problem/integrator.hpp"

namespace perikit {

class Companion;

class BodyProblem final : public Problem {
 public:
  /// Builds everything that the scene describes, by parts from `factory`. Where the communicator has several ranks: this rank's part
  /// of it, whose fields are zero at ghosts. Throws InputError.
  BodyProblem(const Scene& scene, const PartFactory& factory, bool quasi_static);
  ~BodyProblem() override;

  int dimension() const noexcept override { return body_.dimension(); }
  std::size_t stride() const noexcept override { return body_.stride(); }
  std::size_t points() const noexcept override { return whole().points(); }
  double spacing() const noexcept override { return body_.spacing(); }
  Field make_field(int components) const override { return body_.make_field(components); }

  FieldView displacement() noexcept override { return displacement_; }
  FieldView velocity() noexcept override { return declare("velocity", dimension()); }
  FieldView internal_force() noexcept override { return internal_force_; }
  FieldView external_force() noexcept override { return declare("external_force", dimension()); }
  FieldView declare(const std::string& name, int components) override;
  std::span<double> declare_numbers(const std::string& name, std::size_t count) override;
  double& time() noexcept override { return time_; }
  std::int64_t& step() noexcept override { return step_; }
  Energies& energies() noexcept override { return energies_; }
  std::vector<std::byte> snapshot() const override;
  void restore(std::span<const std::byte> bytes) override;

  std::span<const double> mass() override;
  double uniform_mass() override;

  EvaluationStatus evaluate_forces(ConstFieldView u, FieldView force, double* energy, double time_step = 0) override;
  EvaluationStatus tangent_action(ConstFieldView u, ConstFieldView w, FieldView Kw) override;
  EvaluationStatus assemble_tangent(ConstFieldView u, BlockMatrix& K) override;
  AssembledSize assembled_size() override;
  void assemble_companion(ConstFieldView u, BlockMatrix& K) override;
  std::vector<Field> rigid_motions(ConstFieldView u) override;
  void evaluate_loads(double t, FieldView force) override;
  bool any_load() const noexcept override { return !loads_.empty(); }
  bool loads_depend_on_time() const noexcept override;
  bool advance_history(double time_step, ConstFieldView velocity = {}) override;
  std::vector<std::byte> bonds() const override;
  void restore_bonds(std::span<const std::byte> bonds) override;

  /// Points all of whose components are prescribed as 0 at all times.
  std::size_t points_held_at_rest() const;
  bool any_constraint() const noexcept override { return !constraints_.empty(); }
  std::span<const std::int64_t> constrained() const noexcept override { return constrained_; }
  ConstFieldView free_mask() const noexcept override;
  void prescribe_half_step_velocity(double t_begin, double t_end, FieldView v) override;
  void prescribe_velocity(double t, FieldView v) override;
  void prescribe_displacement(double t, FieldView u) override;

  double largest_eigenvalue(ConstFieldView u) override;
  double bond_based_time_step() const override;
  bool constant_stiffness() const noexcept override { return model_->has_gradients() && laws_->constant_tangent() && !damage_; }

  const Body& body() const noexcept { return body_; }
  /// The body of all ranks.
  const Body& whole() const noexcept { return partition_ ? partition_->whole() : body_; }
  Model& model() noexcept { return *model_; }
  const Model& model() const noexcept { return *model_; }
  const Laws& laws() const noexcept { return *laws_; }
  const Scene& scene() const noexcept { return scene_; }
  /// Kinetic energy of a velocity field [J].
  double kinetic_energy(ConstFieldView velocity);
  /// Acceleration at time t: (internal + external)/mass, prescribed components as prescribed [m/s^2].
  Field acceleration(double t);
  /// Force that the constraints exert, 0 at free components: mass a - internal - external [N]; a only for dynamic runs.
  Field reaction(bool dynamic, double t);
  /// How bonds failed so far, in words; empty without [damage].
  std::string fracture_summary() const;
  /// What was left out because no wave had arrived, in words; empty where nothing was.
  std::string quiet_summary() const;
  /// Bytes held by body, model and state.
  std::size_t bytes() const noexcept;

 private:
  /// One component of one [[boundary]] on the points that it governs.
  struct Constraint {
    bool velocity = false;
    int component = 0;
    Expression value;
    bool ramp = false;                    ///< a plain number of a quasi-static run: scaled with t
    std::vector<std::int32_t> points;
    std::vector<double> fixed;            ///< values where they do not depend on t
    double at(const Body& body, std::size_t k, double t) const;
  };
  struct Load {
    int component = 0;
    Expression value;
    bool ramp = false;
    std::vector<std::int32_t> points;
    std::vector<double> share;            ///< force on the point per unit of the value [N / unit]
  };

  /// The scene's penalty, null without one; refused over kinematics that it does not suit.
  std::shared_ptr<const Stabilization> make_stabilization(const PartFactory& factory) const;
  void read_materials(const PartFactory& factory);
  /// Laws with history: refuses runs that have no steps of a path, and makes room.
  void prepare_history(bool quasi_static);
  void read_damage();
  class ByteReader;
  /// State of the bonds in snapshots.
  void append_bonds(std::vector<std::byte>& bytes) const;
  void take_bonds(ByteReader& in);
  /// Lets bonds fail at the present displacement; true where any changed.
  bool update_bonds(double time_step, ConstFieldView velocity);
  void read_initial();
  void read_constraints(bool quasi_static);
  void read_loads(bool quasi_static);
  /// Overwrites prescribed components with their acceleration at t: differences of what is prescribed.
  void prescribe_acceleration(double t, FieldView a) const;
  std::vector<double> face_shares(const Body& body, const LoadDescription& load, std::vector<std::int32_t>& points) const;
  /// What of these points of the whole body belongs to this rank, with its shares.
  void keep_owned(std::vector<std::int32_t>& points, std::vector<double>& share) const;
  /// Throws RunError where several ranks share the body.
  void refuse_assembly() const;
  /// u with the values of ghosts, in `memory`; u itself where there are none.
  ConstFieldView filled(ConstFieldView u, Field& memory) const;
  /// Ends an evaluation: forces on ghosts go to their owners; one status for all ranks.
  void finish(FieldView force, EvaluationStatus& status) const;

  Scene scene_;
  std::shared_ptr<const Damage> damage_law_;   ///< null without [damage]
  std::unique_ptr<const Partition> partition_;   ///< null where one rank has the whole body
  Body body_;
  std::optional<Ghosts> ghosts_;
  mutable Field with_ghosts_, direction_with_ghosts_;
  std::shared_ptr<const InfluenceFunction> influence_;
  Formulation formulation_;
  std::unique_ptr<Laws> laws_;
  std::unique_ptr<BodyDamage> damage_;
  std::unique_ptr<Model> model_;
  std::vector<Constraint> constraints_;
  std::vector<Load> loads_;
  std::vector<std::int64_t> constrained_;
  mutable Field free_mask_;
  Field displacement_, internal_force_;
  std::map<std::string, Field> declared_;
  std::map<std::string, std::vector<double>> numbers_;
  std::unique_ptr<Companion> companion_;       ///< made when asked for
  Field eigenvector_;
  AlignedVector<double> mass_;
  double uniform_mass_ = -1;
  double time_ = 0, last_step_ = 0;
  std::int64_t step_ = 0;
  Energies energies_;
  std::int64_t gains_ = 0;                     ///< updates of bonds that raised the strain energy
  double gained_ = 0;                          ///< what they added [J]
};

}  // namespace perikit
