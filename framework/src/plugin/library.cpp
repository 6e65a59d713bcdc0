#include "plugin/library.hpp"

#include <dlfcn.h>
#include <elf.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <boost/dll/shared_library.hpp>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>
#include <thread>
#include <vector>

#include "perikit/plugin/abi.hpp"
#include "plugin/registrar.hpp"

namespace perikit {

namespace fs = std::filesystem;
namespace dll = boost::dll;

namespace {

/// Whether [offset, offset + length) lies inside a file of `size` bytes; no sum that could overflow.
bool inside(std::uint64_t offset, std::uint64_t length, std::uint64_t size) {
  return offset <= size && length <= size - offset;
}

/// Whether header, program headers, segments and section table of a 64-bit ELF file lie inside the file.
bool complete(std::ifstream& in, std::uint64_t size) {
  Elf64_Ehdr header{};
  in.seekg(0);
  if (!in.read(reinterpret_cast<char*>(&header), sizeof header)) return false;
  const std::uint64_t segments = std::uint64_t{header.e_phnum} * sizeof(Elf64_Phdr);
  if (header.e_phentsize != sizeof(Elf64_Phdr) || !inside(header.e_phoff, segments, size)) return false;
  if (!inside(header.e_shoff, std::uint64_t{header.e_shnum} * header.e_shentsize, size)) return false;
  std::vector<Elf64_Phdr> program(header.e_phnum);
  in.seekg(static_cast<std::streamoff>(header.e_phoff));
  if (!in.read(reinterpret_cast<char*>(program.data()), static_cast<std::streamsize>(segments))) return false;
  return std::ranges::all_of(program, [&](const Elf64_Phdr& p) { return inside(p.p_offset, p.p_filesz, size); });
}

/// How a library becomes one of this program's level.
std::string remedy() {
  static const char here = 0;
  Dl_info own{};
  const fs::path folder = ::dladdr(&here, &own) != 0 && own.dli_fname ? fs::path(own.dli_fname).parent_path() : fs::path();
  return fmt::format("cmake -D perikit_DIR={} in its build folder, and build it again; or take the perikit of its level",
                     (folder / "cmake" / "perikit").string());
}

dll::shared_library load(const fs::path& file) try {
  // Never unloaded: live objects, std::functions and kept exceptions hold the library's code.
  constexpr auto mode = static_cast<dll::load_mode::type>(RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  return dll::shared_library(file, mode);
} catch (const dll::fs::system_error& error) {
  // Its text is dlerror's; its code means nothing.
  const std::string text = error.what();
  const bool level = text.find("CPU ISA level") != std::string::npos;
  throw Refusal(fmt::format("the loader refuses it: {}{}", text, level ? fmt::format("; this program is for level {}: {}", PERIKIT_LEVEL, remedy()) : ""));
}

/// Exit status of a child that came to its own end; a library that calls exit() leaves another one.
constexpr int probe_ended = 90;

constexpr std::chrono::seconds registration_limit{10};   // it only declares what is there

/// Waits for a child, no longer than the limit. A child that has stopped itself is not waited for. Returns its status; nothing where it
/// had to be killed.
std::optional<int> wait_for(pid_t child) {
  const auto end = std::chrono::steady_clock::now() + registration_limit;
  for (auto pause = std::chrono::milliseconds(1);; pause = std::min(2 * pause, std::chrono::milliseconds(50))) {
    int status = 0;
    const pid_t changed = ::waitpid(child, &status, WNOHANG | WUNTRACED);
    if (changed < 0 && errno != EINTR) throw Refusal(fmt::format("the process that tries it cannot be watched: {}", std::strerror(errno)));
    if (changed == child && !WIFSTOPPED(status)) return status;
    if (changed == child || std::chrono::steady_clock::now() > end) {
      ::kill(child, SIGKILL);
      while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
      return std::nullopt;
    }
    std::this_thread::sleep_for(pause);
  }
}

/// A file without a name, for what a child has to say: unlike a pipe it takes any length without a reader.
class Report {
 public:
  Report() : file_(::memfd_create("perikit", MFD_CLOEXEC)) {
    if (file_ < 0) throw Refusal(fmt::format("no memory to try it in: {}", std::strerror(errno)));
  }
  ~Report() { ::close(file_); }
  Report(const Report&) = delete;
  Report& operator=(const Report&) = delete;

  bool write(std::string_view text) const noexcept {
    return ::pwrite(file_, text.data(), text.size(), 0) == static_cast<ssize_t>(text.size());
  }
  std::string read() const {
    struct stat of{};
    if (::fstat(file_, &of) != 0 || of.st_size < 0 || of.st_size > longest) return {};
    std::string text(static_cast<std::size_t>(of.st_size), ' ');
    return ::pread(file_, text.data(), text.size(), 0) == of.st_size ? text : std::string();
  }

 private:
  static constexpr off_t longest = 1 << 20;   // [bytes]: far more parts than any library brings
  int file_;
};

constexpr int crash_signals[] = {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT};

/// A build id in two: the level with its packs ("x86-64-v4"), and all other words.
struct SplitBuildId {
  std::string level, rest;
};

SplitBuildId split(const std::string& build_id) {
  SplitBuildId id;
  std::istringstream words(build_id);
  for (std::string word; words >> word;) {
    if (word.starts_with("x86-64") || word.starts_with("armv") || word.starts_with("native-")) id.level = word;
    else if (word.starts_with("simd") && !id.level.empty()) continue;   // follows from the level
    else id.rest += word + " ";
  }
  return id;
}

constexpr char refused = '!';   ///< begins the report of a library that is refused; others are a line "kind name" for each part

/// noexcept: nothing may unwind into the parent's stack frames.
[[noreturn]] void probe_in_child(const fs::path& file, const Report& report) noexcept {
  for (const int signal : crash_signals) std::signal(signal, SIG_DFL);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const int silence = ::open("/dev/null", O_WRONLY);
  dup2(silence, STDOUT_FILENO);
  dup2(silence, STDERR_FILENO);
  std::string text;
  try {
    PartCollector collector([](Kind, std::string_view) { return fs::path(); });
    load_library(file, collector);
    for (const auto& part : collector.parts) text += fmt::format("{} {}\n", name(part->kind()), part->description.name);
  } catch (const Refusal& reason) {
    text = refused + std::string(reason.what());
  }
  _exit(report.write(text) ? probe_ended : EXIT_FAILURE);
}

/// The parts in the report of a child, which may have written anything. Throws Refusal.
std::vector<NamedPart> reported(const std::string& text) {
  if (!text.empty() && text.front() == refused) throw Refusal(text.substr(1));
  std::vector<NamedPart> parts;
  std::istringstream lines(text);
  for (std::string kind_name, part_name; lines >> kind_name >> part_name;) {
    const auto kind = kind_from_name(kind_name);
    if (!kind || !is_snake_case(part_name)) throw Refusal("the process that tries it reports no names of parts");
    parts.push_back({*kind, part_name, {}});
  }
  if (parts.empty()) throw Refusal("it registers no part");
  return parts;
}

/// What is written in a crash, when nothing can be put together any more.
struct LastWords {
  char text[4096];
  std::size_t length = 0;

  void add(std::string_view words) noexcept {
    const std::size_t n = std::min(words.size(), sizeof text - length);
    std::memcpy(text + length, words.data(), n);
    length += n;
  }
} last_words;

void end_in_crash(int) {
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, last_words.text, last_words.length);
  constexpr char end[] = "\n";
  [[maybe_unused]] const ssize_t ended = ::write(STDERR_FILENO, end, 1);
  ::_exit(EXIT_FAILURE);
}

}  // namespace

void suspect_in_crashes(const fs::path& file) {
  last_words.add(last_words.length == 0 ? "perikit crashed after it had opened libraries that have no manifest, one of which may be damaged: " : ", ");
  last_words.add(file.string());
  for (const int signal : crash_signals) std::signal(signal, end_in_crash);
}

void check_file(const fs::path& file) {
  std::error_code unreadable;
  if (!fs::exists(file, unreadable)) throw Refusal("no such file");
  if (!fs::is_regular_file(file, unreadable)) throw Refusal("not a regular file");
  const std::uintmax_t size = fs::file_size(file, unreadable);
  std::ifstream in(file, std::ios::binary);
  if (unreadable || !in) throw Refusal("cannot be read");
  std::array<unsigned char, EI_NIDENT> identity{};
  in.read(reinterpret_cast<char*>(identity.data()), identity.size());
  if (std::memcmp(identity.data(), ELFMAG, SELFMAG) != 0) throw Refusal("not a shared library (ELF magic missing)");
  if (!in) throw Refusal("truncated (shorter than its ELF header)");
  // Other classes and byte orders have other headers; the loader refuses them by name.
  const bool readable = identity[EI_CLASS] == ELFCLASS64 && identity[EI_DATA] == ELFDATA2LSB;
  if (readable && !complete(in, size)) throw Refusal(fmt::format("truncated ({} bytes, its ELF headers name more)", size));
}

void check_abi(int version, const std::string& build_id) {
  if (version != PERIKIT_ABI_VERSION) {
    throw Refusal(fmt::format("ABI version {}, this program has {}", version, PERIKIT_ABI_VERSION));
  }
  if (build_id == PERIKIT_BUILD_ID) return;
  const SplitBuildId its = split(build_id), own = split(PERIKIT_BUILD_ID);
  if (its.level != own.level && its.rest == own.rest)
    throw Refusal(fmt::format("built for level {}, this program for level {}: {}", its.level, own.level, remedy()));
  const bool same_toolchain = build_id.starts_with(PERIKIT_TOOLCHAIN_ID);
  throw Refusal(fmt::format("built as '{}', this program as '{}'{}", build_id, PERIKIT_BUILD_ID,
                            same_toolchain ? ": perikit's headers are others now; build it again" : ""));
}

void load_library(const fs::path& file, Registrar& registrar) {
  check_file(file);
  const dll::shared_library library = load(file);
  for (const char* symbol : {"perikit_abi_version", "perikit_build_id", "perikit_register"}) {
    if (!library.has(symbol)) throw Refusal(fmt::format("symbol {} missing: PERIKIT_PLUGIN(registrar) {{ registrar.material({{.name = ...}}, ...); }} defines it, at the end of the source", symbol));
  }
  try {
    const char* build_id = library.get<const char*()>("perikit_build_id")();
    check_abi(library.get<int()>("perikit_abi_version")(), build_id ? build_id : "");
    library.get<void(void*)>("perikit_register")(&registrar);
  } catch (const Refusal&) {
    throw;
  } catch (const std::exception& error) {
    throw Refusal(fmt::format("its registration failed: {}", error.what()));
  } catch (...) {
    throw Refusal("its registration failed: it threw something that is no std::exception");
  }
}

std::vector<NamedPart> probe_library(const fs::path& file) {
  check_file(file);
  const Report report;
  const pid_t child = fork();
  if (child == 0) probe_in_child(file, report);
  if (child < 0) throw Refusal(fmt::format("no process to try it in: {}", std::strerror(errno)));
  const std::optional<int> ended = wait_for(child);
  if (!ended) throw Refusal(fmt::format("its registration does not come to an end (within {} s), or stops the process", registration_limit.count()));
  const int status = *ended;
  if (WIFSIGNALED(status)) throw Refusal(fmt::format("it kills the process that loads it ({})", strsignal(WTERMSIG(status))));
  if (WEXITSTATUS(status) != probe_ended) {
    throw Refusal(fmt::format("it ends the process that loads it (exit status {})", WEXITSTATUS(status)));
  }
  return reported(report.read());
}

}  // namespace perikit
