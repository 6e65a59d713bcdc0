#pragma once

#include "perikit/core/spectral.hpp"
#include "perikit/model/elastic_constants.hpp"
#include "perikit/sdk/free_stretch.hpp"
#include "perikit/sdk/history.hpp"

namespace perikit {

/// Rate law of Flanagan and Taylor [Partmann et al., eqs. 4.45-4.57]: the Cauchy stress sigma = R s R^T, turned back by the
/// rotation of F = R U, grows with the unrotated rate of deformation,
///   ds/dt = lambda tr(d) I + 2 mu d,   d = R^T sym(dF/dt F^-1) R = sym(dU/dt U^-1),   P = J sigma F^-T = J F U^-1 s U^-1.
/// Codes that know only the velocity gradient integrate R and the left stretch (4.46-4.52); F at both ends of the step is known
/// here, so that U is the exact stretch and R is not needed. The increment is the midpoint rule in U: of second order, and blind
/// to rotations.
///   strain = sym((U1 - U0) ((U0 + U1)/2)^-1),   s1 = s0 + lambda tr(strain) I + 2 mu strain
///   psi1 = psi0 + (J0 s0 + J1 s1)/2 : strain, the work of the stress
/// History: U - I, s (components i <= j), psi.
struct Hypoelastic {
  static constexpr MaterialTraits traits{.constants = 2, .hyperelastic = false, .symmetric_tangent = false};
  template <class S>
  static constexpr std::array state{StateVariable{"stretch", "-", symmetric_size<S>}, StateVariable{"unrotated_stress", "Pa", symmetric_size<S>},
                                    StateVariable{"work", "J/m^3", 1}};
  template <class S>
  static constexpr int size = components_of(state<S>);

  void constants(const MaterialInput& input, double* k) const {
    const Moduli moduli = elastic_constants(input);
    k[0] = moduli.lambda;
    k[1] = moduli.mu;
  }
  Moduli small_strain(const double* k) const noexcept { return {k[0], k[1]}; }

  /// The step that begins at one state.
  template <class T, class S>
  struct Step {
    using State = std::array<T, size<S>>;

    explicit Step(const State& begin) noexcept
        : stretch(unpack_symmetric<S>(begin.data())),
          stress(unpack_symmetric<S>(begin.data() + symmetric_size<S>)),
          energy(begin.back()) {}

    template <class K>
    HistoryUpdate<T, S, size<S>> update(const Tensor<T, S>& H, const K& k) const noexcept {
      const Stretch end(H);
      const Tensor<T, S> strain = symmetric_part(increment(end) * middle_inverse(end)), s = stress + hooke(strain, k);
      const T J = 1.0 + jacobian_minus_one(H), J0 = 1.0 + jacobian_minus_one(stretch);
      const Tensor<T, S> second = J * rotate(end.inverse, s);  // second Piola-Kirchhoff stress J U^-1 s U^-1
      HistoryUpdate<T, S, size<S>> r;
      r.psi = energy + 0.5 * inner(J0 * stress + J * s, strain);
      r.P = second + H * second;
      pack_symmetric(end.U, r.state.data());
      pack_symmetric(s, r.state.data() + symmetric_size<S>);
      r.state.back() = r.psi;
      return r;
    }
    template <class K>
    Tensor<T, S> P(const Tensor<T, S>& H, const K& k) const noexcept {
      return update(H, k).P;
    }

    /// s33 = 0 is linear in the strain along the free axes, where U is diagonal: strain33 = e = 2 (u - u0)/(2 + u0 + u), u = U33 - 1.
    template <class K>
    T free_stretch(const Tensor<T, S>& H, const K& k) const noexcept {
      const auto& [lambda, mu] = k;
      const Stretch end(with_free_part(H, T(0.0)));
      const Tensor<T, S> change = increment(end), M = inverse(with_free_part(middle(end), T(1.0)));
      T given = 0.0;   // the trace over the space
      for (int i = 0; i < S::dimension; ++i)
        for (int j = 0; j < S::dimension; ++j) given += change(i, j) * M(j, i);
      const T e = -(stress(2, 2) + lambda * given) / free_modulus<S>(lambda, mu);
      return (2.0 * stretch(2, 2) + e * (2.0 + stretch(2, 2))) / (2.0 - e);
    }

    /// Derivative of the update at fixed state; not symmetric.
    template <class K>
    auto tangent(const Tensor<T, S>& H, const K& k) const noexcept {
      return derivative(H, k, k, [](const Tensor<T, S>&) { return T(0.0); });
    }

