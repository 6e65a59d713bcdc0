#include "output/plot.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "output/recorder.hpp"
#include "perikit/core/errors.hpp"
#include "tests/unit/temporary_folder.hpp"

using namespace perikit;

namespace {

struct Sample {
  std::vector<std::array<double, 3>> positions;
  OutputField displacement{"displacement", 3, {}}, cauchy{"cauchy", 9, {}}, damage{"damage", 1, {}};

  void add(double x, double y, double z, std::array<double, 3> moved, double fraction) {
    positions.push_back({x, y, z});
    displacement.data.insert(displacement.data.end(), {moved[0] - x, moved[1] - y, moved[2] - z});
    for (int c = 0; c < 9; ++c) cauchy.data.push_back(c % 4 == 0 ? fraction * (c + 1) : 0.0);
    damage.data.push_back(fraction);
  }
  void write(const std::filesystem::path& folder, const std::string& title) const {
    ReferenceData reference;
    reference.points = positions.size();
    reference.point = [&](std::size_t p) -> ReferenceData::Point { return {positions[p], 1.0, 0}; };
    FrameWriter writer(folder, reference, {"0.1.0", title, ""});
    for (int k = 0; k < 2; ++k) writer.write(0.5 * k, k, std::vector<OutputField>{displacement, cauchy, damage});
  }
};

/// A bar that is bent to a quarter of a circle and twisted by half a turn.
Sample bar(int length) {
  Sample sample;
  for (int k = 0; k < length; ++k) {
    for (int j = 0; j < 10; ++j) {
      for (int i = 0; i < 10; ++i) {
        const double s = k + 0.5, bend = 1.57 * s / length, twist = 3.14 * s / length, radius = length / 1.57;
        const double a = i - 4.5, b = j - 4.5;
        const double u = a * std::cos(twist) - b * std::sin(twist), v = a * std::sin(twist) + b * std::cos(twist);
        sample.add(a, b, s, {radius - (radius - u) * std::cos(bend), v, (radius - u) * std::sin(bend)}, s / length);
      }
    }
  }
  return sample;
}

Sample ball() {
  Sample sample;
  const double radius = 14.5;
  for (int k = -15; k < 15; ++k) {
    for (int j = -15; j < 15; ++j) {
      for (int i = -15; i < 15; ++i) {
        const double x = i + 0.5, y = j + 0.5, z = k + 0.5;
        if (x * x + y * y + z * z < radius * radius) sample.add(x, y, z, {x, y, z}, (z + radius) / (2 * radius));
      }
    }
  }
  return sample;
}

/// A plate with a hole under tension (Kirsch), or the same with points off the lattice.
Sample plate(double jitter) {
  Sample sample;
  unsigned state = 1;
  const auto random = [&] { return (state = state * 1664525u + 1013904223u) / 4294967296.0 - 0.5; };
  for (int j = -40; j < 40; ++j) {
    for (int i = -60; i < 60; ++i) {
      const double x = i + 0.5 + jitter * random(), y = j + 0.5 + jitter * random(), r2 = x * x + y * y;
      if (r2 < 225) continue;
      const double c = 225 / r2, cos2 = (x * x - y * y) / r2, cos4 = 2 * cos2 * cos2 - 1;
      const double stress = 1 - c * (1.5 * cos2 + cos4) + 1.5 * c * c * cos4;
      sample.add(x, y, 0, {x * (1 + 0.15 * (1 + c)), y * (1 - 0.05 * (1 + c)) + (x > 30 && y > 0 ? 3 : 0), 0}, stress);
    }
  }
  return sample;
}

Sample strip() {
  Sample sample;
  for (int j = 0; j < 12; ++j) {
    for (int i = 0; i < 120; ++i) sample.add(1e-3 * i, 1e-3 * j, 0, {1.1e-3 * i, 1e-3 * j, 0}, 0);
  }
  return sample;
}

Sample string() {
  Sample sample;
  for (int i = 0; i < 200; ++i) sample.add(i, 0, 0, {i + std::sin(0.1 * i), 0, 0}, 0);
  return sample;
}

std::string bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

bool gnuplot_missing() {
  if (std::system("command -v gnuplot > /dev/null 2>&1") == 0) return false;
  MESSAGE("pictures not tested: gnuplot is not installed");
  return true;
}

void check_png(const std::filesystem::path& file) {
  const std::string picture = bytes(file);
  CHECK(picture.size() > 2000);
  CHECK(picture.starts_with("\x89PNG"));
}

/// PERIKIT_KEEP_PICTURES names a folder in which the pictures stay, to be looked at.
std::filesystem::path picture_folder(const TemporaryFolder& folder) {
  const char* kept = std::getenv("PERIKIT_KEEP_PICTURES");
  return kept ? std::filesystem::path(kept) : folder.path;
}

}  // namespace

