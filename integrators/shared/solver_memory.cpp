#include "solver_memory.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "perikit/core/field_operations.hpp"
#include "preconditioner.hpp"


namespace perikit {

namespace {

using Box = std::array<double, 3>;  // points along each axis

double volume(const Box& box) {
  return box[0] * box[1] * box[2];
}

/// Along an axis of n points: those within `reach` of a point, in the mean.
double reached(double n, double reach) {
  return reach < n ? 2 * reach + 1 - reach * (reach + 1) / n : n;
}

class Dissection {
 public:
  Dissection(int dimension, double reach) : dimension_(dimension), reach_(std::max(reach, 1.0)) {}

  /// Unknowns of the box, with `sides` of its sides along each axis at layers that are eliminated later.
  FactorSize of(const Box& box, const Box& sides) const {
    const FactorSize whole = front(volume(box), volume(grown(box, sides)) - volume(box));
    const auto axis = static_cast<std::size_t>(std::max_element(box.begin(), box.end()) - box.begin());
    if (box[axis] < 2 * reach_) return whole;
    Box half = box, layer = box, half_sides = sides, layer_sides = sides;
    half[axis] = (box[axis] - reach_) / 2;
    half_sides[axis] = std::min(2.0, sides[axis] / 2 + 1);
    layer[axis] = reach_;
    layer_sides[axis] = 0;
    // The layer, eliminated last, is coupled with what surrounds the whole box.
    const FactorSize part = of(half, half_sides), last = front(volume(layer), volume(grown(box, sides)) - volume(box));
    const FactorSize dissected{2 * part.numbers + last.numbers, 2 * part.operations + last.operations};
    return dissected.operations < whole.operations ? dissected : whole;
  }

 private:
  Box grown(Box box, const Box& sides) const {
    for (std::size_t k = 0; k < 3; ++k) box[k] += sides[k] * reach_;
    return box;
  }
  /// s points eliminated together, of which each is coupled with the others and with b more.
  FactorSize front(double s, double b) const {
    const double n = s * dimension_, m = b * dimension_;
    return {n * n / 2 + n * m, n * n * n / 3 + n * n * m + n * m * m};
  }

  int dimension_;
  double reach_;
};

}  // namespace

FactorSize predict_factor(Problem& problem, double blocks) {
  const Points& points = problem.points();
  const auto d = static_cast<std::size_t>(points.dimension());
  const ConstFieldView free = problem.constraints().free();
  const double free_points = dot(free, free) / static_cast<double>(d);
  if (free_points == 0) return {};
  Box low, high, box{1, 1, 1};
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const std::int32_t p : points.owned()) {
    const Point x = points.position(static_cast<std::size_t>(p));
    for (std::size_t k = 0; k < d; ++k) {
      low[k] = std::min(low[k], x[k]);
      high[k] = std::max(high[k], x[k]);
    }
  }
  for (std::size_t k = 0; k < d; ++k) box[k] = (high[k] - low[k]) / points.spacing() + 1;
  // Holes and held points leave fewer than the box has.
  const double scale = std::pow(free_points / volume(box), 1.0 / static_cast<double>(d));
  for (std::size_t k = 0; k < d; ++k) box[k] = std::max(1.0, box[k] * scale);
  // The reach of rows whose balls, cut off at the sides of the box, have so many points.
  const double of_cube = d == 1 ? 1 : d == 2 ? std::numbers::pi / 4 : std::numbers::pi / 6, wanted = blocks / static_cast<double>(points.size());
  double least = 0, most = *std::max_element(box.begin(), box.end());
  for (int k = 0; k < 50; ++k) {
    const double reach = (least + most) / 2;
    double found = 1;
    for (std::size_t a = 0; a < d; ++a) found *= reached(box[a], reach);
    (found * of_cube < wanted ? least : most) = reach;
  }
  return Dissection(points.dimension(), most).of(box, {});
}

namespace {

constexpr double bytes_of_libraries = 8e6;  // SUNDIALS, SuiteSparse and BLAS with their buffers
/// Of the companion with its multigrid, a point (measured).
constexpr std::array<double, 4> bytes_a_companion_point = {0, 800, 3000, 13000};

}  // namespace

double direct_solver_bytes(Problem& problem) {
  const AssembledSize size = problem.assembled_size();
  const FactorSize factor = predict_factor(problem, static_cast<double>(size.blocks));
  const double d = problem.dimension(), entries = static_cast<double>(size.blocks) * d * d;
  // Beside the tangent: its upper triangle in compressed columns, values and indices of 8 bytes, once for itself and once permuted by CHOLMOD.
  return bytes_of_libraries + static_cast<double>(size.bytes) + 16 * entries + 8 * factor.numbers;
}

double krylov_solver_bytes(Problem& problem, const std::string& preconditioner, int vectors) {
  const std::string chosen = preconditioner == "auto" ? automatic_preconditioner(problem) : preconditioner;
  const auto d = static_cast<std::size_t>(problem.dimension());
  const double field = 8.0 * static_cast<double>(problem.points().stride() * d), fields = (vectors + 10) * field;
  if (chosen == "factorisation") return fields + direct_solver_bytes(problem);
  if (chosen == "jacobi") return bytes_of_libraries + fields + static_cast<double>(problem.assembled_size().bytes);
  const double points = chosen == "none" ? 0 : static_cast<double>(problem.points().size());
  return bytes_of_libraries + fields + bytes_a_companion_point[d] * points;
}

}  // namespace perikit
