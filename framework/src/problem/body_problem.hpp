#pragma once
/// The Problem of one body: evaluations by its terms, with what holds loose pieces, and bonds that fail. What ghosts and images change of them is in
/// Surroundings, what a run continues from in SavedState.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "body/partition/partition.hpp"
#include "fracture/fracture.hpp"
#include "operators/samples.hpp"
#include "perikit/problem/problem.hpp"
#include "problem/driven_work.hpp"
#include "problem/saved/saved_state.hpp"
#include "problem/surroundings/surroundings.hpp"
#include "problem/world.hpp"

namespace perikit {

class Companion;
class Families;
class NearBonds;
class WeakSprings;

/// Everything behind the operations of a problem; later members refer to earlier ones.
struct ProblemParts {
  ProblemParts();
  ProblemParts(ProblemParts&&) noexcept;
  ~ProblemParts();
  std::unique_ptr<Partition> partition;         ///< null where one rank has the whole body
  std::unique_ptr<const Body> body;             ///< of this rank, with the images of its points
  std::unique_ptr<const ImageMap> images;       ///< null without
  std::unique_ptr<Laws> laws;
  std::unique_ptr<Families> families;           ///< of the body: everything that looks at bonds borrows them
  std::unique_ptr<Terms> terms;
  std::unique_ptr<Fracture> fracture;           ///< null: bonds never fail
  std::string kinematics;                       ///< names, for messages
  std::vector<std::string> materials;           ///< by material of the body
  std::vector<std::string> warnings;            ///< of what is allowed and can hardly be meant
  std::vector<std::string> notes;               ///< where sides were found to lie
};

class BodyProblem final : public Problem {
 public:
  /// `values` are of the body and the laws of `parts`. Where the communicator has several ranks: of this rank's part of the body,
  /// with fields that are zero at ghosts.
  BodyProblem(ProblemParts parts, ProblemValues values);
  ~BodyProblem() override;

  void share(FieldView field) override { surroundings_.share(field); }
  EvaluationStatus evaluate_forces(const Configuration& at, FieldView force, double* energy) override;
  EvaluationStatus external_forces(const Configuration& at, FieldView force) override;
  EvaluationStatus add_load_stiffness(const Configuration& at, ConstFieldView w, FieldView Kw) override;
  EvaluationStatus tangent_action(const Configuration& at, ConstFieldView w, FieldView Kw) override;
  EvaluationStatus assemble_tangent(const Configuration& at, BlockMatrix& K) override;
  AssembledSize assembled_size() override;
  void assemble_companion(ConstFieldView u, BlockMatrix& K, double most_bulk) override;
  std::unique_ptr<VolumetricPart> volumetric_part() override;
  /// Of the present state.
  EvaluationStatus sample(PointSamples& samples);
  /// The next evaluation of forces takes these samples along where it can, for a `sample` of the same displacements that asks for the same: most
  /// of what either does is what the other does, too.
  void sample_along(Sampling asked) noexcept { along_ = asked; }
  bool constant_stiffness() const noexcept override;
  void accept() override;
  void revert() override;
  bool update_bonds(const Configuration& at, double elapsed, FieldView velocity = {}) override;
  std::int64_t failed_bonds() const override;
  std::unique_ptr<WeakeningBonds> weakening_bonds() override;
  std::unique_ptr<DamagedPart> damaged_part() override;
  StretchRange stretches(ConstFieldView u) override;
  std::vector<std::byte> bonds() const override;
  void restore_bonds(std::span<const std::byte> bonds) override;

  /// Quasi-static runs: from now on pieces of the body that nothing holds are known. Where loads move one, forces are refused and
  /// the status names it; weak_springs > 0 holds their points by springs of this share of a point's stiffness. Returns what is
  /// loose now, in words; empty: nothing. All ranks must call it.
  std::string watch_pieces(double weak_springs);

