#include "unknowns.hpp"

#include <algorithm>

#include "perikit/core/field_operations.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

Unknowns::Unknowns(Problem& problem, const BlockMatrix& K, ConstFieldView free)
    : number_(problem.points().make_field(1)), free_(problem.make_field()) {
  const Points& points = problem.points();
  std::vector<std::uint8_t> own(points.stride(), 0);
  for (const std::int32_t p : points.owned()) own[static_cast<std::size_t>(p)] = 1;
  copy(free, free_);
  number_.fill(-1);
  for (std::size_t r = 0; r < K.rows(); ++r) {
    const std::int32_t p = K.point[r];
    bool any = false;
    for (int c = 0; c < dimension(); ++c) any = any || free_.component(c)[p] != 0;
    if (!own[static_cast<std::size_t>(p)] || !any) continue;
    row_.push_back(static_cast<std::int32_t>(r));
    point_.push_back(p);
  }
  const Counted rows = counted(mine());
  before_ = rows.before;
  of_all_ = rows.all;
  for (std::size_t k = 0; k < point_.size(); ++k)
    number_.data()[point_[k]] = static_cast<double>(before_ + static_cast<std::int64_t>(k));
  problem.share(number_);
  problem.share(free_);
}

template <class Visit>
void Unknowns::over_free(Visit&& visit) const {
  const auto d = static_cast<std::size_t>(dimension());
  for (std::size_t k = 0; k < point_.size(); ++k)
    for (std::size_t c = 0; c < d; ++c)
      if (free_.component(static_cast<int>(c))[point_[k]] != 0) visit(k * d + c, static_cast<int>(c), point_[k]);
}

void Unknowns::gather(ConstFieldView field, double* values) const {
  std::fill_n(values, point_.size() * static_cast<std::size_t>(dimension()), 0.0);
  over_free([&](std::size_t k, int c, std::int32_t p) { values[k] = field.component(c)[p]; });
}

void Unknowns::scatter(const double* values, FieldView field) const {
  std::fill_n(field.data, field.size(), 0.0);
  over_free([&](std::size_t k, int c, std::int32_t p) { field.component(c)[p] = values[k]; });
}

}  // namespace perikit
