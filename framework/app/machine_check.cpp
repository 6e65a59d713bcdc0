#include "machine_check.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <vector>

#include "data_folder.hpp"
#include "output/recorder.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/plugin/abi.hpp"
#include "run/simulation.hpp"

namespace perikit::app {

namespace {

const std::string header = "kind,part,example,dimension,body,energy,force_sum,projection_1,projection_2,projection_3,projection_4";

/// Levels and compilers differ by rounding alone: without fused multiply-adds by 4e-15 of the sum of the forces.
constexpr double tolerance = 1e-10;

/// A part with one of its examples on one body.
struct Case {
  Kind kind;
  std::string part;
  std::size_t example;   ///< from 1
  std::string table;     ///< of the example
  int dimension;
  bool cloud;

  std::string key() const { return fmt::format("{},{},{},{},{}", name(kind), part, example, dimension, cloud ? "cloud" : "lattice"); }
  std::string label() const {
    std::string keys = table;
    std::replace(keys.begin(), keys.end(), '\n', ';');
    return fmt::format("{}/{}{} on a {} in {}D", name(kind), part, keys.empty() ? "" : " (" + keys + ")", cloud ? "cloud" : "lattice", dimension);
  }
};

/// What is compared: the strain energy, the sum of the absolute values of all components of the forces, and the sums of the components times four fields
/// that oscillate from point to point: a force that is wrong at a single point shows in each of them.
struct Values {
  double energy = 0, force_sum = 0;
  std::array<double, 4> projections{};

