#pragma once
#include <memory>
#include <vector>

#include "operators/batch.hpp"
#include "families/blocks.hpp"
#include "assembly/assembly.hpp"
#include "spaces/local_force_point.hpp"

namespace perikit {

/// The non-variational force states of evaluation points that belong to bonds, for comparison [Partmann et al. 4.20; Scabbia et al.
/// 23, 30]:
///   f_i += t, f_j -= t,   t = V_i (sum of V over the domain / sum of V over H_i) dpsi/dFt g_ij,   g_ij = omega V_j K_ij^-1 xi_ij,
/// and the volumetric part of the selective map through the whole family. Energies and samples are those of the variational
/// model; forces are not -dE/du and break angular momentum; the tangent is their exact derivative and not symmetric.
/// One point at a time, every stencil built anew: right, not fast.
template <int D>
class LocalForceModel final : public AssemblingModel {
 public:
  LocalForceModel(const ModelParts& parts, std::unique_ptr<Model> variational);

  EvaluationStatus forces(ConstFieldView u, FieldView force, double* energy) override;
  EvaluationStatus tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) override;
  EvaluationStatus sample(ConstFieldView u, PointSamples& samples) override { return variational_->sample(u, samples); }
  Field shape_tensor_condition() override { return variational_->shape_tensor_condition(); }
  Field damage() override { return variational_->damage(); }
  ModelReport report() const override;
  bool conservative() const noexcept override { return false; }

 protected:
  std::unique_ptr<Assembly> make_assembly(const ModelParts& parts) const override;

 private:
  struct Memory {
    LocalForcePoint<D> point;
    std::vector<double> t;  ///< [bond][D]: force of the point along its bonds
  };

  void gradient(std::size_t row, const double* g, ConstFieldView u, double* H, int stride) const noexcept;
  /// t of the bonds of a row. Whether the point is admissible.
  bool bond_forces(std::size_t row, Memory& m, BatchScratch& s, Pass& pass) const;
  EvaluationStatus run(Pass& pass);

  const Body& body_;
  const Laws& laws_;
  Formulation formulation_;
  std::unique_ptr<Model> variational_;
  PointFamilies families_;
  std::vector<double> family_volume_;  ///< sum of V over the whole family, by row
  Colouring colouring_;
  ScratchPool scratch_;
  PerThread<Memory> memory_;
};

}  // namespace perikit
