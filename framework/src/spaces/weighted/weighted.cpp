#include "spaces/weighted/weighted.hpp"

#include <algorithm>
#include <cstring>
#include <optional>
#include <type_traits>

#include "spaces/weighted/weighted_kernel.hpp"

namespace perikit {

template <int D>
void Weighted<D>::load_differences(std::int32_t point, const AlignedVector<Row>& rows, const Memory& m, AlignedVector<double>& out) const {
  const std::size_t size = m.family.size, bonds = m.family.far.size();
  out.resize(D * size);
  for (std::size_t c = 0; c < D; ++c) std::fill_n(out.data() + c * size + bonds, size - bonds, 0.0);
  const Row own = rows[static_cast<std::size_t>(point)];
  for (std::size_t k = 0; k < bonds; ++k) {
    const Row difference = rows[static_cast<std::size_t>(m.family.far[k])] - own;
    for (std::size_t c = 0; c < D; ++c) out[c * size + k] = difference[c];
  }
}

template <int D>
double Weighted<D>::weight(std::int32_t p) const noexcept {
  const auto at = static_cast<std::size_t>(p);
  return parts_ > 0 ? body_.volume(at) * (1 - families_.damage(at)) : body_.volume(at);
}

template <int D>
void Weighted<D>::keep_owner_gradients(int points, double share, Memory& m, BatchScratch& s, bool tangent) const noexcept {
  for (std::size_t c = 0; c < D * D; ++c) {
    std::copy_n(s.Ht + c * batch_points, 8, m.owner_H + c * 8);
    if (tangent) std::copy_n(s.dHt + c * batch_points, 8, m.owner_dH + c * 8);
  }
  for (auto& pressure : m.pressure) std::fill_n(pressure, 8, 0.0);
  owner_volume(laws_.space(), {8, 8, m.owner_H, tangent ? m.owner_dH : nullptr}, s.volume, batch_points);
  s.volume[volume_share * batch_points] = share;
  for (int c = 0; c < volume_components && points == 1; ++c) std::fill_n(s.volume + c * batch_points, 8, s.volume[c * batch_points]);
  std::fill(std::begin(s.volume_group), std::end(s.volume_group), 0);
  s.owner_volumes = {s.volume, batch_points, s.volume_group, share == 1};   // an owner without a gradient has none at its evaluation points either
}

template <int D>
void Weighted<D>::clear_lanes(std::uint8_t kept, int slot, int slots, double* H, double* dH) noexcept {
  for (double* gradient : {H, dH})
    for (int c = 0; c < D * D && gradient; ++c)
      for (int l = 0; l < 8 * slots; ++l)
        if (!(kept >> l % 8 & 1)) gradient[c * batch_points + 8 * slot + l] = 0.0;
}

template <int D>
void Weighted<D>::add_pressures(int lanes, int wide, const BatchScratch& s, bool tangent, Memory& m) noexcept {
  for (int l = 0; l < lanes; ++l) {
    m.pressure[0][l % wide] += s.pressure[l];
    if (tangent) m.pressure[1][l % wide] += s.pressure_rate[l];
  }
}

template <int D>
void Weighted<D>::owner_stresses(const Memory& m, bool tangent, BatchScratch& s) const noexcept {
  for (int c = 0; c < D * D; ++c) std::fill_n(s.P + c * batch_points, 8, 0.0);
  add_owner_stress(laws_.space(), {8, 8, m.owner_H, tangent ? m.owner_dH : nullptr}, m.pressure[0], m.pressure[1], s.P, batch_points);
}

template <int D>
std::uint8_t Weighted<D>::lanes(const Group& g, const Pass& pass) const noexcept {
  unsigned lanes = g.live & ((1u << g.count) - 1);
  for (unsigned l = 0; l < g.count && pass.only; ++l)
    if (!pass.wanted(members_[g.first + l])) lanes &= ~(1u << l);
  return static_cast<std::uint8_t>(lanes);
}

template <int D>
std::int32_t Weighted<D>::single(std::size_t g, Memory& m, BatchScratch& s, Pass& pass, GroupEnergy* energy) {
  const std::int32_t p = members_[groups_[g].first];
  if (lattice_) {
    load_class(groups_[g].family, m);
    for (std::int32_t& far : m.family.far) far += p;
  } else {
    load_family(static_cast<std::size_t>(p), BondsOf::set_up, m);
  }
  m.original.clear();
  return evaluate_family(p, number_of(g), m, s, pass, energy);
}

template <int D>
std::int32_t Weighted<D>::bond_at_set_up(std::int32_t p, std::int32_t far, const Group& g) const noexcept {
  if (cloud_) return static_cast<std::int32_t>(cloud_->index(p, far) - cloud_->lists().first[static_cast<std::size_t>(p)]);
  const std::vector<std::int32_t>& shifts = classes_[static_cast<std::size_t>(g.family)].shifts;
  return static_cast<std::int32_t>(std::find(shifts.begin(), shifts.end(), far - p) - shifts.begin());
}

/// A point that has left its group keeps the numbers of its evaluation points.
template <int D>
PointNumbers Weighted<D>::number_of(std::int32_t p, std::int32_t far, int part) const noexcept {
  const Place& place = place_[static_cast<std::size_t>(p)];
  if (groups_.empty() || members_[groups_[place.group].first + place.lane] != p) return {};   // a point without bonds
  const std::int64_t number = number_of(place.group) + place.lane + 8 * (parts_ > 0 ? part : bond_at_set_up(p, far, groups_[place.group]));
  return {number, number};
}

template <int D>
std::int32_t Weighted<D>::evaluate_detached_point(std::int32_t p, Memory& m, BatchScratch& s, Pass& pass, GroupEnergy* energy) {
  const Place& place = place_[static_cast<std::size_t>(p)];
  if (!sparse_.empty()) {
    std::unique_ptr<SparseStencils<D>>& stencil = remade_[static_cast<std::size_t>(p)];
    if (!stencil) {
      stencil = std::make_unique<SparseStencils<D>>();
      load_family(static_cast<std::size_t>(p), BondsOf::intact, m);
      if (!m.family.far.empty()) {
        build(m, 0, nullptr);
        stencil->append(m.stencil, m.family.far);
      }
    }
    if (stencil->size() == 0) return -1;
    m.original.clear();
    return evaluate_point(p, number_of(place.group) + place.lane, StoredStencil{*this, *stencil, p}, m, s, pass, energy);
  }
  load_family(static_cast<std::size_t>(p), BondsOf::intact, m);
  if (m.family.far.empty()) return -1;
  m.original.clear();
  if ((pass.work.numbered() || factor_) && parts_ == 0)
    for (const std::int32_t far : m.family.far) m.original.push_back(bond_at_set_up(p, far, groups_[place.group]));
  return evaluate_family(p, number_of(place.group) + place.lane, m, s, pass, energy);
}

template <int D>
struct Weighted<D>::MadeStencil {
  Weighted& space;
  Memory& m;
  std::int32_t p;
  int points() const noexcept { return m.stencil.points(); }
  double share(int q) const noexcept { return m.stencil.share(q); }
  void gradient(int field, int first, int n, double* H) const noexcept { m.stencil.gradient(field, first, n, H, batch_points); }
  void add_stress(int first, int n, double* P) const noexcept {
    // Of whole packs.
    for (int c = 0; c < D * D; ++c) std::fill(P + c * batch_points + n, P + c * batch_points + static_cast<int>(padded(static_cast<std::size_t>(n))), 0.0);
    m.stencil.add_stress(first, n, P, batch_points);
  }
  void finish() const { space.scatter_rows(p, m); }
};

/// Its evaluation points come at every eighth lane.
template <int D>
struct Weighted<D>::StoredStencil {
  Weighted& space;
  const SparseStencils<D>& stencil;
  std::int32_t p;
  int points() const noexcept { return space.owners_ + space.parts_; }
  double share(int q) const noexcept { return stencil.share(0, q); }
  void gradient(int field, int first, int n, double* H) const noexcept {
    const AlignedVector<Row>& rows = field == 0 ? space.u_rows_ : space.w_rows_;
    double apart[9 * batch_points];
    stencil.gradient(0, first, n, static_cast<std::size_t>(p), rows.data(), apart, batch_points);
    for (int c = 0; c < D * D; ++c) {
      for (int q = 0; q < n; ++q) H[c * batch_points + q] = apart[c * batch_points + 8 * q];
      std::fill(H + c * batch_points + n, H + c * batch_points + static_cast<int>(padded(static_cast<std::size_t>(n))), 0.0);
    }
  }
  void add_stress(int first, int n, const double* P) const noexcept {
    double apart[9 * batch_points];
    for (int c = 0; c < D * D; ++c)
      for (int q = 0; q < n; ++q) apart[c * batch_points + 8 * q] = P[c * batch_points + q];
    stencil.scatter(0, first, n, static_cast<std::size_t>(p), apart, batch_points, space.out_rows_.data());
  }
  void finish() const noexcept {}
};

template <int D>
std::int32_t Weighted<D>::evaluate_family(std::int32_t p, std::int64_t number, Memory& m, BatchScratch& s, Pass& pass, GroupEnergy* energy) {
  const bool tangent = pass.work.tangent();
  const std::size_t size = m.family.size;
  load_differences(p, u_rows_, m, m.u);
  if (tangent) load_differences(p, w_rows_, m, m.w);
  const double* fields[2][D];
  for (std::size_t c = 0; c < D; ++c) {
    fields[0][c] = m.u.data() + c * size;
    fields[1][c] = m.w.data() + (tangent ? c * size : 0);
  }
  build(m, tangent ? 2 : 1, fields, rules_.local() ? families_.normaliser(static_cast<std::size_t>(p), BondWeight::volume) : 0.0);
  return evaluate_point(p, number, MadeStencil{*this, m, p}, m, s, pass, energy);
}

template <int D>
template <class Stencil>
std::int32_t Weighted<D>::evaluate_point(std::int32_t p, std::int64_t number, Stencil stencil, Memory& m, BatchScratch& s, Pass& pass, GroupEnergy* energy) {
  const bool tangent = pass.work.tangent(), sample = pass.work.work() == Work::sample, alone = pass.gathers_only(), ends = sample || pass.work.screens_bonds() || pass.work.wants_ends();
  double* const H = selective_ ? s.Ht : s.H;
  double* const dH = selective_ ? s.dHt : s.dH;
  const double volume = weight(p);
  double factors[batch_points];
  // A multiple of eight that the lanes of a stored stencil leave room for.
  constexpr int at_once = std::is_same_v<Stencil, StoredStencil> ? batch_points / 8 : batch_points;
  for (int first = 0; first < stencil.points(); first += at_once) {
    const int n = std::min(at_once, stencil.points() - first);
    stencil.gradient(0, first, n, H);
    if (tangent) stencil.gradient(1, first, n, dH);
    if (selective_ && first == 0) keep_owner_gradients(1, families_.remaining_influence(static_cast<std::size_t>(p)), m, s, tangent);
    for (int l = 0; l < n; ++l) {
      s.owner[l] = p;
      const int k = first + l - owners_, original = k < 0 || m.original.empty() ? k : m.original[static_cast<std::size_t>(k)];
      factors[l] = factor(p, original);
      s.weight[l] = volume * stencil.share(first + l) * factors[l];
      s.number[l] = k < 0 ? -1 : number + 8 * original;
      if (ends) s.far[l] = parts_ > 0 ? far_of_part(k, pass) : k < 0 ? -1 : m.family.far[static_cast<std::size_t>(k)];
    }
    if (pass.work.evaluate(n, s, false, energy) >= 0) return p;
    if (pass.work.balance() && alone)
      for (int l = std::max(0, owners_ - first); l < n; ++l)
        pass.work.balance()->factors[factor_of(p, first + l - owners_)] = s.psi[l];
    if (pass.work.screens_bonds()) pass.work.screen_bonds(n, -1, s, factors);
    else pass.work.screen(&p, 1, n, s);
    if (sample) pass.add_samples(n, s);
    if (alone) continue;
    if (selective_) add_pressures(n, 1, s, tangent, m);
    pass.work.weigh_stress(n, s);
    stencil.add_stress(first, n, s.P);
  }
  if (alone) return -1;
  if (selective_) {
    owner_stresses(m, tangent, s);
    stencil.add_stress(0, 1, s.P);
  }
  stencil.finish();
  return -1;
}

template <int D>
void Weighted<D>::scatter_rows(std::int32_t p, Memory& m) {
  const std::size_t size = m.family.size;
  m.t.resize(D * size);
  double* t[D];
  for (std::size_t c = 0; c < D; ++c) t[c] = m.t.data() + c * size;
  m.stencil.adjoint(t);
  Row sum{};
  for (std::size_t k = 0; k < m.family.far.size(); ++k) {
    Row force{};
    for (std::size_t c = 0; c < D; ++c) force[c] = t[c][k];
    sum += force;
    out_rows_[static_cast<std::size_t>(m.family.far[k])] -= force;
  }
  out_rows_[static_cast<std::size_t>(p)] += sum;
}

template <int D>
std::int32_t Weighted<D>::together(std::size_t group, Memory& m, BatchScratch& s, Pass& pass, GroupEnergy* energy) {
  const Group& g = groups_[group];
  const std::int64_t number = number_of(group);
  const MirroredStencil<D>& stencil = stencils_[static_cast<std::size_t>(g.stencil)];
  const std::int32_t* members = members_.data() + g.first;
  const LanePoints points{members, g.count, g.contiguous, classes_[static_cast<std::size_t>(g.family)].shifts.data()};
  const bool tangent = pass.work.tangent(), sample = pass.work.work() == Work::sample, alone = pass.gathers_only(), ends = sample || pass.work.screens_bonds() || pass.work.wants_ends();
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
  double lane_weight[8];
  double* const H = selective_ ? s.Ht : s.H;
  double* const dH = selective_ ? s.dHt : s.dH;
  for (int l = 0; l < 8; ++l) lane_weight[l] = here >> l & 1 ? weight(members[l]) : 0.0;
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
          const int lane = (slots + i) * 8 + l, k = stencil.original(end->element[i]) - owners_;
          s.owner[lane] = members[l];
          s.weight[lane] = lane_weight[l] * stencil.share(end->element[i]);
          s.number[lane] = k < 0 || !(here >> l & 1) ? -1 : number + 8 * k + l;
          if (ends) s.far[lane] = parts_ > 0 ? far_of_part(k, pass) : k < 0 ? -1 : members[l] + points.shift[k];
        }
    }
    if (selective_ && begin == orbits.begin()) keep_owner_gradients(8, 1.0, m, s, tangent);
    const int bad = pass.work.evaluate(slots * 8, s, false, energy);
    if (bad >= 0) return members[bad % 8];
    if (pass.work.screens_bonds()) pass.work.screen_bonds(slots * 8, -1, s);
    else pass.work.screen(members, 8, slots * 8, s);
    if (sample) pass.add_samples(slots * 8, s);
    if (selective_ && !alone) add_pressures(slots * 8, 8, s, tangent, m);
    if (!alone) pass.work.weigh_stress(slots * 8, s);
    slots = 0;
    for (; begin != end; slots += begin++->size)
      if (!alone) orbit_stresses<D>(*begin, s.P, slots, m.m.data());
  }
  if (alone) return -1;
  if (selective_) {
    owner_stresses(m, tangent, s);
    orbit_stresses<D>(orbits.front(), s.P, 0, m.m.data());
  }
  m.t.assign(bonds * D * 8, 0.0);
  stencil.adjoint(m.m.data(), m.t.data());
  scatter_coefficients<D>(stencil.bond_basis(), points, m.t.data(), m.u.data(), pass.out);
  return -1;
}

