#include "spaces/weighted_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>

#include "operators/samples.hpp"
#include "spaces/weighted_kernel.hpp"

namespace perikit {

template <int D>
WeightedModel<D>::WeightedModel(const ModelParts& parts)
    : AssemblingModel(parts),
      body_(*parts.body),
      laws_(*parts.laws),
      formulation_(parts.formulation),
      rules_{&formulation_, body_.horizon()},
      share_(parts.share),
      owners_(formulation_.selective() ? 1 : 0),
      parts_(formulation_.parts(D)),
      condition_(body_.make_field(1)),
      damage_(body_.make_field(1)) {
  if (body_.lattice())
    prepare_lattice(*parts.influence);
  else
    prepare_cloud(*parts.influence);
  if (!parts.skip || laws_.history()) quiet_ = {};
  singles_ = std::any_of(groups_.begin(), groups_.end(), [](const Group& g) { return g.stencil < 0; });
  if (parts.damage) {
    prepare_damage();
    this->watch_bonds(lattice_ ? static_cast<BondState&>(lattice_bonds_.emplace(*lattice_)) : cloud_->bond_state());
  }
}

template <int D>
void WeightedModel<D>::prepare_damage() {
  place_.assign(body_.stride(), {});
  left_.resize(block_first_.size() - 1);
  for (std::size_t b = 0; b + 1 < block_first_.size(); ++b)
    for (std::size_t g = block_first_[b]; g < block_first_[b + 1]; ++g)
      for (std::uint8_t l = 0; l < groups_[g].count; ++l)
        place_[static_cast<std::size_t>(members_[groups_[g].first + l])] = {static_cast<std::uint32_t>(b),
                                                                            static_cast<std::uint32_t>(g), l, false};
}

template <int D>
std::vector<BondChange> WeightedModel<D>::bonds_changed(std::span<const std::int32_t> points) {
  std::vector<BondChange> fragments = lattice_ ? lattice_->fragment_bonds(points) : cloud_->changed(points);
  for (const std::int32_t p : points) {
    const auto at = static_cast<std::size_t>(p);
    if (lattice_) {
      const LatticePattern& pattern = lattice_->pattern(lattice_->chunks[static_cast<std::size_t>(lattice_->chunk_of(p))]);
      condition_.data()[p] = pattern.condition[at % chunk_points];
      damage_.data()[p] = pattern.damage[at % chunk_points];
    } else {
      condition_.data()[p] = cloud_->condition.data()[p];
      damage_.data()[p] = cloud_->damage.data()[p];
    }
    // Families that are whole again return: a restored model is bitwise a new one.
    Place& place = place_[at];
    if (place.left == (lattice_ ? lattice_->lost_bonds(p) : cloud_->lost_bonds(at))) continue;
    place.left = !place.left;
    groups_[place.group].live ^= static_cast<std::uint8_t>(1u << place.lane);
    std::vector<std::int32_t>& left = left_[place.block];
    const auto entry = std::lower_bound(left.begin(), left.end(), p);
    if (place.left)
      left.insert(entry, p);
    else
      left.erase(entry);
    singles_ = true;
  }
  return fragments;
}

template <int D>
double WeightedModel<D>::energy_of(ConstFieldView u, const GroupMarks& marks) {
  const BondState& bonds = lattice_ ? static_cast<const BondState&>(*lattice_bonds_) : cloud_->bond_state();
  return run_energy(body_, laws_, formulation_.selective(), block_first_.size() - 1, u, marks, bonds,
                    [&](Pass& pass) { return run(pass); });
}

template <int D>
void WeightedModel<D>::load_own_family(std::int32_t p, Memory& m) const {
  m.index.clear();
  if (lattice_) {
    const LatticePattern& pattern = lattice_->pattern(lattice_->chunks[static_cast<std::size_t>(lattice_->chunk_of(p))]);
    const std::vector<std::uint16_t> slots = lattice_->intact_slots(pattern, p % chunk_points);
    lattice_->load(slots, m.family);
    for (const std::uint16_t s : slots) m.index.push_back(static_cast<std::int32_t>(p + lattice_->shifts[s]));
    set_lattice_shares(pattern.scale[p % chunk_points], m);
    return;
  }
  const auto at = static_cast<std::size_t>(p);
  cloud_->load(at, m.family);
  const auto family = cloud_->neighbours(at);
  m.family.integrity.assign(m.family.size, 1.0);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < family.size(); ++k) {
    const double b = cloud_->integrity(static_cast<std::size_t>(cloud_->lists.first[at]) + k);
    if (b == 0) continue;
    for (std::size_t c = 0; c < D; ++c) m.family.xi[c][kept] = m.family.xi[c][k];
    for (AlignedVector<double>* values : {&m.family.length, &m.family.volume, &m.family.omega}) (*values)[kept] = (*values)[k];
    m.family.integrity[kept++] = b;
    m.index.push_back(family[k]);
  }
  m.family.resize(D, static_cast<int>(kept));
  m.family.integrity.resize(m.family.size);
  if (std::all_of(m.family.integrity.begin(), m.family.integrity.begin() + static_cast<std::ptrdiff_t>(kept),
                  [](double b) { return b == 1; }))
    m.family.integrity.clear();
  set_cloud_shares(at, m);
}

