#include "multigrid_cycle.hpp"

#include "multigrid.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/library_beside.hpp"
#include "perikit/problem/first_rank.hpp"

namespace perikit {

namespace {

class OneRank final : public MultigridCycle {
 public:
  void watch(std::function<bool()> goes_on) override { multigrid_.watch(std::move(goes_on)); }
  bool make(Problem&, const BlockMatrix& K, ConstFieldView free, const std::vector<Field>& rigid, bool) override {
    multigrid_.make(K, free, rigid);
    return false;
  }
  void apply(ConstFieldView r, FieldView z) override { multigrid_.apply(r, z); }

 private:
  Multigrid multigrid_;
};

/// The first rank has the matrix of all points: a solve takes the iterations that it takes on one.
class Gathered final : public MultigridCycle {
 public:
  explicit Gathered(const Points& points) : first_rank_(points, points.owned()) {}

  bool make(Problem&, const BlockMatrix& K, ConstFieldView free, const std::vector<Field>& rigid, bool) override {
    const BlockMatrix whole = first_rank_.gather(K);
    const Field free_of_all = first_rank_.gather(free);
    std::vector<Field> rigid_of_all;
    for (const Field& motion : rigid) rigid_of_all.push_back(first_rank_.gather(motion));
    if (communicator().rank() == 0) multigrid_.make(whole, free_of_all, rigid_of_all);
    return false;
  }

  void apply(ConstFieldView r, FieldView z) override {
    Field whole = first_rank_.gather(r);
    if (communicator().rank() == 0) multigrid_.apply(whole, whole);
    first_rank_.scatter(whole, z);
  }

 private:
  FirstRank first_rank_;
  Multigrid multigrid_;
};

/// PETSc's, where all ranks can open it. Null where they cannot; why: the first reason.
std::unique_ptr<MultigridCycle> distributed(std::string& why) {
  std::unique_ptr<MultigridCycle> cycle;
  why = "ranks are not processes of MPI";
  if (communicator().mpi()) {
    why.clear();
    cycle.reset(static_cast<MultigridCycle*>(made_by_library("libperikit_petsc.so", "perikit_petsc_cycle", why)));
  }
  why = first_message(why);
  return why.empty() ? std::move(cycle) : nullptr;
}

}  // namespace

std::unique_ptr<MultigridCycle> make_multigrid_cycle(const Problem& problem, std::string& how) {
  how.clear();
  if (communicator().size() == 1) return std::make_unique<OneRank>();
  std::string why;
  how = "aggregation of PETSc on all ranks";
  if (std::unique_ptr<MultigridCycle> cycle = distributed(why)) return cycle;
  how = "solved by the first rank: " + why;
  return std::make_unique<Gathered>(problem.points());
}

}  // namespace perikit
