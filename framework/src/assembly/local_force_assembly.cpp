#include "assembly/local_force_assembly.hpp"

#include <algorithm>

namespace perikit {

std::vector<double> family_volumes(const Body& body, const InfluenceFunction& influence) {
  const PointFamilies families(body, influence, BondWeight::volume);
  std::vector<double> volumes;
  for (std::size_t r = 0; r < families.rows(); ++r) volumes.push_back(families.normaliser(r));
  return volumes;
}

template <int D>
LocalForceAssembly<D>::LocalForceAssembly(const ModelParts& parts)
    : Assembly(parts, 2), formulation_(parts.formulation), selective_(formulation_.selective()),
      family_volume_(family_volumes(*parts.body, *parts.influence)), batch_(*parts.laws, selective_) {}

template <int D>
void LocalForceAssembly<D>::add_lanes(std::size_t row, ConstFieldView u) {
  const auto family = families().neighbours(row);
  const std::size_t p = families().point(row);
  const auto gradient = [&](const double* g, int c, int e) {
    const double* value = u.component(c);
    double sum = 0;
    for (std::size_t k = 0; k < family.size(); ++k) {
      sum += (value[families().point(static_cast<std::size_t>(family[k]))] - value[p]) * g[k * D + static_cast<std::size_t>(e)];
    }
    return sum;
  };
  batch_.clear();
  for (std::size_t q = 0; q < family.size(); ++q) {
    const int lane = batch_.add(static_cast<std::int32_t>(p), families().volume(row) * point_.share[q], 1.0);
    for (int c = 0; c < D; ++c)
      for (int e = 0; e < D; ++e) {
        batch_.H(lane, c * D + e) = gradient(point_.at(q, 0), c, e);
        if (selective_) batch_.owner_H(lane, c * D + e) = gradient(point_.own.data(), c, e);
      }
  }
}

template <int D>
void LocalForceAssembly<D>::couple(std::size_t row, std::size_t k, const std::vector<double>& B, BlockMatrix& K) const {
  const auto family = families().neighbours(row);
  const auto add = [&](std::size_t r, std::size_t column, const double* block, double sign) {
    const auto begin = K.column.begin() + K.row_first[r], end = K.column.begin() + K.row_first[r + 1];
    const auto found = std::lower_bound(begin, end, static_cast<std::int32_t>(column));
    double* to = K.values.data() + (found - K.column.begin()) * (D * D);
    for (int c = 0; c < D * D; ++c) to[c] += sign * block[c];
  };
  const auto far = static_cast<std::size_t>(family[k]);
  for (std::size_t l = 0; l < family.size(); ++l) {
    const double* block = B.data() + l * D * D;
    const auto column = static_cast<std::size_t>(family[l]);
    add(row, column, block, -1);
    add(row, row, block, 1);
    add(far, column, block, 1);
    add(far, row, block, -1);
  }
}

template <int D>
std::int64_t LocalForceAssembly<D>::fill(ConstFieldView u, BlockMatrix& K) {
  constexpr std::size_t n = D * D;
  K.symmetric = false;
  // dP_r/du_lb of evaluation point q through one of its gradients: sum_f M[r][bD + f] g_lf, M transposed where `turn`.
  const auto through = [](const double* M, bool turn, std::size_t r, std::size_t b, const double* g) {
    double sum = 0;
    for (std::size_t f = 0; f < D; ++f) sum += (turn ? M[(b * D + f) * n + r] : M[r * n + b * D + f]) * g[f];
    return sum;
  };
  std::vector<double> B, of_owner;
  for (std::size_t row = 0; row < families().rows(); ++row) {
    const std::size_t bonds = families().neighbours(row).size();
    if (bonds == 0) continue;
    point_.build(*formulation_.weighted, families(), row, family_volume_[row]);
    add_lanes(row, u);
    if (batch_.evaluate() >= 0) return static_cast<std::int64_t>(families().point(row));
    of_owner.assign(selective_ ? bonds * n * D : 0, 0.0);  // [l][r][b]: derivative of the stress on the owner's gradient
    for (std::size_t q = 0; q < bonds; ++q) {
      const int lane = static_cast<int>(q);
      B.assign(bonds * n, 0.0);
      for (std::size_t l = 0; l < bonds; ++l)
        for (std::size_t r = 0; r < n; ++r)
          for (std::size_t b = 0; b < D; ++b) {
            const double *g = point_.at(q, l), *own = point_.own.data() + l * D;
            double dP = through(batch_.own(lane), false, r, b, g);
            if (selective_) {
              dP += through(batch_.mixed(lane), false, r, b, own);
              of_owner[(l * n + r) * D + b] += through(batch_.mixed(lane), true, r, b, g) + through(batch_.bar(lane), false, r, b, own);
            }
            B[l * n + r / D * D + b] += point_.scale[q] * dP * point_.at(q, q)[r % D];
          }
      couple(row, q, B, K);
    }
    for (std::size_t k = 0; k < bonds && selective_; ++k) {
      B.assign(bonds * n, 0.0);
      for (std::size_t l = 0; l < bonds; ++l)
        for (std::size_t r = 0; r < n; ++r)
          for (std::size_t b = 0; b < D; ++b) B[l * n + r / D * D + b] += of_owner[(l * n + r) * D + b] * point_.own[k * D + r % D];
      couple(row, k, B, K);
    }
  }
  return -1;
}

template class LocalForceAssembly<1>;
template class LocalForceAssembly<2>;
template class LocalForceAssembly<3>;

}  // namespace perikit
