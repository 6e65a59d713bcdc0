#include "terms/pairs/pair_forces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/dimension.hpp"
#include "families/bond_stretch.hpp"
#include "perikit/core/warnings.hpp"
#include "terms/family_point.hpp"
#include "terms/pairs/pair_assembly.hpp"

namespace perikit {

template <int D>
PairForces<D>::PairForces(const PairParts& parts)
    : families_(parts.families), body_(families_.body()), laws_(parts.laws), interfaces_(parts.interfaces), formulation_(parts.formulation), law_(*formulation_.pairs), share_(parts.share), factors_(parts.factors) {
  if (formulation_.dilatation) {
    for (Field* field : {&scale_, &dilatation_modulus_, &theta_, &q_}) *field = body_.make_field(1);
  }
  fields_.factors = factors_.get();
  Field modulus = body_.make_field(1);
  FamilyArrays family;
  families_.each_class([&](std::span<const std::int32_t> points) {
    families_.load(static_cast<std::size_t>(points[0]), BondsOf::uncut, family);
    set_moduli(family, points, modulus);
  });
  // Points with incomplete families have a record of their own, and no bond that anybody feels.
  const std::vector<MaterialRecord>& records = laws_.records();
  const bool one_law = laws_.single() || (records.size() == 2 && records[0].uniform && records[1].incomplete);
  if (share_ && one_law && formulation_.pair_traits.constant_moduli) {
    fields_.uniform = law_.moduli(point(static_cast<std::size_t>(body_.owned().front()))).bond;
  } else {
    fields_.modulus = std::move(modulus);
  }
  const PairLoopParts loop{families_, formulation_, fields_, share_, parts.skip};
  loop_ = families_.lattice() ? make_lattice_pairs<D>(loop) : make_cloud_pairs<D>(loop);
  if (interfaces_) set_sides();
  if (parts.images) {
    const auto internal = body_.internal();
    const std::size_t real = internal.size() - parts.images->size();
    for (std::size_t k = 0; k < parts.images->size(); ++k)
      images_.push_back({internal[real + k], internal[static_cast<std::size_t>(parts.images->source[k])]});
  }
}

template <int D>
void PairForces<D>::set_sides() {
  fields_.near.assign(body_.stride() / padding, 0);
  fields_.sides = body_.make_field(PairFields::side_components);
  for (const std::int32_t index : body_.internal()) {
    const auto p = static_cast<std::size_t>(index);
    fields_.sides.component(PairFields::material)[p] = interfaces_->material[p];
    fields_.sides.component(PairFields::stores)[p] = laws_.record_of(p).silent ? 0.0 : 1.0;
  }
  for (const Interface& interface : interfaces_->all)
    for (std::size_t k = 0; k < interface.point.size(); ++k) {
      const auto p = static_cast<std::size_t>(interface.point[k]);
      // Of several interfaces the nearest one.
      double& distance = fields_.sides.component(PairFields::distance)[p];
      const double found = std::abs(interface.distance[k]);
      distance = distance > 0 ? std::min(distance, found) : found;
      fields_.near[p / padding] = 1;
      // Of the material, which a point far from this rank's does not have; laws that vary in space have none.
      const MaterialRecord& record = laws_.records()[interfaces_->material[p]];
      if (!record.uniform) continue;
      PairPoint whole = point(p);
      whole.moduli = record.material->small_strain(record.constants.data());
      whole.weighted_volume = 1;
      fields_.sides.component(PairFields::of_material)[p] = law_.moduli(whole).bond;
    }
  renew_sides();
}

/// Moduli have changed.
template <int D>
void PairForces<D>::renew_sides() {
  double* const stiffness = fields_.sides.component(PairFields::stiffness);
  for (const Interface& interface : interfaces_->all)
    for (const std::int32_t p : interface.point) stiffness[p] = fields_.modulus.data()[interfaces_->source[static_cast<std::size_t>(p)]];
}

template <int D>
void PairForces<D>::show_bonds_to_images(bool whole) {
  for (const auto& [image, source] : images_) {
    fields_.modulus.data()[image] = whole ? fields_.modulus.data()[source] : 0.0;
    if (interfaces_) fields_.sides.component(PairFields::stores)[image] = whole ? 1.0 : 0.0;
  }
}

template <int D>
PairPoint PairForces<D>::point(std::size_t p) const {
  return {family_point(body_, laws_, p), 0, 1};
}

template <int D>
void PairForces<D>::warn(const PairPoint& x, const MaterialRecord& record) {
  if (std::find(warned_.begin(), warned_.end(), &record) != warned_.end()) return;
  const std::string told = law_.warning(x);
  if (told.empty()) return;
  const std::string warning = warning_name(told).empty() ? named("pair_law", told) : told;
  warned_.push_back(&record);
  if (std::find(warnings_.begin(), warnings_.end(), warning) == warnings_.end()) warnings_.push_back(warning);
}

template <int D>
void PairForces<D>::set_moduli(const FamilyArrays& family, std::span<const std::int32_t> points, Field& modulus) {
  const double intact = 1 - families_.damage(static_cast<std::size_t>(points[0]));
  const bool own_factors = fields_.factors->of_dilatation;   // which points with equal families need not have alike
  FamilyArrays own;
  double m = 0;
  PairModuli moduli;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto p = static_cast<std::size_t>(points[k]);
    const bool anew = k == 0 || (own_factors && !fields_.factors->same(static_cast<std::size_t>(points[k - 1]), p));
    if (anew) {
      if (k > 0) families_.load(p, BondsOf::uncut, own);
      m = fields_.factors->weighted_volume(families_, p, k > 0 ? own : family);
    }
    if (m > 0 && (anew || !laws_.single())) {
      PairPoint x = point(p);
      x.weighted_volume = m;
      x.intact = intact;
      moduli = law_.moduli(x);
      if (x.bulk() > 0) warn(x, laws_.record_of(p));   // not of ghosts and images
    }
    // A point without bonds is a free mass: nothing to divide by, nothing stored.
    if (modulus.size() > 0) modulus.data()[p] = moduli.bond;
    if (!formulation_.dilatation) continue;
    scale_.data()[p] = m > 0 ? D / m : 0.0;
    dilatation_modulus_.data()[p] = moduli.dilatation;
  }
}

