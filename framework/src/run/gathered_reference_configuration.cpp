#include "run/gathered_reference_configuration.hpp"

#include <algorithm>

#include "core/ranks/numbered_rows.hpp"
#include "perikit/core/rank_values.hpp"
#include "run/gathering.hpp"

namespace perikit {

namespace {

constexpr std::size_t values_of_a_row = 5;  // of a point: its place, volume and material
constexpr auto piece_size = static_cast<std::int64_t>(rows_of_piece);

ReferenceData of_one_rank(const Body& body) {
  ReferenceData data;
  data.points = body.owned().size();
  data.point = [&body](std::size_t p) -> ReferenceData::Point {
    const auto i = static_cast<std::size_t>(body.owned()[p]);
    return {body.position(i), body.volume(i), body.material_ids().empty() ? 0 : body.material_ids()[i]};
  };
  for (const auto& [name, members] : body.sets()) {
    std::vector<std::int64_t> ids;
    for (const std::int32_t i : members) ids.push_back(body.input_of(static_cast<std::size_t>(i)));
    std::ranges::sort(ids);
    data.sets.emplace(name, ReferenceData::Set(std::move(ids)));
  }
  return data;
}

}  // namespace

GatheredReferenceConfiguration::GatheredReferenceConfiguration(const BodyProblem& problem) : problem_(problem) {
  for (const auto& [name, members] : problem.body().sets()) sets_.push_back(name);
}

void GatheredReferenceConfiguration::use(const std::function<void(const ReferenceData& data)>& work) {
  if (!problem_.partition()) return work(of_one_rank(problem_.body()));
  const ReferenceData data = of_all();
  if (communicator().rank() > 0) return serve();
  work(data);
  ask({});
}

void GatheredReferenceConfiguration::ask(Wanted wanted) {
  told_to_all(std::vector{wanted});
}

void GatheredReferenceConfiguration::serve() {
  for (;;) {
    const Wanted wanted = told_to_all(std::vector<Wanted>(1)).front();
    if (wanted.what < 0) return;
    wanted.what == 0 ? static_cast<void>(points(wanted.piece)) : static_cast<void>(members(wanted.what - 1, wanted.piece));
  }
}

ReferenceData GatheredReferenceConfiguration::of_all() {
  const Body& body = problem_.body();
  ReferenceData data;
  data.points = body.points_of_all_ranks();
  data.point = [this](std::size_t p) -> ReferenceData::Point {
    const auto wanted = static_cast<std::int64_t>(p / rows_of_piece);
    if (wanted != piece_number_) {
      ask({0, wanted});
      piece_ = points(wanted);
      piece_number_ = wanted;
    }
    const double* row = &piece_[p % rows_of_piece * values_of_a_row];
    return {{row[0], row[1], row[2]}, row[3], static_cast<std::int64_t>(row[4])};
  };
  for (std::size_t s = 0; s < sets_.size(); ++s) {
    std::int64_t size = std::ssize(body.set(sets_[s]));
    communicator().sum({&size, 1});
    const auto pieces = [this, s](const ReferenceData::Set::Use& use) {
      const std::int64_t all = (static_cast<std::int64_t>(problem_.body().points_of_all_ranks()) + piece_size - 1) / piece_size;
      for (std::int64_t piece = 0; piece < all; ++piece) {
        ask({static_cast<std::int64_t>(s) + 1, piece});
        use(members(static_cast<std::int64_t>(s), piece));
      }
    };
    data.sets.emplace(sets_[s], ReferenceData::Set(static_cast<std::size_t>(size), pieces));
  }
  return data;
}

std::vector<double> GatheredReferenceConfiguration::points(std::int64_t piece) {
  const Body& body = problem_.body();
  const std::size_t first = static_cast<std::size_t>(piece) * rows_of_piece;
  return gather_rows(body, first, std::min(rows_of_piece, body.points_of_all_ranks() - first), values_of_a_row,
                     [&](std::size_t p, double* row) {
                       const Point x = body.position(p);
                       std::copy(x.begin(), x.end(), row);
                       row[3] = body.volume(p);
                       row[4] = body.material_ids()[p];
                     });
}

std::vector<std::int64_t> GatheredReferenceConfiguration::members(std::int64_t set, std::int64_t piece) {
  const Body& body = problem_.body();
  if (own_set_ != set) {
    own_set_ = set;
    own_.clear();
    for (const std::int32_t p : body.set(sets_[static_cast<std::size_t>(set)]))
      own_.push_back(body.number(static_cast<std::size_t>(p)));
    std::ranges::sort(own_);
  }
  const auto begin = std::ranges::lower_bound(own_, piece * piece_size),
             end = std::lower_bound(begin, own_.end(), (piece + 1) * piece_size);
  std::vector<std::int64_t> all = gathered<std::int64_t>(std::span<const std::int64_t>(begin, end));
  std::ranges::sort(all);
  return all;
}

}  // namespace perikit
