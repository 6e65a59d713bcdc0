#include "perikit/problem/image_map.hpp"

#include <algorithm>

#include "core/each_once.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/rank_values.hpp"

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
    if (term.motion >= 0 && (held_.empty() || held_.back() != image)) held_.push_back(image);
    if (body.owns(static_cast<std::size_t>(image))) shares_.push_back({image, term.surface, term.component, term.factor, term.at});
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

std::vector<ImageMap::Part> ImageMap::parts(ConstFieldView reaction) const {
  std::vector<Part> parts;
  for (const Share& share : shares_)
    parts.push_back({body_->number(static_cast<std::size_t>(share.image)), share.surface, share.component,
                     share.factor * reaction.component(share.component)[share.image]});
  return parts;
}

/// Of all ranks. The point at a plane may be another rank's than the image, and others add to it.
std::vector<ImageMap::Part> ImageMap::of_all(std::vector<Part> parts, const Body& body) {
  if (body.places().place.empty()) return parts;
  parts = told_to_all(gathered<Part>(parts));
  std::ranges::stable_sort(parts, {}, &Part::image);
  return parts;
}

void ImageMap::hand_out(const std::vector<Part>& parts, const std::function<void(std::int32_t, const Part&)>& add) const {
  const std::vector<std::int32_t>& own = body_->owned();
  const auto number = [&](std::int32_t p) { return body_->number(static_cast<std::size_t>(p)); };
  for (const Part& part : of_all(parts, *body_)) {
    const auto at = std::ranges::lower_bound(own, part.surface, {}, number);
    if (at != own.end() && number(*at) == part.surface) add(*at, part);
  }
}

void ImageMap::gather(FieldView reaction) const {
  hand_out(parts(reaction), [&](std::int32_t p, const Part& part) { reaction.component(static_cast<int>(part.component))[p] += part.value; });
  for (int c = 0; c < reaction.components; ++c)
    for (const std::int32_t p : image_) reaction.component(c)[p] = 0;
}

namespace {

Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Point at_point(ConstFieldView field, std::int32_t p) {
  Point value{};
  for (int c = 0; c < field.components; ++c) value[static_cast<std::size_t>(c)] = field.component(c)[p];
  return value;
}

}  // namespace

void ImageMap::add_couples(ConstFieldView reaction, ConstFieldView u, FieldView couple) const {
  const auto now = [&](std::int32_t p) {
    Point y = at_point(u, p);
    for (std::size_t c = 0; c < 3; ++c) y[c] += body_->position(static_cast<std::size_t>(p))[c];
    return y;
  };
  const bool plane = couple.components == 1;
  const auto axis_of = [&](int row) { return static_cast<std::size_t>(plane ? 2 : row); };
  // Moments about the origin. Beyond a corner an image has parts at several planes: these have their levers at rest, and the last one what remains.
  const std::vector<Part> forces = parts(reaction);
  std::vector<Part> moments;
  for (std::size_t first = 0, last; first < shares_.size(); first = last) {
    const std::int32_t image = shares_[first].image;
    const auto k = static_cast<std::size_t>(map_[static_cast<std::size_t>(image)]);
    const Point force = at_point(reaction, image);
    Point on_source = force;
    for (std::size_t c = 0; c < 3; ++c) on_source[c] *= sign_[k][c];
    const Point of_image = cross(now(image), force), of_source = cross(now(source_[k]), on_source);
    Point left;
    for (std::size_t c = 0; c < 3; ++c) left[c] = of_image[c] - of_source[c];
    for (last = first; last < shares_.size() && shares_[last].image == image; ++last) {
      Point part{};
      part[static_cast<std::size_t>(shares_[last].component)] = forces[last].value;
      const bool ends = last + 1 == shares_.size() || shares_[last + 1].image != image;
      const Point moment = ends ? left : cross(shares_[last].at, part);
      for (int row = 0; row < couple.components; ++row) moments.push_back({forces[last].image, forces[last].surface, row, moment[axis_of(row)]});
      for (std::size_t c = 0; c < 3; ++c) left[c] -= moment[c];
    }
  }
  hand_out(moments, [&](std::int32_t p, const Part& part) { couple.component(static_cast<int>(part.component))[p] += part.value; });
  hand_out(forces, [&](std::int32_t p, const Part& part) {
    Point force{};
    force[static_cast<std::size_t>(part.component)] = part.value;
    const Point moment = cross(now(p), force);
    for (int row = 0; row < couple.components; ++row) couple.component(row)[p] -= moment[axis_of(row)];
  });
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
      keep_each_once(columns);
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
