#pragma once
/// A whole Material from a point law that is written once:
///
///   struct MyLaw {
///     static constexpr MaterialTraits traits{.constants = 2};
///     void constants(const MaterialInput&, double* out) const;                  // throws std::domain_error
///     Moduli small_strain(const double* k) const noexcept;
///     template <class T, class S, class K> T psi(const Tensor<T, S>& H, const K& k) const noexcept;             // one of these
///     template <class T, class S, class K> Tensor<T, S> P(const Tensor<T, S>& H, const K& k) const noexcept;    // or both
///     template <class T, class S, class K> auto tangent(const Tensor<T, S>& H, const K& k) const noexcept;      // may be left out
///   };
///   auto material = std::make_unique<LawMaterial<MyLaw>>();
///
/// T is a Pack, or Duals of it; k is a std::array<Pack, traits.constants>. What rounding leaves of psi and P at H = 0 is taken
/// off, so that a law may be written in F and its invariants; written in H it keeps all digits of small strains. A law that is
/// stressed at rest by more than rounding is refused. Stress, tangent actions, tangents and all five spaces follow; whatever the
/// law leaves out comes from forward differentiation. A law with P alone stores no energy: it declares hyperelastic = false, and
/// its psi reads zero. Laws with history: perikit/sdk/history.hpp. Laws with traits.objective = false are small-strain laws and
/// accept every finite H. Uniaxial stress needs an isotropic law (both free stretches are taken equal).
///
/// A law that reads variables from outside names them, and finds them behind its constants in k, which is a std::array<Pack, constants_of<MyLaw>>:
///     static constexpr std::array external{ExternalVariable{"temperature", "K", 293.0}};
///
/// Faster, where a root or a division stands at the beginning of all of them: invariants(H), which psi, P and tangent then take as a third
/// argument (perikit/sdk/differentiation.hpp; rubber_invariants.hpp has those of rubber). In plane and uniaxial stress: the free stretch, its equation,
/// the tangent that it leaves, or constants with which zero lateral strain has the same stress (perikit/sdk/free_stretch.hpp). Under the selective
/// map, of laws psi = psi_iso(J^(-1/3) F) + U(J): the constants of psi_iso alone, and U,
///
///     template <class K> std::array<K, n> isochoric(const std::array<K, n>& k) const noexcept;
///     template <class T, class K> VolumeResponse<T> volume(const T& j, const K& k) const noexcept;    // j = J - 1; perikit/sdk/volumetric.hpp

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "perikit/core/field.hpp"
#include "perikit/model/material.hpp"
#include "perikit/sdk/free_stretch.hpp"
#include "perikit/sdk/history.hpp"
#include "perikit/sdk/law_checks.hpp"
#include "perikit/sdk/volumetric.hpp"

// Everything of one point is inlined: its tensors live in registers only where nothing is called. Not in sanitized builds, where the
// checks in the inlined bodies would take minutes to compile.
#if defined(__SANITIZE_ADDRESS__)
#define PERIKIT_FLATTEN
#else
#define PERIKIT_FLATTEN [[gnu::flatten]]
#endif

namespace perikit {

/// psi = psi_iso(J^(-1/3) F) + U(J), and the law tells both.
template <class Law>
concept HasVolume = external_size<Law> == 0 && requires(const Law& law, const std::array<double, Law::traits.constants>& k) {
  { law.isochoric(k) } -> std::same_as<std::array<double, Law::traits.constants>>;
  { law.volume(0.0, k) } -> std::same_as<VolumeResponse<double>>;
};

template <class Law>
class LawMaterial final : public Material {
  static_assert(detail::check_law<Law>());

 public:
  explicit LawMaterial(Law law = {}) : law_(std::move(law)) {}

  MaterialTraits traits() const noexcept override { return Law::traits; }
  void constants(const MaterialInput& input, double* out) const override {
    law_.constants(input, out);
    if constexpr (!HasHistory<Law>) {
      check_rest<Solid>(out);
      check_rest<Plane>(out);
      check_rest<Line>(out);
    }
  }
  Moduli small_strain(const double* k) const noexcept override { return law_.small_strain(k); }
  std::span<const StateVariable> state(Space space) const noexcept override {
    if constexpr (HasHistory<Law>) {
      const int d = dimension(space);
      if (d == 3) return Law::template state<Solid>;
      if (d == 2) return Law::template state<Plane>;
      return Law::template state<Line>;
    } else {
      return {};
    }
  }

  std::span<const ExternalVariable> external() const noexcept override {
    if constexpr (external_size<Law> > 0) return Law::external;
    else return {};
  }

