#include "problem/loose/loose_pieces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/symmetric_matrix.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

constexpr int translations(int dimension) {
  return dimension;
}
constexpr int motions_of(int dimension) {
  return dimension * (dimension + 1) / 2;
}
constexpr std::array<std::array<int, 2>, 3> planes{{{0, 1}, {0, 2}, {1, 2}}};
constexpr std::size_t most_motions = motions_of(3);
/// Products of each motion with each.
using Products = std::array<double, most_motions * most_motions>;

Point place(const Body& body, ConstFieldView u, std::int32_t p) {
  Point y = body.position(static_cast<std::size_t>(p));
  for (int c = 0; c < u.components; ++c) y[static_cast<std::size_t>(c)] += u.component(c)[p];
  return y;
}

/// values, `width` of each piece, <- their sums over all ranks.
void add_up(const std::vector<LoosePiece>& pieces, std::size_t width, std::span<double> values) {
  add_up_over_ranks(pieces.size(), [&](std::size_t k) -> const Piece& { return pieces[k]; }, width, values);
}

/// Where the pieces are, and their motions before they are sifted: those of unit norm that move a piece at all.
void find_motions(const Body& body, ConstFieldView u, std::vector<LoosePiece>& pieces) {
  const int d = body.dimension(), m = motions_of(d);
  std::vector<std::array<double, 3>> places(pieces.size());
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    places[k] = {};
    for (const std::int32_t p : pieces[k].points)
      for (std::size_t c = 0; c < 3; ++c) places[k][c] += place(body, u, p)[c];
  }
  add_up(pieces, 3, {places.front().data(), 3 * places.size()});
  std::vector<Products> gram(pieces.size());
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    LoosePiece& piece = pieces[k];
    for (std::size_t c = 0; c < 3; ++c) piece.centre[c] = places[k][c] / static_cast<double>(piece.count);
    gram[k] = {};
    for (const std::int32_t p : piece.points) {
      std::array<Point, most_motions> at;
      for (int i = 0; i < m; ++i) {
        LoosePiece::Motion unit{};
        unit[static_cast<std::size_t>(i)] = 1;
        at[static_cast<std::size_t>(i)] = piece.at(unit, d, place(body, u, p));
      }
      for (int i = 0; i < m; ++i)
        for (int j = 0; j < m; ++j)
          for (std::size_t c = 0; c < 3; ++c) gram[k][static_cast<std::size_t>(i * m + j)] += at[static_cast<std::size_t>(i)][c] * at[static_cast<std::size_t>(j)][c];
    }
  }
  add_up(pieces, gram.front().size(), {gram.front().data(), gram.front().size() * gram.size()});
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    LoosePiece& piece = pieces[k];
    // Turns as long as translations.
    double turned = 0;
    for (int i = translations(d); i < m; ++i) turned += gram[k][static_cast<std::size_t>(i * m + i)];
    piece.size = std::max(1e-3 * body.spacing(), std::sqrt(turned / static_cast<double>(piece.count)));
    const auto scale = [&](int i) { return i < translations(d) ? 1.0 : piece.size; };
    for (int i = 0; i < m; ++i)
      for (int j = 0; j < m; ++j) gram[k][static_cast<std::size_t>(i * m + j)] /= scale(i) * scale(j);
    const SymmetricEigen axes(m, gram[k].data());
    for (int i = 0; i < m; ++i) {
      // Points on a line do not turn about it, and a single one does not turn.
      if (axes.value(i) <= 1e-9 * axes.largest()) continue;
      LoosePiece::Motion& motion = piece.motions.emplace_back();
      for (int j = 0; j < m; ++j) motion[static_cast<std::size_t>(j)] = axes.vector(j, i) / std::sqrt(axes.value(i));
    }
  }
}

/// squares += the products of the forces by which terms that act on points resist the motions, in parts of the largest.
void add_resistance(const Body& body, Terms& terms, const Configuration& at, const std::vector<LoosePiece>& pieces, std::vector<Products>& squares) {
  const int d = body.dimension();
  std::array<Field, most_motions> forces;
  double largest = 0;
  for (int i = 0; i < motions_of(d); ++i) {
    Field w = body.make_field(d);
    for (const LoosePiece& piece : pieces)
      for (const std::int32_t p : piece.points) {
        if (static_cast<std::size_t>(i) >= piece.motions.size()) break;
        const Point motion = piece.at(piece.motions[static_cast<std::size_t>(i)], d, place(body, at.u(), p));
        for (int c = 0; c < d; ++c) w.component(c)[p] = motion[static_cast<std::size_t>(c)];
      }
    Field& force = forces[static_cast<std::size_t>(i)] = body.make_field(d);
    if (!terms.tangent_of_points(at, w, force).ok()) fill(0, force);   // the first evaluation of forces says so
    largest = std::max(largest, largest_magnitude(force));
  }
  if (!(largest > 0)) return;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const std::size_t n = pieces[k].motions.size();
    for (const std::int32_t p : pieces[k].points)
      for (int c = 0; c < d; ++c)
        for (std::size_t i = 0; i < n; ++i)
          for (std::size_t j = 0; j < n; ++j) squares[k][i * n + j] += forces[i].component(c)[p] / largest * (forces[j].component(c)[p] / largest);
  }
}

