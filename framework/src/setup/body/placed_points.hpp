#pragma once
/// The points of a body before it has images, as planes ask for them.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "body/partition/lattice_shares.hpp"
#include "body/partition/streamed_cloud.hpp"
#include "perikit/body/body.hpp"
#include "scene/scene.hpp"

namespace perikit {

class PlacedPoints {
 public:
  using OnePoint = CloudShares::OnePoint;
  using Visit = std::function<void(const OnePoint& point)>;

  virtual ~PlacedPoints() = default;
  const BodyFrame& frame() const noexcept { return frame_; }
  /// Null for clouds.
  virtual const Lattice* lattice() const noexcept = 0;
  /// Whether other ranks look at other points.
  virtual bool shared() const noexcept = 0;
  /// Those of a set that this rank looks at, in input order; together ranks look at all, or at all that can be outermost.
  virtual void over(const std::string& set, const Visit& visit) const = 0;
  /// Of a lattice: the number of the point of a set in a cell of it, or beyond it; -1: there is none.
  virtual std::int64_t at(const std::array<std::int64_t, 3>& cell, const std::string& set) const = 0;

 protected:
  explicit PlacedPoints(BodyFrame frame) : frame_(std::move(frame)) {}

 private:
  BodyFrame frame_;
};

/// Of a body that every rank has as a whole, which must outlive them; their numbers are those of the input.
std::shared_ptr<const PlacedPoints> placed_points(const Body& whole);

/// Of a lattice that no rank has as a whole: their numbers are those of the cells of the input, x fastest. inside: empty where
/// all cells have a point. The scene must outlive them. Sets are those that faces are of, and "all". All ranks must call it.
/// Throws InputError for listed points that do not exist.
std::shared_ptr<const PlacedPoints> placed_points(const Scene& scene, const Lattice& lattice, const Inside& inside);

/// The same of a cloud that no rank has as a whole: this rank's run of its points, or all of them; their numbers are those of the
/// input.
std::shared_ptr<const PlacedPoints> placed_points(const Scene& scene, const BodyFrame& frame, PointStream points);

}  // namespace perikit
