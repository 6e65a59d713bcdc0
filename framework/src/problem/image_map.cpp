#include "perikit/problem/image_map.hpp"

#include <algorithm>

#include "perikit/core/rank_values.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

ImageMap::ImageMap(const Body& body, const Images& images) : body_(&body), map_(body.stride(), -1) {
  const std::size_t real = body.points() - images.size();
  for (std::size_t k = 0; k < images.size(); ++k) {
    image_.push_back(body.internal()[real + k]);
    source_.push_back(body.internal()[static_cast<std::size_t>(images.source[k])]);
    sign_.push_back({static_cast<double>(images.sign[k][0]), static_cast<double>(images.sign[k][1]), static_cast<double>(images.sign[k][2])});
    map_[static_cast<std::size_t>(image_.back())] = static_cast<std::int32_t>(k);
  }
  for (const ImageTerm& term : images.terms) {
    const std::int32_t image = image_[static_cast<std::size_t>(term.image)];
    if (body.owns(static_cast<std::size_t>(image))) shares_.push_back({image, term.surface, term.component, term.factor});
  }
}

void ImageMap::extend(FieldView u) const {
  for (int c = 0; c < u.components; ++c) {
    double* of = u.component(c);
    for (std::size_t k = 0; k < image_.size(); ++k) of[image_[k]] += sign_[k][static_cast<std::size_t>(c)] * of[source_[k]];
  }
}

void ImageMap::fold(FieldView force) const {
  for (int c = 0; c < force.components; ++c) {
    double* of = force.component(c);
    for (std::size_t k = 0; k < image_.size(); ++k) of[source_[k]] += sign_[k][static_cast<std::size_t>(c)] * of[image_[k]];
  }
}

void ImageMap::copy_from_sources(FieldView field) const {
  for (int c = 0; c < field.components; ++c)
    for (std::size_t k = 0; k < image_.size(); ++k) field.component(c)[image_[k]] = field.component(c)[source_[k]];
}

void ImageMap::mirror_gradients(FieldView H) const {
  const int d = H.components == 9 ? 3 : H.components == 5 ? 2 : 1;
  for (int c = 0; c < H.components; ++c) {
    const bool in_space = c < d * d;
    const auto row = static_cast<std::size_t>(c / d), column = static_cast<std::size_t>(c % d);
    double* of = H.component(c);
    // The normal of a plane of symmetry changes its sign as the displacement along it does.
    for (std::size_t k = 0; k < image_.size(); ++k)
      of[image_[k]] = (in_space ? sign_[k][row] * sign_[k][column] : 1.0) * of[source_[k]];
  }
}

void ImageMap::append_images(std::vector<std::int32_t>& points) const {
  std::vector<bool> chosen(map_.size(), false);
  for (const std::int32_t p : points) chosen[static_cast<std::size_t>(p)] = true;
  for (std::size_t k = 0; k < image_.size(); ++k)
    if (chosen[static_cast<std::size_t>(source_[k])]) points.push_back(image_[k]);
}

/// Of all ranks. The point at a plane may be another rank's than the image, and others add to it.
std::vector<ImageMap::Part> ImageMap::parts_of_all(ConstFieldView reaction) const {
  std::vector<Part> parts;
  for (const Share& share : shares_)
    parts.push_back({body_->number(static_cast<std::size_t>(share.image)), share.surface, share.component,
                     share.factor * reaction.component(share.component)[share.image]});
  if (body_->places().place.empty()) return parts;
  parts = told_to_all(gathered<Part>(parts));
  std::ranges::stable_sort(parts, {}, &Part::image);
  return parts;
}

void ImageMap::gather(FieldView reaction) const {
  const std::vector<std::int32_t>& own = body_->owned();
  const auto number = [&](std::int32_t p) { return body_->number(static_cast<std::size_t>(p)); };
  for (const Part& part : parts_of_all(reaction)) {
    const auto at = std::ranges::lower_bound(own, part.surface, {}, number);
    if (at != own.end() && number(*at) == part.surface) reaction.component(static_cast<int>(part.component))[*at] += part.value;
  }
  for (int c = 0; c < reaction.components; ++c)
    for (const std::int32_t p : image_) reaction.component(c)[p] = 0;
}

void ImageMap::fold(const BlockMatrix& full, BlockMatrix& K) const {
  const std::size_t n = full.rows(), d = static_cast<std::size_t>(full.dimension), size = d * d;
  // Block row of the source of each row that is an image's.
  std::vector<std::int32_t> row_of(map_.size(), -1), source(n, -1);
  for (std::size_t r = 0; r < n; ++r) row_of[static_cast<std::size_t>(full.point[r])] = static_cast<std::int32_t>(r);
  const auto image = [&](std::size_t r) { return map_[static_cast<std::size_t>(full.point[r])]; };
  std::vector<std::vector<std::int32_t>> images(n);   // rows of the images of each row
  for (std::size_t r = 0; r < n; ++r) {
    if (image(r) < 0) continue;
    source[r] = row_of[static_cast<std::size_t>(source_[static_cast<std::size_t>(image(r))])];
    images[static_cast<std::size_t>(source[r])].push_back(static_cast<std::int32_t>(r));
  }
  const auto each_block = [&](std::size_t row, auto&& visit) {   // (column, factors of the row or null, of the column or null, block of full)
    const auto add = [&](std::size_t from, const double* left) {
      for (std::int64_t b = full.row_first[from]; b < full.row_first[from + 1]; ++b) {
        const std::int32_t column = full.column[static_cast<std::size_t>(b)];
        visit(column, left, static_cast<const double*>(nullptr), b);
        const std::int32_t of = source[static_cast<std::size_t>(column)];
        if (of >= 0) visit(of, left, sign_[static_cast<std::size_t>(image(static_cast<std::size_t>(column)))].data(), b);
      }
    };
    add(row, nullptr);
    for (const std::int32_t r : images[row]) add(static_cast<std::size_t>(r), sign_[static_cast<std::size_t>(image(static_cast<std::size_t>(r)))].data());
  };
  if (!K.has_pattern()) {
    K.dimension = full.dimension;
    K.symmetric = full.symmetric;
    K.point = full.point;
    K.row_first.assign(1, 0);
    std::vector<std::int32_t> columns;
    for (std::size_t r = 0; r < n; ++r) {
      columns.clear();
      each_block(r, [&](std::int32_t column, const double*, const double*, std::int64_t) { columns.push_back(column); });
      std::ranges::sort(columns);
      columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
      K.column.insert(K.column.end(), columns.begin(), columns.end());
      K.row_first.push_back(static_cast<std::int64_t>(K.column.size()));
    }
    K.values.resize(K.blocks() * size);
  }
  parallel_for(n, [&](std::size_t r) {
    const auto begin = K.column.begin() + K.row_first[r], end = K.column.begin() + K.row_first[r + 1];
    std::fill(K.values.begin() + K.row_first[r] * static_cast<std::int64_t>(size), K.values.begin() + K.row_first[r + 1] * static_cast<std::int64_t>(size), 0.0);
    each_block(r, [&](std::int32_t column, const double* left, const double* right, std::int64_t b) {
      double* to = &K.values[static_cast<std::size_t>(std::lower_bound(begin, end, column) - K.column.begin()) * size];
      const double* from = &full.values[static_cast<std::size_t>(b) * size];
      for (std::size_t i = 0; i < d; ++i)
        for (std::size_t j = 0; j < d; ++j) to[i * d + j] += (left ? left[i] : 1.0) * (right ? right[j] : 1.0) * from[i * d + j];
    });
  });
}

}  // namespace perikit
