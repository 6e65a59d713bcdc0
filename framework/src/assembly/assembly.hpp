#pragma once
/// Assembled tangents: K = sum_q W_q g_q . A(F_q) . g_q with the evaluation points and stencils of the models, never by probing.

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "assembly/block_pattern.hpp"
#include "families/bond_state.hpp"
#include "terms/zero_energy_penalty.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/terms/model.hpp"

namespace perikit {

/// One way of assembling: what a model of these parts sums over. Made when a tangent is asked for.
class Assembly {
 public:
  virtual ~Assembly() = default;
  EvaluationStatus assemble(ConstFieldView u, BlockMatrix& K);
  AssembledSize size() const;
  /// Of bonds that fail: every change since the set-up. The pattern stays that of the set-up.
  void set_bonds(std::span<const BondChange> changes);

 protected:
  /// steps: bonds between two points that depend on each other, at most.
  Assembly(const ModelParts& parts, int steps);
  /// Adds to values that are zero. Returns the field index of the first inadmissible point, or -1.
  virtual std::int64_t fill(ConstFieldView u, BlockMatrix& K) = 0;
  /// What is kept from one assembly to the next and depends on bonds is to be made anew.
  virtual void bonds_changed() {}
  /// Kept from one assembly to the next.
  virtual std::size_t work_bytes() const noexcept { return 0; }
  const PointFamilies& families() const noexcept { return families_; }
  /// Of the matrix that is being filled: see BlockMatrix.
  bool convex() const noexcept { return convex_; }

 private:
  PointFamilies families_;
  int steps_;
  bool convex_ = false;
};

/// A model with an assembled tangent, by default that of the correspondence shapes, and with bonds that fail.
class AssemblingModel : public Model {
 public:
  EvaluationStatus assemble(ConstFieldView u, BlockMatrix& K) final;
  AssembledSize assembled_size() final { return assembly().size(); }
  BondUpdate update_bonds(ConstFieldView u, const Motion& motion = {}) final;
  std::vector<BondChange> changed_bonds() const final { return fracture_ ? fracture_->changes() : std::vector<BondChange>{}; }
  void restore_bonds(std::span<const BondChange> changes) final;
  /// A penalty on top of this model changes with the bonds too. It must outlive the model's last update.
  void watch_bonds_of(ZeroEnergyPenalty& penalty) noexcept { penalty_ = &penalty; }
  BondChecks bond_checks() const final { return fracture_ ? fracture_->checks() : BondChecks{}; }

 protected:
  explicit AssemblingModel(const ModelParts& parts) : parts_(parts) {}
  virtual std::unique_ptr<Assembly> make_assembly(const ModelParts& parts) const;
  Fracture::Changed changed();
  /// With [damage], once the families are there.
  void watch_bonds(BondState& state);
  const Fracture* fracture() const noexcept { return fracture_ ? &*fracture_ : nullptr; }
  std::size_t fracture_bytes() const noexcept { return fracture_ ? fracture_->bytes() : 0; }
  /// Strain energy of the evaluation points that the marked groups own.
  virtual double energy_of(ConstFieldView, const GroupMarks&) { return 0; }
  /// See Fracture::Changed.
  virtual std::vector<BondChange> bonds_changed(std::span<const std::int32_t>) { return {}; }

 private:
  Assembly& assembly() {
    if (!assembly_) assembly_ = make_assembly(parts_);
    return *assembly_;
  }

  ModelParts parts_;
  std::unique_ptr<Assembly> assembly_;
  std::optional<Fracture> fracture_;
  ZeroEnergyPenalty* penalty_ = nullptr;  ///< null: none
  std::size_t assembled_version_ = 0;     ///< of the bonds that the assembly knows
};

/// First inadmissible point of loops over blocks: the smallest field index that any thread reports.
class FirstBad {
 public:
  void report(std::int64_t point) {
    const std::lock_guard lock(guard_);
    if (point_ < 0 || point < point_) point_ = point;
  }
  std::int64_t point() const noexcept { return point_; }

 private:
  std::mutex guard_;
  std::int64_t point_ = -1;
};

/// One T per thread, made on first use.
template <class T>
class PerThread {
 public:
  template <class Make>
  void prepare(Make&& make) {
    while (all_.size() < static_cast<std::size_t>(thread_count())) all_.push_back(make());
  }
  T& mine() noexcept { return *all_[static_cast<std::size_t>(thread_index())]; }

 private:
  std::vector<std::unique_ptr<T>> all_;
};

}  // namespace perikit
