#pragma once
#include "perikit/core/parallel.hpp"

namespace perikit {

/// What can be put there as soon as something else has arrived.
class FollowingArrival : public Arrival {
 protected:
  /// Null, or not pending: it is there already, and so is what follows.
  explicit FollowingArrival(Arrival* first) noexcept : first_(first) {
    if (first && first->pending()) expect();
  }

 private:
  bool come(bool wait) final {
    wait ? first_->finish() : first_->look();
    return !first_->pending();
  }

  Arrival* first_;
};

}  // namespace perikit
