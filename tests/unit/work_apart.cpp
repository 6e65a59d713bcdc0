// Work on a thread of its own: it is left alone where the run is to end, and what it throws arrives.
#include "integrators/shared/work_apart.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <memory>
#include <stdexcept>

using namespace perikit;

TEST_CASE("work apart: done here, done on a thread, or left to itself when the run ends") {
  int done = 0;
  CHECK(work_apart({}, [&] { ++done; }));
  CHECK(work_apart([] { return true; }, [&] { ++done; }));
  CHECK(done == 2);
  const auto let_go = std::make_shared<std::atomic<bool>>(false), ended = std::make_shared<std::atomic<bool>>(false);
  int asked = 0;
  CHECK_FALSE(work_apart([&] { return ++asked < 3; }, [let_go, ended] {
    let_go->wait(false);
    ended->store(true);
    ended->notify_all();
  }));
  CHECK(asked == 3);
  CHECK_FALSE(ended->load());
  let_go->store(true);
  let_go->notify_all();
  ended->wait(false);
  CHECK_THROWS_AS(work_apart([] { return true; }, [] { throw std::runtime_error("not enough memory"); }), std::runtime_error);
}
