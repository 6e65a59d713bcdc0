#include "fracture/search/bond_release.hpp"

#include <algorithm>
#include <cmath>

#include "cloud_balance/consistency.hpp"
#include "cloud_balance/shift.hpp"
#include "core/dimension.hpp"
#include "families/cloud/cloud_families.hpp"
#include "families/lattice/lattice_families.hpp"
#include "families/reproducing_kernel.hpp"
#include "families/shape_tensor.hpp"
#include "maps/selective_map.hpp"
#include "perikit/core/parallel.hpp"
#include "spaces/bond_ends.hpp"
#include "spaces/weighted/local_stencil.hpp"
#include "spaces/weighted/stencil_shift.hpp"
#include "terms/family_point.hpp"
#include "terms/penalty/penalty_matrix.hpp"

namespace perikit {

namespace {

/// Step of central differences in b for what kinematics and stabilizations state as functions of a family.
constexpr double step = 1e-5;

template <int D>
double product(const double* a, const double* b) noexcept {
  double sum = 0;
  for (int c = 0; c < D; ++c) sum += a[c] * b[c];
  return sum;
}

/// S : (z (x) g)
template <int D>
double work(const double* S, const double* z, const double* g) noexcept {
  double sum = 0;
  for (int c = 0; c < D; ++c) sum += z[c] * product<D>(S + c * D, g);
  return sum;
}

/// z -= H xi
template <int D>
void subtract(const double* H, const double* xi, double* z) noexcept {
  for (int c = 0; c < D; ++c) z[c] -= product<D>(H + c * D, xi);
}

/// H = sum_k u_k (x) g_k of n bonds.
template <int D>
void sum_gradient(std::size_t n, const double* u, const double* g, double* H) noexcept {
  std::fill_n(H, D * D, 0.0);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t c = 0; c < D; ++c)
      for (std::size_t e = 0; e < D; ++e) H[c * D + e] += u[D * k + c] * g[D * k + e];
}

/// K^-1 where the b of one bond is greater by `by`: K^-1 - by omega V K^-1 xi (x) K^-1 xi. weight: omega V.
template <int D>
void change_inverse(const double* inverse, double weight, const double* xi, double by, double* changed) noexcept {
  double Ax[D] = {};
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) Ax[a] += inverse[symmetric_index(D, a, b)] * xi[b];
  for (int a = 0; a < D; ++a)
    for (int b = a; b < D; ++b) changed[symmetric_index(D, a, b)] = inverse[symmetric_index(D, a, b)] - by * weight * Ax[a] * Ax[b];
}

/// The entries of an owner, asked for in ascending order of their far ends.
class EntriesOf {
 public:
  EntriesOf(const BondSamples& samples, std::int32_t owner) : samples_(samples), owner_(owner), next_(end()) {}
  const BondSamples::Entry* at(std::int32_t far) noexcept {
    if (next_ != end() && next_->owner == owner_ && next_->far == far) return next_++;
    const BondSamples::Entry* const entry = samples_.find(owner_, far);
    next_ = entry ? entry + 1 : end();
    return entry;
  }

 private:
  const BondSamples::Entry* end() const noexcept { return samples_.entries().data() + samples_.entries().size(); }
  const BondSamples& samples_;
  std::int32_t owner_;
  const BondSamples::Entry* next_;
};

/// One law with the same constants at all points that store energy; on every rank the same.
bool one_law(const Laws& laws) {
  const auto stores = [](const MaterialRecord& record) { return !record.silent; };
  return std::ranges::count_if(laws.records(), stores) == 1 && laws.records().front().uniform;
}

}  // namespace

/// Of one thread. Vectors by bond have D components each.
struct BondRelease::Memory {
  FamilyArrays family;
  std::vector<std::size_t> wanted;    ///< which bonds are
  std::vector<double> xi, u, z;       ///< bond vectors, relative displacements, and what is not affine of them
  std::vector<double> g, gradient;    ///< corrections of the bonds, and the point gradient
  AlignedVector<double> correction, shares;
  std::vector<double> weighted, shifted;
  double H[9];                        ///< [c * dimension + e]
  LocalStencil<1> line;
  LocalStencil<2> plane;
  LocalStencil<3> solid;
  template <int D>
  LocalStencil<D>& stencil() noexcept {
    if constexpr (D == 1) return line;
    else if constexpr (D == 2) return plane;
    else return solid;
  }
};

