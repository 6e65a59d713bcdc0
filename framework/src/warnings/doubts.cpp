#include "warnings/doubts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "perikit/body/lattice.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/warnings.hpp"

namespace perikit {

namespace {

/// "a by b"
std::string sizes(std::span<const double> values) {
  std::string text;
  for (const double value : values) text += fmt::format("{}{:.6g}", text.empty() ? "" : " by ", value);
  return text;
}

/// How far n is from a whole number.
double from_whole(double n) { return std::abs(n - std::round(n)); }

/// A box is a multiple of the spacing where it is so up to this share of it, so that the digits that a spacing was rounded to count for
/// nothing.
constexpr double whole_box = 1e-3;

/// The nearest spacings below and above that fit each of these lengths, from a quarter of this one to four times as much.
std::vector<double> fitting_spacings(std::span<const double> lengths, double spacing) {
  const double shortest = std::ranges::min(lengths), cells = shortest / spacing;
  const auto fits = [&](double n) {
    return std::ranges::all_of(lengths, [&](double length) { return from_whole(length / shortest * n) < whole_box; });
  };
  std::vector<double> found;
  for (double n = std::floor(cells) + 1; n <= 4 * cells + 1 && n <= cells + 1e5; ++n)
    if (fits(n)) {
      found.push_back(shortest / n);
      break;
    }
  for (double n = std::floor(cells); n >= 1 && n >= cells / 4 && n >= cells - 1e5; --n)
    if (fits(n)) {
      found.push_back(shortest / n);
      break;
    }
  return found;
}

/// The body of a lattice consists of whole cells: where its box does not, it is another body.
void find_cut_cells(const Scene& scene, const Body& body, std::vector<std::string>& lines) {
  if (!scene.body.lattice) return;
  const LatticeDescription& lattice = *scene.body.lattice;
  const auto d = static_cast<std::size_t>(body.dimension());
  std::vector<double> asked, cells, got;
  bool differs = false;
  for (std::size_t a = 0; a < d; ++a) {
    asked.push_back(lattice.upper[a] - lattice.lower[a]);
    cells.push_back(asked.back() / lattice.spacing);
    got.push_back(static_cast<double>(lattice_cells(lattice.lower[a], lattice.upper[a], lattice.spacing)) * lattice.spacing);
    if (from_whole(cells.back()) <= whole_box) continue;
    // `inside` may cut the body before its box ends.
    double last = -std::numeric_limits<double>::infinity();
    for (const std::int32_t p : body.owned()) last = std::max(last, body.position(static_cast<std::size_t>(p))[a]);
    differs |= communicator().largest(last) > lattice.lower[a] + got.back() - 0.999 * lattice.spacing;
  }
  if (!differs) return;
  std::string remedy;
  for (const double spacing : fitting_spacings(asked, lattice.spacing)) remedy += fmt::format("{}{:.6g}", remedy.empty() ? "spacing = " : " or ", spacing);
  if (!remedy.empty()) {
    remedy += " would fit";
  } else {
    std::string upper;
    for (std::size_t a = 0; a < d; ++a) upper += fmt::format("{}{:.6g}", a > 0 ? ", " : "", lattice.lower[a] + got[a]);
    remedy = fmt::format("no spacing nearby fits, upper = [{}] does", upper);
  }
  lines.push_back(named("box", fmt::format("the box of [body.lattice] is {} spacings, which are not whole numbers: the body is {} m, not {} m; {}",
                              sizes(cells), sizes(got), sizes(asked), remedy)));
}

/// How the surface of the body cuts a cell of its lattice: not at all, along the axes, or obliquely.
enum class Cut { none, along_axes, oblique };

Cut cut_of(const Expression& inside, const Point& centre, double spacing, int d) {
  constexpr double within = 1 - 1e-6;   // surfaces that lie on sides of cells cut none
  unsigned kept = 0;   // by corner
  const unsigned corners = 1u << d, all = (1u << corners) - 1;
  for (unsigned corner = 0; corner < corners; ++corner) {
    Point x = centre;
    for (int a = 0; a < d; ++a) x[static_cast<std::size_t>(a)] += (corner >> a & 1 ? 0.5 : -0.5) * within * spacing;
    if (inside(x) != 0) kept |= 1u << corner;
  }
  if (kept == all) return Cut::none;
  for (int a = 0; a < d; ++a) {   // whether one coordinate says which corners are kept
    unsigned upper = 0;
    for (unsigned corner = 0; corner < corners; ++corner)
      if (corner >> a & 1) upper |= 1u << corner;
    if (kept == upper || kept == (all & ~upper)) return Cut::along_axes;
  }
  return Cut::oblique;
}

/// Cells of a lattice are there or not: oblique and curved surfaces are stairs.
void find_stairs(const Scene& scene, const Body& body, std::vector<std::string>& lines) {
  if (!scene.body.lattice || !scene.body.lattice->inside || scene.body.lattice->jitter > 0 || scene.partial_volume) return;
  constexpr std::int64_t most_cells = 300000;   // that are looked at, evenly among all
  const std::int64_t every = body.points_of_all_ranks() / most_cells + 1;
  std::int64_t counts[2] = {};
  for (const std::int32_t p : body.owned()) {
    const auto point = static_cast<std::size_t>(p);
    if (body.image(point) || body.number(point) % every != 0) continue;
    const Cut cut = cut_of(*scene.body.lattice->inside, body.position(point), body.spacing(), body.dimension());
    if (cut != Cut::none) ++counts[cut == Cut::oblique];
  }
  communicator().sum(counts);
  // Corners of cuts along the axes look oblique, and are few.
  if (counts[1] < 0.15 * static_cast<double>(counts[0] + counts[1]) || counts[1] <= 4) return;
  lines.push_back(named("stairs", "a surface of [body.lattice] inside cuts cells obliquely, and a cell is there or not: the surface is made of stairs, beside which stresses are off by 10 % "
                                  "and more; partial_volume = true in [family], or a cloud ([body.points])"));
}

/// Families within two spacings are the nearest neighbours and hardly more.
void find_small_horizon(const Scene& scene, const Body& body, std::vector<std::string>& lines) {
  const double ratio = body.horizon() / body.spacing();
  if (ratio >= (body.dimension() == 1 ? 1.0 : 2.0) * (1 - 1e-9)) return;
  lines.push_back(named("horizon", fmt::format("{} is {:.4g} spacings: families are the nearest neighbours and hardly more, and directions of the lattice and zero-energy modes show; "
                                               "2 to 4 is usual",
                                               scene.horizon > 0 ? "family.horizon" : "family.horizon_ratio", ratio)));
}

/// A force [N] on a plate: the thickness counts, and has a value where nobody gave one.
void find_thick_plate(const Scene& scene, const Body& body, std::vector<std::string>& lines) {
  const bool force = std::ranges::any_of(scene.loads, [](const LoadDescription& load) { return load.type == LoadDescription::Type::force; });
  if (!force || scene.body.space != Space::plane_stress) return;
  double length = 0;
  for (std::size_t a = 0; a < 2; ++a) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const std::int32_t p : body.owned()) {
      low = std::min(low, body.position(static_cast<std::size_t>(p))[a]);
      high = std::max(high, body.position(static_cast<std::size_t>(p))[a]);
    }
    length = std::max(length, communicator().largest(high) + communicator().largest(-low) + body.spacing());
  }
  if (scene.body.section <= length) return;
  lines.push_back(named("thickness", fmt::format("a force acts on a body in plane stress that is {:.6g} m thick and {:.6g} m long: plane stress is of bodies that are thin; thickness in [body], which is 1 m "
                                                 "where it is not given",
                                                 scene.body.section, length)));
}

}  // namespace

