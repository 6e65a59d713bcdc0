#include "problem/companion.hpp"

#include <algorithm>
#include <cmath>

#include "perikit/core/parallel.hpp"

namespace perikit {

namespace {

constexpr double least = 1e-3;     // share of a spring between points whose bond has failed
constexpr double floating = 1e-9;  // of the diagonal: less than the softest bending of bodies that fit into memory

/// a and b of the springs that stand for an isotropic law.
struct SpringModuli {
  double stretch, slide;
};
SpringModuli spring_moduli(Space space, const Moduli& moduli) {
  if (moduli.mu == 0) return {0, 0};   // images behind faces store nothing: the springs to them are those of the points in front
  const double mu = moduli.mu, plane = 2 * moduli.lambda * mu / (moduli.lambda + 2 * mu);
  const double lambda = space == Space::plane_stress ? plane : moduli.lambda, d = dimension(space);
  if (space == Space::line_strain) return {lambda + 2 * mu, 0};
  if (space == Space::line_stress) return {moduli.youngs(), 0};
  double slide = std::max(0.0, 2 * d * (mu - lambda));
  const double stretch = slide + d * (d + 2) * (lambda <= mu ? std::max(lambda, 0.0) : std::sqrt(mu * (lambda + 2 * mu) / 3));
  slide = std::max(slide, 0.05 * stretch);
  return {stretch, slide};
}

double squared(const double* a, const double* b) {
  return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]);
}

/// Rows of `near`; those of poor points, and their partners, from `far` instead.
FamilyLists merged(const FamilyLists& near, const FamilyLists& far, const std::vector<bool>& poor) {
  FamilyLists lists{{0}, {}};
  for (std::size_t i = 0; i + 1 < near.first.size(); ++i) {
    const auto in_near = [&](std::int32_t j) {
      return std::binary_search(near.neighbour.begin() + near.first[i], near.neighbour.begin() + near.first[i + 1], j);
    };
    for (std::int64_t k = far.first[i]; k < far.first[i + 1]; ++k) {
      const std::int32_t j = far.neighbour[static_cast<std::size_t>(k)];
      if (poor[i] || poor[static_cast<std::size_t>(j)] || in_near(j)) lists.neighbour.push_back(j);
    }
    lists.first.push_back(static_cast<std::int64_t>(lists.neighbour.size()));
  }
  return lists;
}

}  // namespace

Companion::Companion(const Families& families, const Laws& laws)
    : families_(families), laws_(laws), body_(families.body()), dimension_(body_.dimension()) {
  const Body& body = body_;
  for (std::size_t p = 0; p < body.stride(); ++p) {
    if (!body.alive(p)) continue;
    point_.push_back(static_cast<std::int32_t>(p));
    const Point x = body.position(p);
    rows_.insert(rows_.end(), {x[0], x[1], x[2], body.volume(p)});
  }
  find_pattern();
}

void Companion::limit_bulk(double most) {
  if (most == most_bulk_) return;
  most_bulk_ = most;
  stretch_.resize(point_.size());
  slide_.resize(point_.size());
  for (std::size_t i = 0; i < point_.size(); ++i) {
    double m = 0;
    for (std::int64_t k = lists_.first[i]; k < lists_.first[i + 1]; ++k) {
      const double* other = &rows_[4 * static_cast<std::size_t>(lists_.neighbour[static_cast<std::size_t>(k)])];
      const double xi2 = squared(&rows_[4 * i], other);
      m += influence(xi2) * xi2 * other[3];
    }
    Moduli of_point = laws_.moduli(static_cast<std::size_t>(point_[i]));
    of_point.lambda = std::min(of_point.lambda, (most - 2.0 / 3) * of_point.mu);
    const SpringModuli moduli = spring_moduli(body_.space(), of_point);
    // A point without a spring stands alone, as stiff as its like.
    stretch_[i] = m > 0 ? moduli.stretch / m : moduli.stretch * rows_[4 * i + 3] / (body_.spacing() * body_.spacing());
    slide_[i] = m > 0 ? moduli.slide / m : 0;
  }
}

void Companion::find_pattern() {
  const std::size_t n = point_.size();
  // A little more than the diagonal of a face; clouds have about as many neighbours there, but where points are far apart some
  // have few: they keep their family.
  double reach = (dimension_ == 1 ? 1.01 : 1.43) * body_.spacing();
  // Farther than a horizon from its own points a rank knows no moduli.
  if (!body_.places().place.empty()) reach = std::min(reach, body_.horizon());
  const auto number = [&](std::size_t i) { return body_.image(static_cast<std::size_t>(point_[i])) ? -1 : static_cast<std::int64_t>(i); };
  lists_ = find_families(rows_, n, dimension_, reach, number);
  std::vector<bool> poor(n);
  for (std::size_t i = 0; i < n; ++i) poor[i] = lists_.first[i + 1] - lists_.first[i] < dimension_;
  if (std::ranges::find(poor, true) != poor.end())
    lists_ = merged(lists_, find_families(rows_, n, dimension_, std::max(body_.horizon(), reach), number), poor);
  if (body_.cracks().empty()) return;
  FamilyLists whole{{0}, {}};
  for (std::size_t i = 0; i < n; ++i) {
    for (std::int64_t k = lists_.first[i]; k < lists_.first[i + 1]; ++k) {
      const std::int32_t j = lists_.neighbour[static_cast<std::size_t>(k)];
      const double *a = &rows_[4 * i], *b = &rows_[4 * static_cast<std::size_t>(j)];
      if (!body_.cut({a[0], a[1], a[2]}, {b[0], b[1], b[2]})) whole.neighbour.push_back(j);
    }
    whole.first.push_back(static_cast<std::int64_t>(whole.neighbour.size()));
  }
  lists_ = std::move(whole);
}

