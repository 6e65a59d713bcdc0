#include "spaces/evaluation_points.hpp"

#include "families/cloud/cloud_families.hpp"
#include "families/lattice/lattice_families.hpp"
#include "spaces/weighted/stencil_shift.hpp"

namespace perikit {

template <int D>
EvaluationPoints<D>::EvaluationPoints(const SpaceParts& parts) : parts_(parts), parts_of_family_(parts.formulation.parts(D)) {}

template <int D>
void EvaluationPoints<D>::read(std::size_t p) {
  p_ = p;
  parts_.families.load(p, BondsOf::set_up, family_);
  bond_shares(parts_.families, p, parts_.formulation.weight, family_, share_);
  const LatticeFamilies* const lattice = parts_.families.lattice();
  const bool whole = lattice && lattice->tiles.chunks[static_cast<std::size_t>(lattice->tiles.chunk_of(static_cast<std::int64_t>(p)))].pattern < 0;
  if (whole && whole_) return;
  whole_ = whole;
  own_made_ = weighted_made_ = corrected_ = false;
}

template <int D>
double EvaluationPoints<D>::weight(int q) {
  const Families& families = parts_.families;
  const double volume = families.body().volume(p_), intact = volume * (1 - families.damage(p_));
  if (!at_bonds()) {
    if (!parts_.formulation.own_stencils()) return intact;
    make_weighted();
    return stencil_.share(stencil_.points() - parts_of_family_ + q) * intact;
  }
  if (parts_.formulation.bond && shares(q).none()) return 0;
  const auto k = static_cast<std::size_t>(q);
  // Factors are there for clouds alone.
  const double factor = parts_.factors.empty() ? 1.0 : parts_.factors[static_cast<std::size_t>(families.cloud()->lists().first[p_]) + k];
  return volume * share_[k] * factor;
}

template <int D>
const double* EvaluationPoints<D>::own() {
  if (own_made_) return own_.data();
  own_made_ = true;
  point_gradient(family_, parts_.families.body().horizon(), parts_.formulation.order, own_);
  if (parts_.shift.data)
    each_shift<D>(family_, family_.omega.data(), own_.data(), parts_.shift, 0, [&](std::size_t k, std::size_t e, double d) { own_[k * D + e] += d; });
  return own_.data();
}

template <int D>
const double* EvaluationPoints<D>::gradient(int q) {
  if (!parts_.formulation.own_stencils()) return own();
  make_weighted();
  return weighted_.data() + static_cast<std::size_t>(stencil_.points() - points() + q) * bonds() * D;
}

template <int D>
const std::vector<double>& EvaluationPoints<D>::tested() {
  static const std::vector<double> none;
  if (!parts_.formulation.weighted) return none;
  make_weighted();
  return stencil_.tested();
}

template <int D>
EndShares EvaluationPoints<D>::shares(int q) const noexcept {
  return end_shares(parts_.families, parts_.formulation.far_share, p_, static_cast<std::size_t>(family_.far[static_cast<std::size_t>(q)]));
}

template <int D>
void EvaluationPoints<D>::correction(int q, double (&g)[D]) {
  if (!corrected_) {
    corrected_ = true;
    correction_.assign(D * family_.size, 0.0);
    parts_.formulation.bond->correction(family_.view(parts_.families.body().horizon()), correction_.data(), family_.size);
  }
  for (std::size_t e = 0; e < D; ++e) g[e] = correction_[e * family_.size + static_cast<std::size_t>(q)];
}

template <int D>
void EvaluationPoints<D>::make_weighted() {
  if (weighted_made_) return;
  weighted_made_ = true;
  const Families& families = parts_.families;
  stencil_.build({&parts_.formulation, families.body().horizon(), parts_.shift}, family_, share_.data(), 0, nullptr,
                 families.normaliser(p_, BondWeight::volume));
  stencil_.expand(weighted_);
}

template class EvaluationPoints<1>;
template class EvaluationPoints<2>;
template class EvaluationPoints<3>;

}  // namespace perikit
