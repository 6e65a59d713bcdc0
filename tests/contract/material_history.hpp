#pragma once
/// What every material with history must fulfil beyond the contract of one increment: steps along paths.

#include "tests/contract/material_check.hpp"

namespace perikit::contract {

/// One material with history in one space.
class HistoryContract : MaterialCheck {
 public:
  using MaterialCheck::MaterialCheck;

  void check() {
    CHECK_MESSAGE(!traits_.hyperelastic, label(), "a law with history is not hyperelastic");
    standing_still();
    tangent();
    rigid_rotations();
    turned_paths();
    units();
    batches();
    dissipation();
  }

 private:
  /// F = I + t slope + sin(3 t) bend, and the rotation by t angle of the frame it is seen from.
  struct Path {
    Matrix slope, bend;
    double angle;
  };
  static constexpr int points_ = 11;

  std::vector<Path> random_paths() {
    std::vector<Path> paths;
    for (int p = 0; p < points_; ++p) {
      Path path{};
      for (const int k : places(space_)) {
        path.slope[k] = uniform(random_, -0.2, 0.2);
        path.bend[k] = uniform(random_, -0.1, 0.1);
      }
      path.angle = uniform(random_, -3, 3);
      paths.push_back(path);
    }
    return paths;
  }
  static Matrix at(const Path& path, double t) {
    Matrix F = identity;
    for (int k = 0; k < 9; ++k) F[k] += t * path.slope[k] + std::sin(3 * t) * path.bend[k];
    return F;
  }
  /// A rotation that grows with t: about z in the plane, about a fixed skew axis in space.
  Matrix turn(const Path& path, double t) const {
    const int d = dimension(space_);
    if (d == 1) return identity;
    const double c = std::cos(t * path.angle), s = std::sin(t * path.angle);
    if (d == 2) return {c, -s, 0, s, c, 0, 0, 0, 1};
    const double a[3] = {2.0 / 3, -1.0 / 3, 2.0 / 3};
    Matrix Q{};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) Q[3 * i + j] = (1 - c) * a[i] * a[j] + (i == j ? c : 0.0);
    const int next[3] = {1, 2, 0};
    for (int i = 0; i < 3; ++i) {
      const int j = next[i], k = next[j];
      Q[3 * i + j] -= s * a[k];
      Q[3 * j + i] += s * a[k];
    }
    return Q;
  }

  std::vector<Values> histories(const Evaluation& e) const {
    std::vector<Values> r;
    for (int p = 0; p < e.n; ++p) r.push_back(e.at(e.state, p));
    return r;
  }
  std::vector<Values> gradients(const std::vector<Path>& paths, double t, bool turned) const {
    std::vector<Values> H;
    for (const Path& path : paths) H.push_back(gradient(turned ? product(turn(path, t), at(path, t)) : at(path, t)));
    return H;
  }
  Evaluation step(const std::vector<Values>& H, const std::vector<Values>& from,
                  const std::vector<Values>& directions = {}, double time_step = 0) const {
    Evaluation e(material_, space_, constants_, H, directions, false, from, false, time_step);
    CHECK_MESSAGE(e.status.ok(), label(), "admissible step refused, point ", e.status.inadmissible);
    for (int p = 0; p < e.n; ++p) {
      const double factor = e.step_factor.data()[p];
      CHECK_MESSAGE((factor > 0 && std::isfinite(factor)), label(), "the law asks for a step of ", factor, " of the length that it had; a share is above 0");
    }
    return e;
  }
  /// The end of a path in equal steps.
  Evaluation follow(const std::vector<Path>& paths, int steps, bool turned) const {
    std::vector<Values> from;
    for (int n = 1; n < steps; ++n) from = histories(step(gradients(paths, double(n) / steps, turned), from));
    return step(gradients(paths, 1.0, turned), from);
  }

  void standing_still() {
    const Evaluation e = follow(random_paths(), 5, true);
    std::vector<Values> H;
    for (int p = 0; p < points_; ++p) H.push_back(e.at(e.H, p));
    const Evaluation same = step(H, histories(e));
    for (int p = 0; p < points_; ++p) {
      near("a step without motion keeps P", same.at(same.P, p), e.at(e.P, p), 1e-13, stress_scale(e, p));
      near("a step without motion keeps psi", same.at(same.psi, p), e.at(e.psi, p), 1e-13, stress_scale(e, p));
    }
  }