template <int D>
void PairForces<D>::bonds_changed(std::span<const std::int32_t> points) {
  FamilyArrays family;
  for (const std::int32_t p : points) {
    families_.load(static_cast<std::size_t>(p), BondsOf::uncut, family);
    set_moduli(family, {&p, 1}, fields_.modulus);
  }
  if (interfaces_) renew_sides();
}

template <int D>
void PairForces<D>::load_bonds(std::size_t p, ConstFieldView u, Bonds& bonds) const {
  FamilyArrays& family = bonds.family;
  families_.load(p, BondsOf::intact, family);
  for (auto* array : {&bonds.extension, &bonds.modulus, &bonds.omega, &bonds.factor, &bonds.energy, &bonds.force}) array->assign(family.size, 0.0);
  for (std::size_t k = 0; k < family.far.size(); ++k) {
    const auto far = static_cast<std::size_t>(family.far[k]);
    bonds.omega[k] = family.whole_omega(k);
    bonds.extension[k] = bond_stretch(family, k, p, u) * family.length[k];
    double& modulus = bonds.modulus[k];
    bonds.factor[k] = fields_.factors->of(families_, p, far);
    modulus = bonds.factor[k] * fields_.of_bond(p, far);
    if (!fields_.factors->of_dilatation) bonds.factor[k] = 1;
  }
  law_.bond_law({family.bonds, family.length.data(), bonds.omega.data(), bonds.extension.data(), bonds.modulus.data(),
                 bonds.energy.data(), bonds.force.data(), nullptr});
}

template <int D>
double PairForces<D>::poisson(std::size_t p) const noexcept {
  if (D == 1 || formulation_.dilatation) return laws_.moduli(p).poisson();
  return laws_.space() == Space::plane_stress ? 1.0 / 3 : 1.0 / 4;
}

