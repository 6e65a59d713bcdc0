#include "problem/driven_work.hpp"

#include <array>

#include "perikit/core/errors.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/problem/state.hpp"
#include "terms/term.hpp"

namespace perikit {

DrivenWork::DrivenWork(Terms& terms, State& state) : terms_(terms), state_(state) {}

void DrivenWork::find(const Configuration& at, bool count) {
  struct Part {
    Drive drive;
    const char *force, *energy;
  };
  constexpr std::array parts{Part{Drive::outside, "driven_force", "driven_energy"}, Part{Drive::loss, "lossy_force", "lossy_energy"}};
  if (!terms_.driven(Drive::outside) && !terms_.driven(Drive::loss)) return;
  const ConstFieldView u = at.u();
  const FieldView begin = state_.declare("driven_displacement");
  Field path = terms_.body().make_field(u.components), force = path;
  combine(1, u, -1, begin, path);
  for (const Part& part : parts) {
    if (!terms_.driven(part.drive)) continue;
    const FieldView old_force = state_.declare(part.force);
    double& old_energy = state_.declare_numbers(part.energy, 1)[0];
    double energy = 0;
    if (const EvaluationStatus status = terms_.driven_forces(at, part.drive, force, energy); !status.ok())
      throw RunError("the work of terms: " + status.description);
    if (count) {
      const double gain = energy - old_energy + 0.5 * (dot(old_force, path) + dot(force, path));
      if (part.drive == Drive::outside) {
        state_.energies.external_work += gain;
      } else {
        state_.energies.dissipated -= gain;
        state_.energies.dissipated_by_laws -= gain;
      }
    }
    copy(force, old_force);
    old_energy = energy;
  }
  copy(u, begin);
}

}  // namespace perikit
