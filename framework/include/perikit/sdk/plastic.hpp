#pragma once
/// Plastic laws at finite strains from a yield stress alone. A law of plastic flow says how its yield stress grows with the equivalent plastic strain:
///
///   struct MyFlow {
///     static constexpr int flow_constants = 2;                                      // numbers that the functions below find in k
///     void constants(const MaterialInput& input, const Moduli& elastic, double* k) const;   // refuse_parameter(...) says what is wrong
///     template <class T, class K> T yield_stress(const T& a, const K& k) const noexcept;    // [Pa], a: equivalent plastic strain
///     /// The integral of the yield stress from a to a + increment [J/m^3]; may be left out.
///     template <class T, class K> T plastic_work(const T& a, const T& increment, const K& k) const noexcept;
///   };
///   auto material = std::make_unique<LawMaterial<Plastic<MyFlow>>>();
///
/// T is a Pack, or a Dual of it; k is a std::array<Pack, MyFlow::flow_constants>. Everything else is written here, for all five spaces: the elastic law, the return to the yield
/// surface, what is remembered, the stretches of plane and uniaxial stress, the tangent, and the energies.
///
/// F = F_e F_p. The elastic law is linear in logarithmic strains, flow is associative with the yield function of von Mises [Simo 1992; de Souza Neto, Peric, Owen 2008, box 14.3]:
///   b = F C_p^-1 F^T,  h = ln(b)/2,  tau = K ln(J) I + 2 mu dev h,  q = sqrt(3/2) |dev tau| <= yield stress(a)
/// A step takes the trial b of its end with the C_p of its beginning. Where q exceeds the yield stress, dev tau shrinks by a factor, its principal axes stay, and
///   q_trial - 3 mu (a1 - a0) = yield stress(a1),   C_p1^-1 = F^-1 exp(2 h) F^-T
/// One equation for one number: its left side less its right side falls as long as 3 mu + d(yield stress)/da > 0, so that it has one root, which lies between none and all of q_trial. Newton's
/// method inside of this bracket finds it, for steps of any size. Plastic flow keeps volumes.
///
/// Where the path is straight in logarithmic strains the end of a step does not depend on the number of steps; otherwise results depend on it to first order. The stress is the
/// derivative of an incremental energy at fixed state, psi + plastic work, so that tangents are symmetric.
///
/// psi is the elastic energy; the plastic work, which is the integral of the yield stress over a, is dissipated.
///
/// On the yield surface, to rounding, a step is elastic: the tangent of a body at rest at the end of a step is that of unloading, the stiffest that there is, and stable steps of
/// explicit runs follow from it.
///
/// A yield stress below zero counts as zero: what has softened that far carries no shear.

#include <array>
#include <concepts>
#include <limits>
#include <string_view>

#include "perikit/core/spectral.hpp"
#include "perikit/model/elastic_constants.hpp"
#include "perikit/sdk/free_stretch.hpp"
#include "perikit/sdk/history.hpp"

namespace perikit {

/// Throws std::domain_error: "found NAME = VALUE; allowed: ALLOWED".
[[noreturn]] void refuse_parameter(std::string_view name, double value, std::string_view allowed);

/// The divided difference (log1p(a) - log1p(b))/(a - b), its limit 1/(1 + a) where both are equal.
template <class T>
T logarithm_slope(const T& a, const T& b) noexcept {
  const T low = min(a, b), x = abs(a - b) / (1.0 + low);   // (1 + high)/(1 + low) = 1 + x
  const T ratio = log1p(x) / select(x > T(0.0), x, T(1.0));
  return select(x > T(0.0), ratio, T(1.0)) / (1.0 + low);
}

/// Where a trial stress comes to: dev tau = ratio * trial dev tau.
template <class T>
struct PlasticReturn {
  T increment;   ///< of the equivalent plastic strain
  T ratio;       ///< of the deviator at the end of the step to that of the trial
  T slope;       ///< d(ratio)/d ln|trial deviator|; 0 where the step is elastic
};

template <class Flow>
struct Plastic {
  static constexpr auto flow_size = static_cast<std::size_t>(Flow::flow_constants);
  static constexpr MaterialTraits traits{.constants = 2 + Flow::flow_constants, .hyperelastic = false, .symmetric_tangent = true, .dissipates = true};

