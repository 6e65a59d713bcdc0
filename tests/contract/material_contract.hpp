#pragma once
/// What every material must fulfil, as doctest checks: check_material(material, constants, {.law = "my_law"}).
/// A law with history is checked over one increment from the fresh state, and by material_history.hpp.

#include "tests/contract/material_check.hpp"
#include "tests/contract/material_history.hpp"

namespace perikit::contract {

/// One material in one space.
class MaterialContract : MaterialCheck {
 public:
  using MaterialCheck::MaterialCheck;

  /// One identity, by the member function that checks it.
  void check(void (MaterialContract::*identity)()) {
    CHECK_MESSAGE(traits_.constants == static_cast<int>(constants_.size()), label(), "number of constants");
    if (traits_.constants != static_cast<int>(constants_.size())) return;
    (this->*identity)();
  }

  void reference_state() {
    const Evaluation e = evaluate({Values(components_, 0.0)});
    CHECK_MESSAGE(e.status.ok(), label(), "F = I is refused");
    CHECK_MESSAGE(e.psi.data()[0] == 0.0, label(), "psi(0) = 0: ", e.psi.data()[0]);
    for (int c = 0; c < components_; ++c)
      CHECK_MESSAGE(e.P.component(c)[0] == 0.0, label(), "P(0) = 0: component ", c, " ", e.P.component(c)[0]);
    const double scale = stiffness_scale(e.at(e.A, 0));
    for (int c = 0; c < components_; ++c) {
      Values unit(components_, 0.0), column;
      unit[c] = 1;
      for (int r = 0; r < components_; ++r) column.push_back(e.A.component(r * components_ + c)[0]);
      near("tangent at I is linear elastic", column, linear_stress(unit), 1e-12, scale);
    }
  }

  /// P and psi of small strains to eight digits: of 1e-10 impossible through F = I + H or C.
  void small_strains() {
    const double size = options_.smallest_strain;
    const Moduli moduli = material_.small_strain(constants_.data());
    // A law written in F has the rounding of F in its energy.
    const double rounding = size > 1e-10 ? 64 * std::numeric_limits<double>::epsilon() * (moduli.lambda + 2 * moduli.mu) : 0.0,
                 tolerance = std::max(1e-8, 10 * size);
    for (int trial = 0; trial < 4; ++trial) {
      Values H = random_direction(random_, space_);
      for (double& x : H) x *= size;
      const Evaluation e = evaluate({H});
      const Values linear = linear_stress(H);
      near("P of a small strain", e.at(e.P, 0), linear, tolerance, largest(linear) + rounding / tolerance);
      if (!traits_.hyperelastic) continue;
      double energy = 0;
      for (int c = 0; c < components_; ++c) energy += is_free(space_, c) ? 0.0 : 0.5 * linear[c] * H[c];
      near("psi of a small strain", e.at(e.psi, 0), {energy}, tolerance, energy + rounding / tolerance);
    }
  }