BondRelease::BondRelease(const TermParts& parts, bool images)
    : parts_(parts),
      one_state_(parts.formulation.pair_symmetric && !parts.formulation.selective() && one_law(*parts.laws)),
      through_point_gradient_(!parts.formulation.weighted || parts.formulation.selective()) {
  if (parts.consistency) factors_ = parts.consistency->factors;
  if (parts.consistency && parts.consistency->shift.components() > 0) shift_ = parts.consistency->shift;
  mirrored_ = one_state_ && factors_.empty() && !images;
}
BondRelease::~BondRelease() = default;

DamageTraits asked_of_bonds(const TermParts& parts, const Damage& criterion) {
  DamageTraits traits = criterion.traits();
  traits.released = traits.released && traits.energy && !traits.stress && !BondRelease::unknown(parts);
  return traits;
}

const char* BondRelease::unknown(const TermParts& parts) {
  const Formulation& f = parts.formulation;
  const int dimension = parts.families->body().dimension();
  const bool stabilized = parts.stabilization != nullptr;
  if (f.pairs) return "of pair laws";
  if (f.selective() && f.weighted && f.parts(dimension) > 0) return "of selective gradients of parts of families";
  if (f.selective() && f.order > 1) return "of selective gradients of orders above 1";
  if (stabilized && f.order > 1 && parts.stabilization->traits().fit == PenaltyFit::linear) return "of penalties on what the linear part of a fit of order 2 or more leaves";
  if (f.force_state == ForceState::local) return "of local force states";
  return nullptr;
}

std::size_t BondRelease::Owner::place_of(std::int32_t end) const noexcept {
  const auto at = std::ranges::lower_bound(far, end);
  return at == far.end() || *at != end ? far.size() : static_cast<std::size_t>(at - far.begin());
}

double BondRelease::of(std::int32_t p, std::int32_t far) const noexcept {
  const Owner& owner = owner_of(p);
  const std::size_t k = owner.place_of(far);
  return k == owner.far.size() ? 0.0 : owner.released[k];
}

bool BondRelease::follows_from_flux() const noexcept {
  const Formulation& f = parts_.formulation;
  return one_state_ && f.bond && f.g_from_xi_only && !f.weighted && f.order == 1 && !parts_.stabilization && !shift_.data;
}

/// dE/dH : (z (x) g)/b with g = b omega V K^-1 xi is omega z . Q d on a lattice, Q the flux and d the bond in cells, and omega V z . Q xi on a cloud; the far
/// end sees -z and -d.
void BondRelease::of(std::int32_t p, const FamilyArrays& family, std::span<const std::size_t> bonds, ConstFieldView u, const PointFlux& flux,
                     const BondSamples& samples, double* released) const noexcept {
  const LatticeFamilies* const lattice = parts_.families->lattice();
  const int dimension = family.dimension;
  const auto normaliser = [&](std::int32_t of) { return parts_.families->normaliser(static_cast<std::size_t>(of), parts_.formulation.weight); };
  const auto factor = [&](std::int32_t owner, std::int32_t far) {
    return factors_.empty() ? 1.0 : factors_[static_cast<std::size_t>(parts_.families->cloud()->index(owner, far))];
  };
  const double own = normaliser(p);
  for (const std::size_t k : bonds) {
    const std::int32_t far = family.far[k];
    double sum = 0;
    for (const std::int32_t end : {p, far}) {
      double of_end = 0;
      for (int c = 0; c < dimension; ++c) {
        double z = u.component(c)[far] - u.component(c)[p], t = 0;
        for (int e = 0; e < dimension; ++e) {
          z -= flux.gradient(end, c, e) * family.xi[e][k];
          t += flux.flux(end, c, e) * family.xi[lattice ? lattice->grid.axis[static_cast<std::size_t>(e)] : e][k];
        }
        of_end += z * t;
      }
      sum += lattice ? of_end / lattice->spacing : of_end * parts_.families->body().volume(static_cast<std::size_t>(end == p ? far : p));
    }
    sum *= family.whole_omega(k);
    if (const BondSamples::Entry* const entry = samples.find(p, far))
      sum += entry->energy / family.b(k) * (1 + own * factor(far, p) / (normaliser(far) * factor(p, far)));
    *released++ = sum;
  }
}

