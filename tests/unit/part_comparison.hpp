#pragma once
/// Compares the parts of a body that ranks place by themselves with those that they cut out of the whole body.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <string>
#include <vector>

#include "body/partition/block_colours.hpp"
#include "setup/body/body.hpp"
#include "setup/body/local_body.hpp"
#include "setup/body/several_ranks.hpp"
#include "setup/surfaces/image_planes.hpp"
#include "tests/kit/scene_text.hpp"
#include "tests/thread_ranks.hpp"
#include "unit/cut_part.hpp"
#include "unit/fake_catalogue.hpp"

namespace perikit::test {

/// A lattice from the origin to `upper`, with further keys.
inline std::string lattice(int dimension, const std::string& upper, const std::string& inside, const std::string& keys = "") {
  const std::string lower = dimension == 3 ? "[0, 0, 0]" : dimension == 2 ? "[0, 0]" : "[0]";
  return fmt::format("[body.lattice]\nspacing = 1.0\nlower = {}\nupper = {}\n{}\n{}\n", lower, upper,
                     inside.empty() ? "" : fmt::format("inside = \"{}\"", inside), keys);
}

inline std::string scene_text(int dimension, const std::string& body, const std::string& sets, const std::string& family = "horizon_ratio = 2.015") {
  return SceneText{.dimension = dimension, .body = body, .sets = sets, .family = family,
                   .further = "[[region]]\nset = \"low\"\nmaterial = { type = \"neo_hookean\", shear_modulus = 2.0, bulk_modulus = 2.0 }\n"
                              "[[region]]\nset = \"some\"\nmaterial = { type = \"neo_hookean\", shear_modulus = 3.0, bulk_modulus = 2.0 }\n",
                   .integrator = "newton"};
}

/// Of each rank: expressions are evaluated by one thread at a time.
inline Scene parsed(const std::string& text) {
  FakeCatalogue parts;
  return parse_scene(text, "body.toml", parts);
}

template <class A, class B>
bool same(const A& a, const B& b) {
  return std::ranges::equal(a, b);
}

/// The colours that blocks have on one rank, by block of the whole body.
inline std::vector<std::int32_t> colours_of_whole(const Body& whole) {
  const std::size_t blocks = (whole.points() + whole.block_points() - 1) / whole.block_points();
  FreeColours free((whole.points() + colour_unit - 1) / colour_unit);
  std::vector<std::int32_t> colours;
  for (const std::vector<std::int32_t>& units : block_reach(whole, colour_unit, 0, blocks)) colours.push_back(free.next(std::span(units)));
  return colours;
}

inline void compare_colours(const Body& part, const Body& whole) {
  const std::vector<std::int32_t> expected = colours_of_whole(whole), &found = part.block_colours();
  const std::size_t block = whole.block_points();
  REQUIRE(part.block_points() == block);
  REQUIRE(found.size() == (part.points() + block - 1) / block);
  bool right = true;
  for (std::size_t b = 0; b < found.size(); ++b)
    right = right && found[b] == expected[static_cast<std::size_t>(part.places().place[b * block]) / block];
  CHECK(right);
}

inline bool same_terms(const Images& a, const Images& b) {
  return std::ranges::equal(a.terms, b.terms, [](const ImageTerm& one, const ImageTerm& other) {
    return one.image == other.image && one.component == other.component && one.motion == other.motion &&
           one.factor == other.factor && one.at == other.at && one.surface == other.surface;
  });
}

/// What all ranks say is wrong when each of them calls `check`.
template <class Check>
std::string message_on(int ranks, const Check& check) {
  std::mutex one;
  std::vector<std::string> said;
  on_ranks(ranks, [&](ThreadRank&) {
    const std::string what = message_of<InputError>(check);
    const std::lock_guard lock(one);
    said.push_back(what);
  });
  for (const std::string& what : said) CHECK(what == said.front());
  return said.front();
}

inline void compare_images(const Images& found, const Images& expected) {
  CHECK(found.source == expected.source);
  CHECK(found.sign == expected.sign);
  CHECK(found.volume == expected.volume);
  CHECK(same_terms(found, expected));
  CHECK(std::ranges::equal(found.held, expected.held, [](const HeldPoint& one, const HeldPoint& other) {
    return one.point == other.point && one.component == other.component && one.motion == other.motion;
  }));
  CHECK(found.cracks.size() == expected.cracks.size());
}

inline void compare(const std::string& text, int ranks, const Partition::Reach& reach) {
  INFO(ranks, " ranks, ", reach.bonds, " bonds", std::string(reach.blocks ? ", whole blocks" : ""));
  std::mutex one;
  std::int64_t points = 0, all = 0;
  constexpr std::uint16_t image_material = 3, far = 7;
  const Scene of_whole = parsed(text);
  Body whole = build_body(of_whole);
  Images images;
  if (has_images(of_whole)) {
    const ScenePlanes planes = build_planes(of_whole, placed_points(whole), false);
    images = make_images(whole, planes.planes, planes.surfaces);
    whole = Body(whole, images, image_material);
  }
  const Cut all_parts(whole, ranks, reach, images.source);
  on_ranks(ranks, [&](ThreadRank& rank) {
    const Scene scene = parsed(text);
    const CutPart cut = all_parts.part(rank.rank(), far);
    const Body& expected = cut.body;
    const LocalBody local = build_local_body(scene, reach, far, image_material);
    const std::lock_guard lock(one);
    CHECK(local.images.has_value() == has_images(scene));
    CHECK(local.partition->images() == images.size());
    if (local.images) compare_images(*local.images, images_of_part(images, expected));
    const Body& found = local.body;
    CHECK(same(found.internal(), expected.internal()));
    CHECK(found.stride() == expected.stride());
    CHECK(found.stride_of_all_ranks() == expected.stride_of_all_ranks());
    CHECK(found.points_of_all_ranks() == expected.points_of_all_ranks());
    CHECK(same(found.owned(), expected.owned()));
    CHECK(same(found.complete(), expected.complete()));
    CHECK(same(found.material_ids(), expected.material_ids()));
    CHECK(same(found.places().place, expected.places().place));
    CHECK(found.sets() == expected.sets());
    for (const auto& [name, members] : found.sets()) CHECK(same(found.order_of(name), expected.order_of(name)));
    CHECK(local.partition->points() == cut.points);
    CHECK(local.partition->lent() == cut.lent);
    CHECK(local.partition->borrowed() == cut.borrowed);
    CHECK(found.spacing() == expected.spacing());
    CHECK(found.horizon() == expected.horizon());
    if (!found.lattice()) compare_colours(found, whole);
    const bool same_points = std::ranges::all_of(found.internal(), [&](std::int32_t index) {
      const auto p = static_cast<std::size_t>(index);
      // Numbers of images ascend as they do in the whole body, and leave some out.
      return (found.number(p) == expected.number(p) || (found.image(p) && expected.image(p))) &&
             found.find(found.number(p)) == index && found.at_place(found.places().place[p]) == index &&
             found.position(p) == expected.position(p) && found.volume(p) == expected.volume(p) &&
             found.owns(p) == expected.owns(p);
    });
    CHECK(same_points);
    points += std::ssize(found.owned());
    all = static_cast<std::int64_t>(found.points_of_all_ranks());
  });
  CHECK(points == all);
  CHECK((images.size() > 0) == has_images(of_whole));
}

constexpr const char* cloud_sets =
    "low = \"x < 5.2\"\nsome = {{ nearest = {} }}\nlisted = {{ points = [90, 3, 250, 17] }}\nfew = {{ points = [2, 5] }}";

/// On 2, 3 and 5 ranks with all reaches.
inline void compare_all(const std::string& text) {
  for (const int ranks : {2, 3, 5})
    for (const Partition::Reach& reach : {Partition::Reach{2, false}, {3, false}, {2, true}, {3, true}})
      compare(text, ranks, reach);
}

}  // namespace perikit::test
