/// Any words, one a line, are a command with values in their ranges, or are refused with status 2; what they set in a scene is taken or
/// is refused with InputError.

#include "command_line.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <sstream>

#include "perikit/core/errors.hpp"
#include "scene/scene.hpp"
#include "unit/fake_catalogue.hpp"

namespace perikit::app {

// What the words ask for is not done here.
std::string version() { return "fuzz"; }
void run(const Options&) {}
void check(const Options&) {}
void study(const Options&) {}
void plot(const Options&) {}
void bench(const Options&) {}
void start_project(const Options&) {}
void contract(const Options&) {}
void list(const Options&) {}
void describe(const Options&) {}

}  // namespace perikit::app

namespace {

const char* const scene = R"(format = 1
[constants]
w = 1.0
[body]
dimension = 2
plane = "strain"
[body.lattice]
spacing = 0.1
lower = [0, 0]
upper = [1, 1]
[family]
horizon_ratio = 3
[kinematics]
type = "baqp"
[material]
type = "neo_hookean"
density = 1.0
shear_modulus = 1.0
bulk_modulus = 2.0
[integrator]
type = "newton"
)";

/// Messages and help go nowhere for as long as this lives.
class Silence {
 public:
  Silence() : out_(dup(STDOUT_FILENO)), error_(dup(STDERR_FILENO)) {
    static const int nowhere = open("/dev/null", O_WRONLY);
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
  }
  ~Silence() {
    std::fflush(stdout);
    dup2(out_, STDOUT_FILENO);
    dup2(error_, STDERR_FILENO);
    close(out_);
    close(error_);
  }

 private:
  int out_, error_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace perikit;
  std::vector<std::string> words{"perikit"};
  std::istringstream text(std::string(reinterpret_cast<const char*>(data), size));
  for (std::string word; std::getline(text, word);) words.emplace_back(word.c_str());   // up to the first 0, as a program gets them
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  app::Options options;
  std::optional<int> status;
  {
    const Silence silence;
    status = app::read_command_line(static_cast<int>(words.size()), arguments.data(), options);
  }
  if (status) {
    if (*status != app::done && *status != app::input_refused) __builtin_trap();
    return 0;
  }
  if (!options.command || options.threads < 0 || options.threads > 1024 || options.jobs < 1 || options.jobs > 1024 || options.ranks < 1 ||
      options.ranks > 100000 || std::ranges::min(options.bench.cells) < 2 || (!options.view.empty() && options.view.size() != 3) ||
      (!options.range.empty() && options.range.size() != 2))
    __builtin_trap();
  static test::FakeCatalogue parts;
  try {
    parse_scene(scene, "scene.toml", parts, {.overrides = options.overrides});
  } catch (const InputError&) {
  }
  return 0;
}