  /// plastic_strain: (I - C_p^-1)/2, which for small strains is the plastic strain.
  template <class S>
  static constexpr std::array state{StateVariable{"plastic_strain", "-", symmetric_size<S>}, StateVariable{"equivalent_plastic_strain", "-", 1}};
  template <class S>
  static constexpr int size = components_of(state<S>);

  Flow flow = {};

  void constants(const MaterialInput& input, double* k) const {
    const Moduli elastic = elastic_constants(input);
    k[0] = elastic.bulk();
    k[1] = elastic.mu;
    flow.constants(input, elastic, k + 2);
  }
  Moduli small_strain(const double* k) const noexcept { return {k[0] - 2 * k[1] / 3, k[1]}; }

  /// The step that begins at one state.
  template <class T, class S>
  struct Step {
    using State = std::array<T, size<S>>;

    Step(const Flow& law, const State& begin) noexcept : flow(law), plastic(unpack_symmetric<S>(begin.data())), equivalent(begin.back()) {}

    template <class K>
    HistoryUpdate<T, S, size<S>> update(const Tensor<T, S>& H, const K& k) const noexcept {
      const Trial trial(*this, H);
      const PlasticReturn<T> back = return_map(trial.square, k);
      const Tensor<T, S> G = inverse_transpose(H);
      HistoryUpdate<T, S, size<S>> r;
      r.psi = 0.5 * k[0] * (trial.volume * trial.volume) + k[1] * (back.ratio * back.ratio) * trial.square;
      r.P = kirchhoff(trial, back.ratio, k) * G;
      // C_p1^-1 - C_p0^-1 = F^-1 (b - b_trial) F^-T, which is exactly zero where nothing flows
      T change[3];
      for (int i = 0; i < 3; ++i) change[i] = -0.5 * (1.0 + trial.axes.values[i]) * expm1(2.0 * (back.ratio - 1.0) * trial.deviator[i]);
      pack_symmetric(plastic + rotate(transpose(G), compose(trial.axes.vectors, change)), r.state.data());
      r.state.back() = equivalent + back.increment;
      r.dissipated = work(back.increment, own(k));
      return r;
    }
    template <class K>
    Tensor<T, S> P(const Tensor<T, S>& H, const K& k) const noexcept {
      const Trial trial(*this, H);
      return kirchhoff(trial, return_map(trial.square, k).ratio, k) * inverse_transpose(H);
    }

    /// Derivative of the update at fixed state.
    template <class K>
    auto tangent(const Tensor<T, S>& H, const K& k) const noexcept {
      const Trial trial(*this, H);
      const PlasticReturn<T> back = return_map(trial.square, k);
      const Tensor<T, S> G = inverse_transpose(H), P = kirchhoff(trial, back.ratio, k) * G;
      const auto& e = trial.axes.values;
      const Tensor<T, S> slopes = Tensor<T, S>::build_symmetric([&](int i, int j) { return 0.5 * logarithm_slope(e[i], e[j]); });
      const Tensor<T, S> F = add_diagonal(H, T(1.0)), pulled = F - T(2.0) * (F * plastic);   // F C_p^-1
      const std::array<T, 3> d = {trial.deviator[0], trial.deviator[1], trial.deviator[2]};
      const T turn = back.slope / select(trial.square > T(0.0), trial.square, T(1.0));
      return [=, axes = trial.axes.vectors, ratio = back.ratio, bulk = k[0], mu = k[1]](const Tensor<T, S>& dH) {
        const Tensor<T, S> half = dH * transpose(pulled);
        const Tensor<T, S> turned = rotate(transpose(axes), T(2.0) * symmetric_part(half));
        const Tensor<T, S> dh = Tensor<T, S>::map([&](int c) { return slopes[c] * turned[c]; });
        const T dratio = turn * (d[0] * dh(0, 0) + d[1] * dh(1, 1) + d[2] * dh(2, 2));
        Tensor<T, S> change = ratio * deviator(dh);
        for (int i = 0; i < 3; ++i) change(i, i) = change(i, i) + dratio * d[i];
        const Tensor<T, S> dtau = add_diagonal((2.0 * mu) * rotate(axes, change), bulk * inner(G, dH));
        return (dtau - P * transpose(dH)) * G;
      };
    }