template <int D>
std::int32_t Weighted<D>::side_by_side(std::size_t group, std::size_t b, Memory& m, BatchScratch& s, Pass& pass, GroupEnergy* energy) {
  const Group& g = groups_[group];
  const std::int64_t number = number_of(group);
  const SparseStencils<D>& stencils = sparse_[b];
  const std::size_t stencil = g.first - groups_[block_first_[b]].first;
  const bool tangent = pass.work.tangent(), sample = pass.work.work() == Work::sample, alone = pass.gathers_only();
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
  double* const H = selective_ ? s.Ht : s.H;
  double* const dH = selective_ ? s.dHt : s.dH;
  double lane_weight[8];
  for (std::size_t l = 0; l < 8; ++l) lane_weight[l] = here >> l & 1 ? weight(members[l]) : 0.0;
  for (int first = 0; first < owners_ + parts_; first += batch_points / 8) {
    const int n = std::min(batch_points / 8, owners_ + parts_ - first);
    gradients(u_rows_, first, n, H);
    if (tangent) gradients(w_rows_, first, n, dH);
    if (!all) clear_lanes(here, 0, n, H, tangent ? dH : nullptr);
    if (selective_ && first == 0) keep_owner_gradients(8, 1.0, m, s, tangent);
    for (int l = 0; l < 8 * n; ++l) {
      const auto lane = static_cast<std::size_t>(l % 8);
      const int k = first + l / 8 - owners_;
      const bool in = here >> lane & 1;
      s.owner[l] = members[lane < members.size() ? lane : 0];
      s.weight[l] = in ? lane_weight[lane] * stencils.share(stencil + lane, first + l / 8) : 0.0;
      s.number[l] = k < 0 || !in ? -1 : number + 8 * k + static_cast<std::int64_t>(lane);
    }
    if (sample || pass.work.wants_ends())
      for (int l = 0; l < 8 * n; ++l) s.far[l] = far_of_part(first + l / 8 - owners_, pass);
    const int bad = pass.work.evaluate(8 * n, s, false, energy);
    if (bad >= 0) return s.owner[bad];
    pass.work.screen(members.data(), static_cast<int>(members.size()), 8 * n, s);
    if (sample) pass.add_samples(8 * n, s);
    if (alone) continue;
    if (selective_) add_pressures(8 * n, 8, s, tangent, m);
    pass.work.weigh_stress(8 * n, s);
    scatter(first, n);
  }
  if (alone || !selective_) return -1;
  owner_stresses(m, tangent, s);
  scatter(0, 1);
  return -1;
}

