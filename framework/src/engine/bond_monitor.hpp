#pragma once
/// Finds the bonds that fail without looking at all of them in every step, and yet at the very step where they fail.
///
/// A group of eight points knows its margin: how much longer the nearest of its bonds may still become. In every step each cell (some
/// neighbouring groups) bounds its increments of displacement by a box; two ends of a bond move apart by no more than the diagonal
/// of the box around its cell and the cells of the partners. A group is checked again when the sum of these diagonals has used up
/// its margin. Rigid motion uses up nothing.

#include <cstdint>
#include <span>
#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/engine/fracture.hpp"

namespace perikit {

class BondMonitor {
 public:
  virtual ~BondMonitor() = default;
  /// Bonds whose integrity is lower at u than it is now, in a fixed order. To be called in every step.
  std::vector<BondChange> find(ConstFieldView u);
  /// Forgets all margins: bonds were restored.
  void forget();
  std::size_t groups() const noexcept { return groups_.size(); }
  std::size_t checked() const noexcept { return checked_; }
  std::size_t bytes() const noexcept;

 protected:
  /// Points first ... first + 7, those of the mask.
  struct Group {
    std::int32_t first;
    std::uint8_t live;
    std::int32_t item;           ///< whatever the derived class finds them by
  };
  /// skip = false: every group in every step, for comparison.
  BondMonitor(const Body& body, bool skip) : body_(body), skip_(skip), previous_(body.make_field(body.dimension())) {}
  /// Groups cell by cell; cell_first has one more entry than there are cells. partners[c]: cells of the far ends of the bonds of c, and c.
  void set_cells(std::vector<Group> groups, std::vector<std::size_t> cell_first, std::vector<std::vector<std::int32_t>> partners);
  /// Appends the bonds of the group that fail; returns the least extension that any other bond of it has left [m].
  virtual double check(const Group& group, ConstFieldView u, std::vector<BondChange>& changes) = 0;

  const Body& body_;

 private:
  void bound_motion(std::size_t cell, ConstFieldView u);
  double relative_motion(std::size_t cell) const noexcept;

  bool skip_;
  Field previous_;                                  ///< displacement at the last call
  std::vector<Group> groups_;
  std::vector<std::size_t> cell_first_;
  std::vector<std::vector<std::int32_t>> partners_;
  std::vector<double> margin_;                      ///< by group [m]
  std::vector<double> low_, high_;                  ///< increments by cell, 3 each
  std::vector<std::vector<BondChange>> found_;      ///< by cell
  std::vector<std::size_t> checks_;                 ///< by cell, of one call
  std::size_t checked_ = 0;
};

}  // namespace perikit
