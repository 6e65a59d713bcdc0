#pragma once
/// The points of a problem, of whatever body: fields hold one body after the other, each with the padding that it has alone. One body is the
/// common case, and then all of this is what the body has.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "perikit/body/body.hpp"

namespace perikit {

class Points {
 public:
  /// The points of one body, which must outlive them.
  Points(const Body& body);
  /// Those of several bodies of one space, which must outlive them. Either all of them are parts of bodies that lie on several ranks, or none.
  explicit Points(std::vector<const Body*> bodies);

  /// A body, and where its points begin.
  struct Slice {
    const Body* body;
    std::size_t first;            ///< in fields: a multiple of `padding`
    std::size_t first_place;      ///< in fields over the points of all ranks
    std::int64_t first_number;    ///< in the input
    /// The points of the body in a field, with the components as far apart as they are there: not to be taken as one piece of memory.
    FieldView of(FieldView field) const noexcept { return {field.data + first, field.stride, field.components}; }
    ConstFieldView of(ConstFieldView field) const noexcept { return {field.data ? field.data + first : nullptr, field.stride, field.components}; }
  };
  std::span<const Slice> slices() const noexcept { return slices_; }
  /// The slice that holds a point, by its index in fields.
  const Slice& slice_of(std::size_t p) const noexcept {
    const Slice* slice = &slices_.back();
    while (p < slice->first) --slice;
    return *slice;
  }

  Space space() const noexcept { return slices_.front().body->space(); }
  int dimension() const noexcept { return perikit::dimension(space()); }
  std::size_t stride() const noexcept { return stride_; }
  /// A field with the margins that the kernels need.
  Field make_field(int components) const { return Field(components, stride_, field_margin); }
  /// The least of the bodies [m].
  double spacing() const noexcept { return spacing_; }
  /// Whether every body is a lattice.
  bool on_lattices() const noexcept;

  /// Indices in fields of the points that are no padding, with ghosts and images; and of those that are neither: the points of this rank alone.
  std::span<const std::int32_t> live() const noexcept { return several_ ? std::span<const std::int32_t>(several_->live) : slices_.front().body->internal(); }
  std::span<const std::int32_t> owned() const noexcept { return several_ ? std::span<const std::int32_t>(several_->owned) : slices_.front().body->owned(); }
  std::size_t size() const noexcept { return live().size(); }
  /// On all ranks, without images.
  std::size_t size_on_all_ranks() const noexcept { return size_on_all_ranks_; }

  bool owns(std::size_t p) const noexcept { return slice_of(p).body->owns(p - slice_of(p).first); }
  bool image(std::size_t p) const noexcept { return slice_of(p).body->image(p - slice_of(p).first); }
  Point position(std::size_t p) const noexcept { return slice_of(p).body->position(p - slice_of(p).first); }
  double volume(std::size_t p) const noexcept { return slice_of(p).body->volume(p - slice_of(p).first); }
  /// Input numbers on all ranks, body after body; not of images.
  std::int64_t number(std::size_t p) const noexcept { return slice_of(p).first_number + slice_of(p).body->number(p - slice_of(p).first); }
  std::vector<std::int64_t> numbers(std::span<const std::int32_t> points) const;

  /// Where the points lie in fields over the points of all ranks; the places are empty where this rank has all.
  Places places() const noexcept {
    if (!distributed()) return {};
    return {several_ ? std::span<const std::int64_t>(several_->places) : slices_.front().body->places().place, stride_of_all_ranks_};
  }
  /// Whether other ranks have some of the points.
  bool distributed() const noexcept { return slices_.front().body->part(); }
  std::size_t stride_of_all_ranks() const noexcept { return stride_of_all_ranks_; }

 private:
  struct Several {
    std::vector<std::int32_t> live, owned;
    std::vector<std::int64_t> places;
  };

  std::vector<Slice> slices_;
  std::size_t stride_ = 0, stride_of_all_ranks_ = 0, size_on_all_ranks_ = 0;
  double spacing_ = 0;
  std::shared_ptr<const Several> several_;   ///< null: one body
};

}  // namespace perikit
