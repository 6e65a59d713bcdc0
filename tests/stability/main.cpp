/// The stability suite: every kinematics, influence function, horizon ratio, jitter and dimension. Writes stability.csv, one row
/// a combination, and stability.md, what of it a user needs; endurance.csv and endurance.md of the long runs. See `usage`.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

#include "tests/stability/measures.hpp"

using namespace perikit;
using namespace perikit::stability;

namespace {

struct Row {
  Setting setting;
  Spectrum spectrum;
  Accuracy accuracy;
  double below, above, longer;  ///< growth at 0.99 and 1.05 of the limit, and over many steps at 0.9 of it
};

Row measure(Registry& registry, const Setting& setting) {
  Specimen specimen(registry, setting);
  Row row{setting, specimen.spectrum(), specimen.accuracy(), 0, 0, 0};
  row.below = specimen.growth(row.spectrum.largest, 0.99, 100);
  row.above = specimen.growth(row.spectrum.largest, 1.05, 100);
  row.longer = specimen.growth(row.spectrum.largest, 0.9, setting.dimension == 1 ? 5000 : setting.dimension == 2 ? 1000 : 300);
  return row;
}

void write_csv(std::FILE* file, const Row& row) {
  const Spectrum& s = row.spectrum;
  const Accuracy& a = row.accuracy;
  fmt::print(file, "{},{},{},{},{},{:.4e},{:.3f},{:.4e},{},{},{:.4f},{:.4g},{:.4g},{:.4g},{:.3e},{:.4g},{:.4g}\n",
             row.setting.label, row.setting.influence, row.setting.horizon_ratio, row.setting.jitter, row.setting.dimension,
             s.lowest, s.roughness, s.lowest_rough, s.zero_modes, s.poor_points, s.estimate, row.below, row.above, row.longer,
             a.affine, a.quadratic_centre, a.quadratic_surface);
  std::fflush(file);
}

/// Markdown: rows kinematics, columns horizon ratios; a cell is the least value over influence functions and jitters, by
/// dimension.
std::string table(const std::vector<Row>& rows, bool jittered, double (*value)(const Row&), bool largest) {
  std::vector<std::string> labels;
  std::vector<double> ratios;
  std::map<std::tuple<std::string, double, int>, double> cells;
  for (const Row& row : rows) {
    if ((row.setting.jitter > 0) != jittered || value(row) == -1) continue;  // -1: pair laws have no gradients
    if (std::find(labels.begin(), labels.end(), row.setting.label) == labels.end()) labels.push_back(row.setting.label);
    if (std::find(ratios.begin(), ratios.end(), row.setting.horizon_ratio) == ratios.end())
      ratios.push_back(row.setting.horizon_ratio);
    const auto [cell, fresh] =
        cells.try_emplace({row.setting.label, row.setting.horizon_ratio, row.setting.dimension}, value(row));
    cell->second = largest ? std::max(cell->second, value(row)) : std::min(cell->second, value(row));
  }
  std::string text = "| kinematics |";
  for (const double ratio : ratios) text += fmt::format(" {} |", ratio);
  text += "\n|---|";
  for (std::size_t k = 0; k < ratios.size(); ++k) text += "---|";
  for (const std::string& label : labels) {
    text += fmt::format("\n| `{}` |", label);
    for (const double ratio : ratios) {
      std::vector<std::string> by_dimension;
      for (int d = 1; d <= 3; ++d) {
        const auto cell = cells.find({label, ratio, d});
        if (cell != cells.end())
          by_dimension.push_back(std::abs(cell->second) < 1e-10 ? "0" : fmt::format("{:.1g}", cell->second));
      }
      text += fmt::format(" {} |", fmt::join(by_dimension, ", "));
    }
  }
  return text + "\n";
}

std::string summary(const std::vector<Row>& rows) {
  const auto by = [&](auto value) {
    std::vector<double> all;
    for (const Row& row : rows) all.push_back(value(row));
    return std::pair(*std::ranges::min_element(all), *std::ranges::max_element(all));
  };
  const auto estimate = by([](const Row& r) { return r.spectrum.estimate; });
  const auto below = by([](const Row&r) { return r.below; }), above = by([](const Row&r) { return r.above; }),
             longer = by([](const Row&r) { return r.longer; });
  const auto affine = by([](const Row& r) { return r.accuracy.affine; });
  const auto lowest = by([](const Row& r) { return r.spectrum.lowest; });
  std::string text = fmt::format(
      "{} combinations\n\nsmallest relative eigenvalue: {:.3g}\n\nestimated over true largest eigenvalue: {:.4f} to {:.4f}\n\n",
      rows.size(), lowest.first, estimate.first, estimate.second);
  text += fmt::format(
      "growth of the kinetic energy: at 0.99 of the limit up to {:.3g}, at 1.05 at least {:.3g}, in a long run at 0.9 up to "
      "{:.3g}\n\n",
      below.second, above.first, longer.second);
  text += fmt::format("error of affine gradients: up to {:.3g}\n\n", affine.second);
  const auto rough = [](const Row& r) { return r.spectrum.lowest_rough; };
  const auto surface = [](const Row& r) { return r.accuracy.quadratic_surface; };
  text += "Lowest relative eigenvalue of a rough mode, 1D, 2D, 3D, by horizon ratio; lattices:\n\n" +
          table(rows, false, rough, false);
  text += "\njittered:\n\n" + table(rows, true, rough, false);
  text += "\nPoints without a gradient of their own, jittered:\n\n" +
          table(
              rows, true, [](const Row& r) { return static_cast<double>(r.spectrum.poor_points); }, true);
  text += "\nError of the gradient of a quadratic field at the surface over second gradient times spacing, lattices:\n\n" +
          table(rows, false, surface, true);
  return text;
}

Registry& registry() {
  static Registry parts;
  static const bool filled = [] {
    for (const auto& path : Registry::standard_search_path({PERIKIT_PLUGIN_FOLDER})) parts.add_folder(path);
    return true;
  }();
  static_cast<void>(filled);
  return parts;
}

/// A bar that vibrates for many steps, for every kinematics. Returns the exit status: 1 where the energy is not bounded.
int vibration(std::int64_t steps) {
  int status = 0;
  fmt::print("{} steps\n| kinematics | periods | largest deviation of the energy | drift |\n|---|---|---|---|\n", steps);
  for (const std::string& kinematics : registry().names(Kind::kinematics)) {
    const Vibration v = vibrate(registry(), kinematics, steps);
    fmt::print("| `{}` | {:.0f} | {:.3e} | {:.3e} |\n", kinematics, v.periods, v.largest_deviation, v.drift);
    std::fflush(stdout);
    if (!(v.largest_deviation <= 0.05 && std::abs(v.drift) <= 1e-4)) status = 1;
  }
  return status;
}

/// Long explicit runs from a random perturbation, at 0.9 of the true limit of the step. Returns the exit status: 1 where the
/// energy drifts.
int endurance(std::int64_t steps, const std::filesystem::path& folder) {
  std::ofstream csv(folder / "endurance.csv"), page(folder / "endurance.md");
  csv << "kinematics,dimension,jitter,steps,largest_deviation,drift\n";
  const std::string head = fmt::format(
      "{} steps of 0.9 of the limit; drift of the energy on lattices and clouds\n| kinematics | 1D | 2D | 3D "
      "|\n|---|---|---|---|",
      steps);
  page << head;
  fmt::print("{}", head);
  std::map<std::string, std::map<int, std::string>> cells;
  int status = 0;
  for (const Setting& setting : long_settings(registry())) {
    Specimen specimen(registry(), setting);
    const Drift d = specimen.endure(specimen.spectrum().largest, 0.9, steps);
    csv << fmt::format("{},{},{},{},{:.3e},{:.3e}\n", setting.label, setting.dimension, setting.jitter, steps,
                       d.largest_deviation, d.drift)
        << std::flush;
    if (!(std::abs(d.drift) <= 1e-2 && d.largest_deviation <= 2)) status = 1;
    std::string& cell = cells[setting.label][setting.dimension];
    cell += fmt::format("{}{:.0e}", cell.empty() ? "" : ", ", d.drift);
    if (setting.dimension != 3 || setting.jitter == 0) continue;
    const std::string row = fmt::format("\n| `{}` | {} | {} | {} |", setting.label, cells[setting.label][1],
                                        cells[setting.label][2], cells[setting.label][3]);
    page << row << std::flush;
    fmt::print("{}", row);
    std::fflush(stdout);
  }
  page << "\n";
  fmt::print("\n");
  return status;
}

constexpr const char* usage = "perikit_stability FOLDER [DIMENSION]... | --endurance STEPS FOLDER | --vibration STEPS\n";

}  // namespace