  /// P = dpsi/dF, A = dP/dF by central differences of order six, and the major symmetry of A.
  void derivatives() {
    constexpr int n = 24;
    constexpr double weights[] = {3.0 / 4, -3.0 / 20, 1.0 / 60};
    const std::vector<Values> points = random_points(n), directions = random_directions(n);
    const Evaluation e = evaluate(points, directions);
    CHECK_MESSAGE(e.status.ok(), label(), "admissible deformation refused, point ", e.status.inadmissible);
    const double h = 1e-3 * std::min(1.0, free_stretch(space_) ? options_.least_free : options_.least_stretch);
    std::vector<double> energy_slope(n, 0.0);
    std::vector<Values> stress_slope(n, Values(components_, 0.0));
    for (int k = 1; k <= 3; ++k)
      for (const int sign : {1, -1}) {
        std::vector<Values> moved = points;
        for (int p = 0; p < n; ++p)
          for (int c = 0; c < components_; ++c) moved[p][c] += sign * k * h * directions[p][c];
        const Evaluation m = evaluate(moved);
        for (int p = 0; p < n; ++p) {
          energy_slope[p] += sign * weights[k - 1] / h * m.psi.data()[p];
          for (int c = 0; c < components_; ++c) stress_slope[p][c] += sign * weights[k - 1] / h * m.P.component(c)[p];
        }
      }
    for (int p = 0; p < n; ++p) {
      const double scale = stress_scale(e, p);
      const Values P = e.at(e.P, p), A = e.at(e.A, p);
      double power = 0;
      for (int c = 0; c < components_; ++c) power += P[c] * directions[p][c];
      if (traits_.hyperelastic) near("P : dF = dpsi (differences)", {power}, {energy_slope[p]}, 1e-7, scale);
      near("A : dF = dP (differences)", e.at(e.dP, p), stress_slope[p], 1e-7, scale);
      if (!traits_.hyperelastic) continue;
      Values transposed(A.size());
      for (int r = 0; r < components_; ++r)
        for (int c = 0; c < components_; ++c) transposed[c * components_ + r] = A[r * components_ + c];
      near("major symmetry of A", A, transposed, 1e-12, scale);
    }
  }

  void tangent_action() {
    constexpr int n = 16;
    const std::vector<Values> directions = random_directions(n);
    const Evaluation e = evaluate(random_points(n), directions);
    for (int p = 0; p < n; ++p) {
      Values action(components_, 0.0);
      for (int r = 0; r < components_; ++r)
        for (int c = 0; c < components_; ++c) action[r] += e.A.component(r * components_ + c)[p] * directions[p][c];
      near("dP = A : dH", e.at(e.dP, p), action, 1e-12, stress_scale(e, p));
      for (int c = 0; c < components_; ++c)
        if (is_free(space_, c))
          CHECK_MESSAGE(e.P.component(c)[p] == 0.0, label(), "free stress is exactly zero: ", e.P.component(c)[p]);
    }
  }

  /// Plane and uniaxial stress are plane and uniaxial strain at the stretch that they report, where the free stress vanishes.
  void free_stretches() {
    if (!free_stretch(space_)) return;
    constexpr int n = 16;
    const Evaluation e = evaluate(random_points(n));
    std::vector<Values> given;
    for (int p = 0; p < n; ++p) {
      CHECK_MESSAGE(std::isfinite(e.lateral.data()[p]), label(), "free stretch of point ", p, " not reported");
      given.push_back(e.at(e.H, p));
      for (int c = 0; c < components_; ++c)
        if (is_free(space_, c)) given.back()[c] = e.lateral.data()[p];
    }
    const Evaluation full(material_, space_ == Space::plane_stress ? Space::plane_strain : Space::line_strain, constants_, given);
    for (int p = 0; p < n; ++p) {
      const double scale = stiffness_scale(full.at(full.A, p)) * (1 + largest(given[p]));
      near("P at the free stretch", full.at(full.P, p), e.at(e.P, p), 1e-12, scale);
      near("psi at the free stretch", full.at(full.psi, p), e.at(e.psi, p), 1e-12, scale);
    }
  }

  /// Plane and uniaxial strain: a law that relies on vanishing lateral components gives what it gives without that promise.
  void confined() {
    if (dimension(space_) == 3 || free_stretch(space_)) return;
    constexpr int n = 16;
    std::vector<Values> points = random_points(n), directions = random_directions(n);
    for (auto* values : {&points, &directions})
      for (Values& H : *values) std::fill(H.begin() + gradient_components(dimension(space_)), H.end(), 0.0);
    const Evaluation open = evaluate(points, directions), confined(material_, space_, constants_, points, directions, false, {}, true);
    for (int p = 0; p < n; ++p) {
      const double scale = stress_scale(open, p);
      near("P of confined points", confined.at(confined.P, p), open.at(open.P, p), 1e-12, scale);
      near("psi of confined points", confined.at(confined.psi, p), open.at(open.psi, p), 1e-12, scale);
      near("dP of confined points", confined.at(confined.dP, p), open.at(open.dP, p), 1e-12, scale);
    }
  }

