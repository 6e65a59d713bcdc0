#include "warnings/small_strains.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "perikit/core/rank_values.hpp"
#include "perikit/core/warnings.hpp"
#include "perikit/model/stabilization.hpp"
#include "setup/materials.hpp"

namespace perikit {

namespace {

/// A strain, or a rotation in radians, of which the square is no longer small beside it.
constexpr double small = 0.1;

using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Of F = R U: the largest principal stretch less 1, and the angle of R.
struct Deformation {
  double strain = 0, rotation = 0;
};

Deformation deformation(const Matrix& F) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d R = svd.matrixU() * svd.matrixV().transpose();
  return {(svd.singularValues().array() - 1).abs().maxCoeff(), std::acos(std::clamp((R.trace() - 1) / 2, -1.0, 1.0))};
}

}  // namespace

SmallStrains::SmallStrains(const Scene& scene, const PartFactory& factory, const BodyProblem& problem) : problem_(problem) {
  if (!problem.terms().has_gradients()) return;
  const auto add = [&](const PartValues& values) {
    const Part part{values.kind, values.type, {}};
    if (std::ranges::find(parts_, part) == parts_.end()) parts_.push_back(part);
  };
  const auto sources = materials(scene);
  for (std::size_t id = 0; id < sources.size(); ++id)
    if (!problem.laws().records()[id].traits.objective) add(*sources[id]);
  penalty_ = scene.stabilization && problem.dimension() > 1 && !factory.stabilization(*scene.stabilization)->traits().isotropic;
  if (penalty_) add(*scene.stabilization);
}

void SmallStrains::tell_limits(PartCatalogue& parts) {
  for (Part& part : parts_) part.limits = parts.describe(part.kind, part.type).limits;
}

std::string SmallStrains::with() const {
  std::string text;
  for (const Part& part : parts_) {
    text += fmt::format("{}{} \"{}\"", text.empty() ? "" : ", and ", name(part.kind), part.type);
    text += part.limits.empty() ? ", which is for small strains and rotations only" : fmt::format(" ({})", part.limits);
  }
  return text;
}

std::string SmallStrains::look(PointFields& fields, double time) {
  const Body& body = problem_.body();
  const Field damage = problem_.terms().damage();
  double worst = 0;
  Deformation there;
  Point place{};
  constexpr std::size_t piece = 1 << 14;
  const std::span<const std::int32_t> owned = body.owned();
  for (std::size_t first = 0; first < owned.size(); first += piece) {
    const auto points = owned.subspan(first, std::min(piece, owned.size() - first));
    const OutputField F = fields.at("deformation_gradient", points);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto p = static_cast<std::size_t>(points[k]);
      const bool law = !problem_.laws().record_of(p).traits.objective;
      // Beside a crack a gradient is the opening of the crack as much as the strain of the body.
      if (!(law || penalty_) || damage.data()[p] > 0) continue;
      const Matrix gradient = Eigen::Map<const Matrix>(F.data.data() + 9 * k);
      if (!gradient.allFinite() || (gradient - Matrix::Identity()).squaredNorm() <= small * small) continue;
      const Deformation now = deformation(gradient);
      const double value = law ? std::max(now.strain, now.rotation) : now.rotation;
      if (!(value > worst)) continue;
      worst = value, there = now, place = body.position(p);
    }
  }
  ++frames_;
  const double of_all = communicator().largest(worst);
  if (!(of_all > small)) return {};
  if (of_all > worst_) worst_ = of_all, worst_time_ = time;
  if (++beyond_ > 1) return {};
  const std::string mine = named("small_strains", fmt::format("warning: time {:.6g}: a strain of {:.3g} and a rotation of {:.3g} rad at ({:.6g}, {:.6g}, {:.6g}), with {}", time, there.strain, there.rotation, place[0],
                                       place[1], place[2], with()));
  return first_message(worst == of_all ? mine : "");
}

std::string SmallStrains::closing() const {
  if (beyond_ == 0) return {};
  return named("small_strains", fmt::format("warning: strains or rotations were not small in {} of {} frames, at most {:.3g} at time {:.6g} (more than {}), with {}", beyond_, frames_, worst_, worst_time_, small, with()));
}

}  // namespace perikit
