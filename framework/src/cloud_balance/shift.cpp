#include "cloud_balance/shift.hpp"

#include <cmath>
#include <numeric>

#include "cloud_balance/balance_solver.hpp"
#include "core/dimension.hpp"
#include "families/cloud/cloud_rows.hpp"
#include "spaces/cloud/cloud_gradient.hpp"
#include "spaces/weighted/local_stencil.hpp"
#include "spaces/weighted/stencil_shift.hpp"

namespace perikit {

namespace {

/// What systems for lambda share: products with the matrix S of sum_q W_q sum_j omega V_j |z_qj|^2 / 2 as loops over points that gather.
template <int D>
class ShiftSystem {
 public:
  ShiftSystem(const SpaceParts& parts, const ClosedPoints& closed, const CloudConsistency& beyond)
      : families_(*parts.families.cloud()),
        body_(families_.body()),
        position_(reinterpret_cast<const Row*>(body_.rows().data())),
        diagonal_(body_.make_field(1)),
        beyond_(beyond),
        closed_(closed, body_),
        stores_(storing_points(parts)) {}

  Field make() const { return body_.make_field(D); }
  double largest(const Field& r, Point* where = nullptr) const { return closed_.largest(r, where); }
  void precondition(const Field& r, Field& z) const {
    copy(r, z);
    for (int c = 0; c < D; ++c)
      for (std::size_t p = 0; p < body_.points(); ++p) z.component(c)[p] /= std::max(diagonal_.data()[p], 1e-300);
  }
  /// x with its images.
  Field shown(const Field& x) {
    show(x);
    return out_;
  }
  /// sum_q W_q sum_j |g_qj|^2 / (omega V_j), of which of_point(p) is the share of an owned point.
  template <class OfPoint>
  double sum_of(OfPoint&& of_point) const {
    Field shares = make(), ones = make();
    for (const std::int32_t p : body_.owned()) {
      shares.component(0)[p] = of_point(static_cast<std::size_t>(p));
      ones.component(0)[p] = 1;
    }
    return dot(shares, ones);
  }