  // See SavedState. All ranks must call them.
  std::vector<std::byte> snapshot() const { return saved_state_.write_here(); }
  void write_snapshot(const std::function<void(std::uint64_t size)>& begin, const std::function<void(std::span<const std::byte>)>& next) const {
    saved_state_.write(begin, next);
  }
  void restore(std::span<const std::byte> bytes);
  void restore(ByteReader& in);
  void carry(ByteReader& in) { saved_state_.carry(in, families()); }

  /// Whether laws or terms lose energy.
  bool dissipates() const noexcept { return laws().dissipates() || terms().driven(Drive::loss); }

  Terms& terms() noexcept { return *parts_.terms; }
  const Terms& terms() const noexcept { return *parts_.terms; }
  const Families& families() const noexcept { return *parts_.families; }
  /// Null where one rank has the whole body.
  const Partition* partition() const noexcept { return parts_.partition.get(); }
  const Ghosts* ghosts() const noexcept { return surroundings_.ghosts(); }
  /// Null where bonds never fail.
  Fracture* fracture() noexcept { return parts_.fracture.get(); }
  /// How bonds failed so far, in words; empty where they never fail. All ranks must call it.
  std::string fracture_summary() const;
  /// Of the terms and of bonds that fail.
  ModelReport report() const;
  const std::vector<std::string>& warnings() const noexcept { return parts_.warnings; }
  /// Faces of cracks that have passed through each other, in words; empty: none. All ranks must call it.
  std::string crossed_faces();
  const std::vector<std::string>& notes() const noexcept { return parts_.notes; }
  /// Bytes held by body, terms and state.
  std::size_t bytes() const noexcept;

 private:
  class Damaged;
  class Volumes;
  class Weakening;

  ProblemParts parts_;
  ProblemValues values_;
  DrivenWork driven_work_;
  Surroundings surroundings_;
  World world_;
  SavedState saved_state_;

  Seen seen(ConstFieldView u, Field& memory) { return surroundings_.seen(u, memory); }
  void finish(FieldView force, EvaluationStatus& status) const { surroundings_.finish(force, status); }
  /// What evaluations of forces say of inadmissible deformation.
  void describe(EvaluationStatus& status) const;
  /// Looks anew for pieces that nothing holds, where they are watched. fresh: see WeakSprings.
  void find_pieces(bool fresh);
  /// `moved` are the points that impulses have moved, some of them twice.
  BondUpdate fail_inside(const Configuration& end, double elapsed, FieldView velocity, std::vector<std::int32_t>& moved);
  /// Bonds took it with them [J].
  void dissipate(double energy);
  /// The forces [N] act so much longer [s], as many seconds before the end of the step as `since` says: velocities change, and displacements by what that has done
  /// since. Overwrites them; returns how fast their power would have grown without the bonds [W/s].
  double push(FieldView force, double time, double since, FieldView velocity, std::vector<std::int32_t>& moved);
  /// Forces and strain energy become those of the bonds that are left, where the points are.
  void renew_forces(const Configuration& at, std::span<const std::int32_t> moved, std::span<const std::int32_t> lost);

  Field seen_, seen_direction_;   ///< what terms see, with images
  Field before_;                 ///< displacement at the beginning of a step inside of which bonds fail
  bool energy_wanted_ = false;   ///< by the last evaluation of forces
  Sampling along_ = Sampling::nothing;   ///< with the next one
  std::optional<PointSamples> kept_;     ///< with the last one
  std::uint64_t kept_at_ = 0;            ///< fingerprint of their displacements
  BlockMatrix tangent_of_terms_, companion_of_terms_;   ///< with images
  std::unique_ptr<Companion> companion_;        ///< made when asked for
  std::unique_ptr<NearBonds> near_bonds_;       ///< made when asked for
  std::unique_ptr<WeakSprings> weak_springs_;   ///< null unless pieces are watched
};

}  // namespace perikit