void BondRelease::find(ConstFieldView u, const GroupMarks& near, const GroupMarks& wide, const WantedBonds& wanted, const BondSamples& samples) {
  const Body& body = parts_.families->body();
  for (std::size_t k = 0; k < count_; ++k) place_[static_cast<std::size_t>(owners_[k].point)] = -1;
  place_.resize(body.stride(), -1);
  while (static_cast<int>(memory_.size()) < thread_count()) memory_.push_back(std::make_unique<Memory>());
  count_ = 0;
  for (const std::int32_t p : body.internal()) {
    if (!marked(wide, static_cast<std::size_t>(p))) continue;
    if (count_ == owners_.size()) owners_.emplace_back();
    owners_[count_].point = p;
    place_[static_cast<std::size_t>(p)] = static_cast<std::int32_t>(count_++);
  }
  with_dimension(body.dimension(), [&](auto d) { find_bonds<d>(u, near, wanted, samples); });
}

template <int D>
void BondRelease::find_bonds(ConstFieldView u, const GroupMarks& near, const WantedBonds& wanted, const BondSamples& samples) {
  const auto over_owners = [&](auto&& visit) {
    parallel_for(count_, [&](std::size_t k) { visit(owners_[k], *memory_[static_cast<std::size_t>(thread_index())]); });
  };
  const auto with_bonds = [&](Owner& owner, Memory& m) {
    load<D>(owner.point, m);
    owner.far = m.family.far;
    if (!parts_.formulation.bond) return;
    correct<D>(m);
    find_onto<D>(owner, samples, m);
  };
  const bool twice = reach() == 2;
  if (twice)
    over_owners([&](Owner& owner, Memory& m) {
      with_bonds(owner, m);
      find_gradient<D>(owner.point, u, m);
      std::copy_n(m.H, D * D, owner.H);
    });
  // What other owners read of an owner stays as it is from here on.
  over_owners([&](Owner& owner, Memory& m) {
    if (!marked(near, static_cast<std::size_t>(owner.point))) return;
    twice ? load<D>(owner.point, m) : with_bonds(owner, m);
    m.wanted.clear();
    for (std::size_t k = 0; k < owner.far.size(); ++k)
      if (wanted(owner.point, owner.far[k])) m.wanted.push_back(k);
    find_gradient<D>(owner.point, u, m);
    release<D>(owner, samples, m);
  });
}

template <int D>
void BondRelease::load(std::int32_t point, Memory& m) const {
  parts_.families->load(static_cast<std::size_t>(point), BondsOf::intact, m.family);
  const FamilyArrays& family = m.family;
  const std::size_t n = family.far.size();
  m.xi.resize(D * n);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t c = 0; c < D; ++c) m.xi[D * k + c] = family.xi[c][k];
}

template <int D>
void BondRelease::correct(Memory& m) const {
  const FamilyArrays& family = m.family;
  m.correction.resize(D * family.size);
  parts_.formulation.bond->correction(family.view(parts_.families->body().horizon()), m.correction.data(), family.size);
  m.g.resize(D * family.far.size());
  for (std::size_t k = 0; k < family.far.size(); ++k)
    for (std::size_t e = 0; e < D; ++e) m.g[D * k + e] = m.correction[e * family.size + k];
}

template <int D>
void BondRelease::find_gradient(std::int32_t point, ConstFieldView u, Memory& m) const {
  const auto p = static_cast<std::size_t>(point);
  const std::size_t n = m.family.far.size();
  m.u.resize(D * n);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t c = 0; c < D; ++c) {
      const double* const component = u.component(static_cast<int>(c));
      m.u[D * k + c] = component[m.family.far[k]] - component[p];
    }
  if (!through_point_gradient_ && !parts_.stabilization) return;
  // z is that of the least squares, whether the gradient is shifted or not; the shift changes H and g alone.
  const double horizon = parts_.families->body().horizon();
  const int order = point_gradient(m.family, horizon, parts_.formulation.order, m.gradient);
  sum_gradient<D>(n, m.u.data(), m.gradient.data(), m.H);
  if (parts_.formulation.order > 1) return kernel_residuals(m.family, horizon, order, m.u, m.z);
  m.z = m.u;
  for (std::size_t k = 0; k < n; ++k) subtract<D>(m.H, &m.xi[D * k], &m.z[D * k]);
  if (!shift_.data) return;
  shift_gradient(m.family, shift_, m.gradient);
  sum_gradient<D>(n, m.u.data(), m.gradient.data(), m.H);
}