template <int D>
void WeightedModel<D>::prepare_lattice(const InfluenceFunction& influence) {
  const LatticeFamilies& f = lattice_.emplace(body_, influence, formulation_.weight);
  quiet_ = QuietBlocks(f.reach);
  bonds_ = f.bonds;
  broken_ = f.broken;
  singular_ = f.singular;
  FamilyClasses found(f);
  classes_ = std::move(found.classes);
  const std::vector<std::int32_t> stencil_of = store_stencils();
  for (const LatticeBlock& block : f.blocks) {
    block_first_.push_back(groups_.size());
    std::map<std::int32_t, std::vector<std::int32_t>> members;  // by class
    for (std::size_t c = block.chunk_begin; c < block.chunk_end; ++c) {
      const LatticeChunk& chunk = f.chunks[c];
      for (int l = 0; l < chunk_points; ++l) {
        condition_.data()[chunk.first + l] = f.pattern(chunk).condition[l];
        damage_.data()[chunk.first + l] = f.pattern(chunk).damage[l];
        const std::int32_t family = found.of_point[static_cast<std::size_t>(chunk.first + l)];
        if (family >= 0) members[family].push_back(chunk.first + l);
      }
    }
    for (const auto& [family, points] : members) group_points(points, family, stencil_of[static_cast<std::size_t>(family)]);
  }
  block_first_.push_back(groups_.size());
}

template <int D>
std::vector<std::int32_t> WeightedModel<D>::store_stencils() {
  std::vector<std::int32_t> stencil_of(classes_.size(), -1);
  std::vector<std::size_t> order(classes_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return classes_[a].members > classes_[b].members; });
  std::size_t bytes = 0;
  Memory m;
  for (const std::size_t k : order) {
    const FamilyClass& family = classes_[k];
    if (family.members == 0 || family.slots.empty()) continue;
    load_class(static_cast<std::int32_t>(k), m);
    build(m, 0, nullptr);
    fallbacks_ += static_cast<std::size_t>(m.stencil.fallbacks()) * family.members;
    dropped_ += static_cast<std::size_t>(m.stencil.dropped()) * family.members;
    if (!share_ || bytes > stencil_bytes || (parts_ == 0 && family.members < fewest_together)) continue;
    stencil_of[k] = static_cast<std::int32_t>(stencils_.size());
    bytes += stencils_.emplace_back(m.family, m.stencil, owners_, parts_ == 0).bytes();
  }
  return stencil_of;
}

