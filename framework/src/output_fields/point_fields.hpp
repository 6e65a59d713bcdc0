#pragma once
/// The point fields of a problem, computed when asked for and once per step.

#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "output_fields/crack_areas.hpp"
#include "output_fields/point_field.hpp"
#include "output_fields/state_field.hpp"
#include "perikit/problem/motion.hpp"
#include "problem/body_problem.hpp"

namespace perikit {

class PointFields {
 public:
  /// moves: the state has a velocity, which dynamic runs always have.
  PointFields(BodyProblem& problem, bool dynamic, bool moves) : problem_(problem), dynamic_(dynamic), moves_(dynamic || moves) {}

  /// Column of a row of so many numbers by component name ("x", "xy"); -1 for "magnitude". Throws std::out_of_range for an unknown one.
  static int column(int width, const std::string& component);

  /// Forget what was computed: the state has changed.
  void renew() {
    cache_.clear(), samples_.reset();
    for (auto& [name, made] : made_) made.now = false;
  }
  const OutputField& get(const std::string& name);
  /// The rows of these points of this rank alone, internal indices, in their order.
  OutputField at(const std::string& name, std::span<const std::int32_t> points);
  /// These, names of point_fields() or of states, are asked for next: what they are made of is sampled once.
  void expect(std::span<const std::string> names);
  /// They are asked for at the end of the step whose forces are evaluated next.
  void expect_after_step(std::span<const std::string> names) { problem_.sample_along(samples_of(names)); }
  /// See perikit/problem/motion.hpp. All ranks must call it.
  const Field& reaction_couples() {
    return once("reaction couples", [&](Field before) { return perikit::reaction_couples(problem_, std::move(before)); });
  }
  /// What broken bonds stand for.
  const CrackAreas& crack_areas();
  /// Frees its memory until it is asked for again.
  void forget(const std::string& name) { cache_.erase(name), made_.erase(name); }

 private:
  static Sampling samples_of(std::span<const std::string> names);
  friend const std::vector<PointField>& point_fields();   // the table computes by the functions below

  /// Of the whole body. Its memory stays when the state changes, for rows of history ask for it at every step.
  struct Made {
    Field field;
    bool now = false;   ///< of the present state
  };
  /// The field that rows of `name` are read from: make(before), with what an earlier state had, when it is asked for first.
  template <class Make>
  const Field& once(const std::string& name, Make&& make) {
    Made& made = made_[name];
    if (!made.now) made.field = make(std::move(made.field));
    made.now = true;
    return made.field;
  }
  /// What the laws remember by this name, averaged over the evaluation points of each point.
  OutputField state(const std::string& name, std::span<const std::int32_t> points);
  std::vector<double> vector(ConstFieldView field, bool per_volume = false) const;
  std::vector<double> scalar(ConstFieldView field) const;
  std::vector<double> tensor(ConstFieldView field, bool identity = false) const;
  std::vector<double> acceleration();
  std::vector<double> external_force() const;
  std::vector<double> reaction();
  std::vector<double> jacobian() const;
  std::vector<double> material_id() const;
  /// Of `fragment`. It changes when bonds do, which is known, and is kept until then. All ranks must call it.
  const Field& piece_numbers();

  BodyProblem& problem_;
  bool dynamic_, moves_;
  std::map<std::string, OutputField> cache_;
  std::optional<PointSamples> samples_;
  std::map<std::string, Made> made_;     ///< by `once`
  Field pieces_;
  std::int64_t pieces_of_ = -1;          ///< version of the families that pieces_ belongs to
  std::optional<CrackAreas> crack_areas_;
  std::span<const std::int32_t> rows_;   ///< the points that are computed for
};

}  // namespace perikit