  /// A law that says it is decoupled, psi = psi_iso(J^(-1/3) F) + U(J): both parts, their stresses and tangents are those of the law.
  void volumes() {
    std::vector<double> shape = constants_;
    if (free_stretch(space_) || !material_.isochoric_constants(constants_.data(), shape.data())) return;
    CHECK_MESSAGE(material_.state_components(space_) == 0, label(), "a law with history is decoupled");
    constexpr int n = 24;
    const std::vector<Values> points = random_points(n), directions = random_directions(n);
    std::vector<Values> grown;
    std::vector<double> j;
    for (const Values& H : points) {
      const Matrix F = deformation(H);
      j.push_back(determinant(F) - 1);
      grown.push_back(gradient(scaled(F, uniform(random_, 0.5, 2.0))));
    }
    const Evaluation whole = evaluate(points, directions), part(material_, space_, shape, points, directions), other(material_, space_, shape, grown);
    const Volumes volume(material_, constants_, j);
    for (int p = 0; p < n; ++p) {
      const double scale = stress_scale(whole, p);
      const Matrix F = deformation(points[p]), dF = extend(space_, directions[p]);
      const Matrix G = transposed(inverse(F)), turned = product(G, product(transposed(dF), G));
      double rate = 0, power = 0;
      for (int k = 0; k < 9; ++k) rate += G[k] * dF[k], power += extend(space_, part.at(part.P, p))[k] * F[k];
      Matrix P = extend(space_, part.at(part.P, p)), dP = extend(space_, part.at(part.dP, p));
      for (int k = 0; k < 9; ++k) {
        P[k] += volume.kirchhoff[p] * G[k];
        dP[k] += volume.slope[p] * rate * G[k] - volume.kirchhoff[p] * turned[k];
      }
      near("psi = psi_iso + U", {part.psi.data()[p] + volume.psi[p]}, whole.at(whole.psi, p), 1e-12, scale);
      near("P = P_iso + tau F^-T", restrict_to(space_, P), whole.at(whole.P, p), 1e-12, scale);
      near("dP = dP_iso + d(tau F^-T)", restrict_to(space_, dP), whole.at(whole.dP, p), 1e-12, scale * (1 + largest(G)));
      near("psi_iso(a F) = psi_iso(F)", other.at(other.psi, p), part.at(part.psi, p), 1e-12, scale);
      near("P_iso : F = 0", {power}, {0.0}, 1e-12, scale * (1 + largest(F)));
    }
    const double bulk = material_.small_strain(constants_.data()).bulk();
    const Volumes rest(material_, constants_, {0.0, 1e-10});
    CHECK_MESSAGE(rest.psi[0] == 0.0, label(), "U(1) = 0: ", rest.psi[0]);
    CHECK_MESSAGE(rest.kirchhoff[0] == 0.0, label(), "tau = 0 at rest: ", rest.kirchhoff[0]);
    near("the slope of tau at rest is the bulk modulus", {rest.slope[0]}, {bulk}, 1e-12, bulk);
    near("tau of a small change of volume", {rest.kirchhoff[1]}, {1e-10 * bulk}, 1e-8, 1e-10 * bulk);
    const Volumes alone(material_, constants_, j, &VolumeBatch::kirchhoff);
    same_bits("tau alone", alone.kirchhoff, volume.kirchhoff);
  }