  std::array<double*, 6> numbers() { return {&energy, &force_sum, &projections[0], &projections[1], &projections[2], &projections[3]}; }
};

/// The values of a case, or why there are none.
struct Outcome {
  std::optional<Values> values;
  std::string reason;
};

std::string text_of(Values values) {
  std::string text;
  for (const double* number : values.numbers()) text += fmt::format("{}{:.17g}", text.empty() ? "" : ",", *number);
  return text;
}

std::optional<Values> parse_values(std::string_view text) {
  Values values;
  const char *at = text.data(), *const end = text.data() + text.size();
  for (double* number : values.numbers()) {
    if (number != &values.energy && (at == end || *at++ != ',')) return std::nullopt;
    const auto [next, error] = std::from_chars(at, end, *number);
    if (error != std::errc()) return std::nullopt;
    at = next;
  }
  return at == end ? std::optional(values) : std::nullopt;
}

/// Lattices in 2D and clouds in 3D have a crack, so that families of many shapes occur.
std::string scene_text(const Case& c) {
  const std::string part = fmt::format("type = \"{}\"\n{}\n", c.part, c.table);
  std::string text = fmt::format("format = 1\n[body]\ndimension = {}\n{}[body.lattice]\nspacing = 1.0\n", c.dimension, c.dimension == 2 ? "plane = \"strain\"\n" : "");
  text += c.dimension == 2 ? "lower = [0, 0]\nupper = [11, 8]\n" : "lower = [0, 0, 0]\nupper = [7, 5, 4]\n";
  if (c.cloud) text += "jitter = 0.25\nseed = 7\n";
  if (c.dimension == 2 && !c.cloud) text += "[[crack]]\nsegment = [[-1.0, 4.1], [5.2, 4.1]]\n";
  if (c.dimension == 3 && c.cloud) text += "[[crack]]\npolygon = [[-1.0, -1.0, 2.1], [3.2, -1.0, 2.1], [3.2, 6.0, 2.1], [-1.0, 6.0, 2.1]]\n";
  text += "[family]\nhorizon_ratio = 2.515\ninfluence = \"gaussian\"\n";
  switch (c.kind) {
    case Kind::kinematics: text += "[kinematics]\n" + part; break;
    case Kind::stabilization: text += fmt::format("[kinematics]\ntype = \"conventional\"\n[kinematics.stabilization]\n{}", part); break;
    default: text += "[kinematics]\ntype = \"baqp\"\n";
  }
  if (c.kind == Kind::term) text += "[[term]]\n" + part;
  text += "[material]\n" + (c.kind == Kind::material ? part : "type = \"saint_venant_kirchhoff\"\ndensity = 1.0\nyoungs_modulus = 2.0\npoisson_ratio = 0.25\n");
  return text + "[integrator]\ntype = \"evaluate\"\n";
}

Values evaluate(const Case& c, Registry& registry) {
  Simulation simulation(parse_scene(scene_text(c), "machine_check.toml", registry), registry);
  BodyProblem& problem = simulation.problem();
  const Points& points = problem.points();
  const auto each_component = [&](auto&& use) {
    for (const std::int32_t p : points.live())
      for (int a = 0; a < c.dimension; ++a) use(points.position(static_cast<std::size_t>(p)), p, a);
  };
  Field u = points.make_field(c.dimension), force = points.make_field(c.dimension);
  each_component([&](const Point& x, std::int32_t p, int a) {
    u.view().component(a)[p] = 0.03 * x[static_cast<std::size_t>((a + 1) % c.dimension)] + 0.05 * std::sin(1.3 * x[0] + 1.7 * x[1] + 0.9 * x[2] + a);
  });
  Values values;
  if (const EvaluationStatus status = problem.evaluate_forces({u.view(), 0}, force.view(), &values.energy); !status.ok()) throw RunError(status.description);
  each_component([&](const Point& x, std::int32_t p, int a) {
    const double f = force.view().component(a)[p];
    values.force_sum += std::abs(f);
    for (std::size_t k = 0; k < values.projections.size(); ++k)
      values.projections[k] += f * std::cos((2.1 + 0.37 * static_cast<double>(k)) * x[0] + (1.9 - 0.21 * static_cast<double>(k)) * x[1] + 2.3 * x[2] + 1.1 * a);
  });
  return values;
}

/// Vectors in the example of a term may be of another dimension.
bool is_scene(const Case& c, Registry& registry) try {
  parse_scene(scene_text(c), "machine_check.toml", registry);
  return true;
} catch (const InputErrors&) {
  return false;
}

std::vector<Case> cases_of(Registry& registry, Kind kind, const std::string& part) {
  std::vector<Case> cases;
  const std::vector<std::string>& examples = registry.describe(kind, part).examples;
  for (std::size_t e = 0; e < examples.size(); ++e)
    for (const int dimension : {2, 3})
      for (const bool cloud : {false, true}) cases.push_back({kind, part, e + 1, examples[e], dimension, cloud});
  if (kind == Kind::term) std::erase_if(cases, [&](const Case& c) { return !is_scene(c, registry); });
  return cases;
}

/// Evaluates the cases in a process of its own, whose crash is no crash of this one, and which has one thread.
std::vector<Outcome> evaluate_in_child(const std::vector<Case>& cases, Registry& registry) {
  int ends[2];
  if (::pipe(ends) != 0) throw RunError(fmt::format("check --machine: no pipe: {}", std::strerror(errno)));
  const pid_t child = ::fork();
  if (child < 0) throw RunError(fmt::format("check --machine: no process: {}", std::strerror(errno)));
  if (child == 0) {
    ::close(ends[0]);
    for (const int signal : {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT}) std::signal(signal, SIG_DFL);
    // What the C library says of a damaged heap; the parent names the part.
    if (const int silence = ::open("/dev/null", O_WRONLY); silence >= 0) ::dup2(silence, STDERR_FILENO);
    set_thread_count(1);
    for (const Case& c : cases) {
      std::string line;
      try {
        line = text_of(evaluate(c, registry)) + "\n";
      } catch (const std::exception& error) {
        line = fmt::format("!{}", error.what());
        std::replace(line.begin(), line.end(), '\n', ' ');
        line += "\n";
      }
      if (::write(ends[1], line.data(), line.size()) != static_cast<ssize_t>(line.size())) ::_exit(1);
    }
    ::_exit(0);
  }
  ::close(ends[1]);
  std::string text;
  std::array<char, 4096> buffer;
  for (ssize_t n; (n = ::read(ends[0], buffer.data(), buffer.size())) != 0;) {
    if (n > 0) text.append(buffer.data(), static_cast<std::size_t>(n));
    else if (errno != EINTR) break;
  }
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  std::vector<Outcome> outcomes;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('!')) outcomes.push_back({std::nullopt, line.substr(1)});
    else outcomes.push_back({parse_values(line), "not a number"});
  }
  if (outcomes.size() < cases.size())   // those after it are not known
    outcomes.push_back({std::nullopt, WIFSIGNALED(status) ? fmt::format("crashes ({})", ::strsignal(WTERMSIG(status))) : "ends the program"});
  return outcomes;
}

using Stored = std::map<std::string, Values, std::less<>>;

Stored read_stored(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  if (!std::getline(stream, line) || line != header) throw InputError({file.string(), 1, 1}, "", fmt::format("found '{}'; allowed: the header {}", line, header));
  Stored stored;
  for (int number = 2; std::getline(stream, line); ++number) {
    std::size_t comma = 0;
    for (int k = 0; k < 5 && comma != std::string::npos; ++k) comma = line.find(',', comma + (k > 0 ? 1 : 0));
    const auto values = comma == std::string::npos ? std::nullopt : parse_values(std::string_view(line).substr(comma + 1));
    if (!values) throw InputError({file.string(), number, 1}, "", fmt::format("found '{}'; allowed: {}", line, header));
    stored[line.substr(0, comma)] = *values;
  }
  return stored;
}

