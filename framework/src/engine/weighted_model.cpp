#include "weighted_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "samples.hpp"
#include "shape_tensor.hpp"
#include "weighted_kernel.hpp"

namespace perikit {

template <int D>
WeightedModel<D>::WeightedModel(const ModelParts& parts)
    : AssemblingModel(parts), body_(*parts.body), laws_(*parts.laws), kinematics_(parts.kinematics), traits_(kinematics_->traits()), parts_(traits_.at == EvaluationPoints::points ? 1 : kinematics_->parts(D)),
      condition_(body_.make_field(1)), damage_(body_.make_field(1)) {
  normaliser_.assign(body_.stride(), 0.0);
  if (body_.lattice()) prepare_lattice(*parts.influence);
  else prepare_cloud(*parts.influence);
}

template <int D>
void WeightedModel<D>::prepare_lattice(const InfluenceFunction& influence) {
  const LatticeFamilies& f = lattice_.emplace(body_, influence, traits_.weight);
  bonds_ = f.bonds;
  broken_ = f.broken;
  singular_ = f.singular;
  const std::size_t slots = f.offsets.size();
  // A class is a set of intact slots together with its normaliser; class 0 is the whole family.
  std::map<std::pair<std::vector<std::uint16_t>, double>, std::int32_t> classes;
  std::vector<std::uint16_t> all(slots);
  for (std::size_t s = 0; s < slots; ++s) all[s] = static_cast<std::uint16_t>(s);
  lattice_bonds_.push_back(all);
  classes[{all, f.whole.scale[0]}] = 0;
  std::vector<std::vector<std::int32_t>> lane_class(f.patterns.size());
  for (std::size_t k = 0; k < f.patterns.size(); ++k) {
    const LatticePattern& pattern = f.patterns[k];
    for (int l = 0; l < chunk_points; ++l) {
      if (!(pattern.live >> l & 1)) {
        lane_class[k].push_back(-1);
        continue;
      }
      std::vector<std::uint16_t> bonds = f.intact_slots(pattern, l);
      const auto [entry, fresh] = classes.try_emplace({bonds, pattern.scale[l]}, static_cast<std::int32_t>(lattice_bonds_.size()));
      if (fresh) lattice_bonds_.push_back(std::move(bonds));
      lane_class[k].push_back(entry->second);
    }
  }
  for (const LatticeBlock& block : f.blocks) {
    block_first_.push_back(groups_.size());
    for (std::size_t c = block.chunk_begin; c < block.chunk_end; ++c) {
      const LatticeChunk& chunk = f.chunks[c];
      const LatticePattern& pattern = f.pattern(chunk);
      for (int l = 0; l < chunk_points; ++l) {
        normaliser_[static_cast<std::size_t>(chunk.first + l)] = pattern.scale[l] > 0 ? f.volume / pattern.scale[l] : 0.0;
        condition_.data()[chunk.first + l] = pattern.condition[l];
        damage_.data()[chunk.first + l] = pattern.damage[l];
      }
      if (chunk.pattern < 0) {
        groups_.push_back({chunk.first, 0, 0, true});
        continue;
      }
      for (int l = 0; l < chunk_points; ++l) {
        const std::int32_t family = lane_class[static_cast<std::size_t>(chunk.pattern)][static_cast<std::size_t>(l)];
        if (family >= 0) groups_.push_back({chunk.first + l, family, family, false});
      }
    }
  }
  block_first_.push_back(groups_.size());
  // Stencils of the classes, the most common ones first, kept up to the cap.
  std::vector<std::size_t> members(lattice_bonds_.size(), 0);
  std::vector<std::int32_t> example(lattice_bonds_.size(), -1);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const auto family = static_cast<std::size_t>(groups_[g].family);
    members[family] += groups_[g].whole ? chunk_points : 1;
    example[family] = static_cast<std::int32_t>(g);
  }
  std::vector<std::int32_t> order(lattice_bonds_.size()), stored(lattice_bonds_.size(), -1);
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<std::int32_t>(k);
  std::stable_sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) { return members[static_cast<std::size_t>(a)] > members[static_cast<std::size_t>(b)]; });
  std::size_t bytes = 0;
  Memory m;
  for (const std::int32_t k : order) {
    const auto family = static_cast<std::size_t>(k);
    if (members[family] == 0) break;
    Group group = groups_[static_cast<std::size_t>(example[family])];
    group.family = -1;
    load_family(group, m);
    count(m.stencil, members[family]);
    if (bytes > stencil_bytes) continue;
    bytes += m.stencil.bytes();
    stored[family] = static_cast<std::int32_t>(stencils_.size());
    stencils_.push_back(m.stencil);
  }
  for (Group& group : groups_) group.family = stored[static_cast<std::size_t>(group.family)];
}