namespace {

/// F - I, row by row in the space of the body, over the bonds that are left; zero where they span no volume.
template <int D>
std::array<double, D * D> family_gradient(FamilyArrays& family, double horizon, std::size_t p, ConstFieldView u, std::vector<double>& g) {
  find_inverse_shape(family);
  point_gradient(family, horizon, 1, g);
  std::array<double, D * D> H{};
  for (std::size_t k = 0; k < family.far.size(); ++k)
    for (std::size_t a = 0; a < D; ++a) {
      const double* const of = u.component(static_cast<int>(a));
      for (std::size_t e = 0; e < D; ++e) H[a * D + e] += (of[family.far[k]] - of[p]) * g[k * D + e];
    }
  return H;
}

template <int D>
double determinant(std::array<double, D * D> H) {
  for (std::size_t a = 0; a < D; ++a) H[a * D + a] += 1;
  if constexpr (D == 1) return H[0];
  else if constexpr (D == 2) return H[0] * H[3] - H[1] * H[2];
  else return H[0] * (H[4] * H[8] - H[5] * H[7]) - H[1] * (H[3] * H[8] - H[5] * H[6]) + H[2] * (H[3] * H[7] - H[4] * H[6]);
}

}  // namespace

template <int D>
void PairForces<D>::add_tensors(ConstFieldView u, PointSamples& samples) const {
  const auto field = [&](Sampling of, int components) { return any_of(samples.asked, of) ? body_.make_field(components) : Field(); };
  samples.H = field(Sampling::H, laws_.components());
  samples.P = field(Sampling::P, laws_.components());
  samples.cauchy = field(Sampling::cauchy, 9);
  samples.von_mises = field(Sampling::von_mises, 1);
  const bool gradients = any_of(samples.asked, Sampling::H | Sampling::cauchy | Sampling::von_mises);
  const bool stresses = any_of(samples.asked, Sampling::P | Sampling::cauchy | Sampling::von_mises);
  if (!gradients && !stresses) return;
  const bool stress_space = laws_.space() == Space::plane_stress || laws_.space() == Space::line_stress;
  parallel_for(body_.stride() / padding, [&](std::size_t group) {
    Bonds bonds;
    std::vector<double> g;
    for (std::size_t p = group * padding; p < (group + 1) * padding; ++p) {
      if (!body_.alive(p) || laws_.record_of(p).silent) continue;
      if (stresses) load_bonds(p, u, bonds);
      else families_.load(p, BondsOf::intact, bonds.family);
      FamilyArrays& family = bonds.family;
      const double nu = D < 3 ? poisson(p) : 0.0, q = formulation_.dilatation ? q_.data()[p] : 0.0;
      double J = 1, across = 1;   // F across the body
      if (gradients) {
        const std::array<double, D * D> H = family_gradient<D>(family, body_.horizon(), p, u, g);
        const double in_space = determinant<D>(H);
        if (in_space > 0) {
          if (stress_space) across = std::pow(in_space, D == 1 ? -nu : -nu / (1 - nu));
          J = in_space * std::pow(across, 3 - D);
        }
        for (int c = 0; c < samples.H.components(); ++c) samples.H.component(c)[p] = c < D * D ? H[static_cast<std::size_t>(c)] : across - 1;
      }
      double P[D][D] = {}, tau[3][3] = {};   // tau = J sigma
      for (std::size_t k = 0; k < family.far.size() && stresses; ++k) {
        const auto far = static_cast<std::size_t>(family.far[k]);
        const double T = 0.5 * bonds.force[k] + bonds.omega[k] * bonds.factor[k] * family.length[k] * fields_.own_strain(p, far) * q,
                     factor = family.b(k) * family.volume[k] * T / (family.length[k] + bonds.extension[k]);
        double y[D];
        for (int a = 0; a < D; ++a) y[a] = family.xi[a][k] + u.component(a)[far] - u.component(a)[p];
        for (int a = 0; a < D; ++a)
          for (int e = 0; e < D; ++e) {
            P[a][e] += factor * y[a] * family.xi[e][k];
            if (e >= a) tau[a][e] += factor * y[a] * y[e];
          }
      }
      double trace = 0;
      for (int a = 0; a < D; ++a) {
        trace += tau[a][a];
        for (int e = 0; e < a; ++e) tau[a][e] = tau[e][a];
      }
      for (int a = D; a < 3 && !stress_space; ++a) tau[a][a] = (D == 1 ? nu / (1 - nu) : nu) * trace;
      for (int c = 0; c < samples.P.components(); ++c) samples.P.component(c)[p] = c < D * D ? P[c / D][c % D] : tau[2][2];
      for (int c = 0; c < samples.cauchy.components(); ++c) samples.cauchy.component(c)[p] = tau[c / 3][c % 3] / J;
      if (samples.von_mises.size() == 0) continue;
      const double dx = tau[0][0] - tau[1][1], dy = tau[1][1] - tau[2][2], dz = tau[2][2] - tau[0][0],
                   off = tau[0][1] * tau[0][1] + tau[1][2] * tau[1][2] + tau[0][2] * tau[0][2];
      samples.von_mises.data()[p] = std::sqrt(0.5 * (dx * dx + dy * dy + dz * dz) + 3 * off) / J;
    }
  });
}