template <int D>
void Weighted<D>::block(std::size_t b, Pass& pass) {
  BatchScratch& s = scratch_.mine();
  Memory& m = *memory_[static_cast<std::size_t>(thread_index())];
  GroupEnergy energy;
  for (std::size_t g = block_first_[b]; g < block_first_[b + 1]; ++g) {
    const Group& group = groups_[g];
    if (lanes(group, pass) == 0) continue;
    const std::int32_t bad = group.stencil >= 0 ? together(g, m, s, pass, &energy)
                             : sparse_.empty()  ? single(g, m, s, pass, &energy)
                                                : side_by_side(g, b, m, s, pass, &energy);
    if (bad >= 0) return pass.report(bad);
  }
  for (std::size_t k = 0; k < (left_.empty() ? 0 : left_[b].size()); ++k) {
    const std::int32_t p = left_[b][k];
    if (!pass.wanted(p)) continue;
    if (evaluate_detached_point(p, m, s, pass, &energy) >= 0) return pass.report(p);
  }
  if (pass.energies && block_first_[b] < block_first_[b + 1]) pass.energies[first_group(b)] = energy;
}

template <int D>
void Weighted<D>::run(Pass& pass) {
  scratch_.prepare(laws_, pass.work.laminates());
  while (memory_.size() < static_cast<std::size_t>(thread_count())) memory_.push_back(std::make_unique<Memory>());
  const std::size_t stride = body_.stride();
  Arrival* arrival = pass.arrival;
  std::optional<ArrivingRows> rows;
  if (singles_) {
    arrival = &rows.emplace(pieces_, pass.u, u_rows_, arrival);
    if (pass.work.tangent()) mirror_rows(pass.w, stride, w_rows_);
  }
  if (pass.gathers_only()) return parallel_for(blocks(), [&](std::size_t b) { block(b, pass); });
  if (singles_) out_rows_.assign(stride, Row{});
  if (pass.everywhere())
    quiet_.wake();
  else
    quiet_.look(
        1, [&](std::size_t b) { return lattice_ ? lattice_->tiles.moves(b, pass.u) : CloudBlocks(body_).moves(pass.u, b); }, arrival);
  (lattice_ ? lattice_->tiles.colouring : cloud_colouring_)
      .for_each(
          [&](std::size_t b) {
            if (quiet_.awake(b, 1)) block(b, pass);
          },
          arrival);
  if (!singles_) return;
  pieces_of(stride).over_points([&](std::size_t p) {
    for (int c = 0; c < D; ++c) pass.out.component(c)[p] += out_rows_[p][c];
  });
}

template class Weighted<1>;
template class Weighted<2>;
template class Weighted<3>;

}  // namespace perikit