template <int D>
void WeightedModel<D>::prepare_cloud(const InfluenceFunction& influence) {
  const CloudFamilies& f = cloud_.emplace(body_, influence, traits_.weight);
  bonds_ = f.bonds();
  broken_ = f.broken;
  singular_ = f.singular;
  condition_ = f.condition;
  damage_ = f.damage;
  for (std::size_t p = 0; p < body_.points(); ++p) {
    normaliser_[p] = f.normaliser[p];
    groups_.push_back({static_cast<std::int32_t>(p), -1, -1, false});
  }
  for (std::size_t p = 0; p < body_.points(); p += cloud_block) block_first_.push_back(p);
  block_first_.push_back(body_.points());
  Memory m;
  for (const Group& group : groups_) {
    load_family(group, m);
    count(m.stencil, 1);
  }
  const std::size_t blocks = block_first_.size() - 1;
  std::vector<std::vector<std::int32_t>> touches(blocks);
  for (std::size_t b = 0; b < blocks; ++b) {
    touches[b].push_back(static_cast<std::int32_t>(b));
    for (std::size_t p = block_first_[b]; p < block_first_[b + 1]; ++p)
      for (const std::int32_t j : f.neighbours(p)) touches[b].push_back(static_cast<std::int32_t>(static_cast<std::size_t>(j) / cloud_block));
    std::sort(touches[b].begin(), touches[b].end());
    touches[b].erase(std::unique(touches[b].begin(), touches[b].end()), touches[b].end());
  }
  cloud_colouring_ = Colouring(touches, blocks);
}

template <int D>
void WeightedModel<D>::load_family(const Group& group, Memory& m) const {
  const auto p = static_cast<std::size_t>(group.first);
  m.index.clear();
  if (lattice_) {
    for (const std::uint16_t s : lattice_bonds_[static_cast<std::size_t>(group.bonds)]) m.index.push_back(static_cast<std::int32_t>(group.first + lattice_->shifts[s]));
  } else {
    const auto family = cloud_->neighbours(p);
    m.index.assign(family.begin(), family.end());
  }
  if (group.family >= 0) return;
  if (lattice_) {
    lattice_->load(lattice_bonds_[static_cast<std::size_t>(group.bonds)], m.family);
  } else {
    cloud_->load(p, m.family);
  }
  m.share.assign(m.family.size, 0.0);
  for (std::size_t k = 0; k < m.index.size(); ++k) {
    m.share[k] = m.family.volume[k] * (traits_.weight == BondWeight::kernel ? m.family.omega[k] : 1.0) / normaliser_[p];
  }
  build_stencil(*kinematics_, traits_, m.family, body_.horizon(), m.share.data(), m.stencil, m.weights);
  if (parts_ > 0) {
    for (double& share : m.stencil.share) share *= 1 - damage_.data()[p];
  }
}

template <int D>
void WeightedModel<D>::count(const LocalStencil& stencil, std::size_t points) {
  fallbacks_ += static_cast<std::size_t>(stencil.fallbacks) * points;
  dropped_ += static_cast<std::size_t>(stencil.dropped) * points;
}

template <int D>
void WeightedModel<D>::gather(const Group& g, const LocalStencil& stencil, ConstFieldView u, const Memory& m, AlignedVector<double>& out) const {
  const auto bonds = static_cast<std::size_t>(stencil.bonds);
  out.resize(bonds * D * 8);
  for (std::size_t k = 0; k < bonds; ++k) {
    for (std::size_t c = 0; c < D; ++c) {
      const double* value = u.component(static_cast<int>(c));
      if (!g.whole) {
        out[k * D + c] = value[m.index[k]] - value[g.first];
        continue;
      }
      for (int l = 0; l < 8; l += pack_width) (Pack::load(value + m.index[k] + l) - Pack::load(value + g.first + l)).store(out.data() + (k * D + c) * 8 + static_cast<std::size_t>(l));
    }
  }
}

