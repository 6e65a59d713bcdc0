#include "problem/saved/saved_state.hpp"

#include "families/families.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/errors.hpp"
#include "problem/bonds/fracture_record.hpp"
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
  const HistoryRecord history(terms_);
  ByteWriter head;
  head.value(snapshot_format);
  head.value(static_cast<std::uint64_t>(points_.stride_of_all_ranks()));
  constraints_.write(head);
  const std::vector<std::byte> bytes = head.take();
  const std::uint64_t size = bytes.size() + fracture_.written(terms_) + history.written() + state_.written();
  if (first) begin(size);
  ByteWriter out([&](std::span<const std::byte> piece) {
    if (first) next(piece);
  });
  out.bytes(bytes.data(), bytes.size());
  fracture_.write(terms_, out);
  history.write(out);
  state_.write(out);
  out.finish();
}

void SavedState::read(ByteReader& in) {
  if (stride_of(in) != points_.stride_of_all_ranks()) throw InputError("the saved state belongs to another body");
  constraints_.read(in);
  fracture_.read(terms_, in);
  HistoryRecord::read(in, terms_);
  state_.read(in);
  expect_end(in);
}

std::vector<std::byte> SavedState::write_here() const {
  ByteWriter out;
  out.value(static_cast<std::uint64_t>(points_.stride()));
  constraints_.write(out);
  fracture_.write_here(terms_, out);
  HistoryRecord::write_here(terms_, out);
  state_.write_here(out);
  return out.take();
}

void SavedState::read_here(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  if (in.value<std::uint64_t>() != points_.stride()) throw InputError("the saved state belongs to another body");
  constraints_.read(in);
  fracture_.read_here(terms_, in);
  HistoryRecord::read_here(in, terms_);
  state_.read_here(in);
  expect_end(in);
}

Carried SavedState::carried_by(ByteReader& in) {
  stride_of(in);
  in.value<double>();  // of the constraints
  Carried carried;
  FractureRecord::read_bonds(in, [&](std::span<const NamedChange> bonds) { carried.bonds += bonds.size(); });
  carried.history = HistoryRecord::count(in);
  return carried;
}

void SavedState::carry(ByteReader& in, const Families& families) {
  if (stride_of(in) != points_.stride_of_all_ranks()) throw InputError("the earlier run had another body");
  in.value<double>();            // of the constraints
  std::vector<BondChange> lost;  // of the bonds that cracks of this scene leave
  bool any = false;
  FractureRecord::read_bonds(in, [&](std::span<const NamedChange> bonds) {
    any = true;
    for (const BondChange& change : terms_.bonds_here(bonds))
      if (families.integrity(change.bond) > change.integrity) lost.push_back(change);
  });
  // On several ranks all of them restore, whoever has such bonds.
  if (!lost.empty() || (points_.distributed() && any)) terms_.restore_bonds(lost);
  HistoryRecord::read(in, terms_);
}

}  // namespace perikit
