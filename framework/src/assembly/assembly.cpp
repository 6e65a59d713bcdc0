#include "assembly/assembly.hpp"

#include <algorithm>

#include "assembly/bond_assembly.hpp"
#include "assembly/element_assembly.hpp"
#include "operators/samples.hpp"

namespace perikit {

Assembly::Assembly(const ModelParts& parts, int steps)
    : families_(*parts.body, *parts.influence, parts.formulation.weight), steps_(steps) {}

EvaluationStatus Assembly::assemble(ConstFieldView u, BlockMatrix& K) {
  convex_ = K.convex;
  if (!K.has_pattern()) make_pattern(families_, steps_, K);
  constexpr std::size_t piece = 1 << 16;
  parallel_for((K.values.size() + piece - 1) / piece, [&](std::size_t b) {
    std::fill(K.values.begin() + static_cast<std::ptrdiff_t>(b * piece),
              K.values.begin() + static_cast<std::ptrdiff_t>(std::min(K.values.size(), (b + 1) * piece)), 0.0);
  });
  return status_at(families_.body(), fill(u, K));
}

AssembledSize Assembly::size() const {
  const std::size_t blocks = predict_blocks(families_, steps_),
                    entries = static_cast<std::size_t>(families_.body().dimension() * families_.body().dimension());
  return {blocks,
          blocks * (entries * sizeof(double) + sizeof(std::int32_t)) + families_.rows() * 12 + families_.bytes() + work_bytes()};
}

void Assembly::set_bonds(std::span<const BondChange> changes) {
  families_.set_bonds(changes);
  bonds_changed();
}

EvaluationStatus AssemblingModel::assemble(ConstFieldView u, BlockMatrix& K) {
  Assembly& own = assembly();
  if (fracture_ && fracture_->version() != assembled_version_) {
    own.set_bonds(fracture_->changes());
    assembled_version_ = fracture_->version();
  }
  return own.assemble(u, K);
}

void AssemblingModel::watch_bonds(BondState& state) {
  fracture_.emplace(*parts_.body, *parts_.damage, state, parts_.skip);
}

BondUpdate AssemblingModel::update_bonds(ConstFieldView u, const Motion& motion) {
  if (!fracture_) return {};
  return fracture_->update(
      u, motion,
      [&](ConstFieldView at, const GroupMarks& marks) {
        return energy_of(at, marks) + (penalty_ ? penalty_->energy_of(at, marks) : 0.0);
      },
      changed());
}

Fracture::Changed AssemblingModel::changed() {
  return [this](std::span<const std::int32_t> points) {
    std::vector<BondChange> fragments = bonds_changed(points);
    if (penalty_) penalty_->bonds_changed(points);
    return fragments;
  };
}

void AssemblingModel::restore_bonds(std::span<const BondChange> changes) {
  if (fracture_) fracture_->restore(changes, changed());
}

namespace {

template <int D>
std::unique_ptr<Assembly> make(const ModelParts& parts) {
  if (parts.formulation.bond) return std::make_unique<BondAssembly<D>>(parts);
  return std::make_unique<ElementAssembly<D>>(parts);
}

}  // namespace

std::unique_ptr<Assembly> AssemblingModel::make_assembly(const ModelParts& parts) const {
  switch (parts.body->dimension()) {
    case 1:
      return make<1>(parts);
    case 2:
      return make<2>(parts);
    default:
      return make<3>(parts);
  }
}

}  // namespace perikit
