#pragma once
/// The way of fields from the owners of points to their ghosts on other ranks.

#include <cstddef>
#include <vector>

#include "perikit/body/partition.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

class Ghosts {
 public:
  /// Of the part that the partition has made. Fields have at most so many components.
  Ghosts(const Partition& partition, int components);

  /// Ghosts <- values of their owners.
  void forward(FieldView field);
  /// Ghosts <- 0.
  void clear(FieldView field) const;
  std::size_t size() const noexcept;
  /// Numbers that a forward sends, a component.
  std::size_t sent() const noexcept;

 private:
  struct Neighbour {
    int rank;
    std::vector<std::int32_t> lent, borrowed;  ///< internal indices
    std::vector<double> to, from;              ///< component by component
  };
  std::vector<Neighbour> neighbours_;
  std::vector<Message> messages_;
};

}  // namespace perikit