/// b V_i V_j w, and what the bond adds to V_i phi and V_j phi: these are shared as bonds make up theta, phi_i/theta_i d theta_i.
template <int D>
void PairForces<D>::add_bonds(const Configuration& at, const Region& region, BondSamples& samples) {
  const ConstFieldView u = at.u();
  const bool dilates = formulation_.dilatation != nullptr;
  if (dilates) {
    if (density_.size() == 0) density_ = body_.make_field(1);
    dilatation(at, {}, {.evaluated = region.gradients}, nullptr, density_.data());
  }
  const auto by_theta = [&](std::size_t p) {
    const double theta = scale_.data()[p] * theta_.data()[p];
    return theta != 0 ? density_.data()[p] / theta * scale_.data()[p] : 0.0;
  };
  samples.take_both_ways();
  parallel_for(body_.stride() / padding, [&](std::size_t g) {
    if (!(*region.evaluated)[g] || !samples.keeps_group(g)) return;
    Bonds bonds;
    for (std::size_t p = g * padding; p < (g + 1) * padding; ++p) {
      if (!body_.alive(p) || !samples.wants(p)) continue;
      load_bonds(p, u, bonds);
      const FamilyArrays& family = bonds.family;
      const double of_own = dilates ? by_theta(p) : 0.0;
      for (std::size_t k = 0; k < family.far.size(); ++k) {
        const auto far = static_cast<std::size_t>(family.far[k]);
        double w = bonds.energy[k];
        if (dilates)
          w += (of_own * fields_.own_strain(p, far) + by_theta(far) * fields_.own_strain(far, p)) * bonds.omega[k] * bonds.factor[k] * family.length[k] * bonds.extension[k];
        samples.add({static_cast<std::int32_t>(p), family.far[k], 0.0, body_.volume(p) * family.volume[k] * family.b(k) * w});
      }
    }
  });
}

template <int D>
std::int64_t PairForces<D>::dilatation(const Configuration& at, ConstFieldView w, const Region& region, GroupEnergy* energies, double* density,
                                       double* by_theta) {
  // At the rim of `gradients` dilatations are not complete, and not the same on several ranks.
  const std::uint8_t *const only = region.near() ? region.near() : region.only(), *const local = region.near() ? region.only() : nullptr;
  PairPass pass{PairWork::dilatation, at.unfinished(), {}, {}, {}, theta_, nullptr, only, local != nullptr};
  pass.arrival = at.arrival();
  pass.motion = at.motion();
  const std::int64_t bad = loop_->run(pass);
  if (bad >= 0) return bad;
  const bool rates = w.data != nullptr;
  if (rates) {
    if (rate_.size() == 0) rate_ = body_.make_field(1);
    loop_->run({PairWork::dilatation_rate, at.u(), w, {}, {}, rate_, nullptr, only, local != nullptr});
  }
  // Points in batches; padding has d/m = 0.
  const std::size_t stride = body_.stride(), batches = (stride + batch_points - 1) / batch_points;
  parallel_for(batches, [&](std::size_t b) {
    const std::size_t first = b * batch_points;
    const int n = static_cast<int>(std::min<std::size_t>(batch_points, stride - first));
    if (only && std::none_of(only + first / padding, only + (first + static_cast<std::size_t>(n)) / padding, [](std::uint8_t m) { return m != 0; })) return;
    alignas(64) double theta[batch_points], phi[batch_points], pressure[batch_points], stiffness[batch_points];
    const double* scale = scale_.data() + first;
    for (int l = 0; l < n; ++l) theta[l] = scale[l] * theta_.data()[first + static_cast<std::size_t>(l)];
    formulation_.dilatation->evaluate({n, theta, dilatation_modulus_.data() + first,
                                       energies || density || by_theta ? phi : nullptr, pressure, rates ? stiffness : nullptr});
    for (int l = 0; l < n; ++l) {
      const std::size_t p = first + static_cast<std::size_t>(l);
      q_.data()[p] = scale[l] * pressure[l];
      if (rates) rate_.data()[p] *= scale[l] * scale[l] * stiffness[l];
      if (by_theta) by_theta[p] = theta[l] != 0 ? phi[l] / theta[l] * scale[l] : 0.0;
      if (density) density[p] = body_.alive(p) ? phi[l] : 0.0;
      if (energies && body_.alive(p) && (!local || marked(local, p))) energies[p / padding].stored += body_.volume(p) * phi[l];
    }
  });
  return -1;
}