  /// A law that says it is linear in the Green strain grows as such laws do.
  void growth() {
    if (!traits_.green_linear || free_stretch(space_)) return;
    constexpr int n = 24;
    const std::vector<Values> points = random_points(n);
    const double kappa = material_.small_strain(constants_.data()).bulk();
    std::vector<Values> grown;
    std::vector<double> by;
    for (const Values& H : points) {
      by.push_back(uniform(random_, 0.5, 2.0));
      grown.push_back(gradient(scaled(deformation(H), by.back())));
    }
    const Evaluation one = evaluate(points), other = evaluate(grown);
    for (int p = 0; p < n; ++p) {
      const double a = by[p], e = (a * a - 1) / 2, scale = stress_scale(other, p) * (1 + std::pow(a, 4));
      const Matrix F = deformation(points[p]);
      double strain = -1.5;   // tr E
      for (const double x : F) strain += 0.5 * x * x;
      Values P = one.at(one.P, p);
      const Values on_F = restrict_to(space_, F);
      for (int c = 0; c < components_; ++c) P[c] = a * a * a * P[c] + 3 * kappa * a * e * on_F[c];
      near("P(a F) = a^3 P(F) + 3 kappa a e F", other.at(other.P, p), P, 1e-12, scale);
      near("psi(a F)", other.at(other.psi, p), {std::pow(a, 4) * one.psi.data()[p] + 3 * kappa * e * (a * a * strain + 1.5 * e)}, 1e-12, scale * (1 + largest(F)));
    }
  }

  /// A batch equals its points one at a time, to the bit, and each output is what it is where no other is asked for: a run that samples energies
  /// in some steps goes through the same states. Outputs are overwritten; nothing behind the padding is touched.
  void batches() {
    constexpr int n = 37;
    std::vector<Values> points = random_points(n);
    const std::vector<Values> directions = random_directions(n);
    const Evaluation batch = evaluate(points, directions);
    CHECK_MESSAGE(batch.guards_intact, label(), "writes behind padded(n)");
    for (int p = 0; p < n; ++p) {
      const Values all = batch.all(p);
      CHECK_MESSAGE(std::none_of(all.begin(), all.end(), [](double x) { return std::isnan(x); }), label(),
                    "outputs overwritten, point ", p);
      const Evaluation single = evaluate({points[p]}, {directions[p]});
      same_bits("batch = single", all, single.all(0));
      if (!free_stretch(space_)) continue;
      Values other = points[p];
      for (int c = 0; c < components_; ++c)
        if (is_free(space_, c)) other[c] = -7.0;
      same_bits("free components of H are not read", evaluate({other}, {directions[p]}).all(0), all);
    }
    const auto alone = [&](const char* what, double* MaterialBatch::*output, const Field& among_others) {
      Field only(among_others.components(), batch.stride);
      MaterialBatch call{.n = n, .stride = batch.stride, .H = batch.H.data(), .dH = batch.dH.data(), .constants = constants_.data()};
      call.*output = only.data();
      material_.evaluate(space_, call);
      for (int p = 0; p < n; ++p) same_bits(what, batch.at(only, p), batch.at(among_others, p));
    };
    alone("psi alone", &MaterialBatch::psi, batch.psi);
    alone("P alone", &MaterialBatch::P, batch.P);
    alone("dP alone", &MaterialBatch::dP, batch.dP);
    const Evaluation per_point(material_, space_, constants_, points, directions, true);
    for (int p = 0; p < n; ++p) same_bits("constants per point = uniform constants", per_point.all(p), batch.all(p));
  }

  void rotations() {
    if (dimension(space_) == 1) return;
    for (int trial = 0; trial < 12; ++trial) {
      const Matrix F = random_F(), Q = random_rotation(random_, space_);
      const Evaluation e = evaluate({gradient(F)});
      const Matrix P = extend(space_, e.at(e.P, 0));
      const double scale = stress_scale(e, 0);
      if (traits_.objective) {
        const Evaluation r = evaluate({gradient(product(Q, F))});
        near("objectivity P(QF) = Q P(F)", r.at(r.P, 0), restrict_to(space_, product(Q, P)), 1e-12, scale);
      }
      if (traits_.objective && traits_.isotropic) {
        const Evaluation r = evaluate({gradient(product(F, Q))});
        near("isotropy P(FQ) = P(F) Q", r.at(r.P, 0), restrict_to(space_, product(P, Q)), 1e-12, scale);
      }
    }
  }

