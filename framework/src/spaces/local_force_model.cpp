#include "spaces/local_force_model.hpp"

#include <algorithm>

#include "families/cloud_rows.hpp"
#include "assembly/local_force_assembly.hpp"
#include "operators/samples.hpp"

namespace perikit {

template <int D>
LocalForceModel<D>::LocalForceModel(const ModelParts& parts, std::unique_ptr<Model> variational)
    : AssemblingModel(parts), body_(*parts.body), laws_(*parts.laws), formulation_(parts.formulation),
      variational_(std::move(variational)), families_(body_, *parts.influence, formulation_.weight),
      family_volume_(family_volumes(body_, *parts.influence)), colouring_(cloud_reach(families_.lists(), families_.rows())) {}

/// H[(c * D + e) * stride] of a stencil.
template <int D>
void LocalForceModel<D>::gradient(std::size_t row, const double* g, ConstFieldView u, double* H, int stride) const noexcept {
  const auto family = families_.neighbours(row);
  const std::size_t p = families_.point(row);
  for (int c = 0; c < D; ++c) {
    const double* value = u.component(c);
    for (int e = 0; e < D; ++e) {
      double sum = 0;
      for (std::size_t k = 0; k < family.size(); ++k) {
        sum += (value[families_.point(static_cast<std::size_t>(family[k]))] - value[p]) * g[k * D + static_cast<std::size_t>(e)];
      }
      H[(c * D + e) * stride] = sum;
    }
  }
}

template <int D>
bool LocalForceModel<D>::bond_forces(std::size_t row, Memory& m, BatchScratch& s, Pass& pass) const {
  LocalForcePoint<D>& point = m.point;
  point.build(*formulation_.weighted, families_, row, family_volume_[row]);
  const auto bonds = static_cast<std::size_t>(point.family.bonds);
  const bool tangent = pass.work.tangent(), selective = formulation_.selective();
  double* const H = selective ? s.Ht : s.H;
  double* const dH = selective ? s.dHt : s.dH;
  double pressure[2][padding] = {}, owner_H[9 * padding] = {}, owner_dH[9 * padding] = {};
  const OwnerGradients owner{static_cast<int>(padding), padding, owner_H, tangent ? owner_dH : nullptr};
  if (selective) {
    gradient(row, point.own.data(), pass.u, owner_H, static_cast<int>(padding));
    if (tangent) gradient(row, point.own.data(), pass.w, owner_dH, static_cast<int>(padding));
    owner_volume(laws_.space(), owner, s.volume, batch_points);
    for (int c = 0; c < volume_components; ++c) std::fill_n(s.volume + c * batch_points, padding, s.volume[c * batch_points]);
    std::fill(std::begin(s.volume_group), std::end(s.volume_group), 0);
    s.owner_volumes = {s.volume, batch_points, s.volume_group, true};
  }
  m.t.assign(bonds * D, 0.0);
  for (std::size_t first = 0; first < bonds; first += batch_points) {
    const int n = static_cast<int>(std::min<std::size_t>(batch_points, bonds - first));
    const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
    std::fill_n(s.owner, lanes, static_cast<std::int32_t>(families_.point(row)));
    for (int c = 0; c < D * D; ++c)
      for (int l = n; l < lanes; ++l) H[c * batch_points + l] = dH[c * batch_points + l] = 0.0;
    for (int l = 0; l < lanes; ++l) {
      const std::size_t q = first + static_cast<std::size_t>(l);
      s.weight[l] = l < n ? families_.volume(row) * point.share[q] : 0.0;
      if (l >= n) continue;
      gradient(row, point.at(q, 0), pass.u, H + l, batch_points);
      if (tangent) gradient(row, point.at(q, 0), pass.w, dH + l, batch_points);
    }
    if (pass.work.evaluate(n, s, false, nullptr) >= 0) return false;
    for (int l = 0; l < n; ++l) {
      const std::size_t q = first + static_cast<std::size_t>(l);
      const double* g = point.at(q, q);
      for (int c = 0; c < D; ++c)
        for (int e = 0; e < D; ++e) m.t[q * D + static_cast<std::size_t>(c)] += point.scale[q] * s.P[(c * D + e) * batch_points + l] * g[e];
      if (!selective) continue;
      pressure[0][0] += s.pressure[l];
      if (tangent) pressure[1][0] += s.pressure_rate[l];
    }
  }
  if (!selective) return true;
  double stress[9 * padding] = {};
  add_owner_stress(laws_.space(), owner, pressure[0], pressure[1], stress, padding);
  for (std::size_t k = 0; k < bonds; ++k)
    for (std::size_t c = 0; c < D; ++c)
      for (std::size_t e = 0; e < D; ++e) m.t[k * D + c] += stress[(c * D + e) * padding] * point.own[k * D + e];
  return true;
}

template <int D>
EvaluationStatus LocalForceModel<D>::run(Pass& pass) {
  scratch_.prepare(laws_);
  memory_.prepare([] { return std::make_unique<Memory>(); });
  std::fill_n(pass.out.data, pass.out.size(), 0.0);
  colouring_.for_each([&](std::size_t b) {
    Memory& m = memory_.mine();
    BatchScratch& s = scratch_.begin_block(b);
    for (std::size_t r = b * cloud_block_points; r < std::min(families_.rows(), (b + 1) * cloud_block_points); ++r) {
      const auto family = families_.neighbours(r);
      const std::size_t p = families_.point(r);
      if (family.empty()) continue;
      if (!bond_forces(r, m, s, pass)) return pass.report(static_cast<std::int64_t>(p));
      for (std::size_t k = 0; k < family.size(); ++k)
        for (std::size_t c = 0; c < D; ++c) {
          double* out = pass.out.component(static_cast<int>(c));
          out[p] += m.t[k * D + c];
          out[families_.point(static_cast<std::size_t>(family[k]))] -= m.t[k * D + c];
        }
    }
  });
  return status_at(body_, pass.bad);
}

template <int D>
EvaluationStatus LocalForceModel<D>::forces(ConstFieldView u, FieldView force, double* energy) {
  if (energy) {
    const EvaluationStatus status = variational_->forces(u, force, energy);
    if (!status.ok()) return status;
  }
  const BatchWork work(laws_, Work::force, false, formulation_.selective());
  Pass pass{work, u, {}, force, nullptr, nullptr, -1, {}};
  return run(pass);
}

template <int D>
EvaluationStatus LocalForceModel<D>::tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) {
  const BatchWork work(laws_, Work::tangent, false, formulation_.selective());
  Pass pass{work, u, w, Kw, nullptr, nullptr, -1, {}};
  return run(pass);
}

template <int D>
std::unique_ptr<Assembly> LocalForceModel<D>::make_assembly(const ModelParts& parts) const {
  return std::make_unique<LocalForceAssembly<D>>(parts);
}

template <int D>
ModelReport LocalForceModel<D>::report() const {
  ModelReport report = variational_->report();
  report.bytes += families_.bytes() + family_volume_.size() * sizeof(double) + scratch_.bytes();
  report.warnings.push_back("local force state: forces are not the derivative of the energy, moments do not balance; for comparison only");
  return report;
}

template class LocalForceModel<1>;
template class LocalForceModel<2>;
template class LocalForceModel<3>;

}  // namespace perikit