  Status evaluate(Space space, const MaterialBatch& batch) const noexcept override {
    const Status status = as_written(space, batch);
    if (offset_at_rest_.load(std::memory_order_relaxed)) [[unlikely]]
      take_off_rest(space, batch);
    return status;
  }

  bool isochoric_constants([[maybe_unused]] const double* constants, [[maybe_unused]] double* isochoric) const noexcept override {
    if constexpr (HasVolume<Law>) {
      std::array<double, Law::traits.constants> k;
      std::copy_n(constants, k.size(), k.begin());
      k = law_.isochoric(k);
      std::copy_n(k.begin(), k.size(), isochoric);
    }
    return HasVolume<Law>;
  }
  void volumetric([[maybe_unused]] const VolumeBatch& batch) const noexcept override {
    if constexpr (HasVolume<Law>) {
      Constants k;
      for (std::size_t i = 0; i < k.size(); ++i) k[i] = batch.constants[i];
      for (int p = 0; p < batch.n; p += pack_width) {
        const auto part = law_.volume(Pack::load(batch.j + p), k);
        if (batch.psi) part.energy.store(batch.psi + p);
        if (batch.kirchhoff) part.kirchhoff.store(batch.kirchhoff + p);
        if (batch.slope) part.slope.store(batch.slope + p);
      }
    }
  }

 private:
  using Constants = std::array<Pack, constants_of<Law>>;
  static constexpr bool small_strain_law = !Law::traits.objective;
  /// Zero lateral stress: as zero lateral strain with other constants where the law has them.
  template <class Confined, class Open>
  using Free = std::conditional_t<HasFreeConstants<Law, Confined, Constants>, Confined, Open>;
  /// Whether psi or P of H = 0 is not exactly zero for some constants that were made: of this law whatever its parameters, since
  /// taking off zero changes nothing.
  inline static std::atomic<bool> offset_at_rest_ = false;

  Status as_written(Space space, const MaterialBatch& batch) const noexcept {
    switch (space) {
      case Space::solid:
        return run<Solid, false>(batch);
      case Space::plane_strain:
        return strain<ConfinedPlane, Plane>(batch);
      case Space::plane_stress:
        return run<Free<ConfinedPlane, Plane>, true>(batch);
      case Space::line_strain:
        return strain<ConfinedLine, Line>(batch);
      case Space::line_stress:
        return run<Free<ConfinedLine, Line>, true>(batch);
    }
    return {0};
  }

  /// psi and P of eight points at rest.
  struct Rest {
    alignas(64) double H[9 * padding] = {}, psi[padding] = {}, P[9 * padding] = {};
    MaterialBatch batch(const double* constants, std::size_t constant_stride, int n) noexcept {
      return {.n = n, .stride = padding, .H = H, .constants = constants, .constant_stride = constant_stride, .psi = psi, .P = P};
    }
  };

  template <class S>
  void check_rest(const double* k) const {
    Rest rest;
    run<S, false>(rest.batch(k, 0, 1));
    double stress = 0;
    for (int c = 0; c < S::components; ++c) stress = std::max(stress, std::abs(rest.P[c * padding]));
    if (stress == 0 && rest.psi[0] == 0) return;
    const Moduli moduli = law_.small_strain(k);
    const double scale = std::abs(moduli.lambda) + 2 * std::abs(moduli.mu);
    if (!(stress <= 1e-10 * scale) || !(std::abs(rest.psi[0]) <= 1e-10 * scale))
      throw std::domain_error("the law is stressed, or stores energy, where nothing is deformed (H = 0)");
    offset_at_rest_ = true;
  }

  [[gnu::noinline, gnu::cold]] void take_off_rest(Space space, const MaterialBatch& b) const noexcept {
    const int components = tensor_components(space);
    for (int p = 0; p < b.n; p += static_cast<int>(padding)) {
      Rest rest;
      const int n = std::min(static_cast<int>(padding), b.n - p);
      as_written(space, rest.batch(b.constant_stride == 0 ? b.constants : b.constants + p, b.constant_stride, n));
      for (int l = 0; l < n; ++l) {
        bool refused = true;  // inadmissible points read zero
        for (int c = 0; c < components && b.P; ++c) refused &= b.P[static_cast<std::size_t>(c) * b.stride + p + l] == 0;
        if (b.psi) refused &= b.psi[p + l] == 0;
        if (refused) continue;
        if (b.psi) b.psi[p + l] -= rest.psi[l];
        for (int c = 0; c < components && b.P; ++c)
          b.P[static_cast<std::size_t>(c) * b.stride + p + l] -= rest.P[static_cast<std::size_t>(c) * padding + l];
      }
    }
  }

