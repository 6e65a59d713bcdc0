#pragma once
/// All bodies of a problem. Their points are slices of the same fields, each body has terms of its own, and there may be terms between bodies, which act on
/// the fields as a whole. Scenes have one body today, and with one body alone every evaluation is that of its terms.

#include <memory>
#include <string>
#include <vector>

#include "perikit/body/points.hpp"
#include "terms/term.hpp"
#include "terms/terms.hpp"

namespace perikit {

class Fracture;

class World {
 public:
  /// A body: its terms know which.
  struct Member {
    std::string name;   ///< for messages
    Terms* terms;
    const Fracture* fracture = nullptr;   ///< null: its bonds never fail
  };
  /// The terms of the bodies must outlive the world. A term between bodies gets the whole fields and couples points of any bodies. Throws
  /// std::invalid_argument where one remembers, is driven or knows bonds, and where bonds of one of several bodies may fail.
  explicit World(std::vector<Member> bodies, std::vector<std::unique_ptr<Term>> between = {});

  const Points& points() const noexcept { return points_; }
  /// force <- -dE/du [N], fully overwritten; E of all bodies and ranks -> *energy where wanted. The rest: see Terms.
  EvaluationStatus forces(const Configuration& at, FieldView force, double* energy);
  /// Kw <- -d(force)/du w [N], fully overwritten.
  EvaluationStatus tangent(const Configuration& at, ConstFieldView w, FieldView Kw);
  bool constant_tangent() const noexcept;
  /// See Terms.
  double accept();
  void revert();

 private:
  bool alone() const noexcept { return members_.size() == 1 && between_.empty(); }
  /// evaluate(terms, slice) of every body until one says that it is inadmissible.
  template <class Evaluate>
  EvaluationStatus each_body(Evaluate&& evaluate);
  /// add(term) of every term between bodies likewise.
  template <class Add>
  EvaluationStatus each_between(Add&& add);
  /// Over all ranks [J].
  double stored_in(std::span<const GroupEnergy> energies) const;

  std::vector<Member> members_;
  Points points_;
  std::vector<std::unique_ptr<Term>> between_;
};

}  // namespace perikit
