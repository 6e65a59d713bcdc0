#pragma once
/// The way of fields from the owners of points to their ghosts on other ranks.

#include <cstddef>
#include <memory>
#include <vector>

#include "body/partition/partition.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

class Ghosts final : public Arrival {
 public:
  /// Of the part that the partition has made. Fields have at most so many components.
  Ghosts(const Partition& partition, int components);

  /// Ghosts <- values of their owners, when they arrive. The field must outlive that, and its ghosts may not be read before.
  void start(FieldView field);
  /// The same at once.
  void forward(FieldView field) {
    start(field);
    finish();
  }
  /// Ghosts <- 0.
  void clear(FieldView field) const;
  std::size_t size() const noexcept;
  /// Numbers that a forward sends, a component.
  std::size_t sent() const noexcept;
  /// How long this rank has done nothing but wait for others [s].
  double waited() const noexcept { return waited_; }

 private:
  struct Neighbour {
    int rank;
    std::vector<std::int32_t> lent, borrowed;  ///< internal indices
    std::vector<double> to, from;              ///< component by component
  };
  bool come(bool wait) override;
  void put() override;

  std::vector<Neighbour> neighbours_;
  std::unique_ptr<ExchangePlan> plan_;
  FieldView arriving_;
  double waited_ = 0;
};

}  // namespace perikit