  /// A law that is an energy alone gets its lateral stress by differentiating with respect to lateral components: it keeps them.
  template <class Confined, class Open>
  Status strain(const MaterialBatch& b) const noexcept {
    if constexpr (HasHistory<Law> || HasStress<Law, Pack, Confined, Constants>) {
      if (b.confined && !b.A) return run<Confined, false>(b);
    }
    return run<Open, false>(b);
  }

  static Constants load_constants(const MaterialBatch& b, int p) noexcept {
    constexpr auto own = static_cast<std::size_t>(Law::traits.constants);
    Constants k;
    for (std::size_t i = 0; i < own; ++i)
      k[i] = b.constant_stride == 0 ? Pack(b.constant(i, p)) : Pack::load(b.constant_at(i, p));
    if constexpr (external_size<Law> > 0)
      for (std::size_t i = 0; i < external_size<Law>; ++i)
        k[own + i] = !b.external ? Pack(Law::external[i].reference) : b.external_stride == 0 ? Pack(b.external[i]) : Pack::load(b.external + i * b.external_stride + p);
    return k;
  }

  /// A displacement gradient, or a direction of one.
  template <class S>
  static Tensor<Pack, S> load(const double* x, std::size_t stride, int p) noexcept {
    return Tensor<Pack, S>::map(
        [&](int c) { return always_zero<S>(row<S>(c)) ? Pack(0.0) : Pack::load(x + c * stride + p); });
  }
  template <class S>
  static void store(const Tensor<Pack, S>& t, double* x, std::size_t stride, int p) noexcept {
    PERIKIT_UNROLL for (int c = 0; c < S::components; ++c) t[c].store(x + c * stride + p);
  }

  /// The step that begins at this state, with its length where the law asks for it.
  template <class S>
  auto after(const std::array<Pack, state_size<Law, S>()>& state, double time_step) const noexcept {
    if constexpr (HasTimeStep<Law>)
      return law_.template after<S>(state, time_step);
    else
      return law_.template after<S>(state);
  }

  /// The law of points p ...: of the step that begins at their history, for laws that have one.
  template <class S>
  decltype(auto) law_at(const MaterialBatch& b, int p) const noexcept {
    if constexpr (HasHistory<Law>) {
      std::array<Pack, state_size<Law, S>()> state{};
      if (b.state_old)
        for (std::size_t i = 0; i < state.size(); ++i) state[i] = Pack::load(b.state_old + i * b.state_stride + p);
      return after<S>(state, b.time_step);
    } else {
      return (law_);
    }
  }

  /// The same pointer, of which the compiler knows nothing.
  static double* hidden(double* pointer) noexcept {
    asm volatile("" : "+r"(pointer));
    return pointer;
  }

  /// Lanes of finite H and, but for small-strain laws, 0 < det F < infinity.
  template <class S, class Invariants>
  static PackMask admissible(const Tensor<Pack, S>& H, const Invariants& of) noexcept {
    if constexpr (small_strain_law) {
      return sum_of_components<S>([&](int c) { return H[c] * 0.0; }) == 0.0;
    } else {
      const Pack J = [&] {  // not finite if any component is not
        if constexpr (requires { of.j; }) return Pack(1.0 + of.j);
        else return determinant(add_diagonal(H, Pack(1.0)));
      }();
      return (J > 0.0) & (J < std::numeric_limits<double>::infinity());
    }
  }

  template <class S>
  Pack contraction(const Constants& k, [[maybe_unused]] double time_step) const noexcept {
    if constexpr (HasHistory<Law>)
      return contraction_ratio<S>(after<S>(std::array<Pack, state_size<Law, S>()>{}, time_step), k);
    else
      return contraction_ratio<S>(law_, k);
  }

  /// Invariants are found for so many packs at once: one waits for its roots while the next ones begin.
  static constexpr int packs_ahead = 8;
  template <class S, bool free_stretch>
  static constexpr bool looks_ahead = !free_stretch && !HasHistory<Law> && HasInvariants<Law, Pack, S>;

  template <class S, bool free_stretch>
  static auto invariants_ahead() noexcept {
    if constexpr (looks_ahead<S, free_stretch>)
      return std::array<decltype(std::declval<const Law&>().invariants(Tensor<Pack, S>())), packs_ahead>();
    else
      return std::array<NoInvariants, 1>();
  }

  /// Memory of a T, without the zeros that packs begin with.
  template <class T>
  union Unset {
    T value;
    Unset() noexcept {}
  };