template <int D>
void WeightedModel<D>::group_points(std::span<const std::int32_t> points, std::int32_t family, std::int32_t stencil) {
  if (classes_[static_cast<std::size_t>(family)].slots.empty()) return;
  const auto add = [&](std::span<const std::int32_t> group, bool contiguous) {
    groups_.push_back(
        {static_cast<std::uint32_t>(members_.size()), family, stencil, static_cast<std::uint8_t>(group.size()), contiguous});
    members_.insert(members_.end(), group.begin(), group.end());
    if (stencil >= 0) members_.insert(members_.end(), 8 - group.size(), group[0]);
  };
  const auto add_singly = [&](std::span<const std::int32_t> rest) {
    stencil = -1;
    for (const std::int32_t& p : rest) add({&p, 1}, false);
  };
  if (stencil < 0) return add_singly(points);
  // Eight in a row need no gathers; the others of the block are put together as they come.
  std::vector<std::int32_t> rest;
  for (std::size_t i = 0; i < points.size();) {
    if (i + 8 <= points.size() && points[i + 7] == points[i] + 7) {
      add(points.subspan(i, 8), true);
      i += 8;
    } else {
      rest.push_back(points[i++]);
    }
  }
  for (std::size_t i = 0; i < rest.size(); i += 8) {
    const std::span<const std::int32_t> some = std::span(rest).subspan(i, std::min<std::size_t>(8, rest.size() - i));
    if (parts_ == 0 && some.size() < fewest_together)
      add_singly(some);
    else
      add(some, false);
  }
}

template <int D>
void WeightedModel<D>::prepare_cloud(const InfluenceFunction& influence) {
  const CloudFamilies& f = cloud_.emplace(body_, influence, formulation_.weight);
  bonds_ = f.bonds();
  broken_ = f.broken;
  singular_ = f.singular;
  condition_ = f.condition;
  damage_ = f.damage;
  const std::size_t together = parts_ > 0 ? 8 : 1;
  for (std::size_t p = 0; p < body_.points(); ++p) {
    if (p % cloud_block == 0) block_first_.push_back(groups_.size());
    if (f.neighbours(p).empty()) continue;
    if (groups_.size() == block_first_.back() || groups_.back().count == together)
      groups_.push_back({static_cast<std::uint32_t>(members_.size()), -1, -1, 0, false});
    ++groups_.back().count;
    members_.push_back(static_cast<std::int32_t>(p));
  }
  block_first_.push_back(groups_.size());
  const std::size_t blocks = block_first_.size() - 1;
  std::vector<std::size_t> fallbacks(blocks, 0), dropped(blocks, 0);
  if (parts_ > 0) sparse_.resize(blocks);
  parallel_for(blocks, [&](std::size_t b) {
    Memory m;
    const auto member = [&](std::size_t g) { return g < groups_.size() ? groups_[g].first : members_.size(); };
    for (std::size_t i = member(block_first_[b]); i < member(block_first_[b + 1]); ++i) {
      const auto p = static_cast<std::size_t>(members_[i]);
      load_cloud_family(p, m);
      build(m, 0, nullptr);
      fallbacks[b] += static_cast<std::size_t>(m.stencil.fallbacks());
      dropped[b] += static_cast<std::size_t>(m.stencil.dropped());
      if (parts_ > 0) sparse_[b].append(m.stencil, f.neighbours(p));
    }
  });
  fallbacks_ = std::accumulate(fallbacks.begin(), fallbacks.end(), std::size_t{0});
  dropped_ = std::accumulate(dropped.begin(), dropped.end(), std::size_t{0});
  BlockReach reach = cloud_reach(f.lists, body_.points(), cloud_block);
  cloud_colouring_ = Colouring(reach);
  quiet_ = QuietBlocks(std::move(reach));
}

template <int D>
void WeightedModel<D>::set_lattice_shares(double scale, Memory& m) const {
  m.share.assign(m.family.size, 0.0);
  for (std::size_t k = 0; k < static_cast<std::size_t>(m.family.bonds); ++k)
    m.share[k] = scale * (formulation_.weight == BondWeight::kernel ? m.family.omega[k] : 1.0);
}

template <int D>
void WeightedModel<D>::set_cloud_shares(std::size_t p, Memory& m) const {
  m.share.assign(m.family.size, 0.0);
  for (std::size_t k = 0; k < static_cast<std::size_t>(m.family.bonds); ++k) {
    const double b = m.family.integrity.empty() ? 1.0 : m.family.integrity[k];
    m.share[k] = m.family.volume[k] * (formulation_.weight == BondWeight::kernel ? m.family.omega[k] : b) / cloud_->normaliser[p];
  }
}

