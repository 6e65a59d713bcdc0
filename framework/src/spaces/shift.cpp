#include "spaces/shift.hpp"

#include <cmath>

#include "families/cloud_rows.hpp"
#include "spaces/balance_solver.hpp"
#include "spaces/cloud_gradient.hpp"

namespace perikit {

namespace {

template <int D>
class ShiftSystem {
 public:
  ShiftSystem(const SpaceParts& parts, const ClosedPoints& closed, const CloudConsistency& beyond)
      : families_(*parts.families.cloud()),
        body_(families_.body()),
        beyond_(beyond),
        closed_(closed, body_),
        gradient_(families_),
        position_(reinterpret_cast<const Row*>(body_.rows().data())),
        weight_(body_.stride(), 0.0),
        gradients_(D * body_.points()) {
    const std::vector<std::uint8_t> stores = storing_points(parts);
    for (const std::int32_t p : body_.internal()) {
      const auto at = static_cast<std::size_t>(p);
      if (stores[at]) weight_[at] = 1 - parts.families.damage(at);
    }
  }

  Field make() const { return body_.make_field(D); }
  double largest(const Field& r, Point* where = nullptr) const { return closed_.largest(r, where); }
  void precondition(const Field& r, Field& z) const {
    copy(r, z);
    for (int c = 0; c < D; ++c)
      for (std::size_t p = 0; p < body_.points(); ++p)
        z.component(c)[p] /= 2 * body_.volume(p) * std::max(families_.normaliser(p, BondWeight::kernel), 1e-300);
  }

  /// y_k = - V_k sum_j omega V_j [W_k/V_k (x_kj - H_k xi_kj) + W_j/V_j (x_kj - H_j xi_kj)], H the gradient of x.
  void apply(const Field& x, Field& y) {
    show(x);
    const double* omega = families_.omegas();
    over_points([&](std::size_t p) { gradient_.at(p, rows_, &gradients_[D * p]); });
    over_points([&](std::size_t p) {
      Row sum{};
      over_bonds(p, [&](std::size_t k, std::size_t j) {
        const Row xi = position_[j] - position_[p], x_kj = rows_[j] - rows_[p];
        Row z = (weight_[p] + weight_[j]) * x_kj;
        for (int e = 0; e < D; ++e)
          z -= xi[e] * (weight_[p] * gradients_[D * p + static_cast<std::size_t>(e)] +
                        weight_[j] * gradients_[D * j + static_cast<std::size_t>(e)]);
        sum -= (omega[k] * position_[j][3]) * z;
      });
      for (int c = 0; c < D; ++c) out_.component(c)[p] = position_[p][3] * sum[c];
    });
    finish(y);
  }

  /// A_k without lambda: - V_k sum_j omega V_j (W_k/V_k K_k^-1 + W_j/V_j K_j^-1) xi_kj.
  void unshifted(Field& y) {
    const double* omega = families_.omegas();
    out_ = body_.make_field(D);
    over_points([&](std::size_t p) {
      Row sum{};
      over_bonds(p, [&](std::size_t k, std::size_t j) {
        const Row xi = position_[j] - position_[p];
        for (int a = 0; a < D; ++a)
          for (int b = 0; b < D; ++b) {
            const int entry = symmetric_index(D, std::min(a, b), std::max(a, b));
            sum[a] -= omega[k] * position_[j][3] *
                      (weight_[p] * families_.inverse_shape(p)[entry] + weight_[j] * families_.inverse_shape(j)[entry]) * xi[b];
          }
      });
      for (int c = 0; c < D; ++c) out_.component(c)[p] = position_[p][3] * sum[c];
    });
    finish(y);
  }

  /// x with its images.
  Field shown(const Field& x) {
    show(x);
    return out_;
  }

 private:
  void show(const Field& x) {
    out_ = body_.make_field(D);
    copy(x, out_);
    if (beyond_.extend) beyond_.extend(out_);
    mirror_rows(out_, body_.points(), rows_);
  }
  void finish(Field& y) {
    if (beyond_.fold) beyond_.fold(out_);
    copy(out_, y);
    closed_.project(y);
  }
  template <class Visit>
  void over_points(Visit&& visit) const {
    parallel_for(cloud_blocks(body_.points()), [&](std::size_t b) {
      for (std::size_t p = b * cloud_block_points; p < std::min(body_.points(), (b + 1) * cloud_block_points); ++p) visit(p);
    });
  }
  template <class Visit>
  void over_bonds(std::size_t p, Visit&& visit) const {
    const FamilyLists& lists = families_.lists();
    for (auto k = static_cast<std::size_t>(lists.first[p]); k < static_cast<std::size_t>(lists.first[p + 1]); ++k)
      visit(k, static_cast<std::size_t>(lists.neighbour[k]));
  }

  const CloudFamilies& families_;
  const Body& body_;
  const CloudConsistency& beyond_;
  ClosedComponents closed_;
  CloudGradient<D> gradient_;
  const Row* position_;         ///< {x, y, z, V}
  std::vector<double> weight_;  ///< W/V; 0 of points that store nothing
  Field out_;
  AlignedVector<Row> rows_, gradients_;
};

}  // namespace

template <int D>
Field find_shift(const SpaceParts& parts, const ClosedPoints& closed, const CloudConsistency& beyond, Balanced& result) {
  ShiftSystem<D> system(parts, closed, beyond);
  Field x = system.make(), b = x, r = x;
  system.unshifted(b);
  result.before = system.largest(b);
  combine(-1, b, 0, b, b);
  result.iterations = solve(system, b, rounding_residual, effort_of_balance(parts), x).iterations;
  system.apply(x, r);
  combine(1, b, -1, r, r);
  result.after = system.largest(r, &result.worst);
  if (!(result.after <= result.before)) {  // the constraints contradict each other
    x = system.make();
    result.after = system.largest(b, &result.worst);
  }
  return system.shown(x);
}

void shift_gradient(const FamilyArrays& family, std::size_t p, ConstFieldView lambda, std::vector<double>& g) {
  const auto d = static_cast<std::size_t>(family.dimension);
  double H[9] = {};  // of lambda
  const auto difference = [&](std::size_t k, std::size_t c) {
    return lambda.component(static_cast<int>(c))[family.far[k]] - lambda.component(static_cast<int>(c))[p];
  };
  bool live = false;
  for (std::size_t k = 0; k < family.far.size(); ++k)
    for (std::size_t c = 0; c < d; ++c)
      for (std::size_t e = 0; e < d; ++e) {
        H[c * d + e] += difference(k, c) * g[k * d + e];
        live = live || g[k * d + e] != 0;
      }
  for (std::size_t k = 0; k < family.far.size() && live; ++k)
    for (std::size_t c = 0; c < d; ++c) {
      double z = difference(k, c);
      for (std::size_t e = 0; e < d; ++e) z -= H[c * d + e] * family.xi[e][k];
      g[k * d + c] += family.omega[k] * family.volume[k] * z;
    }
}

template Field find_shift<1>(const SpaceParts&, const ClosedPoints&, const CloudConsistency&, Balanced&);
template Field find_shift<2>(const SpaceParts&, const ClosedPoints&, const CloudConsistency&, Balanced&);
template Field find_shift<3>(const SpaceParts&, const ClosedPoints&, const CloudConsistency&, Balanced&);

}  // namespace perikit