  /// The derivative of the update at fixed history along directions, by central differences of order six.
  std::vector<Values> differences(const std::vector<Values>& H, const std::vector<Values>& from, const std::vector<Values>& directions, double h) const {
    constexpr double weights[] = {3.0 / 4, -3.0 / 20, 1.0 / 60};
    std::vector<Values> slope(points_, Values(components_, 0.0));
    for (int k = 1; k <= 3; ++k)
      for (const int sign : {1, -1}) {
        std::vector<Values> moved = H;
        for (int p = 0; p < points_; ++p)
          for (int c = 0; c < components_; ++c) moved[p][c] += sign * k * h * directions[p][c];
        const Evaluation m = step(moved, from);
        for (int p = 0; p < points_; ++p)
          for (int c = 0; c < components_; ++c) slope[p][c] += sign * weights[k - 1] / h * m.P.component(c)[p];
      }
    return slope;
  }

  /// dP is the derivative of the update at fixed history. Where a law has a corner, between elastic and plastic steps say, differences over it say nothing: those of two
  /// lengths tell. Most points have none nearby.
  void tangent() {
    constexpr double tolerance = 1e-7, h = 1e-3;
    const std::vector<Path> paths = random_paths();
    const std::vector<Values> from = histories(follow(paths, 5, true)), H = gradients(paths, 1.2, true);
    std::vector<Values> directions;
    for (int p = 0; p < points_; ++p) directions.push_back(random_direction(random_, space_));
    const Evaluation e = step(H, from, directions);
    const std::vector<Values> slope = differences(H, from, directions, h), shorter = differences(H, from, directions, h / 8);
    int compared = 0;
    for (int p = 0; p < points_; ++p) {
      const double scale = stress_scale(e, p);
      bool agree = true;
      for (int c = 0; c < components_; ++c) agree = agree && std::abs(slope[p][c] - shorter[p][c]) <= tolerance * scale;
      if (!agree) continue;
      ++compared;
      near("dP from a history (differences)", e.at(e.dP, p), shorter[p], tolerance, scale);
    }
    CHECK_MESSAGE(4 * compared >= 3 * points_, label(), "differences of P from a history have a limit at ", compared, " of ", points_, " points");
  }

  /// A step that is a rotation turns the stress and does no work.
  void rigid_rotations() {
    if (dimension(space_) == 1) return;
    const Evaluation e = follow(random_paths(), 5, true);
    std::vector<Values> H;
    std::vector<Matrix> Q;
    for (int p = 0; p < points_; ++p) {
      Matrix F = extend(space_, e.at(e.H, p));
      for (int i = 0; i < 3; ++i) F[4 * i] += 1;
      Q.push_back(random_rotation(random_, space_));
      H.push_back(gradient(product(Q.back(), F)));
    }
    const Evaluation turned = step(H, histories(e));
    for (int p = 0; p < points_; ++p) {
      const Matrix P = extend(space_, e.at(e.P, p));
      near("a rotation turns the stress", turned.at(turned.P, p), restrict_to(space_, product(Q[p], P)), 1e-12,
           stress_scale(e, p));
      near("a rotation does no work", turned.at(turned.psi, p), e.at(e.psi, p), 1e-12, stress_scale(e, p));
    }
  }

  /// The same path seen from a turning frame: the stress turned, the same work.
  void turned_paths() {
    const std::vector<Path> paths = random_paths();
    const Evaluation plain = follow(paths, 7, false), turned = follow(paths, 7, true);
    for (int p = 0; p < points_; ++p) {
      const Matrix P = extend(space_, plain.at(plain.P, p));
      near("objectivity along a path", turned.at(turned.P, p), restrict_to(space_, product(turn(paths[p], 1.0), P)), 1e-11,
           stress_scale(plain, p));
      near("work along a path", turned.at(turned.psi, p), plain.at(plain.psi, p), 1e-11, stress_scale(plain, p));
    }
  }

  void units() {
    constexpr double s = 1e-6;  // from Pa to MPa
    const std::vector<Path> paths = random_paths();
    std::vector<double> scaled = constants_;
    for (std::size_t k = 0; k < scaled.size(); ++k)
      if (options_.moduli.empty() || options_.moduli[k]) scaled[k] *= s;
    const HistoryContract other(material_, scaled, space_, options_);
    const Evaluation one = follow(paths, 5, true), two = other.follow(paths, 5, true);
    for (int p = 0; p < points_; ++p) {
      Values expected = one.all(p);
      for (double& x : expected) x *= s;
      near("scaling the moduli scales a path", two.all(p), expected, 1e-11, s * stress_scale(one, p));
    }
  }