template <int D>
void WeightedModel<D>::load_class(std::int32_t family, Memory& m) const {
  const FamilyClass& own = classes_[static_cast<std::size_t>(family)];
  lattice_->load(own.slots, m.family);
  set_lattice_shares(own.scale, m);
}

template <int D>
void WeightedModel<D>::load_cloud_family(std::size_t p, Memory& m) const {
  m.family.integrity.clear();
  cloud_->load(p, m.family);
  set_cloud_shares(p, m);
}

template <int D>
void WeightedModel<D>::build(Memory& m, int fields, const double* const (*u)[D]) const {
  m.stencil.build(rules_, m.family, m.share.data(), fields, u);
}

template <int D>
void WeightedModel<D>::load_differences(std::int32_t point, const AlignedVector<Row>& rows, Memory& m,
                                        AlignedVector<double>& out) const {
  const std::size_t size = m.family.size, bonds = m.index.size();
  out.resize(D * size);
  for (std::size_t c = 0; c < D; ++c) std::fill_n(out.data() + c * size + bonds, size - bonds, 0.0);
  const Row own = rows[static_cast<std::size_t>(point)];
  for (std::size_t k = 0; k < bonds; ++k) {
    const Row difference = rows[static_cast<std::size_t>(m.index[k])] - own;
    for (std::size_t c = 0; c < D; ++c) out[c * size + k] = difference[c];
  }
}

template <int D>
double WeightedModel<D>::weight(std::int32_t p, double share) const noexcept {
  return body_.volume(static_cast<std::size_t>(p)) * share * (parts_ > 0 ? 1 - damage_.data()[p] : 1.0);
}

template <int D>
double WeightedModel<D>::left(std::int32_t p) const noexcept {
  if (!lattice_) return cloud_->left(static_cast<std::size_t>(p));
  if (lattice_->failed == 0) return 1;
  return lattice_->pattern(lattice_->chunks[static_cast<std::size_t>(lattice_->chunk_of(p))]).left[p % chunk_points];
}

template <int D>
void WeightedModel<D>::keep_owner_gradients(int points, double share, Memory& m, BatchScratch& s, bool tangent) const noexcept {
  for (std::size_t c = 0; c < D * D; ++c) {
    std::copy_n(s.Ht + c * batch_points, 8, m.owner_H + c * 8);
    if (tangent) std::copy_n(s.dHt + c * batch_points, 8, m.owner_dH + c * 8);
  }
  owner_volume(laws_.space(), {8, 8, m.owner_H, tangent ? m.owner_dH : nullptr}, s.volume, batch_points);
  s.volume[volume_share * batch_points] = share;
  for (int c = 0; c < volume_components && points == 1; ++c) std::fill_n(s.volume + c * batch_points, 8, s.volume[c * batch_points]);
  std::fill(std::begin(s.volume_group), std::end(s.volume_group), 0);
  s.owner_volumes = {s.volume, batch_points, s.volume_group, share == 1};   // an owner without a gradient has none at its evaluation points either
}

template <int D>
void WeightedModel<D>::clear_lanes(std::uint8_t kept, int slot, int slots, double* H, double* dH) noexcept {
  for (double* gradient : {H, dH})
    for (int c = 0; c < D * D && gradient; ++c)
      for (int l = 0; l < 8 * slots; ++l)
        if (!(kept >> l % 8 & 1)) gradient[c * batch_points + 8 * slot + l] = 0.0;
}

template <int D>
void WeightedModel<D>::add_pressures(int lanes, const BatchScratch& s, bool tangent, double (&pressure)[2][8]) {
  for (int l = 0; l < lanes; ++l) {
    pressure[0][l % 8] += s.pressure[l];
    if (tangent) pressure[1][l % 8] += s.pressure_rate[l];
  }
}

template <int D>
void WeightedModel<D>::owner_stresses(const Memory& m, bool tangent, const double (&pressure)[2][8], BatchScratch& s) const noexcept {
  for (int c = 0; c < D * D; ++c) std::fill_n(s.P + c * batch_points, 8, 0.0);
  add_owner_stress(laws_.space(), {8, 8, m.owner_H, tangent ? m.owner_dH : nullptr}, pressure[0], pressure[1], s.P, batch_points);
}

