#include "terms/pairs/pair_assembly.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace perikit {

namespace {

constexpr std::size_t block_rows = 64;

}  // namespace

template <int D>
PairAssembly<D>::PairAssembly(const Formulation& formulation, const PairPoints& points, const BlockRows& rows)
    : rows_(rows), formulation_(formulation), law_(*formulation.pairs), points_(points) {}

template <int D>
bool PairAssembly<D>::stretch(std::size_t row, ConstFieldView u, Memory& m) const {
  rows_.load(row, m.family);
  for (AlignedVector<double>* x : {&m.omega, &m.extension, &m.inverse_length, &m.modulus, &m.force, &m.stiffness})
    x->assign(m.family.size, 0.0);
  for (auto* vector : {&m.direction, &m.du})
    for (AlignedVector<double>& x : *vector) x.assign(m.family.size, 0.0);
  const auto neighbours = rows_.neighbours(row);
  const std::size_t p = rows_.point(row);
  for (std::size_t k = 0; k < neighbours.size(); ++k) {
    // b weakens the bond itself and leaves its law alone; a broken one is at rest, wherever its far end may be.
    const double b = m.family.b(k);
    m.family.volume[k] *= b;
    m.omega[k] = m.family.whole_omega(k);
    for (std::size_t c = 0; c < D && b > 0; ++c) {
      const double* value = u.component(static_cast<int>(c));
      m.du[c][k] = value[rows_.point(static_cast<std::size_t>(neighbours[k]))] - value[p];
    }
  }
  bool finite = true;
  for (std::size_t l = 0; l < m.family.size; l += pack_width) {
    Pack xi[D], du[D];
    for (int c = 0; c < D; ++c) {
      xi[c] = Pack::load(m.family.xi[c].data() + l);
      du[c] = Pack::load(m.du[c].data() + l);
    }
    const Pack length = Pack::load(m.family.length.data() + l);
    const Stretch<D> bond(xi, length, du);
    finite = finite && all(bond.has_length(length));
    bond.e.store(m.extension.data() + l);
    bond.inverse_length.store(m.inverse_length.data() + l);
    for (int c = 0; c < D; ++c) (bond.y[c] * bond.inverse_length).store(m.direction[c].data() + l);
  }
  return finite;
}

template <int D>
void PairAssembly<D>::moduli(std::size_t row, Memory& m) const {
  const PairFields& fields = points_.fields;
  const auto neighbours = rows_.neighbours(row);
  const std::size_t p = rows_.point(row);
  for (std::size_t k = 0; k < neighbours.size(); ++k) {
    const std::size_t q = rows_.point(static_cast<std::size_t>(neighbours[k]));
    m.modulus[k] = fields.factors->of(rows_.families(), p, q) * fields.of_bond(p, q);
  }
}

/// omega |xi| f of the dilatation.
template <int D>
double PairAssembly<D>::dilatation_weight(const Memory& m, std::size_t p, std::size_t q, std::size_t k) const {
  const BondFactors& factors = *points_.fields.factors;
  return (factors.of_dilatation ? factors.of(rows_.families(), p, q) : 1.0) * m.omega[k] * m.family.length[k];
}

template <int D>
bool PairAssembly<D>::dilatation(std::size_t row, ConstFieldView u, Memory& m) {
  if (!stretch(row, u, m)) return false;
  const std::size_t p = rows_.point(row), first = rows_.first(row), bonds = rows_.neighbours(row).size();
  const double scale = points_.scale.data()[p];
  alignas(64) double theta[padding] = {}, modulus[padding] = {}, pressure[padding] = {}, stiffness[padding] = {};
  std::array<double, D> own{};
  for (std::size_t k = 0; k < bonds; ++k) {
    const std::size_t q = rows_.point(static_cast<std::size_t>(rows_.neighbours(row)[k]));
    const double weight = scale * points_.fields.own_strain(p, q) * dilatation_weight(m, p, q, k) * m.family.volume[k];
    theta[0] += weight * m.extension[k];
    for (std::size_t c = 0; c < D; ++c) {
      const double slope = weight * m.direction[c][k];
      slope_[D * (first + k) + c] = slope;
      own[c] -= slope;
    }
  }
  std::copy_n(own.data(), D, own_slope_.data() + D * row);
  modulus[0] = points_.dilatation_modulus.data()[p];
  formulation_.dilatation->evaluate({1, theta, modulus, nullptr, pressure, stiffness});
  pressure_[row] = scale * pressure[0];
  stiffness_[row] = rows_.volume(row) * stiffness[0];
  return true;
}

