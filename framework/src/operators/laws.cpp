#include "perikit/operators/laws.hpp"

#include <algorithm>

#include "perikit/core/simd.hpp"

namespace perikit {

Laws::Laws(Space space, std::vector<MaterialRecord> records, std::span<const std::uint16_t> ids, std::size_t stride)
    : space_(space), records_(std::move(records)), ids_(ids), stride_(stride),
      single_(ids.empty() && records_.front().uniform),
      silent_(static_cast<std::size_t>(std::ranges::find(records_, true, &MaterialRecord::silent) - records_.begin())) {
  for (const MaterialRecord& record : records_) {
    state_ = std::max(state_, record.material->state_components(space));
    dissipates_ |= record.traits.dissipates;
    limit_steps_ |= record.traits.limits_step;
    read_external_ |= !record.material->external().empty();
    growth_.push_back(growth_of(record, space));
  }
}

Laws::GrowthOfLaw Laws::growth_of(const MaterialRecord& record, Space space) {
  if (!record.uniform || record.material->state_components(space) > 0 || !record.material->external().empty()) return {};
  if (record.traits.green_linear) return {.known = Growth::green_linear, .kappa = record.material->small_strain(record.constants.data()).bulk()};
  MaterialRecord isochoric = record;
  if (!record.material->isochoric_constants(record.constants.data(), isochoric.constants.data())) return {};
  return {.known = Growth::decoupled, .isochoric = std::move(isochoric)};
}

void Laws::evaluate_volumetric(std::size_t id, VolumeBatch batch) const noexcept {
  batch.constants = records_[id].constants.data();
  records_[id].material->volumetric(batch);
}

bool Laws::constant_tangent() const noexcept {
  return std::all_of(records_.begin(), records_.end(), [](const auto& r) { return r.traits.constant_tangent; });
}

bool Laws::objective() const noexcept {
  return std::all_of(records_.begin(), records_.end(), [](const auto& r) { return r.traits.objective; });
}

bool Laws::symmetric_tangent() const noexcept {
  return std::all_of(records_.begin(), records_.end(), [](const auto& r) { return r.traits.symmetric_tangent; });
}

Moduli Laws::moduli(std::size_t p) const {
  const MaterialRecord& record = record_of(p);
  if (record.uniform) return record.material->small_strain(record.constants.data());
  std::vector<double> constants(static_cast<std::size_t>(record.traits.constants));
  for (std::size_t k = 0; k < constants.size(); ++k) constants[k] = record.constants[k * stride_ + p];
  return record.material->small_strain(constants.data());
}

double Laws::density(std::size_t p) const noexcept {
  const MaterialRecord& record = record_of(p);
  return record.densities.empty() ? record.density : record.densities[p];
}

void Laws::prepare(LawScratch& scratch, bool tangents) const {
  std::size_t constants = 1;
  for (const MaterialRecord& record : records_) constants = std::max(constants, static_cast<std::size_t>(record.traits.constants));
  scratch.constants.assign(constants * batch_points, 0.0);
  std::size_t external = 0;
  for (const MaterialRecord& record : records_) external = std::max(external, record.material->external().size());
  scratch.external.assign(external * batch_points, 0.0);
  scratch.history.assign(static_cast<std::size_t>(state_) * batch_points, 0.0);
  scratch.begin.assign(static_cast<std::size_t>(state_) * batch_points, 0.0);
  if (tangents) scratch.A.assign(static_cast<std::size_t>(components() * components()) * batch_points, 0.0);
}

void Laws::find_external(const MaterialRecord& record, const LawBatch& batch, LawScratch& scratch, MaterialBatch& call) noexcept {
  const std::span<const ExternalVariable> variables = record.material->external();
  const auto n = static_cast<std::size_t>(batch.n);
  for (std::size_t k = 0; k < variables.size(); ++k) {
    double* const row = scratch.external.data() + k * batch_points;
    const auto given = std::ranges::find(batch.external.values, variables[k].name, &ExternalValue::name);
    const bool known = given != batch.external.values.end(), field = known && given->field.data;
    for (std::size_t l = 0; l < n && field; ++l) {
      const double* const value = given->field.component(0);
      const double own = value[batch.external.owner[l]];
      const std::int32_t far = batch.external.far ? batch.external.far[l] : -1;
      row[l] = far < 0 ? own : 0.5 * (own + value[far]);
    }
    const std::size_t from = field ? n : 0;
    std::fill(row + from, row + padded(n), field ? row[0] : known ? given->value : variables[k].reference);
  }
  call.external = variables.empty() ? nullptr : scratch.external.data();
  call.external_stride = batch_points;
}

Status Laws::evaluate_one(const MaterialRecord& record, const LawBatch& batch, LawScratch& scratch) const noexcept {
  MaterialBatch call;
  call.n = batch.n;
  call.stride = batch_points;
  call.H = batch.H;
  call.dH = batch.dH;
  call.confined = batch.confined;
  call.psi = batch.psi;
  call.P = batch.P;
  call.dP = batch.dP;
  call.A = batch.A;
  call.lateral = batch.lateral;
  if (record.traits.dissipates) call.dissipated = batch.dissipated;
  else if (batch.dissipated) std::fill_n(batch.dissipated, padded(static_cast<std::size_t>(batch.n)), 0.0);
  if (record.traits.limits_step) call.step_factor = batch.step_factor;
  else if (batch.step_factor) std::fill_n(batch.step_factor, padded(static_cast<std::size_t>(batch.n)), 1.0);
  call.time_step = batch.state.time_step;
  call.state_old = batch.state.begin;
  call.state_new = batch.state.end;
  call.state_stride = batch.state.stride;
  if (read_external_) find_external(record, batch, scratch, call);
  call.constants = record.constants.data();
  if (!record.uniform) {
    const auto count = static_cast<std::size_t>(record.traits.constants);
    for (std::size_t k = 0; k < count; ++k) {
      double* row = scratch.constants.data() + k * batch_points;
      const std::size_t lanes = padded(static_cast<std::size_t>(batch.n));
      for (std::size_t l = 0; l < lanes; ++l) {
        row[l] = record.constants[k * stride_ + static_cast<std::size_t>(batch.points[l < static_cast<std::size_t>(batch.n) ? l : 0])];
      }
    }
    call.constants = scratch.constants.data();
    call.constant_stride = batch_points;
  }
  return record.material->evaluate(space_, call);
}

Status Laws::evaluate_among_silent(const MaterialRecord& record, const LawBatch& batch, LawScratch& scratch) const noexcept {
  const Status status = evaluate_one(record, batch, scratch);
  if (!status.ok()) return status;
  alignas(64) double stores[batch_points];
  for (int l = 0; l < batch.n; ++l) stores[l] = ids_[static_cast<std::size_t>(batch.points[l])] >= silent_ ? 0.0 : 1.0;
  for (int l = batch.n; l < static_cast<int>(padded(static_cast<std::size_t>(batch.n))); ++l) stores[l] = 1.0;
  const auto keep = [&](double* x, int rows) {
    for (int r = 0; x && r < rows; ++r)
      for (int l = 0; l < batch.n; l += pack_width) (Pack::load(x + r * batch_points + l) * Pack::load(stores + l)).store(x + r * batch_points + l);
  };
  keep(batch.psi, 1);
  keep(batch.dissipated, 1);
  for (int l = 0; batch.step_factor && l < batch.n; ++l)
    if (stores[l] == 0) batch.step_factor[l] = 1.0;
  keep(batch.P, components());
  keep(batch.dP, components());
  keep(batch.A, components() * components());
  return status;
}

Status Laws::evaluate(const LawBatch& batch, LawScratch& scratch) const noexcept {
  if (ids_.empty()) return evaluate_one(records_[0], batch, scratch);
  const auto silent = static_cast<std::uint16_t>(silent_);
  std::uint16_t only = silent;   // the one law of all lanes that store something
  bool mixed = false, any_silent = false;
  for (int l = 0; l < batch.n; ++l) {
    const std::uint16_t id = ids_[static_cast<std::size_t>(batch.points[l])];
    any_silent |= id >= silent;
    mixed |= id < silent && only != silent && id != only;
    if (id < silent) only = id;
  }
  if (!mixed && (!any_silent || only == silent)) return evaluate_one(records_[only], batch, scratch);
  if (!mixed) {
    const Status status = evaluate_among_silent(records_[only], batch, scratch);
    if (status.ok()) return status;   // else a point that stores nothing may be to blame
  }
  // Several laws in one batch: each sees its own lanes and the others at rest, for what one law accepts another may not.
  Status status;
  for (std::size_t m = 0; m < records_.size(); ++m) {
    const auto mine = [&](int l) { return ids_[static_cast<std::size_t>(batch.points[l])] == m; };
    bool present = false;
    for (int l = 0; l < batch.n && !present; ++l) present = mine(l);
    if (!present) continue;
    for (int c = 0; c < components(); ++c)
      for (int l = 0; l < static_cast<int>(padded(static_cast<std::size_t>(batch.n))); ++l)
        scratch.H[c * batch_points + l] = l < batch.n && mine(l) ? batch.H[c * batch_points + l] : 0.0;
    LawBatch part = batch;
    part.H = scratch.H;
    part.psi = batch.psi ? scratch.psi : nullptr;
    part.P = batch.P ? scratch.P : nullptr;
    part.dP = batch.dP ? scratch.dP : nullptr;
    part.lateral = batch.lateral ? scratch.lateral : nullptr;
    part.dissipated = batch.dissipated ? scratch.dissipated : nullptr;
    part.step_factor = batch.step_factor ? scratch.step_factor : nullptr;
    part.A = batch.A ? scratch.A.data() : nullptr;
    // What another law remembers at its lanes means nothing to this one.
    for (int c = 0; batch.state.begin && c < records_[m].material->state_components(space_); ++c)
      for (std::size_t l = 0; l < padded(static_cast<std::size_t>(batch.n)); ++l)
        scratch.begin[static_cast<std::size_t>(c) * batch_points + l] =
            l < static_cast<std::size_t>(batch.n) && mine(static_cast<int>(l)) ? batch.state.begin[static_cast<std::size_t>(c) * batch.state.stride + l] : 0.0;
    if (batch.state.begin) part.state.begin = scratch.begin.data();
    if (batch.state.end) part.state.end = scratch.history.data();   // the state of mixed batches has stride batch_points
    const Status one = evaluate_one(records_[m], part, scratch);
    if (!one.ok() && (status.ok() || one.inadmissible < status.inadmissible)) status = one;
    const auto keep = [&](double* to, const double* from, int components, std::size_t stride) {
      if (!to) return;
      for (int c = 0; c < components; ++c)
        for (std::size_t l = 0; l < static_cast<std::size_t>(batch.n); ++l)
          if (mine(static_cast<int>(l))) to[static_cast<std::size_t>(c) * stride + l] = from[static_cast<std::size_t>(c) * stride + l];
    };
    keep(batch.psi, scratch.psi, 1, batch_points);
    keep(batch.lateral, scratch.lateral, 1, batch_points);
    keep(batch.dissipated, scratch.dissipated, 1, batch_points);
    keep(batch.step_factor, scratch.step_factor, 1, batch_points);
    keep(batch.P, scratch.P, components(), batch_points);
    keep(batch.dP, scratch.dP, components(), batch_points);
    keep(batch.A, scratch.A.data(), components() * components(), batch_points);
    keep(batch.state.end, scratch.history.data(), records_[m].material->state_components(space_), batch.state.stride);
  }
  return status;
}

}  // namespace perikit