  /// Those of the packs from point p on.
  template <class S>
  void find_invariants(const MaterialBatch& b, int p, auto& of) const noexcept {
    for (auto& pack : of) {
      if (p < b.n) pack = law_.invariants(load<S>(b.H, b.stride, p));
      p += pack_width;
    }
  }

  /// The equation of a free strain, and the root of J where it vanishes.
  template <class Equation>
  struct FreeRoot {
    const Equation& equation;
    const Pack& root;
  };
  template <class Equation>
  FreeRoot(const Equation&, const Pack&) -> FreeRoot<Equation>;   // which clang does not find by itself before version 17

  template <class S, bool own>
  static auto zeros_of_batch() noexcept {
    if constexpr (own)
      return FreeZeros<Law, S, Constants>();
    else
      return 0;
  }

  /// Free strains of the packs that begin with points p ...; beyond the last point those of the first again.
  template <class S>
  [[gnu::noinline]] PERIKIT_FLATTEN void find_zeros(const MaterialBatch& b, int p, FreeZeros<Law, S, Constants>& zeros) const noexcept {
    const auto first = [&](int i) { return p + i * pack_width < b.n ? p + i * pack_width : p; };
    std::array<Constants, FreeZeros<Law, S, Constants>::packs> k;
    for (std::size_t i = 0; i < k.size(); ++i) k[i] = load_constants(b, first(static_cast<int>(i)));
    zeros.find(law_, k, b.constant_stride == 0, p > 0, [&](int i) { return load<S>(b.H, b.stride, first(i)); });
  }

  template <class S, bool free_stretch>
  PERIKIT_FLATTEN Status run(const MaterialBatch& b) const noexcept {
    constexpr bool own_constants = free_stretch && S::confined;
    constexpr bool own_zeros = free_stretch && HasFreeZeros<Law, Pack, S, Constants>;
    Status status;
    Constants k, given;  // given: where k are those of zero lateral strain
    [[maybe_unused]] Pack ratio = 0.0;
    [[maybe_unused]] Unset<decltype(zeros_of_batch<S, own_zeros>())> memory_of_zeros;
    [[maybe_unused]] Unset<decltype(invariants_ahead<S, free_stretch>())> memory_ahead;
    [[maybe_unused]] auto& zeros = memory_of_zeros.value;
    [[maybe_unused]] auto& ahead = memory_ahead.value;
    const auto begin_constants = [&](int p) {
      k = given = load_constants(b, p);
      if constexpr (own_constants) k = law_.template free_constants<S>(given);
      else if constexpr (free_stretch && !own_zeros) ratio = contraction<S>(k, b.time_step);
    };
    begin_constants(0);
    for (int p = 0; p < b.n; p += pack_width) {
      if (b.constant_stride != 0 || (external_size<Law> > 0 && b.external_stride != 0)) begin_constants(p);
      decltype(auto) law = law_at<S>(b, p);
      Tensor<Pack, S> H = load<S>(b.H, b.stride, p);
      PackMask good = Pack(0.0) == Pack(0.0);
      [[maybe_unused]] const int in_group = p / pack_width % free_zero_packs;
      [[maybe_unused]] const auto at = static_cast<std::size_t>(p / pack_width) % ahead.size();
      if constexpr (own_zeros) {
        if (in_group == 0) find_zeros<S>(b, p, zeros);
        put_free_part(H, zeros.strain[in_group]);
        good = zeros.strain[in_group] == zeros.strain[in_group];
      } else {
        if constexpr (own_constants) {
          if constexpr (requires { law.stretches_freely(H, given); }) good = law.stretches_freely(H, given);
        } else if constexpr (free_stretch) {
          H = admissible_given_part<small_strain_law>(H, good);
          put_free_part(H, free_strain<small_strain_law>(law, H, k, ratio, good));
        }
        if constexpr (looks_ahead<S, free_stretch>) {
          if (at == 0) find_invariants<S>(b, p, ahead);
        }
        good &= admissible(H, ahead[at]);
      }
      if (b.lateral) {
        if constexpr (own_constants) law.free_stretch(H, given).store(b.lateral + p);
        else H[S::components - 1].store(b.lateral + p);
      }

      Pack probe = 0.0;  // turns to NaN where an output is not finite
      const auto put_energy = [&](Pack psi) {
        psi.store(b.psi + p);
        probe += 0.0 * psi;
      };
      const auto put_stress = [&](Tensor<Pack, S> P) {
        if constexpr (free_stretch) put_free_part(P, Pack(0.0));
        store(P, b.P, b.stride, p);
        probe += 0.0 * sum_of_components<S>([&](int c) { return P[c]; });
      };
      if constexpr (HasHistory<Law>) {
        if (b.psi || b.P || b.state_new || b.dissipated || b.step_factor) {
          const auto end = law.update(H, k);
          if (b.psi) put_energy(end.psi);
          if (b.dissipated) end.dissipated.store(b.dissipated + p);
          if (b.step_factor) {
            end.step_factor.store(b.step_factor + p);
            probe += 0.0 * end.step_factor;
          }
          if (b.P) put_stress(end.P);
          if (b.state_new)
            for (std::size_t i = 0; i < end.state.size(); ++i) end.state[i].store(b.state_new + i * b.state_stride + p);
        }
      } else {
        if (b.psi || b.P) {
          // Stress first, and always: what the energy has in common with it is there by then. What is asked for is hidden from the compiler: one
          // that knew would write this once for energies and once without, contract products otherwise, and stresses would have other last bits.
          double *const energies = hidden(b.psi), *const stresses = hidden(b.P);
          const Tensor<Pack, S> P = [&] {
            if constexpr (own_zeros) return zeros.equation[in_group].stress(H, zeros.root[in_group]);
            else if constexpr (looks_ahead<S, free_stretch>) return stress(law, H, k, ahead[at]);
            else return stress(law, H, k);
          }();
          if (energies) {
            if constexpr (!HasEnergy<Law, Pack, S, Constants>) put_energy(0.0);
            else if constexpr (looks_ahead<S, free_stretch>) put_energy(energy(law, H, k, ahead[at]));
            else put_energy(energy(law, H, k));
          }
          if (stresses) put_stress(P);
        }
      }
      if (b.dP || b.A) {
        if constexpr (own_zeros) tangents<S, free_stretch>(law, b, p, H, k, FreeRoot{zeros.equation[in_group], zeros.root[in_group]});
        else tangents<S, free_stretch>(law, b, p, H, k, ahead[at]);
      }
      good &= probe == 0.0;
      if (!all(good)) [[unlikely]]
        clear(b, S::components, state_size<Law, S>(), p, good, status);
    }
    return status;
  }

