#pragma once
/// The zero-energy penalty of one point as a quadratic form over its family. With w_k = V_i omega V_k for the bonds of i, p_k = w_k xi_k and the
/// point gradient H_i = sum_k u_ik (x) g_k,
///
///   sum_k w_k z_ik . M z_ik = sum_kl N_kl u_ik . M u_il,   N = diag(w) - (p g^T + g p^T) + g S g^T,   S = sum_k w_k xi_k (x) xi_k.
///
/// Where the whole fit of order n is subtracted, with its orthonormal polynomials phi (families/reproducing_kernel.hpp),
///
///   z_ik = u_ik - sum_a phi_a(k) c_a,   c_a = sum_k omega V_k phi_a(k) u_ik,   N = diag(w) - V_i sum_a p_a p_a^T,   p_a = omega V phi_a.

#include <vector>

#include "families/families.hpp"
#include "model/formulation.hpp"
#include "perikit/model/stabilization.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

/// What penalties are made of. All but the stabilization must outlive them.
struct PenaltyParts {
  const Families& families;
  const Formulation& formulation;
  const Laws& laws;
  std::shared_ptr<const Stabilization> stabilization;
  bool skip = true;
};

/// Whether the whole fit of an order above 1 is subtracted from each bond.
inline bool whole_fit(const PenaltyParts& parts) { return parts.formulation.order > 1 && parts.stabilization->traits().fit == PenaltyFit::whole; }

template <int D>
class PenaltyElement {
 public:
  /// False where the family has no gradient, or is too flat to be penalised.
  bool load(const PenaltyParts& parts, std::size_t point);
  /// N over nodes [k * nodes + l]: the bonds, with the point itself at place `own` among them, closing the sums.
  void form(std::size_t own, std::vector<double>& N) const;

  const FamilyArrays& family() const noexcept { return family_; }
  double spring(std::size_t k) const noexcept { return spring_[k]; }          ///< w_k
  double gradient(std::size_t k, int e) const noexcept { return gradient_[k * D + static_cast<std::size_t>(e)]; }   ///< g_k
  double matrix(int a, int b) const noexcept { return M_[a][b]; }
  /// Of the whole fit; 0 where its linear part is subtracted alone.
  std::size_t polynomials() const noexcept { return polynomials_; }
  double polynomial(std::size_t k, std::size_t a) const noexcept { return polynomial_[k * polynomials_ + a]; }   ///< phi_a(k)
  double owner_volume() const noexcept { return volume_; }   ///< V_i

 private:
  void form_whole(std::size_t own, std::vector<double>& N) const;

  FamilyArrays family_;
  AlignedVector<double> spring_;
  std::vector<double> gradient_, polynomial_;
  std::size_t polynomials_ = 0;
  double M_[D][D], S_[D][D], volume_ = 0;
};

}  // namespace perikit