template <int D>
void WeightedModel<D>::scatter(const Group& g, const LocalStencil& stencil, const Memory& m, FieldView out) const {
  for (int c = 0; c < D; ++c) {
    double* f = out.component(c);
    for (int l = 0; l < 8; l += pack_width) {
      Pack own(0.0);
      double single = 0;
      for (int k = 0; k < stencil.bonds; ++k) {
        const double* t = m.t.data() + (k * D + c) * 8;
        if (g.whole) {
          const Pack v = Pack::load(t + l);
          own += v;
          double* far = f + m.index[static_cast<std::size_t>(k)] + l;
          (Pack::load(far) - v).store(far);
        } else if (l == 0) {
          double v = 0;
          for (int i = 0; i < 8; ++i) v += t[i];
          single += v;
          f[m.index[static_cast<std::size_t>(k)]] -= v;
        }
      }
      if (g.whole) (Pack::load(f + g.first + l) + own).store(f + g.first + l);
      else if (l == 0) f[g.first] += single;
    }
  }
}

template <int D>
void WeightedModel<D>::keep_owner_gradients(int points, Memory& m, BatchScratch& s, bool tangent) const noexcept {
  for (std::size_t c = 0; c < D * D; ++c) {
    std::copy_n(s.Ht + c * batch_points, 8, m.owner_H + c * 8);
    if (tangent) std::copy_n(s.dHt + c * batch_points, 8, m.owner_dH + c * 8);
  }
  owner_volume(laws_.space(), {8, 8, m.owner_H, tangent ? m.owner_dH : nullptr}, s.volume, batch_points);
  for (int c = 0; c < volume_components && points == 1; ++c) std::fill_n(s.volume + c * batch_points, 8, s.volume[c * batch_points]);
  std::fill(std::begin(s.volume_group), std::end(s.volume_group), 0);
  s.owner_volumes = {s.volume, batch_points, s.volume_group, true};   // an owner without a gradient has none at its evaluation points either
}

template <int D>
int WeightedModel<D>::group(const Group& g, Memory& m, BatchScratch& s, Pass& pass, double* energy) {
  load_family(g, m);
  if (m.index.empty()) return -1;
  const LocalStencil& stencil = g.family >= 0 ? stencils_[static_cast<std::size_t>(g.family)] : m.stencil;
  const bool tangent = pass.work.tangent(), sample = pass.work.work() == Work::sample;
  gather(g, stencil, pass.u, m, m.u);
  if (tangent) gather(g, stencil, pass.w, m, m.w);
  m.t.assign(static_cast<std::size_t>(stencil.bonds) * D * 8, 0.0);
  const int lanes_per_tile = g.whole ? 64 : 8, tiles_at_once = batch_points / lanes_per_tile, points = g.whole ? 8 : 1;
  double pressure[2][8] = {};   // on the owners' gradients (selective map), and its rate
  double* const H = traits_.selective ? s.Ht : s.H;
  double* const dH = traits_.selective ? s.dHt : s.dH;
  for (int tile = 0; tile < stencil.tiles; tile += tiles_at_once) {
    const int tiles = std::min(tiles_at_once, stencil.tiles - tile);
    for (int i = 0; i < tiles; ++i) {
      const int lane = i * lanes_per_tile;
      if (g.whole) {
        tile_gradient<D>(stencil, tile + i, m.u.data(), H + lane);
        if (tangent) tile_gradient<D>(stencil, tile + i, m.w.data(), dH + lane);
      } else {
        single_gradient<D>(stencil, tile + i, m.u.data(), H + lane);
        if (tangent) single_gradient<D>(stencil, tile + i, m.w.data(), dH + lane);
      }
      if (traits_.selective && tile + i == 0) keep_owner_gradients(points, m, s, tangent);
      for (int l = 0; l < lanes_per_tile; ++l) {
        const int q = g.whole ? l / 8 : l, point = g.whole ? l % 8 : 0;
        s.owner[lane + l] = g.first + point;
        s.weight[lane + l] = body_.volume(static_cast<std::size_t>(g.first)) * stencil.share[static_cast<std::size_t>((tile + i) * 8 + q)];
      }
    }
    const int n = tiles * lanes_per_tile;
    const int bad = pass.work.evaluate(n, s, false, energy);
    if (bad >= 0) return g.whole ? bad % 8 : 0;
    if (sample) {
      pass.work.add_samples(n, s, *pass.sums);
      continue;
    }
    for (int l = 0; l < n && traits_.selective; ++l) {
      pressure[0][l % points] += s.pressure[l];
      if (tangent) pressure[1][l % points] += s.pressure_rate[l];
    }
    for (int i = 0; i < tiles; ++i) {
      if (g.whole) tile_adjoint<D>(stencil, tile + i, s.P + i * lanes_per_tile, m.t.data());
      else single_adjoint<D>(stencil, tile + i, s.P + i * lanes_per_tile, m.t.data());
    }
  }
  if (sample) return -1;
  if (traits_.selective) {
    // The owner's gradient is evaluation point 0 of tile 0.
    for (int c = 0; c < D * D; ++c) std::fill_n(s.P + c * batch_points, lanes_per_tile, 0.0);
    add_owner_stress(laws_.space(), {8, 8, m.owner_H, tangent ? m.owner_dH : nullptr}, pressure[0], pressure[1], s.P, batch_points);
    for (int c = 0; c < D * D && !g.whole; ++c) std::fill_n(s.P + c * batch_points + 1, 7, 0.0);
    if (g.whole) tile_adjoint<D>(stencil, 0, s.P, m.t.data());
    else single_adjoint<D>(stencil, 0, s.P, m.t.data());
  }
  scatter(g, stencil, m, pass.out);
  return -1;
}

