#pragma once
/// Texts of scenes, put together from what a test says of its body.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>
#include <vector>

namespace perikit::test {

/// What a test leaves out is as most tests have it. A part is its name alone, or the keys of its table, `type` among them; other texts are whole lines.
struct SceneText {
  int dimension = 2;
  std::string space = "strain";    ///< or "stress": across planes and lines; empty: not said
  std::string constants;           ///< lines of [constants]
  std::string body;                ///< further lines of [body]
  double spacing = 1;
  std::vector<double> lower;       ///< empty: the origin
  std::vector<double> upper;       ///< empty: no lattice, the points are those of `body`
  std::string lattice;             ///< further lines of [body.lattice]
  std::string sets;
  std::string family = "horizon_ratio = 2.015";
  std::string kinematics = "baqp";
  std::string material = "type = \"neo_hookean\"\nshear_modulus = 1.0\nbulk_modulus = 2.0";
  std::string further;             ///< further sections
  std::string integrator = "evaluate";

  operator std::string() const {
    const auto lines = [](const std::string& some) { return some.empty() || some.back() == '\n' ? some : some + "\n"; };
    const auto section = [&](const char* header, const std::string& some) { return some.empty() ? "" : header + ("\n" + lines(some)); };
    const auto part = [](const std::string& text) { return text.find('=') == std::string::npos ? "type = \"" + text + "\"" : text; };
    const std::string across = dimension == 2 ? "plane" : "line";
    std::string text = "format = 1\n" + section("[constants]", constants);
    text += fmt::format("[body]\ndimension = {}\n{}", dimension, dimension == 3 || space.empty() ? "" : fmt::format("{} = \"{}\"\n", across, space)) + lines(body);
    if (!upper.empty()) {
      const std::vector<double> origin(upper.size(), 0.0);
      text += fmt::format("[body.lattice]\nspacing = {}\nlower = {}\nupper = {}\n", spacing, lower.empty() ? origin : lower, upper) + lines(lattice);
    }
    return text + section("[sets]", sets) + section("[family]", family) + section("[kinematics]", part(kinematics)) + section("[material]", part(material)) +
           lines(further) + section("[integrator]", part(integrator));
  }
};

}  // namespace perikit::test
