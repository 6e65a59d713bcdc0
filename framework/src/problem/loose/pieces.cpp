#include "problem/loose/pieces.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>

#include "core/each_once.hpp"
#include "perikit/core/rank_values.hpp"
#include "perikit/problem/image_map.hpp"

namespace perikit {

namespace {

/// Which of so many things belong together.
class Parts {
 public:
  explicit Parts(std::size_t things) : above_(things) { std::iota(above_.begin(), above_.end(), 0); }
  std::int32_t of(std::int32_t p) {
    while (above_[static_cast<std::size_t>(p)] != p) {
      std::int32_t& above = above_[static_cast<std::size_t>(p)];
      above = above_[static_cast<std::size_t>(above)];
      p = above;
    }
    return p;
  }
  void join(std::int32_t p, std::int32_t q) {
    p = of(p);
    q = of(q);
    above_[static_cast<std::size_t>(std::max(p, q))] = std::min(p, q);
  }

 private:
  std::vector<std::int32_t> above_;
};

/// What decides on the place of a piece among all: the same order as that of comes_before.
struct Place {
  std::int64_t count_below_zero, first;
  auto operator<=>(const Place&) const = default;
};

/// Pieces of one rank that are parts of one: `other` holds the lowest number of a point of the other part, on its rank.
struct Link {
  std::int64_t mine, other;
};

/// What the pieces are called that have parts on several ranks: by the lowest number of a part that of the whole. All ranks must call it.
std::map<std::int64_t, std::int64_t> names_of_parts(const std::vector<Link>& links) {
  const std::vector<Link> all = gathered(std::span(links));
  std::vector<std::int64_t> numbers;
  for (const Link& link : all) {
    numbers.push_back(link.mine);
    numbers.push_back(link.other);
  }
  keep_each_once(numbers);
  const auto index = [&](std::int64_t number) { return static_cast<std::int32_t>(std::ranges::lower_bound(numbers, number) - numbers.begin()); };
  Parts parts(numbers.size());
  for (const Link& link : all) parts.join(index(link.mine), index(link.other));
  std::vector<Link> names;
  for (const std::int64_t number : numbers)
    names.push_back({number, numbers[static_cast<std::size_t>(parts.of(index(number)))]});
  std::map<std::int64_t, std::int64_t> name_of;
  for (const Link& name : told_to_all(names)) name_of[name.mine] = name.other;
  return name_of;
}

/// The pieces of which this rank has points, which `parts` joins; without their counts.
std::vector<Piece> joined_over_ranks(const Body& body, Parts& parts, Problem& problem) {
  constexpr std::int64_t none = std::numeric_limits<std::int64_t>::max();
  std::vector<std::int64_t> first(body.stride(), none);  // by the point that the part leads to
  const auto first_of = [&](std::int32_t p) -> std::int64_t& { return first[static_cast<std::size_t>(parts.of(p))]; };
  for (const std::int32_t p : body.owned()) first_of(p) = std::min(first_of(p), body.number(static_cast<std::size_t>(p)));
  std::map<std::int64_t, std::int64_t> name_of;
  if (communicator().size() > 1) {
    Field at_owners = body.make_field(1);
    for (const std::int32_t p : body.owned()) at_owners.data()[p] = static_cast<double>(first_of(p));
    problem.share(at_owners);
    std::vector<Link> links;
    for (const std::int32_t p : body.internal()) {
      const auto point = static_cast<std::size_t>(p);
      if (!body.owns(point) && !body.image(point) && first_of(p) != none) links.push_back({first_of(p), static_cast<std::int64_t>(at_owners.data()[p])});
    }
    const auto both = [](const Link& link) { return std::pair(link.mine, link.other); };
    keep_each_once(links, both);
    name_of = names_of_parts(links);
  }
  std::map<std::int64_t, std::size_t> place;  // by name
  std::vector<Piece> pieces;
  for (const std::int32_t p : body.owned()) {
    const auto found = name_of.find(first_of(p));
    const std::int64_t name = found == name_of.end() ? first_of(p) : found->second;
    const auto [piece, fresh] = place.try_emplace(name, pieces.size());
    if (fresh) {
      pieces.emplace_back().first = name;
      pieces.back().shared = found != name_of.end();
    }
    pieces[piece->second].points.push_back(p);
  }
  for (Piece& piece : pieces) std::ranges::sort(piece.points);
  return pieces;
}

}  // namespace

Sources::Sources(const Body& body, const ImageMap* images) : source(body.stride(), -1) {
  if (!images) return;
  Field number = body.make_field(1);
  sign = body.make_field(body.dimension());
  for (const std::int32_t p : body.internal()) {
    if (body.image(static_cast<std::size_t>(p))) continue;
    number.data()[p] = p;
    for (int c = 0; c < body.dimension(); ++c) sign.component(c)[p] = 1;
  }
  images->copy_from_sources(number);
  images->extend(sign);
  for (const std::int32_t p : body.internal())
    if (body.image(static_cast<std::size_t>(p))) source[static_cast<std::size_t>(p)] = static_cast<std::int32_t>(number.data()[p]);
}

void add_up_over_ranks(std::size_t count, const std::function<const Piece&(std::size_t)>& pieces, std::size_t width, std::span<double> values) {
  if (communicator().size() == 1) return;
  std::vector<double> mine;  // of each piece its number, which a double holds, and the values
  for (std::size_t k = 0; k < count; ++k) {
    if (!pieces(k).shared) continue;
    mine.push_back(static_cast<double>(pieces(k).first));
    mine.insert(mine.end(), values.begin() + k * width, values.begin() + (k + 1) * width);
  }
  const std::vector<double> all = gathered<double>(mine);
  std::map<double, std::vector<double>> sums;
  for (std::size_t k = 0; k < all.size(); k += width + 1) {
    std::vector<double>& sum = sums.try_emplace(all[k], width, 0.0).first->second;
    for (std::size_t i = 0; i < width; ++i) sum[i] += all[k + 1 + i];
  }
  std::vector<double> told;
  for (const auto& [number, sum] : sums) {
    told.push_back(number);
    told.insert(told.end(), sum.begin(), sum.end());
  }
  told = told_to_all(told);
  std::map<double, std::size_t> place;
  for (std::size_t k = 0; k < told.size(); k += width + 1) place[told[k]] = k + 1;
  for (std::size_t k = 0; k < count; ++k)
    if (pieces(k).shared) std::copy_n(told.begin() + place.at(static_cast<double>(pieces(k).first)), width, values.begin() + k * width);
}

std::vector<Piece> find_pieces(const Families& families, Problem& problem, const Sources& sources, std::vector<BondedImage>* bonded_images) {
  const Body& body = families.body();
  Parts parts(body.stride());
  FamilyArrays family;
  for (const std::int32_t p : body.owned()) {
    families.load(static_cast<std::size_t>(p), BondsOf::intact, family);
    for (int k = 0; k < family.bonds; ++k) {
      const std::int32_t q = family.far[static_cast<std::size_t>(k)], source = sources.source[static_cast<std::size_t>(q)];
      parts.join(p, source >= 0 ? source : q);
      if (source >= 0 && bonded_images) bonded_images->emplace_back(q, p);
    }
  }
  if (bonded_images) {
    std::ranges::sort(*bonded_images);
    drop_repeated(*bonded_images, &BondedImage::first);
  }
  std::vector<Piece> pieces = joined_over_ranks(body, parts, problem);
  std::vector<double> counts;
  for (const Piece& piece : pieces) counts.push_back(static_cast<double>(piece.points.size()));
  add_up_over_ranks(pieces.size(), [&](std::size_t k) -> const Piece& { return pieces[k]; }, 1, counts);
  for (std::size_t k = 0; k < pieces.size(); ++k) pieces[k].count = static_cast<std::int64_t>(counts[k]);
  return pieces;
}

bool comes_before(const Piece& a, const Piece& b) { return a.count != b.count ? a.count > b.count : a.first < b.first; }

bool speaks_for(const Piece& piece, const Body& body) {
  return std::ranges::any_of(piece.points, [&](std::int32_t p) { return body.number(static_cast<std::size_t>(p)) == piece.first; });
}

Field piece_numbers(const Families& families, Problem& problem) {
  const Body& body = families.body();
  const std::vector<Piece> mine = find_pieces(families, problem, Sources(body, problem.images()));
  std::vector<Place> all;   // of each piece, from the rank that speaks for it
  for (const Piece& piece : mine)
    if (speaks_for(piece, body)) all.push_back({-piece.count, piece.first});
  all = told_to_all(gathered(std::span<const Place>(all)));
  std::ranges::sort(all);
  Field numbers = body.make_field(1);
  for (const Piece& piece : mine) {
    const auto number = std::ranges::lower_bound(all, Place{-piece.count, piece.first}) - all.begin() + 1;
    for (const std::int32_t p : piece.points) numbers.data()[p] = static_cast<double>(number);
  }
  return numbers;
}

}  // namespace perikit
