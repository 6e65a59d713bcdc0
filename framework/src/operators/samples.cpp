#include "operators/samples.hpp"

#include <fmt/format.h>

namespace perikit {

EvaluationStatus status_at(const Body& body, std::int64_t bad) {
  EvaluationStatus status;
  if (bad < 0) return status;
  const Point x = body.position(static_cast<std::size_t>(bad));
  status.point = body.input_of(static_cast<std::size_t>(bad));
  status.description = fmt::format("point {} at ({:.6g}, {:.6g}, {:.6g})", status.point, x[0], x[1], x[2]);
  return status;
}

EvaluationStatus run_forces(const Laws& laws, bool selective, std::size_t blocks, ConstFieldView u, FieldView force, double* energy,
                            const std::function<EvaluationStatus(Pass&)>& run) {
  if (laws.history()) laws.history()->prepare(blocks);
  const BatchWork work(laws, Work::force, energy != nullptr, selective);
  std::vector<double> energies(energy ? blocks : 0, 0.0);
  Pass pass{work, u, {}, force, nullptr, energy ? energies.data() : nullptr, -1, {}};
  const EvaluationStatus status = run(pass);
  if (energy) {
    *energy = 0;
    for (const double e : energies) *energy += e;
  }
  return status;
}

double run_energy(const Body& body, const Laws& laws, bool selective, std::size_t blocks, ConstFieldView u, const GroupMarks& marks, const BondState& bonds,
                  const std::function<EvaluationStatus(Pass&)>& run) {
  std::vector<std::int32_t> points;
  for (std::size_t p = 0; p < body.stride(); ++p)
    if (marks[p / padding] && body.alive(p)) points.push_back(static_cast<std::int32_t>(p));
  GroupMarks near(marks.size(), 0);
  bonds.mark_families(points, near);
  const BatchWork work(laws, Work::force, true, selective);
  std::vector<double> energies(blocks, 0.0);
  Pass pass{work, u, {}, {}, nullptr, energies.data(), -1, {}, marks.data(), near.data()};
  run(pass);
  double energy = 0;
  for (const double e : energies) energy += e;
  return energy;
}

EvaluationStatus run_samples(const Body& body, const Laws& laws, bool selective, ConstFieldView u, PointSamples& s,
                             const std::function<EvaluationStatus(Pass&)>& run) {
  Field weight = body.make_field(1);
  s = {body.make_field(1), body.make_field(laws.components()), body.make_field(laws.components()), body.make_field(9), body.make_field(1)};
  const SampleSums sums{weight.data(), s.strain_energy_density.data(), s.H.data(), s.P.data(), s.cauchy.data(), s.von_mises.data(), body.stride()};
  const BatchWork work(laws, Work::sample, false, selective);
  Pass pass{work, u, {}, {}, &sums, nullptr, -1, {}};
  const EvaluationStatus status = run(pass);
  for (const std::int32_t index : body.internal()) {
    const auto p = static_cast<std::size_t>(index);
    const double inverse = weight.data()[p] > 0 ? 1.0 / weight.data()[p] : 0.0;
    s.strain_energy_density.data()[p] /= body.volume(p);
    for (Field* field : {&s.H, &s.P, &s.cauchy, &s.von_mises})
      for (int c = 0; c < field->components(); ++c) field->component(c)[p] *= inverse;
  }
  return status;
}

}  // namespace perikit