TEST_CASE("bodies of every dimension become pictures") {
  if (gnuplot_missing()) return;
  const TemporaryFolder folder;
  const auto draw = [&](const Sample& sample, const std::string& title, PlotOptions options) {
    options.results = {folder.path / title};
    sample.write(options.results.front(), title);
    options.output = picture_folder(folder) / (title + ".png");
    CHECK(plot(options) == options.output);
    check_png(options.output);
  };
  PlotOptions options;
  options.deformed = 1;
  draw(bar(100), "bent bar", options);
  draw(plate(0), "torn plate", options);
  draw(string(), "string", {});
  draw(strip(), "wide strip", {});
  options.field = "cauchy";
  options.component = "xx";
  options.deformed = 0;
  draw(plate(0), "plate with a hole", options);
  draw(plate(0.8), "plate of irregular points", options);
  options.field = "damage";
  options.component = "";
  draw(ball(), "ball", options);
}

TEST_CASE("history columns, file types and default names") {
  if (gnuplot_missing()) return;
  const TemporaryFolder folder;
  const auto run = folder.path / "it's a run";
  plate(0).write(run, "run");
  {
    HistoryWriter history(run / "history.csv", {"step", "time", "tip_uy"});
    for (int k = 0; k < 100; ++k) history.row(std::vector<double>{1.0 * k, 0.1 * k, std::sin(0.1 * k)});
  }
  PlotOptions options;
  options.results = {run / "results.h5"};
  options.field = "history:tip_uy";
  options.output = picture_folder(folder) / "history.png";
  plot(options);
  check_png(options.output);
  // Units come from the scene of the run.
  const auto drawn = [&](const std::string& scene) {
    std::ofstream(run / "scene.toml") << scene;
    options.output = folder.path / "history.svg";
    plot(options);
    return bytes(options.output);
  };
  const std::string own = "[integrator]\nend_time = 1.0\n[[output.history]]\nname = \"tip_uy\"\nquantity = \"displacement\"\n";
  const std::string dynamic = drawn(own), quasi_static = drawn(own.substr(own.find("[[")));
  CHECK(dynamic.find(">tip uy [m]<") != std::string::npos);
  CHECK(dynamic.find(">time [s]<") != std::string::npos);
  CHECK(quasi_static.find(">time<") != std::string::npos);
  CHECK(drawn("[integrator]\nsteps = 10\n").find(">load parameter<") != std::string::npos);
  options.unit = "mm";
  CHECK(drawn(own).find(">tip uy [mm]<") != std::string::npos);
  CHECK(drawn(own).find(">time<") != std::string::npos);
  options.unit.reset();
  options.field = "history:time";
  CHECK(drawn("no scene").find(">time<") != std::string::npos);
  options.field = "volume";
  options.output = folder.path / "volume.svg";
  plot(options);
  CHECK(bytes(options.output).find("<svg") != std::string::npos);
  options.output = folder.path / "volume.pdf";
  plot(options);
  CHECK(bytes(options.output).starts_with("%PDF"));
  options.output.clear();
  options.frame = 0;
  CHECK(plot(options) == run / "volume_00000000.png");
  check_png(run / "volume_00000000.png");
}

TEST_CASE("curves of columns over each other, of several runs, with gaps where a value is missing") {
  if (gnuplot_missing()) return;
  const TemporaryFolder folder;
  PlotOptions options;
  for (const char* name : {"coarse", "fine"}) {
    std::filesystem::create_directories(folder.path / name);
    HistoryWriter history(folder.path / name / "history.csv", {"step", "time", "u", "P", "E"}, -1, {"E"});
    for (int k = 0; k < 30; ++k) {
      const double u = 0.1 * k, P = std::sin(u) * (name[0] == 'c' ? 1 : 1.2);
      history.row(std::vector<double>{1.0 * k, u, u, P, k == 0 ? std::nan("") : P / u});
    }
    options.results.push_back(folder.path / name);
  }
  options.x = "u", options.y = "P";
  options.output = picture_folder(folder) / "curves.png";
  plot(options);
  check_png(options.output);
  options.output = folder.path / "curves.svg";
  const auto drawn = [&] { return plot(options), bytes(options.output); };
  const std::string usual = drawn();
  for (const char* word : {">u<", ">P<", ">coarse<", ">fine<"}) CHECK_MESSAGE(usual.find(word) != std::string::npos, word);
  options.window = {0, 1, 0, 0.5};
  CHECK(drawn() != usual);
  options.y = "E";
  CHECK(drawn().find("nan") == std::string::npos);
  options.results.pop_back();
  CHECK(drawn().find(">coarse<") == std::string::npos);   // one curve needs no name
  options.output.clear();
  CHECK(plot(options) == folder.path / "coarse" / "history_E_over_u.png");
}

