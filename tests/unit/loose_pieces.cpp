#include "problem/loose/loose_pieces.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/kit/registry.hpp"
#include "tests/kit/scene_text.hpp"

using namespace perikit;
using namespace perikit::test;

TEST_CASE("loose pieces: a force across their motion does not move them, whatever rounding has left of it along the motion") {
  const auto simulation = simulation_of(SceneText{.upper = {5, 4}});
  const Body& body = simulation->problem().body();
  std::vector<LoosePiece> pieces;
  Piece& whole = pieces.emplace_back(Piece{});
  whole.count = static_cast<std::int64_t>(body.points());
  Field at_rest = body.make_field(2), along_x = body.make_field(2), oblique = body.make_field(2);
  for (const std::int32_t p : body.internal()) {
    whole.points.push_back(p);
    along_x.component(0)[p] = oblique.component(0)[p] = 3e5;
    oblique.component(1)[p] = 1.0;
  }
  for (const double rounding : {0.0, 3e-17, -2e-17}) {
    pieces[0].motions = {{rounding, 1.0 / std::sqrt(static_cast<double>(body.points())), 0, 0, 0, 0}};   // along y
    CHECK(driven_piece(pieces, body, at_rest, along_x) == nullptr);
    CHECK(driven_piece(pieces, body, at_rest, oblique) == &pieces[0]);
  }
}