template <int D>
void PairAssembly<D>::fill_row(std::size_t row, ConstFieldView u, BlockMatrix& K, Memory& m) const {
  constexpr std::size_t entries = D * D;
  const auto neighbours = rows_.neighbours(row);
  m.places.open(K, row);
  double* own = m.places.block(K, static_cast<std::int32_t>(row), entries);
  stretch(row, u, m);
  moduli(row, m);
  law_.bond_law({static_cast<int>(neighbours.size()), m.family.length.data(), m.omega.data(), m.extension.data(),
                 m.modulus.data(), nullptr, m.force.data(), m.stiffness.data()});
  for (std::size_t k = 0; k < neighbours.size(); ++k) {
    double T = m.force[k];
    if (formulation_.dilatation) {
      const auto far = static_cast<std::size_t>(neighbours[k]);
      const std::size_t p = rows_.point(row), q = rows_.point(far);
      T += dilatation_weight(m, p, q, k) * (points_.fields.own_strain(p, q) * pressure_[row] + points_.fields.own_strain(q, p) * pressure_[far]);
    }
    const double volumes = rows_.volume(row) * m.family.volume[k], turn = T * m.inverse_length[k];
    double* block = m.places.block(K, neighbours[k], entries);
    for (std::size_t a = 0; a < D; ++a)
      for (std::size_t b = 0; b < D; ++b) {
        const double value = volumes * ((m.stiffness[k] - turn) * m.direction[a][k] * m.direction[b][k] + (a == b ? turn : 0.0));
        own[a * D + b] += value;
        block[a * D + b] -= value;
      }
  }
  if (!formulation_.dilatation) return;
  // Dilatations that this point enters: its own and those of its neighbours.
  const auto add = [&](std::size_t i, const double* slope) {
    const auto couple = [&](const double* other, std::int32_t l) {
      double* block = m.places.block(K, l, entries);
      for (std::size_t a = 0; a < D; ++a)
        for (std::size_t b = 0; b < D; ++b) block[a * D + b] += stiffness_[i] * slope[a] * other[b];
    };
    couple(&own_slope_[D * i], static_cast<std::int32_t>(i));
    for (std::size_t k = rows_.first(i); k < rows_.first(i + 1); ++k)
      couple(&slope_[D * k], rows_.lists().neighbour[k]);
  };
  add(row, &own_slope_[D * row]);
  for (std::size_t k = 0; k < neighbours.size(); ++k) {
    const auto i = static_cast<std::size_t>(neighbours[k]);
    const auto back = rows_.neighbours(i);
    const auto at =
        static_cast<std::size_t>(std::lower_bound(back.begin(), back.end(), static_cast<std::int32_t>(row)) - back.begin());
    add(i, &slope_[D * (rows_.first(i) + at)]);
  }
}

template <int D>
std::int64_t PairAssembly<D>::add(const Configuration& at, BlockMatrix& K) {
  const ConstFieldView u = at.u();
  const std::size_t rows = rows_.size();
  memory_.prepare([] { return std::make_unique<Memory>(); });
  if (formulation_.dilatation) {
    pressure_.resize(rows);
    stiffness_.resize(rows);
    slope_.resize(D * rows_.bonds());
    own_slope_.resize(D * rows);
  }
  FirstBad bad;
  const auto over_rows = [&](auto&& body) {
    parallel_for((rows + block_rows - 1) / block_rows, [&](std::size_t b) {
      for (std::size_t r = b * block_rows; r < std::min(rows, (b + 1) * block_rows); ++r) body(r, memory_.mine());
    });
  };
  over_rows([&](std::size_t r, Memory& m) {
    if (!(formulation_.dilatation ? dilatation(r, u, m) : stretch(r, u, m)))
      bad.report(static_cast<std::int64_t>(rows_.point(r)));
  });
  if (bad.point() >= 0) return bad.point();
  over_rows([&](std::size_t r, Memory& m) { fill_row(r, u, K, m); });
  return -1;
}

template <int D>
std::size_t PairAssembly<D>::bytes() const noexcept {
  return formulation_.dilatation ? ((D + 2) * rows_.size() + D * rows_.bonds()) * sizeof(double) : 0;
}

template class PairAssembly<1>;
template class PairAssembly<2>;
template class PairAssembly<3>;

}  // namespace perikit
