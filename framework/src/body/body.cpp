#include "perikit/body/body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "perikit/body/point_file.hpp"
#include "size_check.hpp"

namespace perikit {

namespace {

/// Uniform in [-1, 1), the same on every platform.
double centred(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1.0p-52 - 1.0; }

void check_cloud(const Scene& scene, std::size_t points, double ratio) {
  check_index(scene, static_cast<double>(points));
  check_horizon(scene, ratio);
  check_memory(scene, static_cast<double>(points), ratio, true);
}

}  // namespace

Body::Body(const Scene& scene, bool lists) : dimension_(scene.body.dimension), space_(scene.body.space), section_(scene.body.section) {
  for (const CrackDescription& crack : scene.cracks) cracks_.emplace_back(crack.vertices);
  if (scene.body.lattice) {
    spacing_ = scene.body.lattice->spacing;
    horizon_ = scene.horizon > 0 ? scene.horizon : scene.horizon_ratio * spacing_;
    place_lattice(scene, lists);
  } else {
    PointCloud cloud = read_points(*scene.body.points_file, dimension_);
    double total = 0;
    for (double& v : cloud.volume) total += v;
    spacing_ = std::pow(total / section_ / static_cast<double>(cloud.volume.size()), 1.0 / dimension_);
    horizon_ = scene.horizon > 0 ? scene.horizon : scene.horizon_ratio * spacing_;
    check_cloud(scene, cloud.volume.size(), horizon_ / spacing_);
    place_cloud(std::move(cloud.position), std::move(cloud.volume));
  }
  if (internal_.empty()) {
    throw InputError(scene.body.lattice->position, "body.lattice.inside",
                     "found an expression that keeps no point of the lattice; allowed: one that is true at one point or more");
  }
  if (horizon_ < spacing_ && !scene.body.lattice) {
    throw InputError(scene.body.position, "family.horizon",
                     fmt::format("found {}; allowed: at least the mean spacing of the points, {:.6g}", horizon_, spacing_));
  }
  collect_sets(scene);
}

Body::Body(const Body& whole, const std::vector<bool>& owned, const std::vector<bool>& kept, std::uint16_t ghost_material)
    : dimension_(whole.dimension_), space_(whole.space_), section_(whole.section_), spacing_(whole.spacing_), horizon_(whole.horizon_),
      margin_(whole.margin_), cracks_(whole.cracks_) {
  std::vector<std::int32_t> place(whole.stride_, -1);   // by internal index of the whole body, kept points
  if (whole.lattice_) {
    for (std::size_t n = 0; n < kept.size(); ++n)
      if (kept[n]) internal_.push_back(whole.internal_[n]);
    number_lattice(*whole.lattice_, whole.uniform_volume_);
    for (const std::int32_t p : internal_) place[static_cast<std::size_t>(p)] = p;
  } else {
    std::vector<Point> positions;
    std::vector<double> volumes;
    std::vector<std::int32_t> from;
    for (std::size_t n = 0; n < kept.size(); ++n) {
      if (!kept[n]) continue;
      const auto p = static_cast<std::size_t>(whole.internal_[n]);
      from.push_back(whole.internal_[n]);
      positions.push_back(whole.position(p));
      volumes.push_back(whole.volume(p));
    }
    place_cloud(std::move(positions), std::move(volumes));
    for (std::size_t n = 0; n < from.size(); ++n) place[static_cast<std::size_t>(from[n])] = internal_[n];
  }
  const auto is_owned = [&](std::int32_t p) { return owned[static_cast<std::size_t>(whole.input_of(static_cast<std::size_t>(p)))]; };
  for (const auto& [name, members] : whole.sets_)
    for (const std::int32_t p : members)
      if (is_owned(p)) sets_[name].push_back(place[static_cast<std::size_t>(p)]);
      else sets_[name];
  material_ids_.assign(stride_, ghost_material);
  for (const std::int32_t p : whole.internal_) {
    if (is_owned(p))
      material_ids_[static_cast<std::size_t>(place[static_cast<std::size_t>(p)])] = whole.material_ids_.empty() ? std::uint16_t{0} : whole.material_ids_[static_cast<std::size_t>(p)];
  }
}

void Body::place_lattice(const Scene& scene, bool lists) {
  const LatticeDescription& description = *scene.body.lattice;
  double estimate = 1;
  for (int a = 0; a < dimension_; ++a) estimate *= std::max(1.0, (description.upper[a] - description.lower[a]) / spacing_ + 1);
  const bool jittered = description.jitter > 0;
  // What `inside` leaves is known after it was asked for every cell.
  check_index(scene, estimate);
  check_horizon(scene, horizon_ / spacing_);
  if (!description.inside) check_memory(scene, estimate, horizon_ / spacing_, jittered);
  Lattice lattice = make_lattice(dimension_, spacing_, description.lower, description.upper, horizon_);
  std::array<std::int64_t, 3> cells{1, 1, 1}, along{};
  for (int k = 0; k < 3; ++k) {
    cells[static_cast<std::size_t>(lattice.axis[k])] = lattice.extent[k];
    along[static_cast<std::size_t>(lattice.axis[k])] = k;
  }
  for (int a = 0; a < dimension_; ++a) {
    if (cells[static_cast<std::size_t>(a)] < 1) {
      throw InputError(
          description.position, "body.lattice",
          fmt::format("found no room for a point along {}; allowed: upper - lower of half a spacing or more", "xyz"[a]));
    }
  }
  internal_.reserve(static_cast<std::size_t>(cells[0] * cells[1] * cells[2]));
  std::array<std::int64_t, 3> k{};
  for (k[2] = 0; k[2] < cells[2]; ++k[2])
    for (k[1] = 0; k[1] < cells[1]; ++k[1])
      for (k[0] = 0; k[0] < cells[0]; ++k[0]) {   // input order: x fastest
        std::array<std::int64_t, 3> inner{};
        for (std::size_t a = 0; a < 3; ++a) inner[static_cast<std::size_t>(along[a])] = k[a];
        const std::int64_t index = lattice.index(inner[0], inner[1], inner[2]);
        if (description.inside && (*description.inside)(lattice.position(index)) == 0.0) continue;
        internal_.push_back(static_cast<std::int32_t>(index));
      }
  const double volume = std::pow(spacing_, dimension_) * section_;
  // Jitter needs a cloud; so does a body that fills so little of its box that dead cells would dominate.
  const bool sparse = static_cast<double>(internal_.size()) < 0.08 * static_cast<double>(cells[0] * cells[1] * cells[2]);
  if (jittered || lists || (sparse && !internal_.empty())) {
    std::mt19937_64 random(static_cast<std::uint64_t>(description.seed));
    check_cloud(scene, internal_.size(), horizon_ / spacing_);
    std::vector<Point> positions;
    positions.reserve(internal_.size());
    for (const std::int32_t index : internal_) {
      Point x = lattice.position(index);
      for (int a = 0; a < dimension_ && jittered; ++a) x[static_cast<std::size_t>(a)] += description.jitter * spacing_ * centred(random);
      positions.push_back(x);
    }
    std::vector<double> volumes(positions.size(), volume);
    place_cloud(std::move(positions), std::move(volumes));
    return;
  }
  check_memory(scene, static_cast<double>(lattice.cells), horizon_ / spacing_, false);
  number_lattice(lattice, volume);
}

/// What follows from the lattice and the cells that are kept.
void Body::number_lattice(const Lattice& lattice, double volume) {
  stride_ = static_cast<std::size_t>(lattice.cells);
  margin_ = padding;
  uniform_volume_ = volume;
  lattice_ = lattice;
  input_.assign(stride_, -1);
  alive_.assign(stride_ / 8, 0);
  for (std::size_t p = 0; p < internal_.size(); ++p) {
    const auto index = static_cast<std::size_t>(internal_[p]);
    input_[index] = static_cast<std::int32_t>(p);
    alive_[index / 8] |= static_cast<std::uint8_t>(1u << (index % 8));
  }
}

void Body::place_cloud(std::vector<Point> positions, std::vector<double> volumes) {
  const std::vector<std::int32_t> order = morton_order(positions, horizon_);
  const std::size_t n = positions.size();
  stride_ = padded(n);
  margin_ = padding;
  internal_.resize(n);
  input_.assign(stride_, -1);
  alive_.assign(stride_ / 8, 0);
  positions_.assign(4 * stride_, 0.0);
  for (std::size_t p = 0; p < n; ++p) {
    const auto from = static_cast<std::size_t>(order[p]);
    internal_[from] = static_cast<std::int32_t>(p);
    input_[p] = order[p];
    alive_[p / 8] |= static_cast<std::uint8_t>(1u << (p % 8));
    for (std::size_t c = 0; c < 3; ++c) positions_[4 * p + c] = positions[from][c];
    positions_[4 * p + 3] = volumes[from];
  }
}

std::int32_t Body::input_of(std::size_t internal_index) const noexcept { return input_[internal_index]; }

Point Body::position(std::size_t p) const noexcept {
  if (lattice_) return lattice_->position(static_cast<std::int64_t>(p));
  return {positions_[4 * p], positions_[4 * p + 1], positions_[4 * p + 2]};
}

bool Body::cut(const Point& a, const Point& b) const noexcept {
  return std::any_of(cracks_.begin(), cracks_.end(), [&](const Crack& crack) { return crack.cuts(a, b); });
}

void Body::collect_sets(const Scene& scene) {
  sets_["all"] = internal_;
  for (const SetDescription& description : scene.sets) {
    std::vector<std::int32_t>& members = sets_[description.name];
    const std::string key = "sets." + description.name;
    if (description.expression) {
      for (const std::int32_t p : internal_) {
        if ((*description.expression)(position(static_cast<std::size_t>(p))) != 0.0) members.push_back(p);
      }
    } else if (description.nearest) {
      double best = std::numeric_limits<double>::infinity();
      for (const std::int32_t p : internal_) {
        const Point x = position(static_cast<std::size_t>(p));
        double r2 = 0;
        for (std::size_t c = 0; c < 3; ++c) r2 += (x[c] - (*description.nearest)[c]) * (x[c] - (*description.nearest)[c]);
        // Ties within rounding go to the first point.
        if (r2 < best * (1 - 1e-12)) {
          best = r2;
          members.assign(1, p);
        }
      }
    } else {
      for (const std::int64_t p : description.points) {
        if (p < 0 || static_cast<std::size_t>(p) >= internal_.size()) {
          throw InputError(description.position, key,
                           fmt::format("found the point {}; allowed: 0 to {}", p, internal_.size() - 1));
        }
        const std::int32_t index = internal_[static_cast<std::size_t>(p)];
        if (std::find(members.begin(), members.end(), index) != members.end()) {
          throw InputError(description.position, key, fmt::format("found the point {} twice; allowed: each point once", p));
        }
        members.push_back(index);
      }
    }
    if (members.empty())
      throw InputError(description.position, key,
                       "found a condition that holds at no point; allowed: one that holds at one point or more");
  }
  if (scene.regions.empty()) return;
  material_ids_.assign(stride_, 0);
  for (std::size_t r = 0; r < scene.regions.size(); ++r) {
    for (const std::int32_t p : set(scene.regions[r].set)) material_ids_[static_cast<std::size_t>(p)] = static_cast<std::uint16_t>(r + 1);
  }
}

std::size_t Body::bytes() const noexcept {
  return (internal_.size() + input_.size()) * sizeof(std::int32_t) + positions_.size() * sizeof(double) +
         alive_.size() + material_ids_.size() * sizeof(std::uint16_t);
}

}  // namespace perikit
