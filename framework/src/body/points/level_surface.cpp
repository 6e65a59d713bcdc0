#include "body/points/level_surface.hpp"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "core/symmetric_matrix.hpp"

namespace perikit {

namespace {

using Vector = Eigen::Vector3d;
using Matrix = Eigen::Matrix3d;

Vector vector(const Point& x) {
  return {x[0], x[1], x[2]};
}
Point point(const Vector& x) {
  return {x[0], x[1], x[2]};
}

/// Central differences. Components beyond the dimension are zero.
struct Differences {
  const std::function<double(const Point&)>& level;
  int dimension;
  double step;

  double at(const Vector& x) const { return level(point(x)); }
  Vector along(int c) const { return step * Vector::Unit(c); }
  Vector gradient(const Vector& x) const {
    Vector g = Vector::Zero();
    for (int c = 0; c < dimension; ++c) g[c] = (at(x + along(c)) - at(x - along(c))) / (2 * step);
    return g;
  }
  Matrix hessian(const Vector& x) const {
    Matrix H = Matrix::Zero();
    const double middle = at(x);
    for (int a = 0; a < dimension; ++a) {
      H(a, a) = (at(x + along(a)) - 2 * middle + at(x - along(a))) / (step * step);
      for (int b = 0; b < a; ++b) {
        const Vector sum = along(a) + along(b), difference = along(a) - along(b);
        H(a, b) = H(b, a) = (at(x + sum) - at(x + difference) - at(x - difference) + at(x - sum)) / (4 * step * step);
      }
    }
    return H;
  }
};

/// Of the mirror map; see Foot::stretch.
double stretch_of(const Matrix& shape, double depth) {
  // A tenth of the distance to the centre of curvature on the side of the body, and a twentieth behind the surface, where images
  // come together.
  constexpr double least_in_front = 0.1, least_behind = 0.05;
  const Matrix front = Matrix::Identity() - depth * shape, behind = Matrix::Identity() + depth * shape;
  const auto least = [](const Matrix& A) { return SymmetricEigen(3, A.data(), false).least(); };
  if (least(front) < least_in_front || least(behind) < least_behind) return 0;
  return behind.determinant() / front.determinant();
}

}  // namespace

LevelSurface::LevelSurface(std::function<double(const Point&)> level, int dimension, double spacing)
    : level_(std::move(level)), dimension_(dimension), spacing_(spacing) {}

double LevelSurface::estimate(const Point& x) const {
  const double slope = Differences{level_, dimension_, 1e-3 * spacing_}.gradient(vector(x)).norm();
  return slope > 0 ? -level_(x) / slope : std::copysign(std::numeric_limits<double>::infinity(), -level_(x));
}

std::optional<Foot> LevelSurface::foot(const Point& place) const {
  const Differences fine{level_, dimension_, 1e-3 * spacing_}, coarse{level_, dimension_, 1e-2 * spacing_};
  const Vector x = vector(place);
  Vector f = x, g = Vector::Zero();
  // Onto the surface, each time along the gradient.
  for (int k = 0; k < 5; ++k) {
    g = fine.gradient(f);
    if (!(g.squaredNorm() > 0)) return std::nullopt;
    f -= fine.at(f) / g.squaredNorm() * g;
  }
  // Nearest: f - x + lambda g = 0 and level = 0, the level in units of its slope.
  const double unit = 1 / g.norm();
  g *= unit;
  double lambda = (x - f).dot(g) / g.squaredNorm();
  constexpr int most = 40;
  for (int k = 0; k < most; ++k) {
    g = unit * fine.gradient(f);
    const Matrix H = unit * coarse.hessian(f);
    Eigen::Matrix4d J = Eigen::Matrix4d::Zero();
    J.topLeftCorner<3, 3>() = Matrix::Identity() + lambda * H;
    J.topRightCorner<3, 1>() = g;
    J.bottomLeftCorner<1, 3>() = g.transpose();
    Eigen::Vector4d residual;
    residual.head<3>() = f - x + lambda * g;
    residual[3] = unit * fine.at(f);
    const Eigen::Vector4d step = J.partialPivLu().solve(residual);
    if (!step.allFinite()) return std::nullopt;
    // Steps of many spacings would leave the part of the surface that is near.
    const double length = step.head<3>().norm(), share = length > spacing_ ? spacing_ / length : 1;
    f -= share * step.head<3>();
    lambda -= share * step[3];
    if (length > 1e-9 * spacing_) continue;
    const double slope = g.norm();
    if (!(slope > 0)) return std::nullopt;
    const Vector n = g / slope;
    const Matrix along = Matrix::Identity() - n * n.transpose(), shape = along * H * along / slope;
    const double depth = (f - x).dot(n);
    return Foot{point(f), depth, stretch_of(shape, depth)};
  }
  return std::nullopt;
}

}  // namespace perikit
