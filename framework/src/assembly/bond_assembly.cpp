#include "assembly/bond_assembly.hpp"

#include <algorithm>

#include "families/cloud/cloud_rows.hpp"
#include "spaces/evaluation_points.hpp"

namespace perikit {

namespace {

template <class Body>
void over_rows(std::size_t rows, Body&& body) {
  constexpr std::size_t block = 32;
  parallel_for((rows + block - 1) / block, [&](std::size_t b) {
    for (std::size_t r = b * block; r < std::min(rows, (b + 1) * block); ++r) body(r);
  });
}

}  // namespace

template <int D>
BondAssembly<D>::BondAssembly(const SpaceParts& parts, const LawsOfSpace& laws, const BlockRows& rows)
    : parts_(parts),
      laws_(laws),
      rows_(rows),
      formulation_(parts.formulation),
      symmetric_(parts.bonds_once() && !formulation_.selective()),
      blocks_(rows.size(), rows.body().block_points()),
      colouring_(cloud_reach(rows.lists(), blocks_)) {
  read_bonds();
}

template <int D>
void BondAssembly<D>::read_bonds() {
  const std::size_t rows = rows_.size();
  bond_.resize(rows_.bonds());
  own_gradient_.assign(D * rows, 0.0);
  volume_share_.assign(rows, 0.0);
  PerThread<EvaluationPoints<D>> readers;
  readers.prepare([&] { return std::make_unique<EvaluationPoints<D>>(parts_); });
  over_rows(rows, [&](std::size_t i) {
    EvaluationPoints<D>& points = readers.mine();
    points.read(rows_.point(i));
    const double* const g = points.own();
    const bool regular = std::any_of(g, g + D * points.bonds(), [](double x) { return x != 0; });
    volume_share_[i] = regular ? rows_.families().remaining_influence(rows_.point(i)) : 0.0;
    const auto neighbours = rows_.neighbours(i);
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      Bond& bond = bond_[rows_.first(i) + k];
      const int q = static_cast<int>(k);
      points.correction(q, bond.correction);
      for (std::size_t e = 0; e < D; ++e) {
        bond.xi[e] = points.family().xi[e][k];
        bond.gradient[e] = g[k * D + e];
        own_gradient_[D * i + e] -= bond.gradient[e];
      }
      bond.weight = points.weight(q);
      bond.shares = points.shares(q);
      const auto j = static_cast<std::size_t>(neighbours[k]);
      const auto back = rows_.neighbours(j);
      bond.reverse =
          rows_.first(j) +
          static_cast<std::size_t>(std::lower_bound(back.begin(), back.end(), static_cast<std::int32_t>(i)) - back.begin());
    }
  });
}

template <int D>
void BondAssembly<D>::point_gradients(std::size_t row, ConstFieldView u) noexcept {
  double* H = Hbar_.data() + entries * row;
  std::fill_n(H, entries, 0.0);
  const std::size_t p = rows_.point(row);
  const Bond* bond = bond_.data() + rows_.first(row);
  for (const std::int32_t j : rows_.neighbours(row)) {
    const std::size_t q = rows_.point(static_cast<std::size_t>(j));
    for (std::size_t c = 0; c < D; ++c) {
      const double* value = u.component(static_cast<int>(c));
      for (std::size_t e = 0; e < D; ++e) H[c * D + e] += bond->gradient[e] * (value[q] - value[p]);
    }
    ++bond;
  }
}

template <int D>
bool BondAssembly<D>::evaluated_once(std::size_t i, std::size_t j) const noexcept {
  return symmetric_ && parts_.laws.same(rows_.point(i), rows_.point(j));
}

template <int D>
void BondAssembly<D>::add_lane(std::size_t i, std::size_t k, ConstFieldView u, Memory& m) {
  const Bond& bond = bond_[k];
  const auto j = static_cast<std::size_t>(rows_.lists().neighbour[k]);
  const std::size_t p = rows_.point(i), q = rows_.point(j);
  const double weight = bond.weight + (evaluated_once(i, j) ? bond_[bond.reverse].weight : 0.0);
  const int lane = m.batch.add(p, static_cast<std::int32_t>(q), 0, weight, volume_share_[i]);
  m.bond_of_lane.push_back(k);
  m.row_of_lane.push_back(i);
  const double* own = Hbar_.data() + entries * i;
  const double* far = Hbar_.data() + entries * j;
  for (std::size_t c = 0; c < D; ++c) {
    double A[D], H[D];
    for (std::size_t e = 0; e < D; ++e) A[e] = bond.shares.near * own[c * D + e] + bond.shares.far * far[c * D + e];
    bond_shape_row<D>(A, u.component(static_cast<int>(c))[q] - u.component(static_cast<int>(c))[p], bond.xi, bond.correction, H);
    for (std::size_t e = 0; e < D; ++e) {
      m.batch.H(lane, static_cast<int>(c * D + e)) = H[e];
      if (formulation_.selective()) m.batch.owner_H(lane, static_cast<int>(c * D + e)) = own[c * D + e];
    }
  }
}

