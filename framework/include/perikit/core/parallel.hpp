#pragma once
/// The one place that starts threads. Bodies must not throw; loops are over fixed blocks, so results never depend on the
/// number of threads.

#include <cstddef>
#include <type_traits>

namespace perikit {

/// Number of threads that parallel_for uses; at least 1.
int thread_count() noexcept;
void set_thread_count(int n) noexcept;
/// 0 ... thread_count() - 1 inside a parallel_for, else 0: for choosing scratch memory, never for choosing work.
int thread_index() noexcept;

namespace detail {
void parallel_for(std::size_t n, void* context, void (*body)(void*, std::size_t));
}

/// body(i) for i in [0, n), in any order, on all threads. body must be noexcept in effect.
template <class Body>
void parallel_for(std::size_t n, Body&& body) {
  detail::parallel_for(n, &body,
                       [](void* context, std::size_t i) { (*static_cast<std::remove_reference_t<Body>*>(context))(i); });
}

}  // namespace perikit
