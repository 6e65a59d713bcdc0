#include "body/images/cloud_images.hpp"

#include <algorithm>

#include "body/images/image_list.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

void CloudImages::add(const CloudShares::OnePoint& point, Points& images) const {
  Images made;
  maker_.add(point.x, point.number, 0, made);
  for (std::size_t k = 0; k < made.size(); ++k)
    images.push_back({made.position[k], made.volume[k] * point.volume, points_ + point.number * most_ + static_cast<std::int64_t>(k)});
}

PointStream CloudImages::with_images(PointStream points) const {
  return [this, points = std::move(points)](const auto& visit) {
    Points images;
    points([&](const CloudShares::OnePoint& point) {
      visit(point);
      images.clear();
      add(point, images);
      for (const CloudShares::OnePoint& image : images) visit(image);
    });
  };
}

Images CloudImages::of_part(const Body& part) const {
  Images found;
  found.cracks = part.cracks();
  Images made;
  std::int64_t of = -1;  // the source whose images `made` are
  for (const std::int32_t index : part.internal()) {
    const std::int64_t number = part.number(static_cast<std::size_t>(index));
    if (!image(number)) continue;
    const std::int32_t at = part.find(source(number));
    if (source(number) != of) {
      made = {};
      of = source(number);
      maker_.add(part.position(static_cast<std::size_t>(at)), of, 0, made);
      append_held(made, part.input_of(static_cast<std::size_t>(at)), found);
    }
    append_image(made, static_cast<std::size_t>((number - points_) % most_), part.input_of(static_cast<std::size_t>(at)), found);
  }
  return found;
}

std::int64_t most_images(const ImageMaker& maker, const PointStream& points, CloudImages::Points* with_images) {
  std::size_t most = 1;
  points([&](const CloudShares::OnePoint& point) {
    Images made;
    maker.add(point.x, point.number, 0, made);
    most = std::max(most, made.size());
    if (with_images && made.size() > 0) with_images->push_back(point);
  });
  return static_cast<std::int64_t>(communicator().largest(static_cast<double>(most)));
}

CloudImages::Finder finder_of_run(CloudShares::Points points_with_images, std::int64_t first) {
  return [runs = RunOwners(first), points = std::move(points_with_images)](const std::vector<std::int64_t>& numbers) {
    std::vector<std::vector<std::int64_t>> asked(static_cast<std::size_t>(communicator().size()));
    for (const std::int64_t number : numbers) asked[runs.owner(number)].push_back(number);
    std::vector<CloudShares::Points> answers;
    for (const std::vector<std::int64_t>& of_rank : exchanged(asked)) {
      CloudShares::Points& found = answers.emplace_back();
      for (const std::int64_t number : of_rank)
        found.push_back(*std::ranges::lower_bound(points, number, {}, &CloudShares::OnePoint::number));
    }
    CloudShares::Points all;
    for (const CloudShares::Points& of_rank : exchanged(answers)) all.insert(all.end(), of_rank.begin(), of_rank.end());
    return all;
  };
}

CloudImages::Finder finder_of_stream(PointStream points) {
  return [points = std::move(points)](const std::vector<std::int64_t>& numbers) {
    CloudShares::Points found;
    if (numbers.empty()) return found;
    points([&](const CloudShares::OnePoint& point) {
      if (std::ranges::binary_search(numbers, point.number)) found.push_back(point);
    });
    return found;
  };
}

}  // namespace perikit