// On y = [columns of A_b, du]: H_ae = sum_s R_es y_as with R_es = delta_es - xi_s g_e (s < D), g_e (s = D), so that the matrix of
// the bond is M = R^T A R; y_s = sum over both ends of share_s X_s with shares (near, -1) of i and (far, 1) of j.
template <int D>
void BondAssembly<D>::couple(std::size_t i, std::size_t k, int lane, const TangentBatch<D>& batch) noexcept {
  const Bond& bond = bond_[k];
  const auto j = static_cast<std::size_t>(rows_.lists().neighbour[k]);
  double R[D][slots];
  for (std::size_t e = 0; e < D; ++e) {
    for (std::size_t s = 0; s < D; ++s) R[e][s] = (e == s ? 1.0 : 0.0) - bond.xi[s] * bond.correction[e];
    R[e][D] = bond.correction[e];
  }
  double near_share[slots], far_share[slots];
  for (std::size_t s = 0; s < D; ++s) {
    near_share[s] = bond.shares.near;
    far_share[s] = bond.shares.far;
  }
  near_share[D] = -1;
  far_share[D] = 1;
  double* ii = diagonal_.data() + coupling * i;
  double* jj = diagonal_.data() + coupling * j;
  double* ij = off_diagonal_.data() + coupling * k;
  double* ji = off_diagonal_.data() + coupling * bond.reverse;
  // Half-way products N[a][e][b][s] = sum_f A_(ae)(bf) R_fs, then M_(as)(bs') = sum_e R_es N.
  const auto right = [&](const double* A, double(&N)[D][D][D][slots]) {
    for (std::size_t a = 0; a < D; ++a)
      for (std::size_t e = 0; e < D; ++e)
        for (std::size_t b = 0; b < D; ++b)
          for (std::size_t s = 0; s < slots; ++s) {
            double sum = 0;
            for (std::size_t f = 0; f < D; ++f) sum += A[(a * D + e) * entries + b * D + f] * R[f][s];
            N[a][e][b][s] = sum;
          }
  };
  double N[D][D][D][slots];
  right(batch.own(lane), N);
  for (std::size_t s = 0; s < slots; ++s)
    for (std::size_t t = 0; t < slots; ++t) {
      const double near_near = near_share[s] * near_share[t], near_far = near_share[s] * far_share[t];
      const double far_near = far_share[s] * near_share[t], far_far = far_share[s] * far_share[t];
      for (std::size_t a = 0; a < D; ++a)
        for (std::size_t b = 0; b < D; ++b) {
          double M = 0;
          for (std::size_t e = 0; e < D; ++e) M += R[e][s] * N[a][e][b][t];
          const std::size_t at = (s * slots + t) * entries + a * D + b;
          ii[at] += near_near * M;
          ij[at] += near_far * M;
          ji[at] += far_near * M;
          jj[at] += far_far * M;
        }
    }
  if (!formulation_.selective()) return;
  // Selective map: mixed terms of y with Hbar_i, and Hbar_i with itself.
  const double* mixed = batch.mixed(lane);
  const double* back = batch.back(lane);
  const double* bar = batch.bar(lane);
  for (std::size_t s = 0; s < slots; ++s)
    for (std::size_t f = 0; f < D; ++f)
      for (std::size_t a = 0; a < D; ++a)
        for (std::size_t b = 0; b < D; ++b) {
          double M = 0, M_back = 0;
          for (std::size_t e = 0; e < D; ++e) {
            M += R[e][s] * mixed[(a * D + e) * entries + b * D + f];
            M_back += R[e][s] * back[(b * D + f) * entries + a * D + e];
          }
          const std::size_t at = (s * slots + f) * entries + a * D + b, transposed = (f * slots + s) * entries + b * D + a;
          ii[at] += near_share[s] * M;
          ii[transposed] += near_share[s] * M_back;
          ji[at] += far_share[s] * M;
          ij[transposed] += far_share[s] * M_back;
          if (s < D) ii[at] += bar[(a * D + s) * entries + b * D + f];
        }
}

template <int D>
std::int64_t BondAssembly<D>::add_bonds(std::size_t first, std::size_t last, const Configuration& at, bool convex, Memory& m) {
  m.batch.clear();
  m.bond_of_lane.clear();
  m.row_of_lane.clear();
  const auto finish = [&]() -> std::int64_t {
    const int bad = m.batch.evaluate(at, convex);
    if (bad >= 0) return m.batch.owner(bad);
    for (int lane = 0; lane < m.batch.lanes(); ++lane) {
      const auto l = static_cast<std::size_t>(lane);
      couple(m.row_of_lane[l], m.bond_of_lane[l], lane, m.batch);
    }
    m.batch.clear();
    m.bond_of_lane.clear();
    m.row_of_lane.clear();
    return -1;
  };
  for (std::size_t i = first; i < last; ++i)
    for (std::size_t k = rows_.first(i); k < rows_.first(i + 1); ++k) {
      const auto j = static_cast<std::size_t>(rows_.lists().neighbour[k]);
      if ((j < i && evaluated_once(i, j)) || bond_[k].weight == 0) continue;
      add_lane(i, k, at.u(), m);
      if (m.batch.lanes() < batch_points) continue;
      const std::int64_t bad = finish();
      if (bad >= 0) return bad;
    }
  return finish();
}