    /// Under s33 = 0: the strain along the free axes changes by -lambda/(lambda + 2 mu) tr (dstrain over the space), which leaves stresses there as
    /// another lambda does, and stretches these axes by du/(1 + u) = de (2 + u0 + u)^2/(4 (1 + u0) (1 + u)).
    template <class K>
    auto free_tangent(const Tensor<T, S>& H, const K& k) const noexcept {
      const auto& [lambda, mu] = k;
      const T u0 = stretch(2, 2), u = H(2, 2), twice_middle = 2.0 + u0 + u;
      const T by_trace = -((3 - S::dimension) * lambda) * (twice_middle * twice_middle) / (free_modulus<S>(lambda, mu) * (4.0 * (1.0 + u0) * (1.0 + u)));
      return derivative(H, k, free_lame<S>(k), [by_trace](const Tensor<T, S>& dstrain) { return by_trace * trace(dstrain); });
    }

   private:
    /// U of F = R U from the principal axes of F^T F - I, with all digits of small strains.
    struct Stretch {
      T values[3];                    ///< principal stretches
      Tensor<T, S> axes, U, inverse;  ///< U: U - I

      explicit Stretch(const Tensor<T, S>& H) noexcept {
        const Spectral<T, S> e = spectral(right_cauchy_green_minus_identity(H));
        T less_one[3], inverse_less_one[3];
        for (int i = 0; i < 3; ++i) {
          if (S::dimension == 1 || i >= S::dimension) {  // F is diagonal there
            values[i] = 1.0 + H(i, i);
            less_one[i] = H(i, i);
          } else {
            values[i] = sqrt(1.0 + e.values[i]);
            less_one[i] = e.values[i] / (1.0 + values[i]);
          }
          inverse_less_one[i] = -less_one[i] / values[i];
        }
        axes = e.vectors;
        U = compose(axes, less_one);
        inverse = add_diagonal(compose(axes, inverse_less_one), T(1.0));
      }
    };

    /// slope: constants of the increments of stress; volume(dstrain): what dJ/J is beside F^-T : dH.
    template <class K, class Volume>
    auto derivative(const Tensor<T, S>& H, const K& k, const K& slope, const Volume& volume) const noexcept {
      const Stretch end(H);
      const Tensor<T, S> change = increment(end), M = middle_inverse(end), s = stress + hooke(symmetric_part(change * M), k);
      const T J = 1.0 + jacobian_minus_one(H);
      const Tensor<T, S> second = J * rotate(end.inverse, s), cofactors = add_diagonal(cofactor_minus_identity(H), T(1.0));
      return [=](const Tensor<T, S>& dH) {
        const Tensor<T, S> dC = T(2.0) * symmetric_part(dH + transpose_times(H, dH));
        // dC = dU U + U dU in the principal axes of U
        const Tensor<T, S> turned = rotate(transpose(end.axes), dC);
        const Tensor<T, S> principal =
            Tensor<T, S>::build_symmetric([&](int i, int j) { return turned(i, j) / (end.values[i] + end.values[j]); });
        const Tensor<T, S> dU = rotate(end.axes, principal);
        const Tensor<T, S> dstrain = symmetric_part(dU * M - T(0.5) * (change * rotate(M, dU)));
        const Tensor<T, S> turning = end.inverse * dU * (end.inverse * s * end.inverse);
        const Tensor<T, S> pulled = rotate(end.inverse, hooke(dstrain, slope)) - T(2.0) * symmetric_part(turning);
        const Tensor<T, S> dsecond = (inner(cofactors, dH) / J + volume(dstrain)) * second + J * pulled;
        return dH * second + (dsecond + H * dsecond);
      };
    }

    Tensor<T, S> increment(const Stretch& end) const noexcept { return end.U - stretch; }
    /// (U0 + U1)/2
    Tensor<T, S> middle(const Stretch& end) const noexcept { return add_diagonal(T(0.5) * (stretch + end.U), T(1.0)); }
    /// Of a symmetric tensor.
    static Tensor<T, S> inverse(const Tensor<T, S>& a) noexcept { return (T(1.0) / determinant(a)) * cofactor(a); }
    Tensor<T, S> middle_inverse(const Stretch& end) const noexcept { return inverse(middle(end)); }
    template <class K>
    static Tensor<T, S> hooke(const Tensor<T, S>& strain, const K& k) noexcept {
      return add_diagonal((2.0 * k[1]) * strain, k[0] * trace(strain));
    }

    Tensor<T, S> stretch, stress;
    T energy;
  };

  template <class S, class T>
  Step<T, S> after(const std::array<T, size<S>>& begin) const noexcept {
    return Step<T, S>(begin);
  }
};

}  // namespace perikit