/// Keeps the motions that violate none of the conditions, of whose values at the motions these are the products.
void keep_free(const Products& squares, LoosePiece& piece) {
  const auto n = static_cast<int>(piece.motions.size());
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

/// Whether `mine` (null: this rank has none) comes before those of all other ranks. All ranks must call it, each with another piece.
bool comes_first(const LoosePiece* mine) {
  const double most = communicator().largest(mine ? static_cast<double>(mine->count) : 0.0);
  const bool largest = mine && static_cast<double>(mine->count) == most;
  const double number = largest ? -static_cast<double>(mine->first) : -std::numeric_limits<double>::infinity();
  return communicator().largest(number) == number && largest;
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
  if (count == static_cast<std::int64_t>(body.points_of_all_ranks())) return "the body";
  return fmt::format("a piece of {} point{} about ({:.6g}, {:.6g}, {:.6g})", count, count == 1 ? "" : "s", centre[0], centre[1], centre[2]);
}

std::string names(const std::vector<LoosePiece>& pieces, const Body& body) {
  const LoosePiece* mine = nullptr;
  std::int64_t spoken_for = 0;
  for (const LoosePiece& piece : pieces) {
    if (!speaks_for(piece, body)) continue;
    if (spoken_for++ == 0) mine = &piece;
  }
  const std::int64_t others = counted(spoken_for).all - 1;
  const std::string first = first_message(comes_first(mine) ? mine->name(body) : "");
  return others <= 0 ? first : fmt::format("{} and {} smaller or equal one{}", first, others, others == 1 ? "" : "s");
}

std::vector<LoosePiece> find_loose_pieces(const Families& families, Problem& problem, Terms& terms, ConstFieldView u) {
  const Body& body = families.body();
  const int d = body.dimension();
  const Sources sources(body, problem.images());
  const auto source = [&](std::int32_t p) { return sources.source[static_cast<std::size_t>(p)]; };
  std::vector<BondedImage> bonded_images;
  std::vector<LoosePiece> pieces;
  for (Piece& piece : find_pieces(families, problem, sources, &bonded_images)) pieces.emplace_back(std::move(piece));
  find_motions(body, u, pieces);
  std::vector<std::int32_t> piece_at(body.stride(), -1);
  for (std::size_t k = 0; k < pieces.size(); ++k)
    for (const std::int32_t p : pieces[k].points) piece_at[static_cast<std::size_t>(p)] = static_cast<std::int32_t>(k);
  // What each motion does where it may do nothing.
  std::vector<Products> squares(pieces.size(), Products{});
  const auto add_row = [&](std::int32_t p, auto&& value) {
    const auto k = static_cast<std::size_t>(piece_at[static_cast<std::size_t>(p)]);
    const LoosePiece& piece = pieces[k];
    const std::size_t n = piece.motions.size();
    std::array<double, most_motions> row{};
    for (std::size_t j = 0; j < n; ++j) row[j] = value(piece, piece.motions[j]);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) squares[k][i * n + j] += row[i] * row[j];
  };
  for (const std::int64_t dof : problem.constraints().dofs()) {
    const auto p = static_cast<std::int32_t>(dof % static_cast<std::int64_t>(body.stride()));
    const auto c = static_cast<std::size_t>(dof / static_cast<std::int64_t>(body.stride()));
    if (piece_at[static_cast<std::size_t>(p)] < 0) continue;  // of an image, or of another rank
    add_row(p, [&](const LoosePiece& piece, const LoosePiece::Motion& motion) { return piece.at(motion, d, place(body, u, p))[c]; });
  }
  for (const auto& [q, p] : bonded_images)
    for (int c = 0; c < d; ++c)
      add_row(p, [&, q = q](const LoosePiece& piece, const LoosePiece::Motion& motion) {
        const auto e = static_cast<std::size_t>(c);
        return piece.at(motion, d, place(body, u, q))[e] -
               sources.sign.component(c)[q] * piece.at(motion, d, place(body, u, source(q)))[e];
      });
  if (terms.hold_points()) {
    constexpr double end = 1;   // of the load parameter
    for (const double time : {problem.state().time, end}) add_resistance(body, terms, {u, time}, pieces, squares);
  }
  add_up(pieces, squares.front().size(), {squares.front().data(), squares.front().size() * squares.size()});
  for (std::size_t k = 0; k < pieces.size(); ++k) keep_free(squares[k], pieces[k]);
  std::erase_if(pieces, [](const LoosePiece& piece) { return piece.motions.empty(); });
  std::ranges::sort(pieces, comes_before);
  return pieces;
}

const LoosePiece* driven_piece(const std::vector<LoosePiece>& pieces, const Body& body, ConstFieldView u, ConstFieldView force) {
  constexpr std::size_t width = most_motions + 1;  // along each motion, and at most: motions are across a force but for their rounding
  std::vector<double> work(width * pieces.size(), 0.0);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const LoosePiece& piece = pieces[i];
    double* const along = work.data() + width * i;
    for (const std::int32_t p : piece.points) {
      const Point y = place(body, u, p);
      for (std::size_t k = 0; k < piece.motions.size(); ++k) {
        const Point w = piece.at(piece.motions[k], body.dimension(), y);
        Point f{};
        for (int c = 0; c < body.dimension(); ++c) f[static_cast<std::size_t>(c)] = force.component(c)[p];
        along[k] += f[0] * w[0] + f[1] * w[1] + f[2] * w[2];
        along[most_motions] += std::hypot(f[0], f[1], f[2]) * std::hypot(w[0], w[1], w[2]);
      }
    }
  }
  add_up(pieces, width, work);
  const LoosePiece* mine = nullptr;
  for (std::size_t i = 0; i < pieces.size() && !mine; ++i) {
    const double* const along = work.data() + width * i;
    const bool driven = std::any_of(along, along + pieces[i].motions.size(), [&](double sum) { return std::abs(sum) > 1e-9 * along[most_motions]; });
    if (driven && speaks_for(pieces[i], body)) mine = &pieces[i];
  }
  return comes_first(mine) ? mine : nullptr;
}

}  // namespace perikit
