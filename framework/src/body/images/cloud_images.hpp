#pragma once
/// Images of the points of a cloud that no rank has as a whole. They are made of their sources, by whoever has these.

#include <cstdint>
#include <functional>
#include <vector>

#include "body/partition/streamed_cloud.hpp"
#include "perikit/body/images.hpp"

namespace perikit {

class CloudImages {
 public:
  using Points = CloudShares::Points;
  /// Points with these numbers, which ascend. All ranks must call it.
  using Finder = std::function<Points(const std::vector<std::int64_t>& numbers)>;
  /// points: of the cloud, without images; most: images of a point; find: of those that have any.
  CloudImages(const ImageMaker& maker, std::int64_t points, std::int64_t most, Finder find)
      : maker_(maker), points_(points), most_(most), find_(std::move(find)) {}

  /// Appends those of a point. Their numbers come after those of all points, ascending by sources.
  void add(const CloudShares::OnePoint& point, Points& images) const;
  bool image(std::int64_t number) const noexcept { return number >= points_; }
  std::int64_t source(std::int64_t number) const noexcept { return (number - points_) / most_; }
  std::int64_t points() const noexcept { return points_; }
  /// Of images, by their numbers; each once.
  Points sources(const std::vector<std::int64_t>& numbers) const { return find_(numbers); }
  /// The points of a stream, and their images with them, which must outlive it.
  PointStream with_images(PointStream points) const;
  /// Those that a part of the body has, by the numbers of the part.
  Images of_part(const Body& part) const;

 private:
  const ImageMaker& maker_;
  std::int64_t points_, most_;
  Finder find_;
};

/// How many images a point has at most, on whatever rank, where this one goes through these points; with_images (null: not wanted):
/// gets those of them that have any. All ranks must call it.
std::int64_t most_images(const ImageMaker& maker, const PointStream& points, CloudImages::Points* with_images = nullptr);

/// Finds points that it has been shown: each rank those of its own run of the input.
CloudImages::Finder finder_of_run(CloudShares::Points points_with_images, std::int64_t first);
/// Finds points by going through all of them.
CloudImages::Finder finder_of_stream(PointStream points);

}  // namespace perikit
