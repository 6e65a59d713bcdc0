#pragma once
#include <functional>

#include "operators/batch.hpp"
#include "families/bond_state.hpp"
#include "perikit/terms/model.hpp"

namespace perikit {

/// Input index and position of an internal point, for messages; ok for -1.
EvaluationStatus status_at(const Body& body, std::int64_t bad);

/// Forces and energy: the sum over blocks in their order.
EvaluationStatus run_forces(const Laws& laws, bool selective, std::size_t blocks, ConstFieldView u, FieldView force, double* energy,
                            const std::function<EvaluationStatus(Pass&)>& run);

/// Energy of the evaluation points that the marked groups own.
double run_energy(const Body& body, const Laws& laws, bool selective, std::size_t blocks, ConstFieldView u, const GroupMarks& marks, const BondState& bonds,
                  const std::function<EvaluationStatus(Pass&)>& run);

/// Point averages with the evaluation weights; strain energy density is per point volume.
EvaluationStatus run_samples(const Body& body, const Laws& laws, bool selective, ConstFieldView u, PointSamples& samples,
                             const std::function<EvaluationStatus(Pass&)>& run);

}  // namespace perikit