template <int D>
std::uint8_t WeightedModel<D>::lanes(const Group& g, const Pass& pass) const noexcept {
  unsigned lanes = g.live & ((1u << g.count) - 1);
  for (unsigned l = 0; l < g.count && pass.only; ++l)
    if (!pass.wanted(members_[g.first + l])) lanes &= ~(1u << l);
  return static_cast<std::uint8_t>(lanes);
}

template <int D>
std::int32_t WeightedModel<D>::single(const Group& g, Memory& m, BatchScratch& s, Pass& pass, double* energy) {
  const std::int32_t p = members_[g.first];
  m.index.clear();
  if (lattice_) {
    load_class(g.family, m);
    for (const std::int32_t shift : classes_[static_cast<std::size_t>(g.family)].shifts) m.index.push_back(p + shift);
  } else {
    load_cloud_family(static_cast<std::size_t>(p), m);
    const auto family = cloud_->neighbours(static_cast<std::size_t>(p));
    m.index.assign(family.begin(), family.end());
  }
  return evaluate_family(p, m, s, pass, energy);
}

template <int D>
std::int32_t WeightedModel<D>::evaluate_family(std::int32_t p, Memory& m, BatchScratch& s, Pass& pass, double* energy) {
  const bool tangent = pass.work.tangent(), sample = pass.work.work() == Work::sample, alone = pass.alone();
  const std::size_t size = m.family.size;
  load_differences(p, u_rows_, m, m.u);
  if (tangent) load_differences(p, w_rows_, m, m.w);
  const double* fields[2][D];
  for (std::size_t c = 0; c < D; ++c) {
    fields[0][c] = m.u.data() + c * size;
    fields[1][c] = m.w.data() + (tangent ? c * size : 0);
  }
  build(m, tangent ? 2 : 1, fields);
  LocalStencil<D>& stencil = m.stencil;
  double pressure[2][8] = {};  // on the owner's gradient (selective map), and its rate
  double* const H = formulation_.selective() ? s.Ht : s.H;
  double* const dH = formulation_.selective() ? s.dHt : s.dH;
  for (int first = 0; first < stencil.points(); first += batch_points) {
    const int n = std::min(batch_points, stencil.points() - first);
    stencil.gradient(0, first, n, H, batch_points);
    if (tangent) stencil.gradient(1, first, n, dH, batch_points);
    if (formulation_.selective() && first == 0) keep_owner_gradients(1, left(p), m, s, tangent);
    for (int l = 0; l < n; ++l) {
      s.owner[l] = p;
      s.weight[l] = weight(p, stencil.share(first + l));
    }
    if (pass.work.evaluate(n, s, false, energy) >= 0) return p;
    if (sample) pass.work.add_samples(n, s, *pass.sums);
    if (alone) continue;
    for (int l = 0; l < n && formulation_.selective(); ++l) {
      pressure[0][0] += s.pressure[l];
      if (tangent) pressure[1][0] += s.pressure_rate[l];
    }
    stencil.add_stress(first, n, s.P, batch_points);
  }
  if (alone) return -1;
  if (formulation_.selective()) {
    double stress[D * D][8] = {};
    add_owner_stress(laws_.space(), {8, 8, m.owner_H, tangent ? m.owner_dH : nullptr}, pressure[0], pressure[1], stress[0], 8);
    for (auto& component : stress) std::fill_n(component + 1, 7, 0.0);
    stencil.add_stress(0, 1, stress[0], 8);
  }
  m.t.resize(D * size);
  double* t[D];
  for (std::size_t c = 0; c < D; ++c) t[c] = m.t.data() + c * size;
  stencil.adjoint(t);
  Row sum{};
  for (std::size_t k = 0; k < m.index.size(); ++k) {
    Row force{};
    for (std::size_t c = 0; c < D; ++c) force[c] = t[c][k];
    sum += force;
    out_rows_[static_cast<std::size_t>(m.index[k])] -= force;
  }
  out_rows_[static_cast<std::size_t>(p)] += sum;
  return -1;
}

