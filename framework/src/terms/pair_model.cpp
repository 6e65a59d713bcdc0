#include "terms/pair_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "assembly/pair_assembly.hpp"
#include "families/family_point.hpp"
#include "operators/samples.hpp"

namespace perikit {

namespace {

/// Stiffness of the bonds of a family against a homogeneous stretch along each axis: 1/2 sum_j V_j w''(0) (|xi| cos^2)^2.
template <int D>
std::array<double, D> axial_stiffness(const PairKinematics& law, double modulus, const std::vector<FamilyBond>& bonds) {
  const std::size_t n = padded(bonds.size());
  AlignedVector<double> length(n, 1.0), omega(n, 0.0), rest(n, 0.0), moduli(n, modulus), stiffness(n, 0.0);
  for (std::size_t k = 0; k < bonds.size(); ++k) {
    length[k] = bonds[k].length;
    omega[k] = bonds[k].omega;
  }
  law.bond_law({static_cast<int>(bonds.size()), length.data(), omega.data(), rest.data(), moduli.data(), nullptr, nullptr, stiffness.data()});
  std::array<double, D> sum{};
  for (std::size_t k = 0; k < bonds.size(); ++k)
    for (std::size_t a = 0; a < D; ++a) {
      const double extension = bonds[k].xi[a] * bonds[k].xi[a] / bonds[k].length;
      sum[a] += 0.5 * bonds[k].volume * stiffness[k] * extension * extension;
    }
  return sum;
}

double weighted_volume(const std::vector<FamilyBond>& bonds, bool intact_only) {
  double m = 0;
  for (const FamilyBond& b : bonds) m += (intact_only ? b.integrity : 1.0) * b.omega * b.length * b.length * b.volume;
  return m;
}

/// A whole family of a regular lattice with the spacing of the body.
template <int D>
std::vector<FamilyBond> regular_family(const Body& body, const InfluenceFunction& influence, bool uses_influence) {
  Lattice lattice;
  lattice.dimension = D;
  lattice.spacing = body.spacing();
  lattice.extent.fill(std::int64_t{1} << 20);
  for (std::size_t a = D; a < 3; ++a) lattice.extent[a] = 1;
  std::vector<FamilyBond> bonds;
  std::vector<double> r, omega;
  const double volume = body.section() * std::pow(body.spacing(), D);
  for (const auto& d : family_offsets(lattice, body.horizon())) {
    FamilyBond bond{{}, 0, 1, volume, 1};
    double square = 0;
    for (std::size_t a = 0; a < D; ++a) {
      bond.xi[a] = d[a] * body.spacing();
      square += bond.xi[a] * bond.xi[a];
    }
    bond.length = std::sqrt(square);
    r.push_back(std::min(1.0, bond.length / body.horizon()));
    bonds.push_back(bond);
  }
  omega.resize(r.size());
  influence.evaluate(r, omega);
  for (std::size_t k = 0; k < bonds.size() && uses_influence; ++k) bonds[k].omega = omega[k];
  return bonds;
}

}  // namespace

template <int D>
PairModel<D>::PairModel(const ModelParts& parts)
    : AssemblingModel(parts), body_(*parts.body), laws_(*parts.laws), formulation_(parts.formulation), law_(*formulation_.pairs),
      share_(parts.share), damage_(body_.make_field(1)) {
  const PairLoopParts loop{body_, *parts.influence, law_, fields_, share_, parts.skip};
  loop_ = body_.lattice() ? make_lattice_pairs<D>(loop) : make_cloud_pairs<D>(loop);
  if (formulation_.dilatation) {
    for (Field* field : {&scale_, &dilatation_modulus_, &theta_, &q_}) *field = body_.make_field(1);
  }
  set_moduli();
  if (formulation_.pair_traits.surface_correction) set_correction(*parts.influence);
  if (parts.damage) this->watch_bonds(loop_->bond_state());
}

template <int D>
PairPoint PairModel<D>::point(std::size_t p) const {
  return {family_point(body_, laws_, p), 0, 1};
}

template <int D>
bool PairModel<D>::set_moduli_of(const std::vector<FamilyBond>& bonds, const std::vector<std::int32_t>& points, Field& modulus) {
  double whole = 0, intact = 0;
  for (const FamilyBond& b : bonds) {
    whole += b.omega * b.volume;
    intact += b.integrity * b.omega * b.volume;
  }
  const double m = weighted_volume(bonds, true), share = whole > 0 ? intact / whole : 0.0;
  PairPoint x;
  PairModuli moduli;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto p = static_cast<std::size_t>(points[k]);
    damage_.data()[p] = whole > 0 ? 1 - share : 0.0;
    if (m > 0 && (k == 0 || !laws_.single())) {
      x = point(p);
      x.weighted_volume = m;
      x.intact = share;
      moduli = law_.moduli(x);
      const MaterialRecord* record = &laws_.record_of(p);
      if (std::find(warned_.begin(), warned_.end(), record) == warned_.end()) {
        const std::string warning = law_.warning(x);
        if (!warning.empty()) {
          warned_.push_back(record);
          if (std::find(warnings_.begin(), warnings_.end(), warning) == warnings_.end()) warnings_.push_back(warning);
        }
      }
    }
    // A point without bonds is a free mass: nothing to divide by, nothing stored.
    if (modulus.size() > 0) modulus.data()[p] = moduli.bond;
    if (!formulation_.dilatation) continue;
    scale_.data()[p] = m > 0 ? D / m : 0.0;
    dilatation_modulus_.data()[p] = moduli.dilatation;
  }
  return m > 0;
}

