#pragma once
/// Assembled tangents: K = sum_q W_q g_q . A(F_q) . g_q with the evaluation points and stencils of the models, never by probing.

#include <memory>
#include <mutex>
#include <vector>

#include "engine/assembly/block_pattern.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/engine/model.hpp"

namespace perikit {

/// One way of assembling: what a model of these parts sums over. Made when a tangent is asked for.
class Assembly {
 public:
  virtual ~Assembly() = default;
  EvaluationStatus assemble(ConstFieldView u, BlockMatrix& K);
  AssembledSize size() const;

 protected:
  /// steps: bonds between two points that depend on each other, at most.
  Assembly(const ModelParts& parts, int steps);
  /// Adds to values that are zero. Returns the field index of the first inadmissible point, or -1.
  virtual std::int64_t fill(ConstFieldView u, BlockMatrix& K) = 0;
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

/// A model with an assembled tangent. By default that of the correspondence shapes.
class AssemblingModel : public Model {
 public:
  EvaluationStatus assemble(ConstFieldView u, BlockMatrix& K) final { return assembly().assemble(u, K); }
  AssembledSize assembled_size() final { return assembly().size(); }

 protected:
  explicit AssemblingModel(const ModelParts& parts) : parts_(parts) {}
  virtual std::unique_ptr<Assembly> make_assembly(const ModelParts& parts) const;

 private:
  Assembly& assembly() {
    if (!assembly_) assembly_ = make_assembly(parts_);
    return *assembly_;
  }

  ModelParts parts_;
  std::unique_ptr<Assembly> assembly_;
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
