#pragma once
/// All that a run continues from: the last step of prescribed motion, bonds, what laws remember, and the state. As bytes, and back, bit for bit.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "perikit/problem/constraints.hpp"
#include "perikit/problem/state.hpp"
#include "problem/snapshot.hpp"
#include "terms/terms.hpp"

namespace perikit {

class Families;
class Fracture;

/// What a snapshot of another run holds of its bonds and of the history of its laws: bonds that are not as they were at its set-up, and
/// numbers of history.
struct Carried {
  std::size_t bonds = 0, history = 0;
};

class SavedState {
 public:
  /// All of them must outlive this. fracture: null where bonds never fail.
  SavedState(const Points& points, Constraints& constraints, Fracture* fracture, Terms& terms, State& state)
      : points_(points), constraints_(constraints), fracture_(fracture), terms_(terms), state_(state) {}

  /// Of this rank alone. All ranks must call read_here, and everything below; what reads throws InputError for what belongs to another problem.
  std::vector<std::byte> write_here() const;
  void read_here(std::span<const std::byte> bytes);
  /// Of all ranks, on rank 0: begin(how many bytes), then next(some of them) until all are out. Nobody has all points of all ranks at once, and
  /// any number of ranks may read them.
  void write(const std::function<void(std::uint64_t size)>& begin, const std::function<void(std::span<const std::byte>)>& next) const;
  void read(ByteReader& in);

  static Carried carried_by(ByteReader& in);
  /// Takes bonds and history of another run of the same points, families and laws, and nothing else.
  void carry(ByteReader& in, const Families& families);

 private:
  const Points& points_;
  Constraints& constraints_;
  Fracture* fracture_;
  Terms& terms_;
  State& state_;
};

}  // namespace perikit