template <int D>
void PairModel<D>::set_moduli() {
  Field modulus = body_.make_field(1);
  loop_->families([&](const std::vector<FamilyBond>& bonds, const std::vector<std::int32_t>& points) {
    if (!set_moduli_of(bonds, points, modulus)) lone_ += points.size();
  });
  if (share_ && laws_.single() && formulation_.pair_traits.constant_moduli && !formulation_.pair_traits.surface_correction) {
    fields_.uniform = law_.moduli(point(static_cast<std::size_t>(body_.internal().front()))).bond;
  } else {
    fields_.modulus = std::move(modulus);
  }
}

template <int D>
std::vector<BondChange> PairModel<D>::bonds_changed(std::span<const std::int32_t> points) {
  loop_->families_of(points, [&](const std::vector<FamilyBond>& bonds, const std::vector<std::int32_t>& one) { set_moduli_of(bonds, one, fields_.modulus); });
  return {};
}

template <int D>
double PairModel<D>::energy_of(ConstFieldView u, const GroupMarks& marks) {
  if (density_.size() == 0) density_ = body_.make_field(2);
  if (formulation_.dilatation) dilatation(u, {}, nullptr, density_.component(1), marks.data());
  loop_->run({PairWork::energy, u, {}, q_, {}, {density_.data(), density_.stride(), 1}, nullptr, marks.data()});
  double energy = 0;
  for (std::size_t p = 0; p < body_.stride(); ++p) {
    if (marks[p / padding] && body_.alive(p)) energy += body_.volume(p) * (density_.component(0)[p] + density_.component(1)[p]);
  }
  return energy;
}

template <int D>
void PairModel<D>::set_correction(const InfluenceFunction& influence) {
  fields_.correction = body_.make_field(D);
  const std::vector<FamilyBond> regular = regular_family<D>(body_, influence, formulation_.pair_traits.influence);
  // Pre-cracks weaken a body on purpose: the correction is that of the uncut family.
  loop_->families([&](const std::vector<FamilyBond>& bonds, const std::vector<std::int32_t>& points) {
    const auto stiffness = [&](const std::vector<FamilyBond>& family, PairPoint x) {
      x.weighted_volume = weighted_volume(family, false);
      return axial_stiffness<D>(law_, law_.moduli(x).bond, family);
    };
    std::array<double, D> G;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto p = static_cast<std::size_t>(points[k]);
      if (k == 0 || !laws_.single()) {
        G.fill(1.0);
        if (!bonds.empty()) {
          PairPoint x = point(p);
          if (!(x.bulk() > 0)) x.moduli = {1, 1};   // ghosts: the correction is one of shape
          const auto own = stiffness(bonds, x), exact = stiffness(regular, x);
          for (std::size_t a = 0; a < D; ++a)
            if (own[a] > 0) G[a] = exact[a] / own[a];
        }
      }
      for (int a = 0; a < D; ++a) fields_.correction.component(a)[p] = G[static_cast<std::size_t>(a)];
    }
  });
}