/// H_b = A (I - xi (x) g) + u (x) g: dE/dA = dE/dH (I - g (x) xi).
template <int D>
void BondRelease::find_onto(Owner& owner, const BondSamples& samples, Memory& m) const {
  const std::size_t n = owner.far.size();
  owner.onto.assign(n * D * D, 0.0);
  EntriesOf entries(samples, owner.point);
  for (std::size_t k = 0; k < n; ++k) {
    const BondSamples::Entry* const entry = entries.at(owner.far[k]);
    if (!entry) continue;
    for (std::size_t c = 0; c < D; ++c) {
      const double t = product<D>(entry->tensor + c * D, &m.g[D * k]);
      for (std::size_t e = 0; e < D; ++e) owner.onto[(k * D + c) * D + e] = entry->tensor[c * D + e] - t * m.xi[D * k + e];
    }
  }
}

template <int D>
void BondRelease::release(Owner& owner, const BondSamples& samples, Memory& m) const {
  owner.released.assign(owner.far.size(), 0.0);
  double S[D * D] = {};  // dE/dH of the owner
  if (parts_.formulation.weighted && parts_.formulation.parts(D) > 0) {
    release_parts<D>(owner, samples, m);
  } else if (parts_.formulation.weighted) {
    release_weighted<D>(owner, samples, m);
    release_shares<D>(owner, samples, m, S);
  } else if (parts_.formulation.bond) {
    release_bonds<D>(owner, samples, m, S);
    release_shares<D>(owner, samples, m, S);
  } else if (parts_.formulation.own_stencils()) {
    release_cell<D>(owner, samples, m);
  } else if (const BondSamples::Entry* const entry = samples.find(owner.point, -1)) {
    std::copy_n(entry->tensor, D * D, S);
    release_weight(owner, entry->energy, m);
  }
  if (through_point_gradient_)
    for (std::size_t k = 0; k < owner.far.size(); ++k) owner.released[k] += work<D>(S, &m.z[D * k], &m.gradient[D * k]) / m.family.b(k);
  if (parts_.stabilization) release_penalty<D>(owner, m);
}

void BondRelease::release_weight(Owner& owner, double stored, const Memory& m) const {
  const auto p = static_cast<std::size_t>(owner.point);
  const double left = (1 - parts_.families->damage(p)) * parts_.families->normaliser(p, BondWeight::kernel);
  for (std::size_t k = 0; k < owner.far.size() && left > 0; ++k)
    owner.released[k] += stored * m.family.whole_omega(k) * m.family.volume[k] / left;
}

/// The gradient of each part is the fit to its bonds; the shares of parts do not depend on b.
template <int D>
void BondRelease::release_parts(Owner& owner, const BondSamples& samples, Memory& m) const {
  const std::size_t n = owner.far.size();
  if (n == 0) return;
  LocalStencil<D>& stencil = m.stencil<D>();
  stencil.build({&parts_.formulation, parts_.families->body().horizon()}, m.family, nullptr, 0, nullptr);
  std::vector<double>& g = m.weighted;
  g.resize(n * D);
  double stored = 0;
  for (int q = 0; q < stencil.points(); ++q) {
    const BondSamples::Entry* const entry = samples.find(owner.point, BondSamples::part(q));
    if (!entry) continue;
    stored += entry->energy;
    const double* const influence = stencil.influences(q);
    if (std::ranges::none_of(m.wanted, [&](std::size_t k) { return influence[k] != 0; })) continue;
    stencil.expand_one(q, g.data());
    double H[D * D];
    sum_gradient<D>(n, m.u.data(), g.data(), H);
    // The shift moves the gradient, not what the fit leaves.
    if (shift_.data)
      each_shift<D>(m.family, influence, g.data(), shift_, 0, [&](std::size_t k, std::size_t e, double d) { g[k * D + e] += d; });
    for (const std::size_t k : m.wanted) {
      if (influence[k] == 0) continue;
      double z[D];
      std::copy_n(&m.u[D * k], D, z);
      subtract<D>(H, &m.xi[D * k], z);
      owner.released[k] += work<D>(entry->tensor, z, &g[D * k]) / m.family.b(k);
    }
  }
  release_weight(owner, stored, m);
}

