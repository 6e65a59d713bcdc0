/// perikit contract: becomes the program of the contract suites, and builds it first where the build of this program left it out.

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <regex>
#include <string>
#include <system_error>
#include <vector>

#include "commands.hpp"
#include "core/messages.hpp"
#include "data_folder.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/plugin/abi.hpp"

namespace perikit::app {

namespace {

namespace fs = std::filesystem;

/// A program, started, and the text that it writes.
class Child {
 public:
  explicit Child(std::vector<std::string> words) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw_error(words[0], errno);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const int code = ::posix_spawn(&child_, arguments[0], &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    text_ = ::fdopen(ends[0], "r");
    if (code != 0 || text_ == nullptr) throw_error(words[0], code != 0 ? code : errno);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (text_ != nullptr) std::fclose(text_);
  }

  std::optional<std::string> line() {
    std::string line;
    for (int c; (c = std::fgetc(text_)) != EOF;) {
      if (c == '\n') return line;
      line += static_cast<char>(c);
    }
    return line.empty() ? std::nullopt : std::optional(line);
  }
  /// 0 where it did what it should.
  int end() {
    int status = 0;
    while (::waitpid(child_, &status, 0) < 0)
      if (errno != EINTR) return -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  [[noreturn]] static void throw_error(const std::string& program, int code) {
    throw RunError(fmt::format("{} cannot be started: {}", program, std::generic_category().message(code)));
  }
  pid_t child_ = 0;
  std::FILE* text_ = nullptr;
};

/// "[12/29] Building CXX object .../order_contract.cpp.o" of Ninja, or "[ 41%] Building ..." of Make: how much is done, and what.
std::string progress(const std::string& line) {
  static const std::regex counted(R"(\[ *(\d+)/(\d+)\] (?:.*[/ ])?(\S+))"), shared(R"(\[ *(\d+)%\] (?:.*[/ ])?(\S+))");
  std::smatch found;
  const auto without_object = [](std::string name) { return name.ends_with(".o") ? name.substr(0, name.size() - 2) : name; };
  if (std::regex_match(line, found, counted)) {
    const int done = std::stoi(found[1]), all = std::stoi(found[2]);
    return fmt::format("{} of {} ({} %), {}", done, all, all > 0 ? 100 * done / all : 0, without_object(found[3]));
  }
  if (std::regex_match(line, found, shared)) return fmt::format("{} %, {}", found[1].str(), without_object(found[2]));
  return {};
}

/// An entry of CMakeCache.txt; empty where there is none.
std::string cache_entry(const fs::path& build, const std::string& name) {
  std::ifstream cache(build / "CMakeCache.txt");
  for (std::string line; std::getline(cache, line);)
    if (line.starts_with(name + ":")) return line.substr(line.find('=') + 1);
  return {};
}

/// Whether the suites are there, and of the build that this program is of: they hold its build id.
bool are_built(const fs::path& program) {
  std::ifstream file(program, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return bytes.find(PERIKIT_BUILD_ID) != std::string::npos;
}

/// One at a time builds the suites, others wait for it: held as long as this object.
class BuildLock {
 public:
  explicit BuildLock(const fs::path& file) : file_(::open(file.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666)) {
    if (file_ < 0) throw InputError({file.string()}, "", fmt::format("the contract suites cannot be built here: {}", std::generic_category().message(errno)));
    while (::flock(file_, LOCK_EX) != 0 && errno == EINTR) {}
  }
  BuildLock(const BuildLock&) = delete;
  BuildLock& operator=(const BuildLock&) = delete;
  ~BuildLock() { ::close(file_); }

 private:
  int file_;
};

void build_suites(const fs::path& program) {
  const fs::path build = prefix(), sources = cache_entry(build, "CMAKE_HOME_DIRECTORY"), cmake = cache_entry(build, "CMAKE_COMMAND");
  const std::string missing = fs::exists(program) ? "the contract suites are of another build of perikit" : "the contract suites are not built yet";
  if (!in_build_folder()) throw InputError({program.string()}, "", fmt::format("{}: {}", missing, how_to_build_contract()));
  for (const fs::path& needed : {sources / "CMakeLists.txt", cmake})
    if (!fs::exists(needed)) throw InputError({program.string()}, "", fmt::format("{}, and cannot be: {} is not there any more", missing, needed.string()));

  const BuildLock lock(build / "perikit-contract.lock");
  if (are_built(program)) return;   // by another one meanwhile
  tell(fmt::format("{}: building them, which takes a minute or two ({})\n", missing, how_to_build_contract()));
  ::setenv("NINJA_STATUS", "[%f/%t] ", 1);
  Child child({cmake.string(), "--build", build.string(), "--target", "perikit_contract"});
  const bool terminal = ::isatty(STDERR_FILENO);
  auto shown = std::chrono::steady_clock::now();
  std::deque<std::string> last;
  while (const auto line = child.line()) {
    last.push_back(*line);
    if (last.size() > 30) last.pop_front();
    const std::string done = progress(*line);
    if (done.empty() || (!terminal && std::chrono::steady_clock::now() - shown < std::chrono::seconds(5))) continue;
    shown = std::chrono::steady_clock::now();
    tell(fmt::format("{}building the contract suites: {}{}", terminal ? "\r\033[K" : "", done, terminal ? "" : "\n"));
  }
  if (terminal) tell("\r\033[K");
  const int status = child.end();
  if (status == 0 && are_built(program)) return;
  for (const std::string& line : last) tell(line + '\n');
  throw RunError(fmt::format("the contract suites cannot be built: {} ended with status {}", how_to_build_contract(), status));
}

}  // namespace

void contract(const Options& options) {
  const fs::path program = contract_program();
  if (!are_built(program)) build_suites(program);
  std::vector<std::string> words{program.string(), "--library=" + options.library.string()};
  for (const auto& folder : options.plugin_path) words.push_back("--plugin-path=" + folder.string());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  ::execv(program.c_str(), arguments.data());
  throw InputError({program.string()}, "", fmt::format("the contract suites cannot be run: {}", std::generic_category().message(errno)));
}

}  // namespace perikit::app