template <int D>
std::int32_t WeightedModel<D>::together(const Group& g, Memory& m, BatchScratch& s, Pass& pass, double* energy) {
  const MirroredStencil<D>& stencil = stencils_[static_cast<std::size_t>(g.stencil)];
  const std::int32_t* members = members_.data() + g.first;
  const LanePoints points{members, g.count, g.contiguous, classes_[static_cast<std::size_t>(g.family)].shifts.data()};
  const bool tangent = pass.work.tangent(), sample = pass.work.work() == Work::sample, alone = pass.alone();
  const std::uint8_t here = lanes(g, pass);
  const bool all = here == (1u << g.count) - 1;
  const auto bonds = static_cast<std::size_t>(stencil.bonds()), evaluated = static_cast<std::size_t>(stencil.points());
  const auto coefficients = [&](ConstFieldView field, AlignedVector<double>& hat, AlignedVector<double>& out) {
    hat.resize(bonds * D * 8);
    out.resize(evaluated * D * D * 8);
    gather_coefficients<D>(stencil.bond_basis(), points, field, hat.data());
    stencil.gradient(hat.data(), out.data());
  };
  coefficients(pass.u, m.u, m.m);
  if (tangent) coefficients(pass.w, m.w, m.dm);
  double lane_weight[8], pressure[2][8] = {};  // pressure: on the owners' gradients (selective map), and its rate
  double* const H = formulation_.selective() ? s.Ht : s.H;
  double* const dH = formulation_.selective() ? s.dHt : s.dH;
  for (int l = 0; l < 8; ++l) lane_weight[l] = here >> l & 1 ? weight(members[l], 1.0) : 0.0;
  const std::vector<MirrorBasis::Orbit>& orbits = stencil.point_basis().orbits;
  for (auto begin = orbits.begin(); begin != orbits.end();) {
    // As many orbits as a batch holds.
    auto end = begin;
    int slots = 0;
    for (; end != orbits.end() && (slots + end->size) * 8 <= batch_points; slots += end++->size) {
      orbit_gradients<D>(*end, m.m.data(), slots, H);
      if (tangent) orbit_gradients<D>(*end, m.dm.data(), slots, dH);
      if (!all) clear_lanes(here, slots, end->size, H, tangent ? dH : nullptr);
      for (int i = 0; i < end->size; ++i)
        for (int l = 0; l < 8; ++l) {
          s.owner[(slots + i) * 8 + l] = members[l];
          s.weight[(slots + i) * 8 + l] = lane_weight[l] * stencil.share(end->element[i]);
        }
    }
    if (formulation_.selective() && begin == orbits.begin()) keep_owner_gradients(8, 1.0, m, s, tangent);
    const int bad = pass.work.evaluate(slots * 8, s, false, energy);
    if (bad >= 0) return members[bad % 8];
    if (sample) pass.work.add_samples(slots * 8, s, *pass.sums);
    if (formulation_.selective() && !alone) add_pressures(slots * 8, s, tangent, pressure);
    slots = 0;
    for (; begin != end; slots += begin++->size)
      if (!alone) orbit_stresses<D>(*begin, s.P, slots, m.m.data());
  }
  if (alone) return -1;
  if (formulation_.selective()) {
    owner_stresses(m, tangent, pressure, s);
    orbit_stresses<D>(orbits.front(), s.P, 0, m.m.data());
  }
  m.t.assign(bonds * D * 8, 0.0);
  stencil.adjoint(m.m.data(), m.t.data());
  scatter_coefficients<D>(stencil.bond_basis(), points, m.t.data(), m.u.data(), pass.out);
  return -1;
}

