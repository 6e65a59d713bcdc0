#include "tests/fracture/crack.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "output/history_file.hpp"
#include "output/result_file.hpp"
#include "perikit/core/errors.hpp"

namespace perikit::fracture {

namespace {

/// Different values of one coordinate of some points, ascending; differences below a millionth of the range are none.
std::vector<double> levels(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const double same = 1e-6 * (values.back() - values.front());
  values.erase(std::unique(values.begin(), values.end(), [&](double a, double b) { return b - a <= same; }), values.end());
  return values;
}

std::size_t nearest(const std::vector<double>& levels, double value) {
  const auto above = static_cast<std::size_t>(std::lower_bound(levels.begin(), levels.end(), value) - levels.begin());
  if (above == 0) return 0;
  if (above == levels.size()) return above - 1;
  return levels[above] - value < value - levels[above - 1] ? above : above - 1;
}

/// Runs of cracked points in a column with two or more others between them.
int arms(const Layer& layer, std::size_t column) {
  int count = 0;
  std::size_t whole = 2;
  for (std::size_t row = 0; row < layer.y.size(); ++row) {
    const bool broken = layer.at(column, row) > cracked;
    if (broken && whole >= 2) ++count;
    whole = broken ? 0 : whole + 1;
  }
  return count;
}

void measure_energy(const std::filesystem::path& run, double end, Crack& crack) {
  const History history = read_history(run / "history.csv");
  const auto column = [&](const char* name) -> const std::vector<double>& {
    const auto found = std::find(history.columns.begin(), history.columns.end(), name);
    if (found == history.columns.end()) throw InputError({(run / "history.csv").string(), 0, 0}, name, "found no such column");
    return history.values[static_cast<std::size_t>(found - history.columns.begin())];
  };
  const auto &time = column("time"), &strain = column("strain_energy"), &kinetic = column("kinetic_energy"),
             &work = column("external_work"), &dissipated = column("dissipated_energy");
  if (time.empty()) return;
  double most = 0;
  for (std::size_t k = 0; k < time.size(); ++k) {
    most = std::max(most, work[k]);
    const double missing = std::abs(work[k] - (strain[k] - strain[0]) - (kinetic[k] - kinetic[0]) - dissipated[k]);
    if (time[k] > 0.125 * end && most > 0) crack.balance = std::max(crack.balance, missing / most);
  }
  crack.dissipated = dissipated.back();
}

}  // namespace

Crack measure(const std::filesystem::path& run) {
  const ResultFile results(run);
  const hdf5::Source& source = results.source();
  const auto position = source.read("/reference/position");
  const std::size_t points = position.rows();
  std::vector<double> axis[3];
  for (std::size_t p = 0; p < points; ++p)
    for (std::size_t c = 0; c < 3; ++c) axis[c].push_back(position.data[3 * p + c]);
  Crack crack;
  Layer& layer = crack.layer;
  layer.x = levels(axis[0]);
  layer.y = levels(axis[1]);
  layer.damage.assign(layer.x.size() * layer.y.size(), 0.0);
  const double top = *std::max_element(axis[2].begin(), axis[2].end()), spacing = layer.x[1] - layer.x[0];

  std::vector<double> times, tips;
  for (const std::int64_t frame : results.frames()) {
    const std::string group = results.frame_group(frame);
    const auto damage = source.read(group + "/damage");
    crack.end = source.real(group, "time");
    crack.tip = layer.x.front();
    for (std::size_t p = 0; p < points; ++p)
      if (damage.data[p] > cracked) crack.tip = std::max(crack.tip, axis[0][p]);
    times.push_back(crack.end);
    tips.push_back(crack.tip);
    if (frame != results.frames().back()) continue;
    const auto u = source.read(group + "/displacement");
    for (std::size_t p = 0; p < points; ++p) {
      const double length = std::hypot(u.data[3 * p], u.data[3 * p + 1], u.data[3 * p + 2]);
      crack.fragments = std::max(crack.fragments, length);
      if (damage.data[p] < 0.9) crack.displacement = std::max(crack.displacement, length);
      if (damage.data[p] > cracked) crack.stray = std::max(crack.stray, std::abs(axis[1][p]));
      if (std::abs(axis[2][p] - top) < 0.1 * spacing)
        layer.damage[nearest(layer.x, axis[0][p]) * layer.y.size() + nearest(layer.y, axis[1][p])] = damage.data[p];
    }
  }
  const std::size_t tip = nearest(layer.x, crack.tip), behind = tip >= 2 ? tip - 2 : 0;
  crack.arms = arms(layer, behind);
  for (std::size_t column = behind + 1; column-- > 0 && arms(layer, column) >= 2;) crack.branch = layer.x[column];
  const double stretch = 0.1 * (layer.x.back() - layer.x.front());
  for (std::size_t a = 0; a < times.size(); ++a)
    for (std::size_t b = a + 1; b < times.size(); ++b)
      if (tips[b] - tips[a] >= stretch) {
        crack.speed = std::max(crack.speed, (tips[b] - tips[a]) / (times[b] - times[a]));
        break;
      }
  std::ifstream log(run / "run.log");
  for (std::string line; std::getline(log, line);) crack.ended = crack.ended || line.starts_with("speed  ");
  measure_energy(run, crack.end, crack);
  return crack;
}

}  // namespace perikit::fracture