/// What differs, empty where nothing does. Written so that what is no number differs.
std::string difference(const Values& found, const Values& stored) {
  const double energy = std::abs(found.energy - stored.energy) / std::abs(stored.energy);
  double force = std::abs(found.force_sum - stored.force_sum);
  for (std::size_t k = 0; k < found.projections.size(); ++k) {
    const double projection = std::abs(found.projections[k] - stored.projections[k]);
    if (!(projection <= force)) force = projection;
  }
  force /= stored.force_sum;
  std::string text;
  if (!(energy <= tolerance)) text += fmt::format("the energy differs by {:.2g} of itself", energy);
  if (!(force <= tolerance)) text += fmt::format("{}the forces differ by {:.2g} of their sum", text.empty() ? "" : ", ", force);
  return text;
}

constexpr Kind checked_kinds[] = {Kind::kinematics, Kind::stabilization, Kind::material, Kind::term};

std::string remedy() {
  const std::string level = PERIKIT_LEVEL;
  const std::string other = level == "x86-64-v2" ? "" : level == "x86-64-v3" ? "x86-64-v2" : "x86-64-v3";
  if (other.empty() || level.starts_with("armv") || level == "unknown")
    return "Do not use this build. Build it with another compiler, in a folder of its own, and check that one: cmake --preset release -B build/other -D CMAKE_CXX_COMPILER=...";
  if (!std::filesystem::exists(prefix() / "CMakeCache.txt"))
    return fmt::format("Do not use this build. Take that of another level: PERIKIT_LEVEL={0} perikit check --machine, or from the sources, "
                       "cmake --preset release -B build/{0} -D PERIKIT_LEVEL={0}", other);
  return fmt::format("Do not use this build. Build that of another level, in a folder of its own, and check it:\n"
                     "  cmake --preset release -B build/{0} -D PERIKIT_NATIVE=OFF -D PERIKIT_LEVEL={0} && cmake --build build/{0} && build/{0}/bin/perikit check --machine", other);
}

}  // namespace

std::string check_machine(Registry& registry, const std::filesystem::path& file) {
  const auto start = std::chrono::steady_clock::now();
  const Stored stored = read_stored(file);
  std::string faults;
  std::size_t compared = 0;
  std::vector<std::string> parts, unknown;
  for (const Kind kind : checked_kinds) {
    for (const std::string& part : registry.names(kind)) {
      const std::string label = fmt::format("{}/{}", name(kind), part);
      if (!stored.contains(fmt::format("{},{},1,2,lattice", name(kind), part))) {
        unknown.push_back(label);
        continue;
      }
      const std::vector<Case> cases = cases_of(registry, kind, part);
      const std::vector<Outcome> outcomes = evaluate_in_child(cases, registry);
      for (std::size_t k = 0; k < outcomes.size(); ++k) {
        const auto values = stored.find(cases[k].key());
        std::string fault = outcomes[k].values ? "" : outcomes[k].reason;
        if (fault.empty()) fault = values == stored.end() ? "has no stored values" : difference(*outcomes[k].values, values->second);
        if (!fault.empty()) faults += fmt::format("  {}: {}\n", cases[k].label(), fault);
        ++compared;
      }
      parts.push_back(label);
    }
  }
  // A stored part that no library brings was lost.
  for (const auto& [key, values] : stored) {
    std::string part = key.substr(0, key.find(',', key.find(',') + 1));
    part[part.find(',')] = '/';
    if (std::ranges::find(parts, part) == parts.end()) {
      faults += fmt::format("  {}: no library brings it\n", part);
      parts.push_back(part);
    }
  }
  if (!faults.empty()) throw WrongBuild(fmt::format("perikit does not compute what it should on this machine (level {}, {}):\n{}{}", PERIKIT_LEVEL, PERIKIT_COMPILER_ID, faults, remedy()));
  std::string text = fmt::format("machine       level {}: energies and forces of {} parts on {} bodies are as stored, {:.1f} s", PERIKIT_LEVEL, parts.size(), compared,
                                 std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  for (const std::string& part : unknown) text += fmt::format("\n              {}: not checked, its values are not known (perikit contract)", part);
  return text;
}

void store_machine_values(Registry& registry, const std::filesystem::path& file) {
  std::string text = header + "\n";
  for (const Kind kind : checked_kinds) {
    for (const std::string& part : registry.names(kind)) {
      const std::vector<Case> cases = cases_of(registry, kind, part);
      const std::vector<Outcome> outcomes = evaluate_in_child(cases, registry);
      for (std::size_t k = 0; k < outcomes.size(); ++k) {
        if (!outcomes[k].values) throw RunError(fmt::format("{}: {}", cases[k].label(), outcomes[k].reason));
        text += fmt::format("{},{}\n", cases[k].key(), text_of(*outcomes[k].values));
      }
    }
  }
  write_file_atomically(file, text);
}

}  // namespace perikit::app
