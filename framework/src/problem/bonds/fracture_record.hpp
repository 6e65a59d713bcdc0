#pragma once
/// The bonds of a problem and their account: which fail, and what that does to the energies.

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "perikit/problem/state.hpp"
#include "terms/terms.hpp"

namespace perikit {

class FractureRecord {
 public:
  /// Null: bonds never fail.
  explicit FractureRecord(std::unique_ptr<const BodyDamage> damage = nullptr) : damage_(std::move(damage)) {}

  /// Null where bonds never fail.
  const BodyDamage* damage() const noexcept { return damage_.get(); }
  /// Lets bonds of `terms` fail at displacements as they see them; energies of the state follow. The rest: see Terms.
  BondUpdate update(Terms& terms, const Configuration& at, double elapsed, State& state, const StepInside& step);
  /// Likewise lets bonds weaken to what they are at `forecast`. True when some did.
  bool weaken(Terms& terms, const Configuration& at, ConstFieldView forecast, State& state);
  /// How bonds failed so far, in words; empty where they never fail.
  std::string summary(const BondChecks& checks, double dissipated) const;

  // Run state of all ranks, a piece at a time. All ranks must call what is here, and read the same.
  /// Bytes that `write` makes.
  std::uint64_t written(const Terms& terms) const;
  /// To rank 0; what the others write is worth nothing.
  void write(const Terms& terms, ByteWriter& out) const;
  void read(Terms& terms, ByteReader& in);
  /// Of what `write` made, the bonds alone: use(some of them) until all have come.
  static void read_bonds(ByteReader& in, const std::function<void(std::span<const NamedChange>)>& use);

  // The same of this rank alone, with its ghosts.
  void write_here(const Terms& terms, ByteWriter& out) const;
  void read_here(Terms& terms, ByteReader& in);

 private:
  void write_account(ByteWriter& out) const;
  void read_account(ByteReader& in);
  void account(const BondUpdate& update, State& state);

  std::unique_ptr<const BodyDamage> damage_;
  std::int64_t gains_ = 0;  ///< updates that raised the strain energy
  double gained_ = 0;       ///< what they added [J]
  std::int64_t inside_out_ = 0;  ///< see BondUpdate
  std::int64_t held_ = 0;        ///< likewise, of all updates
};

}  // namespace perikit
