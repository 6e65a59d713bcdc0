#pragma once
/// The point fields that output and history may ask for, computed when asked and once per step.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "perikit/output/recorder.hpp"
#include "perikit/problem/body_problem.hpp"

namespace perikit {

class PointFields {
 public:
  /// moves: the state has a velocity, which dynamic runs always have.
  PointFields(BodyProblem& problem, bool dynamic, bool moves) : problem_(problem), dynamic_(dynamic), moves_(dynamic || moves) {}

  /// Names in the order of the documentation.
  static const std::vector<std::string>& names();
  /// Made of deformation gradients or stresses, which pair laws do not have.
  static bool needs_gradients(const std::string& name);
  /// Numbers per point: 1, 3 or 9.
  static int width(const std::string& name);
  /// Column of a row by component name ("x", "xy"); -1 for "magnitude". Throws std::out_of_range for an unknown one.
  static int column(const std::string& name, const std::string& component);

  /// Forget what was computed: the state has changed.
  void renew() { cache_.clear(), samples_.reset(); }
  const OutputField& get(const std::string& name);

 private:
  OutputField compute(const std::string& name);
  const PointSamples& samples();
  OutputField vector(const std::string& name, ConstFieldView field, bool per_volume) const;
  OutputField scalar(const std::string& name, ConstFieldView field) const;
  OutputField tensor(const std::string& name, ConstFieldView field, bool identity) const;

  BodyProblem& problem_;
  bool dynamic_, moves_;
  std::map<std::string, OutputField> cache_;
  std::optional<PointSamples> samples_;
};

}  // namespace perikit