    /// Zero Kirchhoff stress along the free axes, where they are principal axes: in the logarithm y of the free stretch
    ///   n K (ln J_0 + n y) + 2 mu ratio D = 0,   D = sum of the deviator of the trial over the n free axes
    template <class K>
    T free_stretch(const Tensor<T, S>& H, const K& k) const noexcept {
      constexpr int n = 3 - S::dimension;
      constexpr double by_stretch = n - n * n / 3.0;   // dD/dy
      const T bulk = k[0], twice_mu = 2.0 * k[1];
      const Spectral<T, S> e = spectral(trial_strain(with_free_part(H, T(0.0))));
      const T given = log1p(jacobian_minus_one(with_free_part(H, T(0.0))));
      T h[3];
      for (int i = 0; i < 3; ++i) h[i] = 0.5 * log1p(e.values[i]);
      const auto deviators = [&](const T& y, T* d) {
        for (int i = 0; i < 3; ++i) d[i] = i >= S::dimension ? T(h[i] + y) : h[i];
        const T mean = (d[0] + d[1] + d[2]) * (1.0 / 3);
        for (int i = 0; i < 3; ++i) d[i] = d[i] - mean;
        T D = d[S::dimension];
        for (int i = S::dimension + 1; i < 3; ++i) D = D + d[i];
        return D;
      };
      const auto equation = [&](const T& strain) {
        const T y = log1p(strain);
        T d[3];
        const T D = deviators(y, d), square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        const PlasticReturn<T> back = return_map(square, k);
        return FreeStress<T>{n * bulk * (given + n * y) + twice_mu * (back.ratio * D),
                             n * n * bulk + twice_mu * (by_stretch * back.ratio + back.slope * (D * D) / select(square > T(0.0), square, T(1.0)))};
      };
      T d[3];
      const T elastic = -(n * bulk * given + twice_mu * deviators(T(0.0), d)) / (n * n * bulk + by_stretch * twice_mu);
      // Corners of the solution are as far apart as strains of the size of the yield strain.
      const T most = largest(H), yield = yield_stress(equivalent, own(k)) / (3.0 * k[1]);
      auto active = most >= T(0.0);
      const T strain = solve_free_equation(equation, elastic, max(min(most, yield), 1e-4 * most), active);
      return select(active, T(std::numeric_limits<double>::quiet_NaN()), strain);
    }

    Flow flow;
    Tensor<T, S> plastic;   ///< (I - C_p^-1)/2
    T equivalent;

   private:
    struct Trial {
      Spectral<T, S> axes;   ///< of b - I
      T volume;              ///< ln J
      T deviator[3];         ///< principal values of dev ln(b)/2
      T square;              ///< of the deviator with itself

      Trial(const Step& step, const Tensor<T, S>& H) noexcept : axes(spectral(step.trial_strain(H))), volume(log1p(jacobian_minus_one(H))) {
        for (int i = 0; i < 3; ++i) deviator[i] = 0.5 * log1p(axes.values[i]);
        const T mean = (deviator[0] + deviator[1] + deviator[2]) * (1.0 / 3);
        for (int i = 0; i < 3; ++i) deviator[i] = deviator[i] - mean;
        square = deviator[0] * deviator[0] + deviator[1] * deviator[1] + deviator[2] * deviator[2];
      }
    };

    /// F C_p^-1 F^T - I, with all digits of small strains.
    Tensor<T, S> trial_strain(const Tensor<T, S>& H) const noexcept {
      return left_cauchy_green_minus_identity(H) - T(2.0) * rotate(add_diagonal(H, T(1.0)), plastic);
    }

