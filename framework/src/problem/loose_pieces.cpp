#include "problem/loose_pieces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/symmetric_matrix.hpp"

namespace perikit {

namespace {

constexpr int translations(int dimension) {
  return dimension;
}
constexpr int motions_of(int dimension) {
  return dimension * (dimension + 1) / 2;
}
constexpr std::array<std::array<int, 2>, 3> planes{{{0, 1}, {0, 2}, {1, 2}}};

/// Which points belong together.
class Parts {
 public:
  explicit Parts(std::size_t points) : above_(points) { std::iota(above_.begin(), above_.end(), 0); }
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

Point place(const Body& body, ConstFieldView u, std::int32_t p) {
  Point y = body.position(static_cast<std::size_t>(p));
  for (int c = 0; c < u.components; ++c) y[static_cast<std::size_t>(c)] += u.component(c)[p];
  return y;
}

/// What images are of: by internal index their source and the signs of its components.
struct Sources {
  std::vector<std::int32_t> source;  ///< -1: no image
  Field sign;
};

Sources sources_of(const Body& body, const ImageMap* images) {
  Sources all{std::vector<std::int32_t>(body.stride(), -1), {}};
  if (!images) return all;
  Field number = body.make_field(1);
  all.sign = body.make_field(body.dimension());
  std::vector<std::int32_t> of_images(body.internal().begin(), body.internal().end());
  const std::size_t real = of_images.size() - images->size();
  for (std::size_t k = 0; k < real; ++k) {
    const std::int32_t p = of_images[k];
    number.data()[p] = p;
    for (int c = 0; c < body.dimension(); ++c) all.sign.component(c)[p] = 1;
  }
  images->copy_from_sources(number);
  images->extend(all.sign);
  for (std::size_t k = real; k < of_images.size(); ++k)
    all.source[static_cast<std::size_t>(of_images[k])] = static_cast<std::int32_t>(number.data()[of_images[k]]);
  return all;
}

/// The piece before its motions are sifted: those of unit norm that move it at all.
void find_motions(const Body& body, ConstFieldView u, LoosePiece& piece) {
  const int d = body.dimension(), m = motions_of(d);
  piece.centre = {};
  for (const std::int32_t p : piece.points)
    for (std::size_t c = 0; c < 3; ++c) piece.centre[c] += place(body, u, p)[c] / static_cast<double>(piece.points.size());
  piece.size = 1e-3 * body.spacing();
  for (const std::int32_t p : piece.points)
    for (std::size_t c = 0; c < 3; ++c) piece.size = std::max(piece.size, std::abs(place(body, u, p)[c] - piece.centre[c]));
  std::vector<double> gram(static_cast<std::size_t>(m * m), 0.0);
  for (const std::int32_t p : piece.points) {
    std::array<Point, 6> at;
    for (int k = 0; k < m; ++k) {
      LoosePiece::Motion unit{};
      unit[static_cast<std::size_t>(k)] = 1;
      at[static_cast<std::size_t>(k)] = piece.at(unit, d, place(body, u, p));
    }
    for (int j = 0; j < m; ++j)
      for (int k = 0; k < m; ++k)
        for (std::size_t c = 0; c < 3; ++c) gram[static_cast<std::size_t>(j * m + k)] += at[static_cast<std::size_t>(j)][c] * at[static_cast<std::size_t>(k)][c];
  }
  const SymmetricEigen axes(m, gram.data());
  for (int k = 0; k < m; ++k) {
    // Points on a line do not turn about it, and a single one does not turn.
    if (axes.value(k) <= 1e-9 * axes.largest()) continue;
    LoosePiece::Motion motion{};
    for (int j = 0; j < m; ++j)
      motion[static_cast<std::size_t>(j)] = axes.vector(j, k) / std::sqrt(axes.value(k));
    piece.motions.push_back(motion);
  }
}

/// Keeps the motions that violate none of the conditions: rows of their values.
void keep_free(const std::vector<std::vector<double>>& rows, LoosePiece& piece) {
  const auto n = static_cast<int>(piece.motions.size());
  std::vector<double> squares(static_cast<std::size_t>(n * n), 0.0);
  for (const std::vector<double>& row : rows)
    for (std::size_t j = 0; j < piece.motions.size(); ++j)
      for (std::size_t k = 0; k < piece.motions.size(); ++k) squares[j * piece.motions.size() + k] += row[j] * row[k];
  const SymmetricEigen axes(n, squares.data());
  const double largest = n > 0 ? axes.largest() : 0.0;
  std::vector<LoosePiece::Motion> free;
  for (int k = 0; k < n; ++k) {
    if (largest > 0 && axes.value(k) > 1e-10 * largest) continue;
    LoosePiece::Motion motion{};
    for (int j = 0; j < n; ++j)
      for (std::size_t c = 0; c < motion.size(); ++c)
        motion[c] += axes.vector(j, k) * piece.motions[static_cast<std::size_t>(j)][c];
    free.push_back(motion);
  }
  piece.motions = std::move(free);
}

}  // namespace

Point LoosePiece::at(const Motion& motion, int dimension, const Point& y) const noexcept {
  Point w{};
  for (int c = 0; c < dimension; ++c) w[static_cast<std::size_t>(c)] = motion[static_cast<std::size_t>(c)];
  for (int k = 0; k < motions_of(dimension) - translations(dimension); ++k) {
    const auto a = static_cast<std::size_t>(planes[static_cast<std::size_t>(k)][0]),
               b = static_cast<std::size_t>(planes[static_cast<std::size_t>(k)][1]);
    const double turn = motion[static_cast<std::size_t>(dimension + k)] / size;
    w[a] -= turn * (y[b] - centre[b]);
    w[b] += turn * (y[a] - centre[a]);
  }
  return w;
}

std::string LoosePiece::name(const Body& body) const {
  if (points.size() == body.owned().size()) return "the body";
  return fmt::format("a piece of {} point{} about ({:.6g}, {:.6g}, {:.6g})", points.size(), points.size() == 1 ? "" : "s",
                     centre[0], centre[1], centre[2]);
}

std::string names(const std::vector<LoosePiece>& pieces, const Body& body) {
  if (pieces.empty()) return {};
  const std::string first = pieces.front().name(body);
  return pieces.size() == 1 ? first : fmt::format("{} and {} smaller or equal one{}", first, pieces.size() - 1, pieces.size() == 2 ? "" : "s");
}

std::vector<LoosePiece> find_loose_pieces(const Families& families, const Constraints& constraints, const ImageMap* images,
                                          ConstFieldView u) {
  const Body& body = families.body();
  const int d = body.dimension();
  const Sources sources = sources_of(body, images);
  const auto source = [&](std::int32_t p) { return sources.source[static_cast<std::size_t>(p)]; };
  Parts parts(body.stride());
  std::vector<std::int32_t> real, bonded_images;
  FamilyArrays family;
  for (const std::int32_t p : body.owned()) {
    if (source(p) >= 0) continue;
    real.push_back(p);
    families.load(static_cast<std::size_t>(p), BondsOf::intact, family);
    for (int k = 0; k < family.bonds; ++k) {
      const std::int32_t q = family.far[static_cast<std::size_t>(k)];
      parts.join(p, source(q) >= 0 ? source(q) : q);
      if (source(q) >= 0) bonded_images.push_back(q);
    }
  }
  std::ranges::sort(bonded_images);
  bonded_images.erase(std::ranges::unique(bonded_images).begin(), bonded_images.end());

  std::vector<std::int32_t> number(body.stride(), -1);  // by the first point of a piece
  std::vector<LoosePiece> pieces;
  const auto piece_of = [&](std::int32_t p) -> LoosePiece& {
    return pieces[static_cast<std::size_t>(number[static_cast<std::size_t>(parts.of(p))])];
  };
  for (const std::int32_t p : real) {
    std::int32_t& mine = number[static_cast<std::size_t>(parts.of(p))];
    if (mine < 0) {
      mine = static_cast<std::int32_t>(pieces.size());
      pieces.emplace_back();
    }
    pieces[static_cast<std::size_t>(mine)].points.push_back(p);
  }
  for (LoosePiece& piece : pieces) {
    std::ranges::sort(piece.points);
    find_motions(body, u, piece);
  }
  // What each motion does where it may do nothing, piece by piece.
  std::vector<std::vector<std::vector<double>>> rows(pieces.size());
  const auto add_row = [&](const LoosePiece& piece, auto&& value) {
    std::vector<double> row;
    for (const LoosePiece::Motion& motion : piece.motions) row.push_back(value(motion));
    rows[static_cast<std::size_t>(&piece - pieces.data())].push_back(std::move(row));
  };
  for (const std::int64_t dof : constraints.dofs()) {
    const auto p = static_cast<std::int32_t>(dof % static_cast<std::int64_t>(body.stride()));
    const auto c = static_cast<std::size_t>(dof / static_cast<std::int64_t>(body.stride()));
    if (source(p) >= 0 || number[static_cast<std::size_t>(parts.of(p))] < 0) continue;
    const LoosePiece& piece = piece_of(p);
    add_row(piece, [&](const LoosePiece::Motion& motion) { return piece.at(motion, d, place(body, u, p))[c]; });
  }
  for (const std::int32_t q : bonded_images) {
    const LoosePiece& piece = piece_of(source(q));
    for (int c = 0; c < d; ++c)
      add_row(piece, [&](const LoosePiece::Motion& motion) {
        const auto e = static_cast<std::size_t>(c);
        return piece.at(motion, d, place(body, u, q))[e] -
               sources.sign.component(c)[q] * piece.at(motion, d, place(body, u, source(q)))[e];
      });
  }
  for (std::size_t k = 0; k < pieces.size(); ++k) keep_free(rows[k], pieces[k]);
  std::erase_if(pieces, [](const LoosePiece& piece) { return piece.motions.empty(); });
  std::ranges::stable_sort(pieces, std::greater(), [](const LoosePiece& piece) { return piece.points.size(); });
  return pieces;
}

const LoosePiece* driven_piece(const std::vector<LoosePiece>& pieces, const Body& body, ConstFieldView u, ConstFieldView force) {
  for (const LoosePiece& piece : pieces) {
    double size = 0;
    std::vector<double> along(piece.motions.size(), 0.0);
    for (const std::int32_t p : piece.points) {
      const Point y = place(body, u, p);
      for (std::size_t k = 0; k < along.size(); ++k) {
        const Point w = piece.at(piece.motions[k], body.dimension(), y);
        for (int c = 0; c < body.dimension(); ++c) {
          const double part = force.component(c)[p] * w[static_cast<std::size_t>(c)];
          along[k] += part;
          size += std::abs(part);
        }
      }
    }
    if (std::ranges::any_of(along, [&](double sum) { return std::abs(sum) > 1e-9 * size; })) return &piece;
  }
  return nullptr;
}

}  // namespace perikit