std::vector<std::string> doubts(const Scene& scene, BodyProblem& problem) {
  std::vector<std::string> lines;
  const Body& body = problem.body();
  if (scene.random_points() && !scene.consistent.value_or(true) && problem.terms().has_gradients())
    lines.push_back(
        named("balance", "a cloud with consistent = false in [family]: a constant stress is not in equilibrium on points that lie at random, and "
                         "the body is too soft by 1 to 12 %, however fine it is"));
  find_cut_cells(scene, body, lines);
  find_stairs(scene, body, lines);
  find_small_horizon(scene, body, lines);
  find_thick_plate(scene, body, lines);
  find_doubts_of_model(scene, problem, lines);
  find_doubts_of_stiffness(scene, problem, lines);
  double farthest = 0;
  for (const std::int32_t p : body.internal())
    for (const double x : body.position(static_cast<std::size_t>(p))) farthest = std::max(farthest, std::abs(x));
  farthest = communicator().largest(farthest);
  const double rounding = std::numeric_limits<double>::epsilon() * farthest / body.spacing();
  if (scene.random_points() && rounding > 1e-8)
    lines.push_back(
        named("origin", fmt::format("points {:.3g} m away from the origin: the position of a point rounds to {:.2g} of the spacing; allowed: points "
                    "near the origin",
                    farthest, rounding)));
  for (int a = 0; a < body.dimension(); ++a) {
    const auto c = static_cast<std::size_t>(a);
    double low = body.position(static_cast<std::size_t>(body.internal()[0]))[c],
           high = low;  // with images, which go on behind sides
    for (const std::int32_t p : body.internal()) {
      low = std::min(low, body.position(static_cast<std::size_t>(p))[c]);
      high = std::max(high, body.position(static_cast<std::size_t>(p))[c]);
    }
    low = -communicator().largest(-low);
    high = communicator().largest(high);
    const double extent = high - low + body.spacing();
    if (extent >= body.horizon()) continue;
    lines.push_back(
        named("thin", fmt::format("the body is {:.6g} m thick along {}, less than the horizon, {:.6g} m: no point has half of a family across",
                    extent, "xyz"[a], body.horizon())));
  }
  return lines;
}

}  // namespace perikit
