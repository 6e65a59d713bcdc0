#include "assembly/volumetric_state.hpp"
#include "spaces/lattice_gradient.hpp"

namespace perikit {

namespace {

constexpr int chunks_at_once = batch_points / chunk_points;

/// B w = Fbar^-T : grad w and B^T q = -div(q Fbar^-T) by the operator that forces are made of: five times as fast as reading b.
template <int D>
class LatticeVolumes final : public VolumetricState<D> {
  using Base = VolumetricState<D>;
  using typename Base::T;

 public:
  explicit LatticeVolumes(const SpaceParts& parts)
      : Base(parts),
        families_(*parts.families.lattice()),
        tiles_(families_.tiles),
        operator_(families_),
        inverse_transpose_(families_.body().make_field(D * D)),
        flux_(families_.body().make_field(D * D)) {}

  std::int64_t linearise(ConstFieldView u) override {
    this->memory_.prepare([] { return std::make_unique<typename Base::Memory>(); });
    FirstBad bad;
    over_chunks(u, [&](const LatticeChunk& chunk, const double* H) {
      const LatticePattern& pattern = families_.pattern(chunk);
      for (int l = 0; l < chunk_points; ++l) {
        if (!(families_.live_bits(chunk.first) >> l & 1)) continue;
        const auto p = static_cast<std::size_t>(chunk.first + l);
        T gradient{};
        for (int c = 0; c < D * D; ++c) gradient(c / D, c % D) = H[c * batch_points + l];
        const std::optional<T> inverse_transpose = this->keep(p, gradient, pattern.singular >> l & 1 ? 0.0 : pattern.left[l]);
        if (!inverse_transpose) return bad.report(static_cast<std::int64_t>(p));
        for (int c = 0; c < D * D; ++c) inverse_transpose_.component(c)[p] = (*inverse_transpose)(c / D, c % D);
      }
    });
    if (bad.point() >= 0) return bad.point();
    this->over_batches([&](std::size_t begin, std::size_t end) {
      const std::int64_t point = this->find_stiffness(begin, end, this->memory_.mine());
      if (point >= 0) bad.report(point);
    });
    return bad.point();
  }

  void rates(ConstFieldView w, FieldView q) const override {
    over_chunks(w, [&](const LatticeChunk& chunk, const double* H) {
      for (int l = 0; l < chunk_points; l += pack_width) {
        Pack rate(0.0);
        for (int c = 0; c < D * D; ++c)
          rate += Pack::load(inverse_transpose_.component(c) + chunk.first + l) * Pack::load(H + c * batch_points + l);
        rate.store(q.data + chunk.first + l);
      }
    });
  }

  void forces(ConstFieldView q, FieldView f) const override {
    parallel_for(tiles_.blocks.size(), [&](std::size_t b) {
      tiles_.clear(b, flux_);
      tiles_.clear(b, f);
      alignas(64) double stress[D * D * chunk_points];
      for (std::size_t c = tiles_.blocks[b].chunk_begin; c < tiles_.blocks[b].chunk_end; ++c) {
        const LatticeChunk& chunk = tiles_.chunks[c];
        for (int k = 0; k < D * D; ++k)
          for (int l = 0; l < chunk_points; l += pack_width)
            (-Pack::load(q.data + chunk.first + l) * Pack::load(inverse_transpose_.component(k) + chunk.first + l))
                .store(stress + k * chunk_points + l);
        operator_.stress_to_flux(chunk, stress, chunk_points, flux_, chunk.first);
        operator_.own_flux(chunk, flux_, chunk.first, f);
      }
    });
    tiles_.colouring.for_each([&](std::size_t b) {
      const LatticeBlock& block = tiles_.blocks[b];
      for (std::size_t r = block.row_begin; r < block.row_end; ++r) operator_.divergence(tiles_.rows[r], flux_, tiles_.rows[r].first, f);
      for (std::size_t c = block.chunk_begin; c < block.chunk_end && families_.any_broken(); ++c)
        operator_.remove_broken(tiles_.chunks[c], flux_, tiles_.chunks[c].first, {}, f);
    });
    tiles_.clear_dead(f);
  }

  void squares(ConstFieldView c, FieldView q) const override {
    this->memory_.prepare([] { return std::make_unique<typename Base::Memory>(); });
    this->over_batches([&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) q.data[this->rows_.point(i)] = square(i, c, this->memory_.mine());
    });
  }

 private:
  /// visit(chunk, H) with the gradient of w in the lanes of the chunk.
  template <class Visit>
  void over_chunks(ConstFieldView w, Visit&& visit) const {
    parallel_for(tiles_.blocks.size(), [&](std::size_t b) {
      alignas(64) double H[D * D * batch_points];
      const LatticeBlock& block = tiles_.blocks[b];
      for (std::size_t first = block.chunk_begin; first < block.chunk_end; first += chunks_at_once) {
        const std::size_t n = std::min<std::size_t>(chunks_at_once, block.chunk_end - first);
        operator_.gradient(&tiles_.chunks[first], static_cast<int>(n), w, H, batch_points);
        for (std::size_t k = 0; k < n; ++k) visit(tiles_.chunks[first + k], H + k * chunk_points);
      }
    });
  }

  /// Row i of B, squared: b_ij = Fbar_i^-T g_ij by neighbour, b_ii = -sum_j b_ij.
  double square(std::size_t i, ConstFieldView c, typename Base::Memory& m) const {
    this->rows_.load(i, m.family);
    point_gradient(m.family, this->rows_.body().horizon(), 1, m.g);
    const auto neighbours = this->rows_.neighbours(i);
    const std::size_t p = this->rows_.point(i);
    double own[D] = {}, sum = 0;
    for (std::size_t k = 0; k < neighbours.size(); ++k)
      for (int a = 0; a < D; ++a) {
        double b = 0;
        for (int e = 0; e < D; ++e) b += inverse_transpose_.component(a * D + e)[p] * m.g[k * D + static_cast<std::size_t>(e)];
        own[a] -= b;
        sum += b * b * c.component(a)[this->rows_.point(static_cast<std::size_t>(neighbours[k]))];
      }
    for (int a = 0; a < D; ++a) sum += own[a] * own[a] * c.component(a)[p];
    return sum;
  }

  const LatticeFamilies& families_;
  const LatticeTiles& tiles_;
  LatticeOperator<D> operator_;
  Field inverse_transpose_;        ///< Fbar^-T, 0 in dead cells
  mutable Field flux_;
};

}  // namespace

template <int D>
std::unique_ptr<VolumetricRows> make_lattice_volumes(const SpaceParts& parts) {
  return std::make_unique<LatticeVolumes<D>>(parts);
}

template std::unique_ptr<VolumetricRows> make_lattice_volumes<1>(const SpaceParts&);
template std::unique_ptr<VolumetricRows> make_lattice_volumes<2>(const SpaceParts&);
template std::unique_ptr<VolumetricRows> make_lattice_volumes<3>(const SpaceParts&);

}  // namespace perikit