TEST_CASE("the title says frame, time and factor; points without bonds are dots; a window shows a part") {
  if (gnuplot_missing()) return;
  const TemporaryFolder folder;
  const auto drawn = [&](const Sample& sample, auto change) {
    sample.write(folder.path / "plate", "plate");
    PlotOptions options;
    options.results = {folder.path / "plate"};
    options.field = "damage";
    options.output = folder.path / "picture.svg";
    change(options);
    plot(options);
    return bytes(options.output);
  };
  Sample sample = plate(0);
  std::ranges::fill(sample.damage.data, 0.5);
  const std::string usual = drawn(sample, [](PlotOptions&) {});
  CHECK(usual.find(">plate, frame 1, time 0.5<") != std::string::npos);
  CHECK(drawn(sample, [](PlotOptions& o) { o.deformed = 3; }).find(", deformed 3 times<") != std::string::npos);
  CHECK(drawn(sample, [](PlotOptions& o) { o.window = {20, 40, 0, 15}; }) != usual);
  std::ofstream(folder.path / "plate" / "scene.toml") << "[integrator]\nsteps = 4\n";
  CHECK(drawn(sample, [](PlotOptions&) {}).find(">plate, frame 1, load parameter 0.5<") != std::string::npos);
  // A point that has lost all bonds is another picture than one that has lost most.
  const auto with_damage = [&](double damage) {
    sample.damage.data[100] = damage;
    return drawn(sample, [](PlotOptions& o) { o.range = {0, 0.5}; });
  };
  CHECK(with_damage(0.99) == with_damage(0.999));
  CHECK(with_damage(0.99) != with_damage(1));
}

TEST_CASE("range, view, unit and frame change the picture") {
  if (gnuplot_missing()) return;
  const TemporaryFolder folder;
  bar(20).write(folder.path, "bar");
  const auto drawn = [&](auto change) {
    PlotOptions options;
    options.results = {folder.path};
    options.output = folder.path / "picture.png";
    change(options);
    plot(options);
    return bytes(options.output);
  };
  const std::string usual = drawn([](PlotOptions&) {});
  CHECK(usual == drawn([](PlotOptions&) {}));
  CHECK(usual != drawn([](PlotOptions& o) { o.range = {0, 100}; }));
  CHECK(usual != drawn([](PlotOptions& o) { o.view = {0, 0, 1}; }));
  CHECK(usual != drawn([](PlotOptions& o) { o.unit = "mm"; }));
  CHECK(usual != drawn([](PlotOptions& o) { o.frame = 0; }));
  CHECK(usual != drawn([](PlotOptions& o) { o.component = "x"; }));
  CHECK(usual != drawn([](PlotOptions& o) { o.deformed = 0.5; }));
}

TEST_CASE("what cannot be drawn is refused with the names that can") {
  const TemporaryFolder folder;
  plate(0).write(folder.path, "plate");
  write_file_atomically(folder.path / "history.csv", "time,tip_uy\n0,1\n");
  PlotOptions usual;
  usual.results = {folder.path};
  const auto refused = [&](auto change, const char* message) {
    PlotOptions options = usual;
    change(options);
    CHECK_THROWS_WITH_AS(plot(options), doctest::Contains(message), InputError);
  };
  refused([](PlotOptions& o) { o.field = "displacment"; },
          "cauchy, damage, displacement, volume, material_id, id; did you mean 'displacement'?");
  refused([](PlotOptions& o) { o.field = "von_mises"; }, "what a run writes stands in its scene: [output] fields");
  refused([](PlotOptions& o) { o.component = "w"; }, "found 'w'; 'displacement' has x, y, z, magnitude");
  refused([](PlotOptions& o) { o.field = "damage", o.component = "x"; }, "'damage' is a scalar");
  refused([](PlotOptions& o) { o.frame = 7; }, "frame: found 7; must be one of 0 ... 1");
  refused([](PlotOptions& o) { o.field = "history:tip_ux"; }, "the columns are time, tip_uy; did you mean 'tip_uy'?");
  refused([](PlotOptions& o) { o.y = "tip_ux"; }, "y: found 'tip_ux'; the columns are time, tip_uy; did you mean 'tip_uy'?");
  refused([](PlotOptions& o) { o.x = "tmie", o.y = "tip_uy"; }, "x: found 'tmie'; the columns are time, tip_uy; did you mean 'time'?");
  refused([](PlotOptions& o) { o.x = "time"; }, "y: found nothing over time; must be a column of history.csv");
  refused([](PlotOptions& o) { o.results.push_back(o.results.front()); }, "results: found 2 runs for the picture of a field");
  refused([](PlotOptions& o) { o.window = {1, 1, 0, 1}; }, "window: found 1 1 0 1; must be from x to a larger x");
  refused([](PlotOptions& o) { o.window = {500, 600, 0, 1}; }, "window: found a window without points; the body lies between ");
  refused([](PlotOptions& o) { o.output = "picture.gif"; }, "found 'picture.gif'; must end in .png, .svg or .pdf");
  refused([](PlotOptions& o) { o.view = {0, 0, 0}; }, "view: must be a direction");
  refused([](PlotOptions& o) { o.range = {1, 1}; }, "range: found 1 ... 1");
  refused([](PlotOptions& o) { o.results = {"/no/such/run"}; }, "/no/such/run: cannot be read: No such file");
}

TEST_CASE("a missing gnuplot is said so") {
  const TemporaryFolder folder;
  plate(0).write(folder.path, "plate");
  PlotOptions options;
  options.results = {folder.path};
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", folder.path.c_str(), 1);
  CHECK_THROWS_WITH_AS(plot(options), doctest::Contains("gnuplot is not installed"), RunError);
  ::setenv("PATH", path.c_str(), 1);
}