template <int D>
std::int32_t WeightedModel<D>::side_by_side(const Group& g, std::size_t b, Memory& m, BatchScratch& s, Pass& pass, double* energy) {
  const SparseStencils<D>& stencils = sparse_[b];
  const std::size_t stencil = g.first - groups_[block_first_[b]].first;
  const bool tangent = pass.work.tangent(), sample = pass.work.work() == Work::sample, alone = pass.alone();
  const std::span<const std::int32_t> members(members_.data() + g.first, g.count);
  const std::uint8_t here = lanes(g, pass);
  const bool all = here == (1u << g.count) - 1;
  const auto gradients = [&](const AlignedVector<Row>& rows, int first, int n, double* H) {
    for (std::size_t l = 0; l < members.size(); ++l)
      stencils.gradient(stencil + l, first, n, static_cast<std::size_t>(members[l]), rows.data(), H + l, batch_points);
    for (int c = 0; c < D * D && members.size() < 8; ++c)
      for (int q = 0; q < n; ++q) std::fill_n(H + c * batch_points + 8 * q + members.size(), 8 - members.size(), 0.0);
  };
  const auto scatter = [&](int first, int n) {
    for (std::size_t l = 0; l < members.size(); ++l)
      stencils.scatter(stencil + l, first, n, static_cast<std::size_t>(members[l]), s.P + l, batch_points, out_rows_.data());
  };
  double* const H = formulation_.selective() ? s.Ht : s.H;
  double* const dH = formulation_.selective() ? s.dHt : s.dH;
  double pressure[2][8] = {};  // on the owners' gradients (selective map), and its rate
  for (int first = 0; first < owners_ + parts_; first += batch_points / 8) {
    const int n = std::min(batch_points / 8, owners_ + parts_ - first);
    gradients(u_rows_, first, n, H);
    if (tangent) gradients(w_rows_, first, n, dH);
    if (!all) clear_lanes(here, 0, n, H, tangent ? dH : nullptr);
    if (formulation_.selective() && first == 0) keep_owner_gradients(8, 1.0, m, s, tangent);
    for (int l = 0; l < 8 * n; ++l) {
      const auto lane = static_cast<std::size_t>(l % 8);
      s.owner[l] = members[lane < members.size() ? lane : 0];
      s.weight[l] = here >> lane & 1 ? weight(s.owner[l], stencils.share(stencil + lane, first + l / 8)) : 0.0;
    }
    const int bad = pass.work.evaluate(8 * n, s, false, energy);
    if (bad >= 0) return s.owner[bad];
    if (sample) pass.work.add_samples(8 * n, s, *pass.sums);
    if (alone) continue;
    if (formulation_.selective()) add_pressures(8 * n, s, tangent, pressure);
    scatter(first, n);
  }
  if (alone || !formulation_.selective()) return -1;
  owner_stresses(m, tangent, pressure, s);
  scatter(0, 1);
  return -1;
}

template <int D>
void WeightedModel<D>::block(std::size_t b, Pass& pass) {
  BatchScratch& s = scratch_.begin_block(b);
  Memory& m = *memory_[static_cast<std::size_t>(thread_index())];
  double energy = 0;
  for (std::size_t g = block_first_[b]; g < block_first_[b + 1]; ++g) {
    const Group& group = groups_[g];
    if (lanes(group, pass) == 0) continue;
    const std::int32_t bad = group.stencil >= 0 ? together(group, m, s, pass, &energy)
                             : sparse_.empty()  ? single(group, m, s, pass, &energy)
                                                : side_by_side(group, b, m, s, pass, &energy);
    if (bad >= 0) {
      pass.report(bad);
      return;
    }
  }
  for (std::size_t k = 0; k < (left_.empty() ? 0 : left_[b].size()); ++k) {
    const std::int32_t p = left_[b][k];
    if (!pass.wanted(p)) continue;
    load_own_family(p, m);
    if (m.index.empty()) continue;
    if (evaluate_family(p, m, s, pass, &energy) >= 0) {
      pass.report(p);
      return;
    }
  }
  if (pass.energies) pass.energies[b] = energy;
}