/// Their gradients are linear in the coefficients of the fit, which a bond moves by what the whole fit leaves of it.
template <int D>
void BondRelease::release_cell(Owner& owner, const BondSamples& samples, Memory& m) const {
  const std::size_t n = owner.far.size();
  if (n == 0) return;
  LocalStencil<D>& stencil = m.stencil<D>();
  stencil.build({&parts_.formulation, parts_.families->body().horizon()}, m.family, nullptr, 0, nullptr);
  stencil.expand(m.weighted);
  double stored = 0;
  for (int q = 0; q < stencil.points(); ++q) {
    const BondSamples::Entry* const entry = samples.find(owner.point, BondSamples::part(q));
    if (!entry) continue;
    stored += entry->energy;
    const double* const g = m.weighted.data() + static_cast<std::size_t>(q) * n * D;
    for (const std::size_t k : m.wanted) owner.released[k] += work<D>(entry->tensor, &m.z[D * k], g + D * k) / m.family.b(k);
  }
  release_weight(owner, stored, m);
}

template <int D>
void BondRelease::release_bonds(Owner& owner, const BondSamples& samples, Memory& m, double* S) const {
  const double share = parts_.formulation.far_share;
  const auto normaliser = [&](std::int32_t p) { return parts_.families->normaliser(static_cast<std::size_t>(p), parts_.formulation.weight); };
  const double of_owner = mirrored_ ? normaliser(owner.point) : 0.0;
  for (std::size_t k = 0; k < owner.far.size(); ++k) {
    const double* const own = &owner.onto[k * D * D];
    const auto near = static_cast<std::size_t>(owner.point), other_end = static_cast<std::size_t>(owner.far[k]);
    const double here = end_shares(*parts_.families, share, near, other_end).near, there = end_shares(*parts_.families, share, other_end, near).far;
    const double both = here + (mirrored_ ? there * of_owner / normaliser(owner.far[k]) : 0.0);
    for (int c = 0; c < D * D; ++c) S[c] += both * own[c];
    if (there > 0 && !mirrored_) {
      const Owner& far = owner_of(owner.far[k]);
      const double* const other = &far.onto[far.place_of(owner.point) * D * D];
      for (int c = 0; c < D * D; ++c) S[c] += there * other[c];
    }
  }
  if (!parts_.formulation.g_from_xi_only) release_corrections<D>(owner, samples, m);
}

template <int D>
void BondRelease::release_shares(Owner& owner, const BondSamples& samples, const Memory& m, double* S) const {
  const double left = parts_.families->remaining_influence(static_cast<std::size_t>(owner.point));
  double pressure = 0, by_share = 0;
  EntriesOf entries(samples, owner.point);
  for (std::size_t k = 0; k < owner.far.size(); ++k) {
    const BondSamples::Entry* const entry = entries.at(owner.far[k]);
    if (!entry) continue;
    owner.released[k] += entry->energy / m.family.b(k);
    pressure += entry->pressure;
    if (left > 0) by_share += 3 * entry->pressure * entry->growth / ((entry->growth + left) * left);
  }
  if (parts_.formulation.selective()) release_volume<D>(owner, pressure, by_share, m, S);
}