int main(int argc, char** argv) try {
  if (argc == 3 && std::string(argv[1]) == "--vibration") return vibration(std::atoll(argv[2]));
  if (argc == 4 && std::string(argv[1]) == "--endurance") {
    std::filesystem::create_directories(argv[3]);
    return endurance(std::atoll(argv[2]), argv[3]);
  }
  if (argc < 2 || argv[1][0] == '-') {
    fmt::print(stderr, "{}", usage);
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  std::vector<int> dimensions;
  for (int k = 2; k < argc; ++k) dimensions.push_back(std::atoi(argv[k]));
  std::filesystem::create_directories(folder);
  std::FILE* csv = std::fopen((folder / "stability.csv").c_str(), "w");
  if (!csv) throw RunError(fmt::format("{}: cannot write stability.csv", folder.string()));
  fmt::print(csv,
             "kinematics,influence,horizon_ratio,jitter,dimension,lowest,roughness,lowest_rough,zero_modes,poor_points,estimate,"
             "growth_at_0.99,growth_at_1.05,growth_long,"
             "affine,quadratic_centre,quadratic_surface\n");
  std::vector<Row> rows;
  std::string label;
  const auto start = std::chrono::steady_clock::now();
  for (const Setting& setting : all_settings(registry())) {
    if (!dimensions.empty() && std::ranges::find(dimensions, setting.dimension) == dimensions.end()) continue;
    try {
      rows.push_back(measure(registry(), setting));
    } catch (const std::exception& error) {
      fmt::print("{} {} ratio {} jitter {} {}D: {}\n", setting.label, setting.influence, setting.horizon_ratio, setting.jitter,
                 setting.dimension, error.what());
      continue;
    }
    write_csv(csv, rows.back());
    if (setting.label != label)
      fmt::print("{} {}D, {:.0f} s\n", label = setting.label, setting.dimension,
                 std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    std::fflush(stdout);
  }
  std::fclose(csv);
  std::ofstream(folder / "stability.md") << summary(rows);
  fmt::print("{}", summary(rows));
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