template <int D>
EvaluationStatus WeightedModel<D>::run(Pass& pass) {
  scratch_.prepare(laws_);
  while (memory_.size() < static_cast<std::size_t>(thread_count())) memory_.push_back(std::make_unique<Memory>());
  const std::size_t stride = body_.stride();
  if (singles_) {
    mirror_rows(pass.u, stride, u_rows_);
    if (pass.work.tangent()) mirror_rows(pass.w, stride, w_rows_);
  }
  if (pass.alone()) {
    parallel_for(block_first_.size() - 1, [&](std::size_t b) { block(b, pass); });
    return status_at(body_, pass.bad);
  }
  for (int c = 0; c < D; ++c) std::memset(pass.out.component(c), 0, pass.out.stride * sizeof(double));
  if (singles_) out_rows_.assign(stride, Row{});
  if (pass.work.tangent()) quiet_.wake();
  else quiet_.look(1, [&](std::size_t b) {
    if (lattice_) return lattice_->moves(b, pass.u);
    return cloud_moves(pass.u, b, body_.points(), cloud_block);
  });
  (lattice_ ? lattice_->colouring : cloud_colouring_).for_each([&](std::size_t b) {
    if (quiet_.awake(b, 1)) block(b, pass);
  });
  if (singles_) {
    parallel_for(cloud_blocks(stride), [&](std::size_t b) {
      for (std::size_t p = b * cloud_block_points; p < std::min(stride, (b + 1) * cloud_block_points); ++p)
        for (int c = 0; c < D; ++c) pass.out.component(c)[p] += out_rows_[p][c];
    });
  }
  return status_at(body_, pass.bad);
}

template <int D>
EvaluationStatus WeightedModel<D>::forces(ConstFieldView u, FieldView force, double* energy) {
  return run_forces(laws_, formulation_.selective(), block_first_.size() - 1, u, force, energy, [&](Pass& pass) { return run(pass); });
}

template <int D>
EvaluationStatus WeightedModel<D>::tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) {
  const BatchWork work(laws_, Work::tangent, false, formulation_.selective());
  Pass pass{work, u, w, Kw, nullptr, nullptr, -1, {}};
  return run(pass);
}

template <int D>
EvaluationStatus WeightedModel<D>::sample(ConstFieldView u, PointSamples& samples) {
  return run_samples(body_, laws_, formulation_.selective(), u, samples, [&](Pass& pass) { return run(pass); });
}

template <int D>
ModelReport WeightedModel<D>::report() const {
  ModelReport report;
  report.bonds = bonds_;
  report.broken_bonds = broken_;
  report.singular_families = singular_;
  report.fallbacks = fallbacks_;
  report.dropped_parts = dropped_;
  report.evaluation_points = parts_ > 0 ? body_.points() * static_cast<std::size_t>(parts_) : bonds_;
  std::size_t stencils = 0;
  for (const MirroredStencil<D>& s : stencils_) stencils += s.bytes();
  std::size_t sparse = 0;
  for (const SparseStencils<D>& s : sparse_) sparse += s.bytes();
  report.bytes = (lattice_ ? lattice_->bytes() : cloud_->bytes()) + stencils + groups_.size() * sizeof(Group) +
                 members_.size() * sizeof(std::int32_t) + sparse +
                 (u_rows_.size() + w_rows_.size() + out_rows_.size()) * sizeof(Row) + condition_.bytes() + damage_.bytes() +
                 scratch_.bytes() + place_.size() * sizeof(Place) + this->fracture_bytes();
  if (lattice_) {
    const auto points = static_cast<double>(body_.points());
    std::size_t together = 0;
    for (const Group& group : groups_) together += group.stencil >= 0 ? group.count : 0;
    if (!stencils_.empty()) {
      const double whole = 8.0 * D * static_cast<double>(lattice_->offsets.size()) *
                           (parts_ > 0 ? parts_ : static_cast<double>(lattice_->offsets.size()));
      report.skips.push_back(
          {"stencils of equal families",
           fmt::format("{} stored for {} of {} points, by characters of their mirrors", stencils_.size(), together,
                       body_.points()),
           fmt::format("{:.3g} MB stored instead of {:.3g} MB", static_cast<double>(stencils) / 1e6, whole * points / 1e6)});
    }
    report.skips.push_back({"neighbour lists and bond vectors", "lattice: neighbours lie at fixed shifts",
                            fmt::format("{:.3g} MB", static_cast<double>(bonds_) * (4 + 8 * (D + 1)) / 1e6)});
  }
  return report;
}

template class WeightedModel<1>;
template class WeightedModel<2>;
template class WeightedModel<3>;

}  // namespace perikit