template <int D>
void BondRelease::release_volume(Owner& owner, double pressure, double by_share, const Memory& m, double* S) const {
  double H[9 * padding] = {}, pressures[padding] = {}, stress[9 * padding] = {};
  for (std::size_t c = 0; c < D * D; ++c) H[c * padding] = m.H[c];
  pressures[0] = pressure;
  add_owner_stress(parts_.laws->space(), {static_cast<int>(padding), padding, H, nullptr}, pressures, nullptr, stress, padding);
  for (std::size_t c = 0; c < D * D; ++c) S[c] += stress[c * padding];
  // The share c of the volume is that of the influence that is left.
  const auto p = static_cast<std::size_t>(owner.point);
  double influence = 0;
  for (std::size_t k = 0; k < owner.far.size(); ++k) influence += m.family.omega[k] * m.family.volume[k];
  if (!std::isfinite(parts_.families->condition(p)) || !(influence > 0)) return;
  for (std::size_t k = 0; k < owner.far.size(); ++k)
    owner.released[k] += by_share * m.family.whole_omega(k) * m.family.volume[k] * parts_.families->remaining_influence(p) / influence;
}

/// Corrections that follow from the shape tensor and the influence of the bonds.
template <int D>
void BondRelease::release_corrections(Owner& owner, const BondSamples& samples, Memory& m) const {
  FamilyArrays& family = m.family;
  const auto p = static_cast<std::size_t>(owner.point);
  const std::size_t n = owner.far.size(), size = family.size;
  const double horizon = parts_.families->body().horizon(), share = parts_.formulation.far_share;
  double inverse[6];
  std::copy_n(family.inverse_shape, 6, inverse);
  if (inverse[0] == 0) return;
  m.correction.resize(D * size);
  // By bond and component of its g: dE/dg_e = (dE/dH)_ce (u - A xi)_c.
  m.weighted.assign(D * n, 0.0);
  EntriesOf entries(samples, owner.point);
  for (std::size_t k = 0; k < n; ++k) {
    const BondSamples::Entry* const entry = entries.at(owner.far[k]);
    if (!entry) continue;
    double A[D * D], z[D];
    const double* const other = share > 0 ? owner_of(owner.far[k]).H : m.H;
    const EndShares shares = end_shares(*parts_.families, share, p, static_cast<std::size_t>(owner.far[k]));
    for (int c = 0; c < D * D; ++c) A[c] = shares.near * m.H[c] + shares.far * other[c];
    std::copy_n(&m.u[D * k], D, z);
    subtract<D>(A, &m.xi[D * k], z);
    for (std::size_t e = 0; e < D; ++e)
      for (std::size_t c = 0; c < D; ++c) m.weighted[D * k + e] += entry->tensor[c * D + e] * z[c];
  }
  // A correction depends on K^-1 and on its own bond alone, as batches have parts of families.
  const auto work_of = [&](std::size_t l) {
    double sum = 0;
    for (std::size_t e = 0; e < D; ++e) sum += m.weighted[D * l + e] * m.correction[e * size + l];
    return sum;
  };
  double slope[6] = {};  // dE/dK^-1 through the corrections
  const double by = step * *std::max_element(inverse, inverse + 6);
  for (int c = 0; c < D * (D + 1) / 2; ++c)
    for (const double sign : {1.0, -1.0}) {
      family.inverse_shape[c] = inverse[c] + sign * by;
      parts_.formulation.bond->correction(family.view(horizon), m.correction.data(), size);
      family.inverse_shape[c] = inverse[c];
      for (std::size_t l = 0; l < n; ++l) slope[c] += sign * work_of(l) / (2 * by);
    }
  std::vector<double>& omega = m.shifted;
  omega.assign(family.omega.begin(), family.omega.begin() + static_cast<std::ptrdiff_t>(n));
  for (const double sign : {1.0, -1.0}) {
    for (std::size_t k = 0; k < n; ++k) family.omega[k] = omega[k] + sign * step * (family.whole.empty() ? omega[k] : family.whole_omega(k));
    parts_.formulation.bond->correction(family.view(horizon), m.correction.data(), size);
    for (std::size_t k = 0; k < n; ++k) owner.released[k] += sign * work_of(k) / (2 * step);
  }
  std::copy_n(omega.begin(), n, family.omega.begin());
  for (std::size_t k = 0; k < n; ++k) {
    double changed[6];
    change_inverse<D>(inverse, family.whole_omega(k) * family.volume[k], &m.xi[D * k], 1, changed);
    for (int c = 0; c < D * (D + 1) / 2; ++c) owner.released[k] += slope[c] * (changed[c] - inverse[c]);
  }
}

