#pragma once
/// The body of all ranks as reference.h5 has it, which no rank needs as a whole: rank 0 asks the others for pieces of it.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "output/recorder.hpp"
#include "problem/body_problem.hpp"

namespace perikit {

class GatheredReferenceConfiguration {
 public:
  explicit GatheredReferenceConfiguration(const BodyProblem& problem);

  /// On rank 0: work(data), while the others answer what it asks of the data. All ranks must call it.
  void use(const std::function<void(const ReferenceData& data)>& work);

 private:
  /// A piece of the points or, from 1 on, of a set; -1: nothing more.
  struct Wanted {
    std::int64_t what = -1, piece = 0;
  };
  ReferenceData of_all();
  void serve();
  /// On rank 0 what is wanted, from all ranks.
  std::vector<double> points(std::int64_t piece);
  std::vector<std::int64_t> members(std::int64_t set, std::int64_t piece);
  static void ask(Wanted wanted);

  const BodyProblem& problem_;
  std::vector<std::string> sets_;
  std::vector<double> piece_;  ///< the last one that was asked for
  std::int64_t piece_number_ = -1;
  std::vector<std::int64_t> own_;  ///< input numbers of the rank's own points of the last set
  std::int64_t own_set_ = -1;
};

}  // namespace perikit