template <int D>
void WeightedModel<D>::block(std::size_t b, Pass& pass) {
  BatchScratch& s = scratch_.begin_block(b);
  Memory& m = *memory_[static_cast<std::size_t>(thread_index())];
  double energy = 0;
  for (std::size_t g = block_first_[b]; g < block_first_[b + 1]; ++g) {
    const int bad = group(groups_[g], m, s, pass, &energy);
    if (bad >= 0) {
      pass.report(groups_[g].first + bad);
      return;
    }
  }
  if (pass.energies) pass.energies[b] = energy;
}

template <int D>
EvaluationStatus WeightedModel<D>::run(Pass& pass) {
  scratch_.prepare(laws_);
  while (memory_.size() < static_cast<std::size_t>(thread_count())) memory_.push_back(std::make_unique<Memory>());
  if (pass.work.work() == Work::sample) {
    parallel_for(block_first_.size() - 1, [&](std::size_t b) { block(b, pass); });
    return status_at(body_, pass.bad);
  }
  for (int c = 0; c < D; ++c) std::memset(pass.out.component(c), 0, pass.out.stride * sizeof(double));
  (lattice_ ? lattice_->colouring : cloud_colouring_).for_each([&](std::size_t b) { block(b, pass); });
  return status_at(body_, pass.bad);
}

template <int D>
EvaluationStatus WeightedModel<D>::forces(ConstFieldView u, FieldView force, double* energy) {
  return run_forces(laws_, traits_.selective, block_first_.size() - 1, u, force, energy, [&](Pass& pass) { return run(pass); });
}

template <int D>
EvaluationStatus WeightedModel<D>::tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) {
  const BatchWork work(laws_, Work::tangent, false, traits_.selective);
  Pass pass{work, u, w, Kw, nullptr, nullptr, -1, {}};
  return run(pass);
}

template <int D>
EvaluationStatus WeightedModel<D>::sample(ConstFieldView u, PointSamples& samples) {
  return run_samples(body_, laws_, traits_.selective, u, samples, [&](Pass& pass) { return run(pass); });
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
  for (const LocalStencil& s : stencils_) stencils += s.bytes();
  report.bytes = (lattice_ ? lattice_->bytes() : cloud_->bytes()) + stencils + groups_.size() * sizeof(Group) + normaliser_.size() * 8 + condition_.bytes() + damage_.bytes() + scratch_.bytes();
  if (lattice_) {
    report.skips.push_back({"stencils of equal families", fmt::format("{} stored for {} points", stencils_.size(), body_.points()),
                            fmt::format("{:.3g} MB stored instead of {:.3g} MB", static_cast<double>(stencils) / 1e6,
                                        static_cast<double>(stencils_.empty() ? 0 : stencils_.front().bytes()) * static_cast<double>(body_.points()) / 1e6)});
    report.skips.push_back({"neighbour lists and bond vectors", "lattice: neighbours lie at fixed shifts", fmt::format("{:.3g} MB", static_cast<double>(bonds_) * (4 + 8 * (D + 1)) / 1e6)});
  }
  return report;
}

template class WeightedModel<1>;
template class WeightedModel<2>;
template class WeightedModel<3>;

}  // namespace perikit