  /// A batch equals its points one at a time, history included; history is overwritten, and nothing behind the padding is
  /// touched.
  void batches() {
    const std::vector<Path> paths = random_paths();
    const std::vector<Values> from = histories(follow(paths, 3, true)), H = gradients(paths, 1.1, true);
    const Evaluation batch = step(H, from);
    CHECK_MESSAGE(batch.guards_intact, label(), "writes behind padded(n)");
    for (int p = 0; p < points_; ++p) {
      const Values history = batch.at(batch.state, p);
      CHECK_MESSAGE(std::none_of(history.begin(), history.end(), [](double x) { return std::isnan(x); }), label(),
                    "history overwritten, point ", p);
      const Evaluation single = step({H[p]}, {from[p]});
      same_bits("batch = single from a history", batch.all(p), single.all(0));
      same_bits("history of batch = single", history, single.at(single.state, 0));
      same_bits("step factor of batch = single", batch.at(batch.step_factor, p), single.at(single.step_factor, 0));
    }
    std::vector<Values> zero(points_, Values(from.front().size(), 0.0));
    const Evaluation fresh = step(H, {}), zeros = step(H, zero);
    for (int p = 0; p < points_; ++p) same_bits("fresh history is zero", fresh.all(p), zeros.all(p));
  }

  /// Work along paths of this duration, in this many equal steps: what is missing of psi + dissipated energy = work, by point.
  struct Account {
    std::vector<double> missing, work, dissipated;
  };
  Account account(const std::vector<Path>& paths, double duration, int steps, bool turned) const {
    Account sum{std::vector<double>(points_, 0.0), std::vector<double>(points_, 0.0), std::vector<double>(points_, 0.0)};
    Evaluation before = step(gradients(paths, 0.0, turned), {});
    for (int n = 1; n <= steps; ++n) {
      const Evaluation e = step(gradients(paths, double(n) / steps, turned), n == 1 ? std::vector<Values>() : histories(before), {}, duration / steps);
      for (int p = 0; p < points_; ++p) {
        const double dissipated = e.dissipated.data()[p], scale = stress_scale(e, p);
        CHECK_MESSAGE(dissipated >= -1e-14 * scale, label(), "a step dissipates a negative energy: ", dissipated);
        double work = 0;
        for (int c = 0; c < components_; ++c)   // free stresses are zero
          work += 0.5 * (before.P.component(c)[p] + e.P.component(c)[p]) * (e.H.component(c)[p] - before.H.component(c)[p]);
        sum.work[p] += std::abs(work);
        sum.dissipated[p] += dissipated;
        sum.missing[p] += e.psi.data()[p] - before.psi.data()[p] + dissipated - work;
      }
      before = e;
    }
    return sum;
  }

  /// What a path takes is stored or dissipated, and nothing is won: whatever the speed, as steps grow shorter. Seen from a turning
  /// frame, the same is dissipated.
  void dissipation() {
    const std::vector<Path> paths = random_paths();
    double most = 0;
    for (const double duration : {1e-6, 1e-4, 1e-2, 1.0, 100.0}) {
      const Account coarse = account(paths, duration, 64, false), fine = account(paths, duration, 128, false), turned = account(paths, duration, 64, true);
      for (int p = 0; p < points_; ++p) {
        CHECK_MESSAGE(std::abs(fine.missing[p]) <= 0.7 * std::abs(coarse.missing[p]) + 1e-3 * fine.work[p], label(), "work = psi + dissipated energy in ", duration,
                      " s: ", coarse.missing[p], " is missing in 64 steps, ", fine.missing[p], " in 128, of a work of ", fine.work[p]);
        CHECK_MESSAGE(std::abs(turned.dissipated[p] - coarse.dissipated[p]) <= 1e-10 * coarse.work[p], label(), "a turning frame dissipates ", turned.dissipated[p],
                      " in place of ", coarse.dissipated[p]);
        most = std::max(most, fine.dissipated[p] / fine.work[p]);
      }
    }
    CHECK_MESSAGE((!traits_.dissipates || most > 1e-6), label(), "the law declares that it dissipates, and nothing is, at any speed");
  }
};

}  // namespace perikit::contract
