#include "perikit/problem/fracture_record.hpp"

#include <fmt/format.h>

#include "problem/snapshot.hpp"

namespace perikit {

BondUpdate FractureRecord::update(Terms& terms, ConstFieldView u, State& state, double time_step, const StepBegin& begin,
                                  BondReaction* reaction) {
  BondUpdate update = terms.update_bonds(u, time_step, begin, reaction);
  account(update, state);
  return update;
}

bool FractureRecord::weaken(Terms& terms, ConstFieldView u, ConstFieldView forecast, State& state) {
  const BondUpdate update = terms.weaken_bonds(u, forecast);
  account(update, state);
  return update.changed > 0;
}

void FractureRecord::account(const BondUpdate& update, State& state) {
  state.energies.dissipated += update.dissipated;
  state.energies.strain -= update.dissipated;  // explicit steps take it anew
  if (update.dissipated < 0) {
    ++gains_;
    gained_ -= update.dissipated;
  }
  inside_out_ += update.inside_out;
  held_ += static_cast<std::int64_t>(update.held);
}

std::string FractureRecord::summary(const BondChecks& checks, double dissipated) const {
  if (!damage_) return {};
  std::string text =
      fmt::format("failed bonds  {}, weakened {}, dissipated {:.6g} J\n", checks.failed, checks.weakened, dissipated);
  if (checks.groups > 0) {
    text += fmt::format(
        "bond checks   {} of {} groups of eight points in {} updates ({:.2f} %); the others were too far from failing\n",
        checks.checked, checks.groups, checks.updates,
        100.0 * static_cast<double>(checks.checked) / static_cast<double>(checks.groups));
  }
  if (gains_ > 0) {
    text +=
        fmt::format("warning       {} updates of bonds raised the strain energy, by {:.6g} J in all; the others took {:.6g} J\n",
                    gains_, gained_, dissipated + gained_);
  }
  if (held_ > 0)
    text +=
        fmt::format("bonds held    {} times a bond beyond its limit stayed, as its failure would have created energy\n", held_);
  if (inside_out_ > 0) {
    text += fmt::format("warning       {} times points were turned inside out where bonds failed: the energy and the impulse of these bonds are lost\n",
                        inside_out_);
  }
  return text;
}

void FractureRecord::write(const Terms& terms, ByteWriter& out) const {
  out.value(gains_);
  out.value(gained_);
  out.value(inside_out_);
  out.value(held_);
  const std::vector<NamedChange> bonds = terms.changed_bonds_of_all();
  out.value(static_cast<std::uint64_t>(bonds.size()));
  for (const NamedChange& b : bonds) out.value(b);
}

namespace {

std::vector<NamedChange> read_changes(ByteReader& in) {
  std::vector<NamedChange> bonds;
  for (auto left = in.value<std::uint64_t>(); left > 0; --left) bonds.push_back(in.value<NamedChange>());
  return bonds;
}

}  // namespace

void FractureRecord::read_bonds(ByteReader& in, std::vector<NamedChange>& bonds) {
  FractureRecord record;
  record.read_account(in);
  bonds = read_changes(in);
}

void FractureRecord::read_account(ByteReader& in) {
  gains_ = in.value<std::int64_t>();
  gained_ = in.value<double>();
  inside_out_ = in.value<std::int64_t>();
  held_ = in.value<std::int64_t>();
}

void FractureRecord::read(Terms& terms, ByteReader& in) {
  read_account(in);
  terms.restore_bonds_of_all(read_changes(in));
}

}  // namespace perikit
