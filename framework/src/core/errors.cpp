#include "perikit/core/errors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>

namespace perikit {

namespace {

std::string located(const SourcePosition& position, std::string_view key, std::string_view message) {
  std::string text;
  if (!position.file.empty()) {
    text = position.line > 0 ? fmt::format("{}:{}:{}: ", position.file, position.line, position.column)
                             : fmt::format("{}: ", position.file);
  }
  return key.empty() ? text + std::string(message) : fmt::format("{}{}: {}", text, key, message);
}

std::string joined(const std::vector<std::string>& messages) { return fmt::format("{}", fmt::join(messages, "\n")); }

/// Levenshtein distance with transpositions of neighbours counted once.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = last;
    last = row;
  }
  return last[b.size()];
}

}  // namespace

InputError::InputError(const SourcePosition& position, std::string_view key, std::string_view message)
    : std::runtime_error(located(position, key, message)) {}

InputErrors::InputErrors(std::vector<std::string> messages) : InputError(joined(messages)), messages_(std::move(messages)) {}

std::string nearest(std::string_view name, std::span<const std::string> candidates) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, name.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const bool prefix = name.size() >= 3 && (candidate.starts_with(name) || name.starts_with(candidate));
    const std::size_t distance = prefix ? 1 : edit_distance(name, candidate);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

namespace {

/// Words of other programs, and what there is for them.
std::string instead_of(std::string_view word) {
  constexpr const char* history = "laws that remember, such as plastic ones, are written with `perikit new material NAME --history`";
  constexpr const char* functions = "a value that changes is an expression of t, such as \"t < 1 ? 2*t : 2\"";
  static const std::map<std::string_view, const char*> known = {
      {"elastic_plastic", history}, {"plastic", history}, {"j2", history}, {"johnson_cook", history}, {"viscoelastic", history}, {"plasticity", history},
      {"amplitude", functions}, {"curve", functions}, {"table", functions},
      {"gravity", "gravity is a load: [[load]] set = \"all\", body_force = [...] per volume"},
      {"mesh", "the nodes of a mesh are points: [body.points] file = \"points.csv\", with a volume for each, or volume = \"voronoi\""},
      {"temperature", "there is no temperature yet"}, {"thermal", "there is no temperature yet"},
  };
  const auto found = known.find(word);
  return found == known.end() ? "" : fmt::format("; {}", found->second);
}

}  // namespace

std::string did_you_mean(std::string_view name, std::span<const std::string> candidates) {
  if (const std::string instead = instead_of(name); !instead.empty()) return instead;
  const std::string best = nearest(name, candidates);
  return best.empty() ? "" : fmt::format("; did you mean '{}'?", best);
}

}  // namespace perikit