  void units() {
    constexpr double s = 1e9;
    const std::vector<Values> points = random_points(8), directions = random_directions(8);
    std::vector<double> scaled = constants_;
    for (std::size_t k = 0; k < scaled.size(); ++k)
      if (options_.moduli.empty() || options_.moduli[k]) scaled[k] *= s;
    const Evaluation one = evaluate(points, directions), other(material_, space_, scaled, points, directions);
    for (int p = 0; p < 8; ++p) {
      Values expected = one.all(p);
      for (double& x : expected) x *= s;
      near("scaling the moduli scales psi, P, dP, A", other.all(p), expected, 1e-12, s * stress_scale(one, p));
    }
  }

  /// The first bad point is named, bad points read zero, good points do not notice.
  void inadmissible() {
    constexpr int n = 21, first = 5;
    std::vector<Values> points = random_points(n);
    const std::vector<Values> directions = random_directions(n);
    const Evaluation clean = evaluate(points, directions);
    std::vector<int> bad{first, 9, 18};
    points[9][0] = std::numeric_limits<double>::quiet_NaN();
    points[18][0] = std::numeric_limits<double>::infinity();
    points[first] = Values(components_, 0.0);
    points[first][0] = traits_.objective ? -1.5 : -std::numeric_limits<double>::infinity();
    const Evaluation e = evaluate(points, directions);
    CHECK_MESSAGE(e.status.inadmissible == first, label(), "first inadmissible point ", first, ", reported ",
                  e.status.inadmissible);
    for (int p = 0; p < n; ++p) {
      const bool is_bad = std::find(bad.begin(), bad.end(), p) != bad.end();
      const Values all = e.all(p);
      if (is_bad)
        CHECK_MESSAGE(std::all_of(all.begin(), all.end(), [](double x) { return x == 0; }), label(), "zero at bad point ", p);
      else
        same_bits("points beside inadmissible ones", all, clean.all(p));
    }
    if (!traits_.objective) return;
    Values flat(components_, 0.0);
    flat[0] = -1;  // det F = 0
    CHECK_MESSAGE(evaluate({flat}).status.inadmissible == 0, label(), "det F = 0 must be refused");
  }
};

/// One identity in all five spaces.
inline void check_material(const Material& material, const std::vector<double>& constants, const MaterialOptions& options,
                           void (MaterialContract::*identity)()) {
  for (const Space space : {Space::solid, Space::plane_strain, Space::plane_stress, Space::line_strain, Space::line_stress}) {
    if (space == Space::line_stress && !material.traits().isotropic) continue;
    MaterialContract(material, constants, space, options).check(identity);
  }
}

/// What a law with history must fulfil along paths, in all five spaces; nothing for laws without.
inline void check_history(const Material& material, const std::vector<double>& constants, const MaterialOptions& options) {
  for (const Space space : {Space::solid, Space::plane_strain, Space::plane_stress, Space::line_strain, Space::line_stress}) {
    if (material.state_components(space) > 0 && (space != Space::line_stress || material.traits().isotropic))
      HistoryContract(material, constants, space, options).check();
  }
}

/// All identities.
inline void check_material(const Material& material, const std::vector<double>& constants, const MaterialOptions& options) {
  using Contract = MaterialContract;
  for (const auto identity : {&Contract::reference_state, &Contract::small_strains, &Contract::derivatives, &Contract::tangent_action,
                              &Contract::free_stretches, &Contract::confined, &Contract::volumes, &Contract::growth, &Contract::batches, &Contract::rotations, &Contract::units, &Contract::inadmissible}) {
    check_material(material, constants, options, identity);
  }
  check_history(material, constants, options);
}

}  // namespace perikit::contract