  template <class S, bool free_stretch, class StepLaw, class Invariants>
  [[gnu::noinline]] PERIKIT_FLATTEN static void tangents(const StepLaw& law, const MaterialBatch& b, int p, const Tensor<Pack, S>& H,
                                                       const Constants& k, [[maybe_unused]] const Invariants& of) noexcept {
    const auto action = [&] {
      if constexpr (free_stretch && HasFreeZeros<Law, Pack, S, Constants>)
        return of.equation.tangent(H, of.root);
      else if constexpr (free_stretch && HasFreeTangent<StepLaw, Pack, S, Constants>)
        return law.free_tangent(H, k);
      else if constexpr (free_stretch && !S::confined)
        return condensed_tangent(law, H, k);
      else if constexpr (looks_ahead<S, free_stretch>)
        return tangent(law, H, k, of);
      else
        return tangent(law, H, k);
    }();
    const auto along = [&](Tensor<Pack, S> direction) {
      if constexpr (!free_stretch) return action(direction);
      else return put_free_part(direction, Pack(0.0)), with_free_part(action(direction), Pack(0.0));
    };
    if (b.dP) store(along(load<S>(b.dH, b.stride, p)), b.dP, b.stride, p);
    if constexpr (free_stretch || !S::confined) {
      if (!b.A) return;
#pragma GCC unroll 1
      for (int c = 0; c < S::components; ++c) store(along(Tensor<Pack, S>::unit(c)), b.A + c * b.stride, S::components * b.stride, p);
    }
  }

  /// Zeroes the outputs of the lanes that are not good and notes the first of them.
  [[gnu::noinline, gnu::cold]] static void clear(const MaterialBatch& b, int components, int state, int p, PackMask good,
                                                 Status& status) noexcept {
    for (int lane = 0; lane < pack_width && p + lane < b.n; ++lane) {
      if (good[lane]) continue;
      if (status.ok()) status.inadmissible = p + lane;
      const auto zero = [&](double* x, int count) {
        if (!x) return;
        for (int c = 0; c < count; ++c) x[static_cast<std::size_t>(c) * b.stride + p + lane] = 0.0;
      };
      zero(b.psi, 1);
      zero(b.dissipated, 1);
      if (b.step_factor) b.step_factor[p + lane] = 1.0;
      zero(b.lateral, 1);
      zero(b.P, components);
      zero(b.dP, components);
      zero(b.A, components * components);
      if (!b.state_new) continue;
      for (int c = 0; c < state; ++c) b.state_new[static_cast<std::size_t>(c) * b.state_stride + p + lane] = 0.0;
    }
  }

  Law law_;
};

}  // namespace perikit
