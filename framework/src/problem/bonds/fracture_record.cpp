#include "problem/bonds/fracture_record.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/ranks/merged_rows.hpp"
#include "perikit/core/warnings.hpp"
#include "problem/snapshot.hpp"

namespace perikit {

BondUpdate FractureRecord::update(Terms& terms, const Configuration& at, double elapsed, State& state, const StepInside& step) {
  BondUpdate update = terms.update_bonds(at, elapsed, step);
  account(update, state);
  return update;
}

bool FractureRecord::weaken(Terms& terms, const Configuration& at, ConstFieldView forecast, State& state) {
  const BondUpdate update = terms.weaken_bonds(at, forecast);
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
    text += named("second_law", fmt::format("warning       {} updates of bonds raised the strain energy, by {:.6g} J in all; the others took {:.6g} J",
                                            gains_, gained_, dissipated + gained_)) + "\n";
  }
  if (held_ > 0)
    text +=
        fmt::format("bonds held    {} times a bond beyond its limit stayed, as its failure would have created energy\n", held_);
  if (inside_out_ > 0) {
    text += named("inside_out", fmt::format("warning       {} times points were turned inside out where bonds failed: the energy and the impulse of these bonds are lost",
                                            inside_out_)) + "\n";
  }
  return text;
}

namespace {

/// Calls use(...) with all that `in` has of a list that follows its length, piece by piece.
template <class T>
void over_list(ByteReader& in, const std::function<void(std::span<const T>)>& use) {
  constexpr std::uint64_t most = 1 << 12;
  std::vector<T> piece;
  for (auto left = in.value<std::uint64_t>(); left > 0; left -= piece.size()) {
    in.expect(left, sizeof(T));
    piece.resize(std::min(most, left));
    in.bytes(piece.data(), piece.size() * sizeof(T));
    use(piece);
  }
}

}  // namespace

void FractureRecord::write_account(ByteWriter& out) const {
  out.value(gains_);
  out.value(gained_);
  out.value(inside_out_);
  out.value(held_);
}

void FractureRecord::read_account(ByteReader& in) {
  gains_ = in.value<std::int64_t>();
  gained_ = in.value<double>();
  inside_out_ = in.value<std::int64_t>();
  held_ = in.value<std::int64_t>();
}

std::uint64_t FractureRecord::written(const Terms& terms) const {
  const auto bonds = static_cast<std::uint64_t>(counted(std::ssize(terms.own_changed_bonds())).all);
  return sizeof gains_ + sizeof gained_ + sizeof inside_out_ + sizeof held_ + sizeof bonds + bonds * sizeof(NamedChange);
}

void FractureRecord::write(const Terms& terms, ByteWriter& out) const {
  write_account(out);
  const std::vector<NamedChange> mine = terms.own_changed_bonds();
  out.value(static_cast<std::uint64_t>(counted(std::ssize(mine)).all));
  over_merged(std::span(mine), [&](std::span<const NamedChange> bonds) { out.bytes(bonds.data(), bonds.size_bytes()); });
}

void FractureRecord::read_bonds(ByteReader& in, const std::function<void(std::span<const NamedChange>)>& use) {
  FractureRecord().read_account(in);
  over_list(in, use);
}

void FractureRecord::read(Terms& terms, ByteReader& in) {
  read_account(in);
  std::vector<BondChange> bonds;
  over_list<NamedChange>(in, [&](std::span<const NamedChange> of_all) {
    const std::vector<BondChange> here = terms.bonds_here(of_all);
    bonds.insert(bonds.end(), here.begin(), here.end());
  });
  terms.restore_bonds(bonds);
}

void FractureRecord::write_here(const Terms& terms, ByteWriter& out) const {
  write_account(out);
  const std::vector<BondChange> bonds = terms.changed_bonds();
  out.value(static_cast<std::uint64_t>(bonds.size()));
  out.bytes(bonds.data(), bonds.size() * sizeof(BondChange));
}

void FractureRecord::read_here(Terms& terms, ByteReader& in) {
  read_account(in);
  std::vector<BondChange> bonds;
  over_list<BondChange>(in, [&](std::span<const BondChange> piece) { bonds.insert(bonds.end(), piece.begin(), piece.end()); });
  terms.restore_bonds(bonds);
}

}  // namespace perikit
