#pragma once
/// A whole PointTerm from a law that is written once:
///
///   struct MyLaw {
///     static constexpr TermTraits traits{.constants = 1};
///     void constants(const MaterialInput& input, double* k) const { k[0] = input.value("stiffness"); }
///     template <class T, std::size_t d, class K>
///     T energy(const Vector<T, d>& u, const Vector<Pack, d>& x, double time, const K& k) const noexcept { return 0.5 * k[0] * dot(u, u); }
///   };
///   auto term = std::make_unique<LawTerm<MyLaw>>();
///
/// Force and tangent follow from the energy density by forward differentiation. A force that no energy has stands beside -de/du, or alone; traits
/// then have conservative = false:
///
///     template <class T, std::size_t d, class K>
///     Vector<T, d> force(const Vector<T, d>& u, const Vector<Pack, d>& v, const Vector<Pack, d>& x, double time, const K& k) const noexcept;
///
/// T is a Pack, or Duals of it; k is a std::array<Pack, traits.constants>; v is zero unless traits.velocity. What is not finite is inadmissible.

#include <algorithm>
#include <array>
#include <utility>

#include "perikit/core/dual.hpp"
#include "perikit/core/field.hpp"
#include "perikit/model/point_term.hpp"

namespace perikit {

template <class T, std::size_t d>
using Vector = std::array<T, d>;

template <class A, class B, std::size_t d>
Joint<A, B> dot(const Vector<A, d>& a, const Vector<B, d>& b) noexcept {
  Joint<A, B> sum = a[0] * b[0];
  for (std::size_t c = 1; c < d; ++c) sum = sum + a[c] * b[c];
  return sum;
}

namespace detail {
template <class Law>
concept TermEnergy = requires(const Law& law, const Vector<Pack, 2>& a, const std::array<Pack, Law::traits.constants>& k) {
  { law.energy(a, a, 0.0, k) } -> std::same_as<Pack>;
};
template <class Law>
concept TermForce = requires(const Law& law, const Vector<Pack, 2>& a, const std::array<Pack, Law::traits.constants>& k) {
  { law.force(a, a, a, 0.0, k) } -> std::same_as<Vector<Pack, 2>>;
};
}  // namespace detail

template <class Law>
class LawTerm final : public PointTerm {
  static_assert(detail::TermEnergy<Law> || detail::TermForce<Law>,
                "a law of a term has `T energy(const Vector<T, d>& u, const Vector<Pack, d>& x, double time, const K& k) const noexcept`, or "
                "`Vector<T, d> force(const Vector<T, d>& u, const Vector<Pack, d>& v, const Vector<Pack, d>& x, double time, const K& k) const noexcept`, "
                "templates over T, std::size_t d and K");
  static_assert(Law::traits.conservative != detail::TermForce<Law>, "traits.conservative is true of an energy alone, and false where there is a `force`");
  static_assert(detail::TermForce<Law> || (!Law::traits.velocity && !Law::traits.dissipates), "traits.velocity and traits.dissipates need a `force`");

 public:
  explicit LawTerm(Law law = {}) : law_(std::move(law)) {}

  TermTraits traits() const noexcept override { return Law::traits; }
  void constants(const MaterialInput& input, double* out) const override {
    if constexpr (Law::traits.constants > 0) law_.constants(input, out);
  }
  Status evaluate(int dimension, const TermBatch& batch) const noexcept override {
    return dimension == 1 ? run<1>(batch) : dimension == 2 ? run<2>(batch) : run<3>(batch);
  }

 private:
  using Constants = std::array<Pack, Law::traits.constants>;

  template <std::size_t d>
  static Vector<Pack, d> load(const double* a, std::size_t stride, int p) noexcept {
    Vector<Pack, d> vector;
    for (std::size_t c = 0; a && c < d; ++c) vector[c] = Pack::load(a + c * stride + p);
    return vector;
  }

  template <std::size_t d>
  Status run(const TermBatch& b) const noexcept {
    Status status;
    for (int p = 0; p < b.n; p += pack_width) {
      Constants k;
      for (std::size_t i = 0; i < k.size(); ++i) k[i] = b.constant_stride == 0 ? Pack(b.constant(i, p)) : Pack::load(b.constant_at(i, p));
      const Vector<Pack, d> x = load<d>(b.x, b.stride, p), u = load<d>(b.u, b.stride, p), v = load<d>(b.v, b.stride, p);
      Pack sum = 0.0;   // not finite where an output is not
      const auto put = [&](double* out, std::size_t c, Pack value) {
        value.store(out + c * b.stride + p);
        sum += value - value;
      };
      if (b.energy) put(b.energy, 0, energy(u, x, b.time, k));
      if (b.force) {
        const Vector<Pack, d> f = force(u, v, x, b.time, k);
        for (std::size_t c = 0; c < d; ++c) put(b.force, c, f[c]);
      }
      if (b.dforce) {
        const Vector<Pack, d> w = load<d>(b.w, b.stride, p);
        Vector<Dual<Pack>, d> along;
        for (std::size_t c = 0; c < d; ++c) along[c] = {u[c], w[c]};
        const Vector<Dual<Pack>, d> f = force(along, v, x, b.time, k);
        for (std::size_t c = 0; c < d; ++c) put(b.dforce, c, f[c].derivative);
      }
      for (int l = 0; l < pack_width && p + l < b.n && status.ok(); ++l)
        if (!(sum[l] == 0)) status.inadmissible = p + l;
    }
    return status;
  }

  template <class T, std::size_t d>
  T energy(const Vector<T, d>& u, const Vector<Pack, d>& x, double time, const Constants& k) const noexcept {
    if constexpr (detail::TermEnergy<Law>) return law_.energy(u, x, time, k);
    else return T(0.0);
  }
  template <class T, std::size_t d>
  Vector<T, d> force(const Vector<T, d>& u, const Vector<Pack, d>& v, const Vector<Pack, d>& x, double time, const Constants& k) const noexcept {
    Vector<T, d> f;
    if constexpr (detail::TermForce<Law>) f = law_.force(u, v, x, time, k);
    else f.fill(T(0.0));
    if constexpr (detail::TermEnergy<Law>)
      for (std::size_t c = 0; c < d; ++c) {
        Vector<Dual<T>, d> seeded;
        for (std::size_t e = 0; e < d; ++e) seeded[e] = {u[e], T(e == c ? 1.0 : 0.0)};
        f[c] -= law_.energy(seeded, x, time, k).derivative;
      }
    return f;
  }

  Law law_;
};

}  // namespace perikit