 protected:
  /// W/V of a point with intact bonds, over the share of its evaluation point.
  double weight(std::size_t p) const { return stores_[p] ? 1 - families_.damage(p) : 0.0; }
  void show(const Field& x) {
    out_ = body_.make_field(D);
    copy(x, out_);
    if (beyond_.extend) beyond_.extend(out_);
    mirror_rows(out_, body_.points(), rows_);
  }
  /// y_p <- of_point(p) at points whose components are closed.
  template <class OfPoint>
  void gather(Field& y, OfPoint&& of_point) {
    over_points([&](std::size_t p) {
      const Row sum = of_point(p);
      for (int c = 0; c < D; ++c) out_.component(c)[p] = sum[c];
    });
    if (beyond_.fold) beyond_.fold(out_);
    copy(out_, y);
    closed_.project(y);
  }
  /// visit(block, its first point, the end of its points).
  template <class Visit>
  void over_blocks(Visit&& visit) const {
    const CloudBlocks pieces = pieces_of(body_.points());
    parallel_for(pieces.count(), [&](std::size_t b) { visit(b, pieces.begin(b), pieces.end(b)); });
  }
  template <class Visit>
  void over_points(Visit&& visit) const {
    over_blocks([&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) visit(p);
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
  const Row* position_;  ///< {x, y, z, V}
  Field diagonal_;       ///< of S, roughly
  Field out_;
  AlignedVector<Row> rows_;

 private:
  const CloudConsistency& beyond_;
  ClosedComponents closed_;
  std::vector<std::uint8_t> stores_;
};

/// Of point gradients.
template <int D>
class PointShift : public ShiftSystem<D> {
 public:
  PointShift(const SpaceParts& parts, const ClosedPoints& closed, const CloudConsistency& beyond)
      : ShiftSystem<D>(parts, closed, beyond),
        gradient_(this->families_),
        weight_(this->body_.stride(), 0.0),
        gradients_(D * this->body_.points()) {
    for (const std::int32_t p : this->body_.internal()) weight_[static_cast<std::size_t>(p)] = this->weight(static_cast<std::size_t>(p));
    for (std::size_t p = 0; p < this->body_.points(); ++p)
      this->diagonal_.data()[p] = 2 * this->body_.volume(p) * this->families_.normaliser(p, BondWeight::kernel);
  }

  /// sum_j omega V_j |K^-1 xi|^2 = tr K^-1.
  double unmoved() const {
    return this->sum_of([&](std::size_t p) {
      double trace = 0;
      for (int a = 0; a < D; ++a) trace += this->families_.inverse_shape(p)[symmetric_index(D, a, a)];
      return this->position_[p][3] * weight_[p] * trace;
    });
  }

  /// y_k = - V_k sum_j omega V_j [W_k/V_k (x_kj - H_k xi_kj) + W_j/V_j (x_kj - H_j xi_kj)], H the gradient of x.
  void apply(const Field& x, Field& y) {
    this->show(x);
    const double* omega = this->families_.omegas();
    const auto& rows = this->rows_;
    this->over_points([&](std::size_t p) { gradient_.at(p, rows, &gradients_[D * p]); });
    this->gather(y, [&](std::size_t p) {
      Row sum{};
      this->over_bonds(p, [&](std::size_t k, std::size_t j) {
        const Row xi = this->position_[j] - this->position_[p], x_kj = rows[j] - rows[p];
        Row z = (weight_[p] + weight_[j]) * x_kj;
        for (int e = 0; e < D; ++e)
          z -= xi[e] * (weight_[p] * gradients_[D * p + static_cast<std::size_t>(e)] +
                        weight_[j] * gradients_[D * j + static_cast<std::size_t>(e)]);
        sum -= (omega[k] * this->position_[j][3]) * z;
      });
      return this->position_[p][3] * sum;
    });
  }

  /// A_k without lambda: - V_k sum_j omega V_j (W_k/V_k K_k^-1 + W_j/V_j K_j^-1) xi_kj.
  void unshifted(Field& y) {
    const double* omega = this->families_.omegas();
    this->out_ = this->body_.make_field(D);
    this->gather(y, [&](std::size_t p) {
      Row sum{};
      this->over_bonds(p, [&](std::size_t k, std::size_t j) {
        const Row xi = this->position_[j] - this->position_[p];
        for (int a = 0; a < D; ++a)
          for (int b = 0; b < D; ++b) {
            const int entry = symmetric_index(D, std::min(a, b), std::max(a, b));
            sum[a] -= omega[k] * this->position_[j][3] *
                      (weight_[p] * this->families_.inverse_shape(p)[entry] + weight_[j] * this->families_.inverse_shape(j)[entry]) * xi[b];
          }
      });
      return this->position_[p][3] * sum;
    });
  }

 private:
  CloudGradient<D> gradient_;
  std::vector<double> weight_;  ///< W/V; 0 of points that store nothing
  AlignedVector<Row> gradients_;
};

/// Of the gradients of parts of families, each of which sees some bonds of its point.
template <int D>
class PartShift : public ShiftSystem<D> {
 public:
  PartShift(const SpaceParts& parts, const ClosedPoints& closed, const CloudConsistency& beyond)
      : ShiftSystem<D>(parts, closed, beyond), parts_(static_cast<std::size_t>(parts.formulation.parts(D))) {
    load_parts(parts);
    set_diagonal();
  }

  double unmoved() const {
    return this->sum_of([&](std::size_t p) {
      double sum = 0;
      for (std::size_t q = 0; q < parts_; ++q)
        for (std::size_t a = 0; a < D; ++a) sum += of_point(p, q).weight * of_point(p, q).entry(a, a);
      return this->position_[p][3] * sum;
    });
  }

  /// y_k = - V_k sum_j V_j sum of W_q/V omega_q (x_kj - H_q xi_kj) over the parts q of k and of j that see the bond.
  void apply(const Field& x, Field& y) {
    this->show(x);
    const auto& rows = this->rows_;
    this->over_points([&](std::size_t p) {
      Row* const own = &gradients_[p * parts_ * D];  // first the moments S_q
      std::fill_n(own, parts_ * D, Row{});
      this->over_bonds(p, [&](std::size_t k, std::size_t j) {
        const Row xi = this->position_[j] - this->position_[p];
        const Row difference = this->position_[j][3] * (rows[j] - rows[p]);
        for (std::size_t s = first_[k]; s < first_[k + 1]; ++s)
          for (int b = 0; b < D; ++b) own[seen_[s].part * D + static_cast<std::size_t>(b)] += seen_[s].omega * xi[b] * difference;
      });
      for (std::size_t q = 0; q < parts_; ++q) {
        Row H[D] = {};
        for (std::size_t e = 0; e < D; ++e)
          for (std::size_t b = 0; b < D; ++b) H[e] += of_point(p, q).entry(b, e) * own[q * D + b];
        std::copy_n(H, D, own + q * D);
      }
    });
    this->gather(y, [&](std::size_t p) {
      Row sum{};
      this->over_bonds(p, [&](std::size_t k, std::size_t j) {
        const Row xi = this->position_[j] - this->position_[p], x_kj = rows[j] - rows[p];
        each_part(p, j, k, [&](const Part& part, double omega) {
          Row z = x_kj;
          for (int e = 0; e < D; ++e) z -= xi[e] * gradients_[static_cast<std::size_t>(&part - part_.data()) * D + static_cast<std::size_t>(e)];
          sum -= this->position_[j][3] * part.weight * omega * z;
        });
      });
      return this->position_[p][3] * sum;
    });
  }

  /// A_k without lambda: - V_k sum_j V_j sum of W_q/V omega_q K_q^-1 xi_kj.
  void unshifted(Field& y) {
    this->out_ = this->body_.make_field(D);
    this->gather(y, [&](std::size_t p) {
      Row sum{};
      this->over_bonds(p, [&](std::size_t k, std::size_t j) {
        const Row xi = this->position_[j] - this->position_[p];
        each_part(p, j, k, [&](const Part& part, double omega) {
          for (std::size_t a = 0; a < D; ++a)
            for (std::size_t b = 0; b < D; ++b) sum[a] -= this->position_[j][3] * part.weight * omega * part.entry(a, b) * xi[b];
        });
      });
      return this->position_[p][3] * sum;
    });
  }

 private:
  struct Part {
    double weight = 0;      ///< W/V; 0 of points that store nothing, and of parts without a gradient
    double inverse[6] = {};  ///< of K_q
    double entry(std::size_t a, std::size_t b) const noexcept {
      return inverse[symmetric_index(D, static_cast<int>(std::min(a, b)), static_cast<int>(std::max(a, b)))];
    }
    /// x . K^-1 x.
    double square(const Row& x) const noexcept {
      double sum = 0;
      for (std::size_t a = 0; a < D; ++a)
        for (std::size_t b = 0; b < D; ++b) sum += x[a] * entry(a, b) * x[b];
      return sum;
    }
  };
  /// A part that sees a bond.
  struct Seen {
    double omega;
    std::size_t part;
  };

  const Part& of_point(std::size_t p, std::size_t q) const { return part_[p * parts_ + q]; }

  /// The parts of p and of j that see their bond, the k-th of all.
  template <class Visit>
  void each_part(std::size_t p, std::size_t j, std::size_t k, Visit&& visit) const {
    for (std::size_t s = first_[k]; s < first_[k + 1]; ++s) visit(of_point(p, seen_[s].part), seen_[s].omega);
    const std::size_t back = reverse_[k];
    for (std::size_t s = first_[back]; s < first_[back + 1]; ++s) visit(of_point(j, seen_[s].part), seen_[s].omega);
  }

  /// Of a part q that point k belongs to: W_q omega V_k (1 - omega V_k xi . K^-1 xi); of its own ones W_q (m - s . K^-1 s), m = sum omega V_j,
  /// s = sum omega V_j xi_j. Parts of few bonds, whose lambda is almost affine, hardly count.
  void set_diagonal() {
    this->over_points([&](std::size_t p) {
      double sum = 0;
      std::vector<double> m(parts_, 0.0);
      std::vector<Row> s(parts_, Row{});
      this->over_bonds(p, [&](std::size_t k, std::size_t j) {
        const Row xi = this->position_[j] - this->position_[p];
        for (std::size_t i = first_[k]; i < first_[k + 1]; ++i) {
          const double w = seen_[i].omega * this->position_[j][3];
          m[seen_[i].part] += w;
          s[seen_[i].part] += w * xi;
        }
        const std::size_t back = reverse_[k];
        for (std::size_t i = first_[back]; i < first_[back + 1]; ++i) {
          const Part& part = of_point(j, seen_[i].part);
          const double w = seen_[i].omega * this->position_[p][3];
          sum += this->position_[j][3] * part.weight * w * (1 - w * part.square(xi));
        }
      });
      for (std::size_t q = 0; q < parts_; ++q)
        if (const Part& part = of_point(p, q); part.weight > 0) sum += this->position_[p][3] * part.weight * (m[q] - part.square(s[q]));
      this->diagonal_.data()[p] = sum;
    });
  }

  void load_parts(const SpaceParts& parts) {
    part_.resize(this->body_.points() * parts_);
    gradients_.resize(part_.size() * D);
    reverse_.resize(this->families_.lists().neighbour.size());
    first_.resize(reverse_.size() + 1);
    std::vector<std::vector<Seen>> seen(pieces_of(this->body_.points()).count());  // by block of points, put together below
    this->over_blocks([&](std::size_t b, std::size_t begin, std::size_t end) {
      LocalStencil<D> stencil;
      FamilyArrays family;
      for (std::size_t p = begin; p < end; ++p) {
        if (this->families_.neighbours(p).empty()) continue;
        this->families_.load(p, BondsOf::set_up, family);
        stencil.build({&parts.formulation, this->body_.horizon()}, family, nullptr, 0, nullptr);
        const int owners = stencil.points() - static_cast<int>(parts_);
        Part* const part = &part_[p * parts_];
        for (std::size_t q = 0; q < parts_; ++q) {
          const int at = owners + static_cast<int>(q);
          part[q].weight = this->weight(p) * stencil.share(at);
          for (int c = 0; c < symmetric_components(D); ++c) part[q].inverse[c] = stencil.inverse(at, c);
        }
        int bond = 0;
        this->over_bonds(p, [&](std::size_t k, std::size_t j) {
          reverse_[k] = static_cast<std::size_t>(this->families_.index(static_cast<std::int32_t>(j), static_cast<std::int32_t>(p)));
          const std::size_t before = seen[b].size();
          for (std::size_t q = 0; q < parts_; ++q)
            if (const double omega = stencil.influence(owners + static_cast<int>(q), bond); omega != 0 && part[q].inverse[0] != 0)
              seen[b].push_back({omega, q});
          first_[k + 1] = seen[b].size() - before;
          ++bond;
        });
      }
    });
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    for (const std::vector<Seen>& of_block : seen) seen_.insert(seen_.end(), of_block.begin(), of_block.end());
  }

  std::size_t parts_;
  std::vector<Part> part_;                ///< [point * parts + part]
  std::vector<std::size_t> first_;        ///< by bond: into seen_
  std::vector<Seen> seen_;
  std::vector<std::size_t> reverse_;      ///< the same bond in the list of the far end
  AlignedVector<Row> gradients_;          ///< of x: [(point * parts + part) * D + e]
};

/// Gradients that move more than they were say nothing of the body any more.
constexpr double most_moved = 1;

template <int D, class System>
Field solve_shift(System&& system, const SpaceParts& parts, Balanced& result) {
  Field b = system.make();
  system.unshifted(b);
  result.before = system.largest(b);
  combine(-1, b, 0, b, b);
  auto [x, iterations, contradiction] = solve(system, b, rounding_residual, effort_of_balance(parts));
  result.iterations = iterations;
  Field r = system.make();
  system.apply(x, r);
  result.moved = std::sqrt(dot(x, r) / system.unmoved());
  combine(1, b, -1, r, r);
  result.after = system.largest(r, &result.worst);
  if (!(result.after <= result.before) || !(result.moved <= most_moved)) {  // the constraints contradict each other
    x = system.make();
    result.moved = 0;
    result.after = system.largest(b, &result.worst);
  }
  return system.shown(x);
}

}  // namespace

template <int D>
Field find_shift(const SpaceParts& parts, const ClosedPoints& closed, const CloudConsistency& beyond, Balanced& result) {
  return solve_shift<D>(PointShift<D>(parts, closed, beyond), parts, result);
}

template <int D>
Field find_part_shift(const SpaceParts& parts, const ClosedPoints& closed, const CloudConsistency& beyond, Balanced& result) {
  return solve_shift<D>(PartShift<D>(parts, closed, beyond), parts, result);
}

void shift_gradient(const FamilyArrays& family, ConstFieldView lambda, std::vector<double>& g) {
  with_dimension(family.dimension, [&](auto D) {
    each_shift<D>(family, family.omega.data(), g.data(), lambda, 0, [&](std::size_t k, std::size_t e, double d) { g[k * D + e] += d; });
  });
}

template Field find_shift<1>(const SpaceParts&, const ClosedPoints&, const CloudConsistency&, Balanced&);
template Field find_shift<2>(const SpaceParts&, const ClosedPoints&, const CloudConsistency&, Balanced&);
template Field find_shift<3>(const SpaceParts&, const ClosedPoints&, const CloudConsistency&, Balanced&);
template Field find_part_shift<1>(const SpaceParts&, const ClosedPoints&, const CloudConsistency&, Balanced&);
template Field find_part_shift<2>(const SpaceParts&, const ClosedPoints&, const CloudConsistency&, Balanced&);
template Field find_part_shift<3>(const SpaceParts&, const ClosedPoints&, const CloudConsistency&, Balanced&);

}  // namespace perikit
