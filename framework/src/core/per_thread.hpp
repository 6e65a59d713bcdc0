#pragma once
#include <memory>
#include <vector>

#include "perikit/core/parallel.hpp"

namespace perikit {

/// One T per thread, made on first use.
template <class T>
class PerThread {
 public:
  template <class Make>
  void prepare(Make&& make) {
    while (all_.size() < static_cast<std::size_t>(thread_count())) all_.push_back(make());
  }
  T& mine() noexcept { return *all_[static_cast<std::size_t>(thread_index())]; }

 private:
  std::vector<std::unique_ptr<T>> all_;
};

}  // namespace perikit
