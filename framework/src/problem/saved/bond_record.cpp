#include "problem/saved/bond_record.hpp"

#include <algorithm>

#include "core/ranks/merged_rows.hpp"

namespace perikit {

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

BondAccount account_of(const Fracture* fracture) { return fracture ? fracture->account() : BondAccount{}; }

void restore(Fracture* fracture, const BondAccount& account, std::span<const BondChange> bonds) {
  if (!fracture) return;
  fracture->account() = account;
  fracture->restore(bonds);
}

}  // namespace

BondRecord::BondRecord(const Fracture* fracture) : account_(account_of(fracture)) {
  if (fracture) mine_ = SharedBonds(fracture->families().body()).outward(fracture->families().changed());
  of_all_ = static_cast<std::uint64_t>(counted(std::ssize(mine_)).all);
}

std::uint64_t BondRecord::written() const noexcept { return sizeof account_ + sizeof of_all_ + of_all_ * sizeof(NamedChange); }

void BondRecord::write(ByteWriter& out) const {
  out.value(account_);
  out.value(of_all_);
  over_merged(std::span(mine_), [&](std::span<const NamedChange> bonds) { out.bytes(bonds.data(), bonds.size_bytes()); });
}

void BondRecord::read_bonds(ByteReader& in, const std::function<void(std::span<const NamedChange>)>& use) {
  in.value<BondAccount>();
  over_list(in, use);
}

void BondRecord::read(ByteReader& in, Fracture* fracture) {
  const auto account = in.value<BondAccount>();
  std::vector<BondChange> bonds;
  over_list<NamedChange>(in, [&](std::span<const NamedChange> of_all) {
    const std::vector<BondChange> here = fracture ? SharedBonds(fracture->families().body()).inward(of_all) : std::vector<BondChange>();
    bonds.insert(bonds.end(), here.begin(), here.end());
  });
  restore(fracture, account, bonds);
}

void BondRecord::write_here(const Fracture* fracture, ByteWriter& out) {
  out.value(account_of(fracture));
  const std::vector<BondChange> bonds = fracture ? fracture->families().changed() : std::vector<BondChange>();
  out.value(static_cast<std::uint64_t>(bonds.size()));
  out.bytes(bonds.data(), bonds.size() * sizeof(BondChange));
}

void BondRecord::read_here(ByteReader& in, Fracture* fracture) {
  const auto account = in.value<BondAccount>();
  std::vector<BondChange> bonds;
  over_list<BondChange>(in, [&](std::span<const BondChange> piece) { bonds.insert(bonds.end(), piece.begin(), piece.end()); });
  restore(fracture, account, bonds);
}

}  // namespace perikit