template <int D>
std::int64_t PairForces<D>::forces(const Configuration& at, const Region& region, const ForceSum& sum) {
  GroupEnergy* const energies = sum.wants_stored() ? sum.energies.data() : nullptr;
  if (formulation_.dilatation) {
    if (sum.screen && by_theta_.size() == 0) by_theta_ = body_.make_field(1);
    const std::int64_t bad = dilatation(at, {}, region, energies, nullptr, sum.screen ? by_theta_.data() : nullptr);
    if (bad >= 0) return bad;
  }
  PairPass pass{PairWork::force, at.unfinished(), {}, q_, {}, sum.force, energies, region.only(), !region.whole()};
  pass.arrival = at.arrival();
  if (!formulation_.dilatation) pass.motion = at.motion();   // else all have moved
  pass.screen = sum.screen;
  if (pass.screen && formulation_.dilatation) pass.by_theta = by_theta_.data();
  return loop_->run(pass);
}

template <int D>
std::int64_t PairForces<D>::tangent(const Configuration& at, ConstFieldView w, const Region& region, FieldView Kw) {
  if (formulation_.dilatation) {
    const std::int64_t bad = dilatation(at, w, region, nullptr, nullptr);
    if (bad >= 0) return bad;
  }
  return loop_->run({PairWork::tangent, at.u(), w, q_, rate_, Kw, nullptr, region.only(), !region.whole()});
}

template <int D>
std::unique_ptr<Assembly> PairForces<D>::make_assembly(const BlockRows& rows) {
  return std::make_unique<PairAssembly<D>>(formulation_, PairPoints{fields_, scale_, dilatation_modulus_}, rows);
}

template <int D>
std::int64_t PairForces<D>::sample(const Configuration& at, PointSamples& samples) {
  Field volumetric = body_.make_field(1), bonds = body_.make_field(1);
  if (formulation_.dilatation) {
    const std::int64_t bad = dilatation(at, {}, {}, nullptr, volumetric.data());
    if (bad >= 0) return bad;
  }
  show_bonds_to_images(true);
  add_tensors(at.u(), samples);
  const std::int64_t bad = loop_->run({PairWork::energy, at.u(), {}, q_, {}, bonds, nullptr});
  show_bonds_to_images(false);
  for (std::size_t p = 0; p < body_.stride(); ++p) samples.strain_energy_density.data()[p] += bonds.data()[p] + volumetric.data()[p];
  return bad;
}

template <int D>
void PairForces<D>::report(ModelReport& report) const {
  report.evaluation_points += share_ ? families_.bonds() / 2 : families_.bonds();
  report.bytes += loop_->bytes();
  report.resting += loop_->resting_counts();
  for (const Field* field : {&scale_, &dilatation_modulus_, &theta_, &q_, &rate_, &fields_.modulus, &density_, &by_theta_})
    report.bytes += field->bytes();
  fields_.factors->report(report);
  report.warnings.insert(report.warnings.end(), warnings_.begin(), warnings_.end());
  report.skips.push_back({"deformation gradients and stresses in forces", "pair law", "shape tensors, one material evaluation a point or bond"});
  if (share_) report.skips.push_back(second_evaluation(families_.bonds(), "both ends feel opposite forces"));
  if (share_ && fields_.modulus.size() == 0) report.skips.push_back({"moduli by point", "one material, one modulus", megabytes(static_cast<double>(body_.stride()) * 8)});
}

std::unique_ptr<Term> make_pair_forces(const PairParts& parts) {
  return with_dimension(parts.families.body().dimension(), [&](auto d) -> std::unique_ptr<Term> { return std::make_unique<PairForces<d>>(parts); });
}

}  // namespace perikit