template <int D>
EvaluationStatus PairModel<D>::dilatation(ConstFieldView u, ConstFieldView w, std::vector<double>* energies, double* density, const std::uint8_t* only) {
  const std::int64_t bad = loop_->run({PairWork::dilatation, u, {}, {}, {}, theta_, nullptr, only});
  if (bad >= 0) return status_at(body_, bad);
  const bool rates = w.data != nullptr;
  if (rates) {
    if (rate_.size() == 0) rate_ = body_.make_field(1);
    loop_->run({PairWork::dilatation_rate, u, w, {}, {}, rate_, nullptr});
  }
  // Points in batches; padding has d/m = 0.
  const std::size_t stride = body_.stride(), batches = (stride + batch_points - 1) / batch_points;
  if (energies) energies->assign(batches, 0.0);
  parallel_for(batches, [&](std::size_t b) {
    const std::size_t first = b * batch_points;
    const int n = static_cast<int>(std::min<std::size_t>(batch_points, stride - first));
    if (only && std::none_of(only + first / padding, only + (first + static_cast<std::size_t>(n)) / padding, [](std::uint8_t m) { return m != 0; })) return;
    alignas(64) double theta[batch_points], phi[batch_points], pressure[batch_points], stiffness[batch_points];
    const double* scale = scale_.data() + first;
    for (int l = 0; l < n; ++l) theta[l] = scale[l] * theta_.data()[first + static_cast<std::size_t>(l)];
    formulation_.dilatation->evaluate({n, theta, dilatation_modulus_.data() + first,
                                       energies || density ? phi : nullptr, pressure, rates ? stiffness : nullptr});
    for (int l = 0; l < n; ++l) {
      const std::size_t p = first + static_cast<std::size_t>(l);
      q_.data()[p] = scale[l] * pressure[l];
      if (rates) rate_.data()[p] *= scale[l] * scale[l] * stiffness[l];
      if (density) density[p] = body_.alive(p) ? phi[l] : 0.0;
      if (energies && body_.alive(p)) (*energies)[b] += body_.volume(p) * phi[l];
    }
  });
  return {};
}

template <int D>
EvaluationStatus PairModel<D>::forces(ConstFieldView u, FieldView force, double* energy) {
  std::vector<double> volumetric, bonds(energy ? loop_->blocks() : 0, 0.0);
  if (formulation_.dilatation) {
    const EvaluationStatus status = dilatation(u, {}, energy ? &volumetric : nullptr, nullptr);
    if (!status.ok()) return status;
  }
  const std::int64_t bad = loop_->run({PairWork::force, u, {}, q_, {}, force, energy ? bonds.data() : nullptr});
  if (energy) {
    *energy = 0;
    for (const std::vector<double>* parts : {&volumetric, &bonds})
      for (const double e : *parts) *energy += e;
  }
  return status_at(body_, bad);
}

template <int D>
EvaluationStatus PairModel<D>::tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) {
  if (formulation_.dilatation) {
    const EvaluationStatus status = dilatation(u, w, nullptr, nullptr);
    if (!status.ok()) return status;
  }
  return status_at(body_, loop_->run({PairWork::tangent, u, w, q_, rate_, Kw, nullptr}));
}

template <int D>
std::unique_ptr<Assembly> PairModel<D>::make_assembly(const ModelParts& parts) const {
  return std::make_unique<PairAssembly<D>>(parts, PairPoints{fields_, scale_, dilatation_modulus_});
}

template <int D>
EvaluationStatus PairModel<D>::sample(ConstFieldView u, PointSamples& samples) {
  samples = {};
  samples.strain_energy_density = body_.make_field(1);
  Field volumetric = body_.make_field(1);
  if (formulation_.dilatation) {
    const EvaluationStatus status = dilatation(u, {}, nullptr, volumetric.data());
    if (!status.ok()) return status;
  }
  const std::int64_t bad = loop_->run({PairWork::energy, u, {}, q_, {}, samples.strain_energy_density, nullptr});
  for (std::size_t p = 0; p < body_.stride(); ++p) samples.strain_energy_density.data()[p] += volumetric.data()[p];
  return status_at(body_, bad);
}

template <int D>
ModelReport PairModel<D>::report() const {
  const PairCounts counts = loop_->counts();
  ModelReport report;
  report.bonds = counts.bonds;
  report.broken_bonds = counts.broken;
  report.singular_families = lone_;
  report.evaluation_points = share_ ? counts.bonds / 2 : counts.bonds;
  report.bytes = counts.bytes;
  for (const Field* field : {&damage_, &scale_, &dilatation_modulus_, &theta_, &q_, &rate_, &fields_.modulus, &fields_.correction, &density_}) report.bytes += field->bytes();
  report.bytes += this->fracture_bytes();
  report.warnings = warnings_;
  report.skips.push_back({"bond vectors and lengths", body_.lattice() ? "lattice: neighbours lie at fixed shifts" : "recomputed from positions",
                          fmt::format("{:.3g} MB", static_cast<double>(counts.recomputed) / 1e6)});
  report.skips.push_back({"deformation gradients and stresses", "pair law", "shape tensors, one material evaluation a point or bond"});
  if (share_) report.skips.push_back({"second evaluation of each bond", "both ends feel opposite forces", fmt::format("{} of {} evaluations", counts.bonds / 2, counts.bonds)});
  if (share_ && fields_.modulus.size() == 0) report.skips.push_back({"moduli by point", "one material, no surface correction", fmt::format("{:.3g} MB", static_cast<double>(body_.stride()) * 8e-6)});
  return report;
}

template class PairModel<1>;
template class PairModel<2>;
template class PairModel<3>;

}  // namespace perikit
