#include "problem/saved/saved_state.hpp"

#include "families/families.hpp"
#include "fracture/fracture.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/errors.hpp"
#include "problem/saved/bond_record.hpp"
#include "problem/saved/history_record.hpp"

namespace perikit {

namespace {

/// Of snapshots, which begin with it; the first ones began with a stride, a multiple of 8.
constexpr std::uint64_t snapshot_format = 2;

std::uint64_t stride_of(ByteReader& in) {
  if (in.value<std::uint64_t>() != snapshot_format)
    throw InputError("the saved state has another layout than this version of perikit reads");
  return in.value<std::uint64_t>();
}

void expect_end(const ByteReader& in) {
  if (!in.done()) throw InputError("the saved state is damaged");
}

}  // namespace

void SavedState::write(const std::function<void(std::uint64_t)>& begin, const std::function<void(std::span<const std::byte>)>& next) const {
  const bool first = communicator().rank() == 0;
  const BondRecord bonds(fracture_);
  const HistoryRecord history(terms_);
  ByteWriter head;
  head.value(snapshot_format);
  head.value(static_cast<std::uint64_t>(points_.stride_of_all_ranks()));
  constraints_.write(head);
  const std::vector<std::byte> bytes = head.take();
  const std::uint64_t size = bytes.size() + bonds.written() + history.written() + state_.written();
  if (first) begin(size);
  ByteWriter out([&](std::span<const std::byte> piece) {
    if (first) next(piece);
  });
  out.bytes(bytes.data(), bytes.size());
  bonds.write(out);
  history.write(out);
  state_.write(out);
  out.finish();
}

void SavedState::read(ByteReader& in) {
  if (stride_of(in) != points_.stride_of_all_ranks()) throw InputError("the saved state belongs to another body");
  constraints_.read(in);
  BondRecord::read(in, fracture_);
  HistoryRecord::read(in, terms_);
  state_.read(in);
  expect_end(in);
}

std::vector<std::byte> SavedState::write_here() const {
  ByteWriter out;
  out.value(static_cast<std::uint64_t>(points_.stride()));
  constraints_.write(out);
  BondRecord::write_here(fracture_, out);
  HistoryRecord::write_here(terms_, out);
  state_.write_here(out);
  return out.take();
}

void SavedState::read_here(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  if (in.value<std::uint64_t>() != points_.stride()) throw InputError("the saved state belongs to another body");
  constraints_.read(in);
  BondRecord::read_here(in, fracture_);
  HistoryRecord::read_here(in, terms_);
  state_.read_here(in);
  expect_end(in);
}

Carried SavedState::carried_by(ByteReader& in) {
  stride_of(in);
  in.value<double>();  // of the constraints
  Carried carried;
  BondRecord::read_bonds(in, [&](std::span<const NamedChange> bonds) { carried.bonds += bonds.size(); });
  carried.history = HistoryRecord::count(in);
  return carried;
}

void SavedState::carry(ByteReader& in, const Families& families) {
  if (stride_of(in) != points_.stride_of_all_ranks()) throw InputError("the earlier run had another body");
  in.value<double>();            // of the constraints
  std::vector<BondChange> lost;  // of the bonds that cracks of this scene leave
  bool any = false;
  BondRecord::read_bonds(in, [&](std::span<const NamedChange> bonds) {
    any = true;
    for (const BondChange& change : SharedBonds(families.body()).inward(bonds))
      if (families.integrity(change.bond) > change.integrity) lost.push_back(change);
  });
  // On several ranks all of them restore, whoever has such bonds.
  if (fracture_ && (!lost.empty() || (points_.distributed() && any))) fracture_->restore(lost);
  HistoryRecord::read(in, terms_);
}

}  // namespace perikit