std::vector<double> Companion::shares() const {
  std::vector<double> share;
  const std::vector<BondChange> changed = families_.changed();
  if (changed.empty()) return share;
  share.assign(lists_.neighbour.size(), 1.0);
  const auto row = [&](std::int32_t point) { return std::lower_bound(point_.begin(), point_.end(), point) - point_.begin(); };
  const auto weaken = [&](std::ptrdiff_t i, std::ptrdiff_t j, double integrity) {
    const auto begin = lists_.neighbour.begin() + lists_.first[static_cast<std::size_t>(i)],
               end = lists_.neighbour.begin() + lists_.first[static_cast<std::size_t>(i) + 1],
               spring = std::lower_bound(begin, end, static_cast<std::int32_t>(j));
    if (spring != end && *spring == j)
      share[static_cast<std::size_t>(spring - lists_.neighbour.begin())] = std::max(integrity, least);
  };
  for (const auto& [bond, integrity] : changed) {
    const std::ptrdiff_t i = row(bond.point), j = row(bond.far);
    weaken(i, j, integrity);
    weaken(j, i, integrity);
  }
  return share;
}

void Companion::assemble(ConstFieldView u, BlockMatrix& K) const {
  const std::vector<double> share = shares();
  const std::size_t n = point_.size(), d = static_cast<std::size_t>(dimension_), size = d * d;
  if (!K.has_pattern()) {
    K.dimension = dimension_;
    K.symmetric = true;
    K.point = point_;
    K.row_first.assign(1, 0);
    for (std::size_t i = 0; i < n; ++i) {
      bool placed = false;
      for (std::int64_t k = lists_.first[i]; k < lists_.first[i + 1]; ++k) {
        const std::int32_t j = lists_.neighbour[static_cast<std::size_t>(k)];
        if (!placed && j > static_cast<std::int32_t>(i)) K.column.push_back(static_cast<std::int32_t>(i)), placed = true;
        K.column.push_back(j);
      }
      if (!placed) K.column.push_back(static_cast<std::int32_t>(i));
      K.row_first.push_back(static_cast<std::int64_t>(K.column.size()));
    }
    K.values.resize(K.blocks() * size);
  }
  parallel_for(n, [&](std::size_t i) {
    double sum[9] = {};
    double* own = nullptr;
    auto spring = static_cast<std::size_t>(lists_.first[i]);  // the row's blocks but the diagonal one, in their order
    for (std::int64_t b = K.row_first[i]; b < K.row_first[i + 1]; ++b) {
      const auto j = static_cast<std::size_t>(K.column[static_cast<std::size_t>(b)]);
      double* block = &K.values[static_cast<std::size_t>(b) * size];
      if (j == i) {
        own = block;
        continue;
      }
      const double *from = &rows_[4 * i], *to = &rows_[4 * j];
      const double xi2 = squared(from, to);
      double y[3] = {}, y2 = 0;
      for (std::size_t c = 0; c < d; ++c) {
        y[c] = to[c] - from[c] + u.component(static_cast<int>(c))[point_[j]] - u.component(static_cast<int>(c))[point_[i]];
        y2 += y[c] * y[c];
      }
      const double left = share.empty() ? 1.0 : share[spring++];
      const double volumes = left * from[3] * to[3] * influence(xi2);
      const double stretch = volumes * (stretch_[i] + stretch_[j]), slide = volumes * (slide_[i] + slide_[j]);
      for (std::size_t a = 0; a < d; ++a)
        for (std::size_t c = 0; c < d; ++c) {
          const double along = y2 > 0 ? (stretch - slide) * y[a] * y[c] / y2 : 0.0;
          block[a * d + c] = -(along + (a == c ? slide : 0.0));
          sum[a * d + c] -= block[a * d + c];
        }
    }
    // Parts that springs do not join to a held one stay where they are, all but freely.
    const bool alone = K.row_first[i + 1] - K.row_first[i] == 1;
    for (std::size_t a = 0; a < d; ++a) sum[a * d + a] = alone ? stretch_[i] : sum[a * d + a] * (1 + floating);
    std::copy_n(sum, size, own);
  });
}

}  // namespace perikit