// C_kj = sum_i g_ik Q_ij over the points i whose gradients k enters, then K_kl = sum_j C_kj g_jl.
template <int D>
void BondAssembly<D>::condense(std::size_t row, BlockMatrix& K, Memory& m) const {
  const std::vector<std::int32_t>& near = m.reach.of(rows_, row, 2);
  m.C.assign(strip * near.size(), 0.0);
  const std::size_t first = rows_.first(row), bonds = rows_.first(row + 1) - first;
  const auto add = [&](const double* g, bool own, const double* Q, std::int32_t j) {
    double* C = m.C.data() + strip * m.reach.place(j);
    for (std::size_t x = 0; x < strip; ++x)
      for (std::size_t s = 0; s < D; ++s) C[x] += g[s] * Q[s * strip + x];
    if (own)
      for (std::size_t x = 0; x < strip; ++x) C[x] += Q[D * strip + x];
  };
  const auto add_row = [&](std::size_t i, const double* g, bool own) {
    add(g, own, diagonal_.data() + coupling * i, static_cast<std::int32_t>(i));
    for (std::size_t k = rows_.first(i); k < rows_.first(i + 1); ++k)
      add(g, own, off_diagonal_.data() + coupling * k, rows_.lists().neighbour[k]);
  };
  add_row(row, &own_gradient_[D * row], true);
  for (std::size_t k = first; k < first + bonds; ++k)
    add_row(static_cast<std::size_t>(rows_.lists().neighbour[k]), bond_[bond_[k].reverse].gradient, false);

  m.places.open(K, row);
  // Only where the far end has a share do gradients two bonds away matter; the others have none in C.
  const std::size_t gradients = formulation_.far_share > 0 ? near.size() : bonds + 1;
  for (std::size_t n = 0; n < near.size(); ++n) {
    const double* C = m.C.data() + strip * n;
    double* block = m.places.block(K, near[n], entries);
    for (std::size_t x = 0; x < entries; ++x) block[x] += C[D * entries + x];
    if (n >= gradients) continue;
    const auto add_gradient = [&](const double* g, std::int32_t l) {
      double* to = m.places.block(K, l, entries);
      for (std::size_t x = 0; x < entries; ++x)
        for (std::size_t s = 0; s < D; ++s) to[x] += g[s] * C[s * entries + x];
    };
    const auto j = static_cast<std::size_t>(near[n]);
    add_gradient(&own_gradient_[D * j], near[n]);
    for (std::size_t k = rows_.first(j); k < rows_.first(j + 1); ++k)
      add_gradient(bond_[k].gradient, rows_.lists().neighbour[k]);
  }
}

template <int D>
std::int64_t BondAssembly<D>::add(const Configuration& at, BlockMatrix& K) {
  const ConstFieldView u = at.u();
  const std::size_t rows = rows_.size();
  if (!parts_.laws.symmetric_tangent()) K.symmetric = false;
  memory_.prepare([&] { return std::make_unique<Memory>(laws_, formulation_.selective()); });
  Hbar_.resize(entries * rows);
  diagonal_.resize(coupling * rows);
  off_diagonal_.resize(coupling * rows_.bonds());
  over_rows(rows, [&](std::size_t r) {
    point_gradients(r, u);
    std::fill_n(diagonal_.data() + coupling * r, coupling, 0.0);
    std::fill_n(off_diagonal_.data() + coupling * rows_.first(r), coupling * (rows_.first(r + 1) - rows_.first(r)),
                0.0);
  });
  FirstBad bad;
  colouring_.for_each([&](std::size_t b) {
    const std::int64_t point = add_bonds(blocks_.begin(b), blocks_.end(b), at, K.convex, memory_.mine());
    if (point >= 0) bad.report(point);
  });
  if (bad.point() >= 0) return bad.point();
  over_rows(rows, [&](std::size_t r) { condense(r, K, memory_.mine()); });
  return -1;
}

template <int D>
std::size_t BondAssembly<D>::bytes() const noexcept {
  return bond_.size() * sizeof(Bond) +
         (rows_.size() * (coupling + entries + D) + rows_.bonds() * coupling) * sizeof(double);
}

template class BondAssembly<1>;
template class BondAssembly<2>;
template class BondAssembly<3>;

}  // namespace perikit
