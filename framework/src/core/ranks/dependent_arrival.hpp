#pragma once
#include "perikit/core/parallel.hpp"

namespace perikit {

/// Values that can be computed once another message has been received: images from the displacements of ghosts, say.
class DependentArrival : public Arrival {
 protected:
  /// Null, or not pending: it is there already, and so is what follows.
  explicit DependentArrival(Arrival* first) noexcept : first_(first) {
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
