#include "problem/bonds/near_bonds.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "body/family_limit.hpp"
#include "families/cloud/cloud_families.hpp"
#include "families/lattice/lattice_families.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/simd.hpp"
#include "problem/body_problem.hpp"

namespace perikit {

namespace {

/// Of the longest bonds that count as bonds between neighbours, over the spacing: the diagonals of squares are among them.
constexpr double neighbours_within = 1.5;

/// The bits of the points p ... of a pack, p a multiple of nothing.
unsigned pack_bits(std::span<const std::uint8_t> bits, std::size_t p) noexcept {
  const std::size_t byte = p / 8, next = std::min(byte + 1, bits.size() - 1);
  return (bits[byte] | static_cast<unsigned>(bits[next]) << 8) >> p % 8 & ((1u << pack_width) - 1);
}

}  // namespace

NearBonds::NearBonds(const Families& families) : families_(families) {
  const Body& body = families.body();
  // Bonds between points of other ranks are theirs, too, and images have no displacement of their own.
  all_intact_ = !families.fails() && families.cut() == 0 && body.owned().size() == body.internal().size();
  const double reach = std::min(neighbours_within * body.spacing(), search_radius(body.horizon()));
  if (families.lattice()) {
    const int d = body.dimension();
    for (int c = d > 2 ? -1 : 0; c <= (d > 2 ? 1 : 0); ++c)
      for (int b = d > 1 ? -1 : 0; b <= (d > 1 ? 1 : 0); ++b)
        for (int a = -1; a <= 1; ++a) {
          const bool forward = c > 0 || (c == 0 && (b > 0 || (b == 0 && a > 0)));
          if (forward && std::sqrt(a * a + b * b + c * c) * body.spacing() <= reach) offsets_.push_back({a, b, c});
        }
    return;
  }
  // Bonds of clouds lie in the lists of both ends: those to the point with the higher number are kept.
  const CloudFamilies& cloud = *families.cloud();
  first_.assign(body.stride() + 1, 0);
  for (std::size_t p = 0; p < body.stride(); ++p) {
    first_[p] = static_cast<std::int32_t>(far_.size());
    if (!body.alive(p) || !body.owns(p) || body.image(p)) continue;
    const Point x = body.position(p);
    for (const std::int32_t q : cloud.neighbours(p)) {
      const auto far = static_cast<std::size_t>(q);
      const Point y = body.position(far);
      if (body.number(far) > body.number(p) && std::hypot(y[0] - x[0], y[1] - x[1], y[2] - x[2]) <= reach) far_.push_back(q);
    }
  }
  first_[body.stride()] = static_cast<std::int32_t>(far_.size());
}

void NearBonds::widen(Squares& range, double square, std::size_t p, std::size_t far) const {
  if (!(square < range.least || square > range.largest)) return;
  if (!(families_.integrity({static_cast<std::int32_t>(p), static_cast<std::int32_t>(far)}) > 0)) return;
  range.least = std::min(range.least, square);
  range.largest = std::max(range.largest, square);
}

template <int D>
NearBonds::Squares NearBonds::on_lattice(ConstFieldView u) const {
  const Body& body = families_.body();
  const Lattice& lattice = *body.lattice();
  std::vector<Squares> of_block((u.stride + 1023) / 1024);
  const auto alive = body.alive_bits();
  over_blocks(u.stride, [&](std::size_t begin, std::size_t end) {
    Squares range;
    for (const std::array<int, 3>& offset : offsets_) {
      const std::int64_t shift = lattice.shift(offset);
      double xi[3] = {}, length = 0;
      for (std::size_t k = 0; k < D; ++k) xi[lattice.axis[k]] = offset[k] * lattice.spacing;
      for (int c = 0; c < D; ++c) length += xi[c] * xi[c];
      Pack least(range.least), largest(range.largest);
      for (std::size_t p = begin; p < end; p += pack_width) {
        // Neighbours of points lie within the field, those of padding may not.
        unsigned lanes = pack_bits(alive, p);
        if (lanes != 0) lanes &= pack_bits(alive, p + static_cast<std::size_t>(shift));
        if (lanes == 0) continue;
        Pack square(0.0);
        for (int c = 0; c < D; ++c) {
          const double* const from = u.component(c) + p;
          const Pack y = Pack(xi[c]) + Pack::load(from + shift) - Pack::load(from);
          square += y * y;
        }
        // Stretch 1 in the lanes without a bond.
        const Pack excess = keep(static_cast<std::uint8_t>(lanes), square * Pack(1 / length) - Pack(1.0));
        if (all_intact_) {
          least = min(least, Pack(1.0) + excess);
          largest = max(largest, Pack(1.0) + excess);
          continue;
        }
        lanes &= lane_bits((Pack(1.0) + excess < Pack(range.least)) | (Pack(1.0) + excess > Pack(range.largest)));
        if (lanes == 0) continue;
        double values[pack_width];
        excess.store(values);
        for (; lanes != 0; lanes &= lanes - 1) {
          const auto lane = static_cast<std::size_t>(std::countr_zero(lanes));
          const std::size_t q = p + lane;
          if (body.owns(q) && !body.image(q)) widen(range, 1 + values[lane], q, q + static_cast<std::size_t>(shift));
        }
      }
      if (!all_intact_) continue;
      double values[pack_width];
      least.store(values);
      range.least = *std::ranges::min_element(values);
      largest.store(values);
      range.largest = *std::ranges::max_element(values);
    }
    of_block[begin / 1024] = range;
  });
  Squares all;
  for (const Squares& range : of_block) all = {std::min(all.least, range.least), std::max(all.largest, range.largest)};
  return all;
}

template <int D>
NearBonds::Squares NearBonds::on_cloud(ConstFieldView u) const {
  const double* const rows = families_.body().rows().data();
  std::vector<Squares> of_block((u.stride + 1023) / 1024);
  over_blocks(u.stride, [&](std::size_t begin, std::size_t end) {
    Squares range;
    for (std::size_t p = begin; p < end; ++p)
      for (std::int32_t k = first_[p]; k < first_[p + 1]; ++k) {
        const auto far = static_cast<std::size_t>(far_[static_cast<std::size_t>(k)]);
        double now = 0, before = 0;
        for (std::size_t c = 0; c < D; ++c) {
          const double xi = rows[4 * far + c] - rows[4 * p + c];
          const double y = xi + u.component(static_cast<int>(c))[far] - u.component(static_cast<int>(c))[p];
          before += xi * xi;
          now += y * y;
        }
        widen(range, now / before, p, far);
      }
    of_block[begin / 1024] = range;
  });
  Squares all;
  for (const Squares& range : of_block) all = {std::min(all.least, range.least), std::max(all.largest, range.largest)};
  return all;
}

StretchRange NearBonds::stretches(ConstFieldView u) const {
  const auto of = [&]<int D>() { return families_.lattice() ? on_lattice<D>(u) : on_cloud<D>(u); };
  const int d = families_.body().dimension();
  const Squares squares = d == 1 ? of.operator()<1>() : d == 2 ? of.operator()<2>() : of.operator()<3>();
  return {-communicator().largest(-std::sqrt(squares.least)), communicator().largest(std::sqrt(squares.largest))};
}

StretchRange BodyProblem::stretches(ConstFieldView u) {
  if (!near_bonds_) near_bonds_ = std::make_unique<NearBonds>(*parts_.families);
  return near_bonds_->stretches(seen(u, seen_));
}

}  // namespace perikit
