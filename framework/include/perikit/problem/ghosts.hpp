#pragma once
/// The two ways of fields between the owners of points and their ghosts on other ranks.

#include <vector>

#include "perikit/body/partition.hpp"

namespace perikit {

class Ghosts {
 public:
  /// `part` is that of the partition.
  Ghosts(const Partition& partition, const Body& part);

  /// Ghosts <- values of their owners.
  void forward(FieldView field) const;
  /// Owners += values of their ghosts, which become zero; in the order of the ranks.
  void accumulate(FieldView field) const;

 private:
  using Points = std::vector<std::vector<std::int32_t>>;   ///< internal indices by rank
  static std::vector<std::vector<double>> gather(FieldView field, const Points& points);

  Points lent_, borrowed_;
};

}  // namespace perikit
