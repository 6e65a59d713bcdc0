/// The values that a problem is composed of, without a scene: state and constraints.

#include "perikit/problem/state.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "perikit/core/errors.hpp"
#include "perikit/problem/constraints.hpp"
#include "perikit/problem/loads.hpp"
#include "problem/snapshot.hpp"

using namespace perikit;

namespace {

/// Points at x = 0, 1, 2, 3.
Body bar() {
  BodyFrame frame;
  frame.space = Space::line_strain;
  frame.spacing = 1;
  frame.horizon = 1.5;
  return Body(frame, std::vector<Point>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, std::vector<double>(4, 1.0));
}

SpaceTimeFunction constant(double value) {
  return {[=](const Point&, double) { return value; }};
}

}  // namespace

TEST_CASE("state: what is read is what was written, and what was not written is zero") {
  const Body body = bar();
  State one(body), two(body);
  one.time = 0.1;
  one.step = 7;
  one.energies.strain = 3;
  one.displacement().data[1] = 0.25;
  one.declare("temperature", 1).data[2] = 300;
  one.declare_numbers("plan", 2)[1] = 5;
  ByteWriter out;
  one.write(out);
  const FieldView u = two.displacement(), forgotten = two.declare("forgotten");
  forgotten.data[0] = 1;
  const std::vector<std::byte> bytes = out.take();
  ByteReader in(bytes);
  two.read(in);
  CHECK(in.done());
  CHECK(two.time == 0.1);
  CHECK(two.step == 7);
  CHECK(two.energies.strain == 3);
  CHECK(u.data[1] == 0.25);  // views stay valid
  CHECK(two.declare("temperature", 1).data[2] == 300);
  CHECK(two.declare_numbers("plan", 2)[1] == 5);
  CHECK(forgotten.data[0] == 0);
  ByteReader cut(std::span<const std::byte>(bytes).first(bytes.size() - 1));
  CHECK_THROWS_AS(two.read(cut), InputError);
  CHECK(bytes.size() == one.written());
}

TEST_CASE("state: bytes that go and come in pieces are those of one piece") {
  const Body body = bar();
  State one(body), two(body);
  for (double& x : std::span(one.displacement().data, one.displacement().size()))
    x = 0.5 + static_cast<double>(&x - one.displacement().data);
  std::vector<std::byte> bytes;
  int pieces = 0;
  ByteWriter out([&](std::span<const std::byte> piece) {
    bytes.insert(bytes.end(), piece.begin(), piece.end());
    ++pieces;
  });
  one.write(out);
  const std::vector<double> large(300'000, 0.25);
  out.numbers(large);
  out.finish();
  CHECK(pieces > 2);
  CHECK(bytes.size() == one.written() + sizeof(std::uint64_t) + large.size() * sizeof(double));
  std::size_t at = 0;
  const auto seven = [&] {
    const std::size_t count = std::min<std::size_t>(7, bytes.size() - at);
    at += count;
    return std::vector<std::byte>(&bytes[at - count], &bytes[at - count] + count);
  };
  ByteReader in(bytes.size(), seven);
  two.read(in);
  CHECK(std::equal(one.displacement().data, one.displacement().data + one.displacement().size(), two.displacement().data));
  CHECK(in.value<std::uint64_t>() == large.size());
  std::vector<double> back(large.size());
  in.bytes(back.data(), back.size() * sizeof(double));
  CHECK(back == large);
  CHECK(in.done());
  CHECK_THROWS_AS(in.value<char>(), InputError);
  at = 0;
  ByteReader longer(bytes.size() + 9, seven);
  two.read(longer);
  CHECK_THROWS_AS(longer.bytes(std::vector<std::byte>(bytes.size()).data(), bytes.size() + 9 - one.written()), InputError);
}

TEST_CASE("constraints: the last prescription governs a component of a point") {
  const Body body = bar();
  const auto p = [&](std::size_t n) { return body.internal()[n]; };
  Prescription ends{.value = constant(1), .points = {p(0), p(3)}}, upper{.value = constant(0), .points = {p(3)}};
  upper.value.ramps = ends.value.ramps = true;
  const Constraints constraints(body, {ends, upper});
  Field u = body.make_field(1);
  u.fill(9);
  constraints.prescribe_displacement(0.5, u);
  CHECK(u.data()[p(0)] == 0.5);
  CHECK(u.data()[p(1)] == 9);
  CHECK(u.data()[p(3)] == 0);
  CHECK(constraints.dofs().size() == 2);
  CHECK(constraints.points_held_at_rest() == 1);
  CHECK(constraints.free().data[p(1)] == 1);
  CHECK(constraints.free().data[p(3)] == 0);
}

TEST_CASE("constraints: velocities of a half step reach the prescribed displacement, also from one that is off") {
  const Body body = bar();
  const std::int32_t p = body.internal()[0];
  Constraints constraints(body, {{.value = {[](const Point&, double t) { return t * t; }, false, true}, .points = {p}}});
  Field u = body.make_field(1), v = body.make_field(1);
  u.data()[p] = 0.5;
  constraints.prescribe_half_step_velocity(1.0, 1.25, u, v);
  CHECK(u.data()[p] + 0.25 * v.data()[p] == doctest::Approx(1.5625).epsilon(1e-15));
  constraints.prescribe_velocity(1.0, v);
  CHECK(v.data()[p] == doctest::Approx(2).epsilon(1e-9));
  constraints.prescribe_acceleration(1.0, v);
  CHECK(v.data()[p] == doctest::Approx(2).epsilon(1e-12));
}

TEST_CASE("loads: shares times values, summed over loads, ramped where they say so") {
  const Body body = bar();
  const auto p = [&](std::size_t n) { return body.internal()[n]; };
  Load everywhere{{{0, constant(4)}}, {p(0), p(1), p(2), p(3)}, {1, 1, 1, 1}};
  everywhere.components[0].value.ramps = true;
  const Load linear{{{0, {[](const Point& x, double) { return x[0]; }, true}}}, {p(2)}, {0.5}};
  const Loads loads(body, {everywhere, linear});
  Field force = body.make_field(1);
  loads.evaluate(0.25, force);
  CHECK(force.data()[p(1)] == 1);
  CHECK(force.data()[p(2)] == 2);
  CHECK(loads.depend_on_time());
  CHECK(!Loads(body, {linear}).depend_on_time());
}