template <int D>
void BondRelease::release_weighted(Owner& owner, const BondSamples& samples, Memory& m) const {
  const auto p = static_cast<std::size_t>(owner.point);
  const FamilyArrays& family = m.family;
  const std::size_t n = owner.far.size();
  if (n == 0) return;
  bond_shares(*parts_.families, p, parts_.formulation.weight, family, m.shares);
  LocalStencil<D>& stencil = m.stencil<D>();
  stencil.build({&parts_.formulation, parts_.families->body().horizon()}, family, m.shares.data(), 0, nullptr);
  stencil.expand(m.weighted);
  const std::size_t owners = parts_.formulation.selective() ? 1 : 0;
  EntriesOf entries(samples, owner.point);
  for (std::size_t j = 0; j < n; ++j) {
    const BondSamples::Entry* const entry = entries.at(owner.far[j]);
    if (!entry) continue;
    const double* const g = m.weighted.data() + (owners + j) * n * D;
    double H[D * D];
    sum_gradient<D>(n, m.u.data(), g, H);
    for (const std::size_t k : m.wanted) {
      double z[D];
      std::copy_n(&m.u[D * k], D, z);
      subtract<D>(H, &m.xi[D * k], z);
      owner.released[k] += work<D>(entry->tensor, z, g + D * k) / family.b(k);
    }
  }
}

/// E = 1/2 V_i sum_k V_k omega z_k . M z_k, and M follows from K^-1. Through H, or the whole fit, nothing happens: sum of omega V z q(xi) is zero for
/// all of its monomials.
template <int D>
void BondRelease::release_penalty(Owner& owner, Memory& m) const {
  const auto p = static_cast<std::size_t>(owner.point);
  const FamilyArrays& family = m.family;
  if (!penalised(parts_.families->condition(p))) return;
  const std::size_t n = owner.far.size();
  const bool isotropic = D == 1 || parts_.stabilization->traits().isotropic;
  const double volume = parts_.families->body().volume(p);
  double intact = 0, squares[D * D] = {};  // sum of omega V z (x) z
  for (std::size_t k = 0; k < n; ++k) {
    const double w = family.omega[k] * family.volume[k];
    intact += w;
    for (std::size_t a = 0; a < D; ++a)
      for (std::size_t b = 0; b < D; ++b) squares[a * D + b] += w * m.z[D * k + a] * m.z[D * k + b];
  }
  const auto times = [&](const double* M, const double* zz) {
    double sum = 0;
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b)
        if (!isotropic || a == b) sum += M[isotropic ? 0 : symmetric_index(D, a, b)] * zz[a * D + b];
    return sum;
  };
  const double* const inverse = family.inverse_shape;
  const auto penalty = [&](const double* of_inverse, double* M) {
    parts_.stabilization->penalty(penalty_point(*parts_.families, *parts_.laws, p, intact, of_inverse), M);
  };
  double M[6], slope[D * D] = {};  // dE/dK^-1_ab over V_i/2, a <= b
  penalty(inverse, M);
  const double by = step * *std::max_element(inverse, inverse + 6);
  for (int a = 0; a < D; ++a)
    for (int b = a; b < D; ++b)
      for (const double sign : {1.0, -1.0}) {
        double moved[6], at[6];
        std::copy_n(inverse, 6, moved);
        moved[symmetric_index(D, a, b)] += sign * by;
        penalty(moved, at);
        slope[a * D + b] += sign * times(at, squares) / (2 * by);
      }
  for (std::size_t k = 0; k < n; ++k) {
    const double w = family.whole_omega(k) * family.volume[k];
    double zz[D * D], Ax[D] = {};
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) {
        zz[a * D + b] = w * m.z[D * k + static_cast<std::size_t>(a)] * m.z[D * k + static_cast<std::size_t>(b)];
        Ax[a] += inverse[symmetric_index(D, std::min(a, b), std::max(a, b))] * m.xi[D * k + static_cast<std::size_t>(b)];
      }
    double change = times(M, zz);
    // dK^-1/db = -w K^-1 xi (x) K^-1 xi.
    for (int a = 0; a < D; ++a)
      for (int b = a; b < D; ++b) change -= w * slope[a * D + b] * Ax[a] * Ax[b];
    owner.released[k] += 0.5 * volume * change;
  }
}

}  // namespace perikit
