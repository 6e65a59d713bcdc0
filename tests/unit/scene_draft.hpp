#pragma once
// Scene text by lines, so that a test that spoils one value knows the line and the column that the message must name.

#include <doctest/doctest.h>

#include <cctype>
#include <sstream>
#include <string>
#include <vector>

namespace perikit::test {

/// A place in a scene, 1-based.
struct Place {
  int line = 0, column = 0;
};

class SceneDraft {
 public:
  explicit SceneDraft(const std::string& text) {
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines_.push_back(line);
  }

  std::string text() const {
    std::string all;
    for (const std::string& line : lines_) all += line + "\n";
    return all;
  }

  /// Where the header of a section stands ("[family]", "[[load]]"); "" is the top level.
  Place header(const std::string& section) const { return {static_cast<int>(start(section)) + 1, 1}; }

  /// Gives a key of a section another value, or the section another key; where `name` is given, the key is written under that
  /// name. Returns the place of the value, or of the name.
  Place set(const std::string& section, const std::string& key, const std::string& value, const std::string& name = {}) {
    const std::string& written = name.empty() ? key : name;
    std::size_t at = find(section, key);
    if (at == lines_.size()) {
      at = section.empty() ? 0 : start(section) + 1;
      lines_.insert(lines_.begin() + static_cast<std::ptrdiff_t>(at), "");
    }
    lines_[at] = written + " = " + value;
    return {static_cast<int>(at) + 1, name.empty() ? static_cast<int>(written.size()) + 4 : 1};
  }

  void remove(const std::string& section, const std::string& key) {
    const std::size_t at = find(section, key);
    REQUIRE_MESSAGE(at < lines_.size(), section, " has no ", key);
    lines_[at].clear();
  }

  /// Value of a key as it is written, "" where it is not there.
  std::string get(const std::string& section, const std::string& key) const {
    const std::size_t at = find(section, key);
    return at == lines_.size() ? "" : lines_[at].substr(lines_[at].find('=') + 2);
  }

  void append(const std::string& text) {
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines_.push_back(line);
  }

 private:
  std::size_t start(const std::string& section) const {
    if (section.empty()) return 0;
    for (std::size_t k = 0; k < lines_.size(); ++k)
      if (lines_[k] == "[" + section + "]" || lines_[k] == "[[" + section + "]]") return k;
    FAIL("no section ", section);
    return 0;
  }
  std::size_t find(const std::string& section, const std::string& key) const {
    const std::size_t first = section.empty() ? 0 : start(section) + 1;
    for (std::size_t k = first; k < lines_.size() && !lines_[k].starts_with('['); ++k)
      if (lines_[k].starts_with(key + " =")) return k;
    return lines_.size();
  }

  std::vector<std::string> lines_;
};

}  // namespace perikit::test