    template <class K>
    static std::array<T, flow_size> own(const K& k) noexcept {
      std::array<T, flow_size> r{};
      for (std::size_t i = 0; i < flow_size; ++i) r[i] = k[2 + i];
      return r;
    }
    template <class U>
    U yield_stress(const U& a, const std::array<T, flow_size>& k) const noexcept {
      return max(U(0.0), U(flow.yield_stress(a, k)));
    }

    /// square: of the trial deviator of the logarithmic strain.
    template <class K>
    PlasticReturn<T> return_map(const T& square, const K& k) const noexcept {
      constexpr int max_iterations = 200;
      const std::array<T, flow_size> of_flow = own(k);
      const T thrice_mu = 3.0 * k[1], trial = thrice_mu * sqrt((2.0 / 3) * square);
      const T excess = trial - yield_stress(equivalent, of_flow), inverse = 1.0 / thrice_mu;
      // Beyond rounding: a step that ended on the yield surface and stands still is elastic, and so is its tangent, from which stable steps follow, which unloading must keep, too.
      const auto flows = excess > 64 * std::numeric_limits<double>::epsilon() * thrice_mu;
      if (!any(flows)) return {T(0.0), T(1.0), T(0.0)};
      T lower = 0.0, upper = trial * inverse;
      const T tolerance = 8 * std::numeric_limits<double>::epsilon() * upper;
      T x = select(flows, T(excess * inverse), T(0.0)), slope = thrice_mu;
      auto active = flows;
      for (int iteration = 0; iteration < max_iterations && any(active); ++iteration) {
        const Dual<T> yield = yield_stress(Dual<T>(equivalent + x, T(1.0)), of_flow);
        const T rest = trial - thrice_mu * x - yield.value;
        slope = select(active, T(thrice_mu + yield.derivative), slope);
        const auto low = rest > T(0.0);
        lower = select(active & low, x, lower);
        upper = select(active & !low, x, upper);
        const T newton = x + rest / slope;
        const T next = select((newton >= lower) & (newton <= upper), newton, T(0.5 * (lower + upper)));
        const T step = abs(next - x);
        x = select(active, next, x);
        active = active & (step > tolerance);
      }
      const T safe = select(flows, trial, T(1.0)), shrunk = x / safe;
      return {x, T(1.0 - thrice_mu * shrunk), select(flows, T(thrice_mu * (shrunk - 1.0 / slope)), T(0.0))};
    }

    /// The plastic work of the step; by Gauss points, which are exact for polynomials of order nine, where the law does not tell.
    T work(const T& increment, const std::array<T, flow_size>& k) const noexcept {
      if constexpr (requires { { flow.plastic_work(equivalent, increment, k) } -> std::convertible_to<T>; }) {
        return flow.plastic_work(equivalent, increment, k);
      } else {
        constexpr double places[] = {0.04691007703066800, 0.2307653449471585, 0.5, 0.7692346550528415, 0.9530899229693320};
        constexpr double weights[] = {0.1184634425280945, 0.2393143352496832, 0.2844444444444444, 0.2393143352496832, 0.1184634425280945};
        T sum = 0.0;
        for (int i = 0; i < 5; ++i) sum = sum + weights[i] * yield_stress(T(equivalent + places[i] * increment), k);
        return sum * increment;
      }
    }

    /// F^-T = (I + G)/J.
    static Tensor<T, S> inverse_transpose(const Tensor<T, S>& H) noexcept {
      return (T(1.0) / (1.0 + jacobian_minus_one(H))) * add_diagonal(cofactor_minus_identity(H), T(1.0));
    }
    template <class K>
    static Tensor<T, S> kirchhoff(const Trial& trial, const T& ratio, const K& k) noexcept {
      T principal[3];
      for (int i = 0; i < 3; ++i) principal[i] = (2.0 * k[1]) * (ratio * trial.deviator[i]);
      return add_diagonal(compose(trial.axes.vectors, principal), k[0] * trial.volume);
    }
  };

  template <class S, class T>
  Step<T, S> after(const std::array<T, size<S>>& begin) const noexcept {
    return Step<T, S>(flow, begin);
  }
};

}  // namespace perikit
