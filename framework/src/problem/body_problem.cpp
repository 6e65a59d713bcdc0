#include "perikit/problem/body_problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "families/gradual_failure.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/output/recorder.hpp"
#include "problem/companion.hpp"

namespace perikit {

static std::shared_ptr<const Damage> damage_law(const Scene& scene, const PartFactory& factory, bool quasi_static) {
  if (!scene.damage) return nullptr;
  std::shared_ptr<const Damage> law = factory.damage(*scene.damage);
  const ParameterValues& values = scene.damage->values;
  if (!values.has("gradual") || !values.boolean("gradual")) return law;
  const auto refuse = [&](const std::string& found, const char* allowed) {
    throw InputError(values.position("gradual"), "damage.gradual", fmt::format("found true with {}; allowed: {}", found, allowed));
  };
  if (!law->traits().bits) refuse(fmt::format("\"{}\", whose bonds weaken of themselves", scene.damage->type), "criteria that break bonds at once");
  if (quasi_static) refuse(fmt::format("integrator \"{}\", which knows no time", scene.integrator->type), "explicit integrators");
  return std::make_shared<GradualFailure>(law);
}

static Body whole_body(const Scene& scene, const Damage* damage) { return Body(scene, damage && !damage->traits().bits); }

BodyProblem::BodyProblem(const Scene& scene, const PartFactory& factory, bool quasi_static)
    : scene_(scene), damage_law_(damage_law(scene, factory, quasi_static)),
      partition_(communicator().size() > 1 ? std::make_unique<Partition>(whole_body(scene, damage_law_.get()), communicator().rank(), communicator().size()) : nullptr),
      body_(partition_ ? partition_->part(static_cast<std::uint16_t>(scene.regions.size() + 1)) : whole_body(scene, damage_law_.get())) {
  if (partition_) ghosts_.emplace(*partition_, body_);
  influence_ = factory.influence(*scene_.influence);
  formulation_ = make_formulation(factory.kinematics(*scene_.kinematics));
  const bool stress = body_.space() == Space::plane_stress || body_.space() == Space::line_stress;
  if (formulation_.selective() && stress) {
    throw InputError(
        scene_.body.position, "body",
        fmt::format(
            "found a state of stress with kinematics \"{}\", which needs the strain across the body; allowed: {} = \"strain\"",
            scene_.kinematics->type, dimension() == 2 ? "plane" : "line"));
  }
  read_materials(factory);
  displacement_ = body_.make_field(dimension());
  internal_force_ = body_.make_field(dimension());
  read_damage();
  try {
    model_ = make_model({&body_, formulation_, influence_, laws_.get(), make_stabilization(factory), scene_.skip, scene_.share,
                         damage_.get()});
  } catch (const std::domain_error& error) {
    throw InputError(scene_.body.position, scene_.body.lattice ? "body.lattice" : "body.points", error.what());
  }
  prepare_history(quasi_static);
  read_initial();
  read_constraints(quasi_static);
  read_loads(quasi_static);
}

std::shared_ptr<const Stabilization> BodyProblem::make_stabilization(const PartFactory& factory) const {
  if (!scene_.stabilization) return nullptr;
  if (!formulation_.point)
    throw InputError(scene_.kinematics->values.position("stabilization"), "kinematics.stabilization",
                     fmt::format("found '{}' over {}; allowed: over kinematics with one gradient per point", scene_.stabilization->type, scene_.kinematics->type));
  return factory.stabilization(*scene_.stabilization);
}

FieldView BodyProblem::declare(const std::string& name, int components) {
  const auto [entry, fresh] = declared_.try_emplace(name);
  if (fresh) entry->second = body_.make_field(components);
  return entry->second;
}

std::span<double> BodyProblem::declare_numbers(const std::string& name, std::size_t count) {
  std::vector<double>& numbers = numbers_[name];
  if (numbers.size() < count) numbers.resize(count, 0.0);
  return numbers;
}

std::span<const double> BodyProblem::mass() {
  if (!mass_.empty()) return mass_;
  mass_.assign(stride(), 0.0);
  for (const std::int32_t p : body_.owned()) {
    const double density = laws_->density(static_cast<std::size_t>(p));
    if (!(density > 0)) {
      const std::size_t id = body_.material_ids().empty() ? 0 : body_.material_ids()[static_cast<std::size_t>(p)];
      const ParameterValues& values = (id == 0 ? scene_.material : scene_.regions[id - 1].material)->values;
      const Point x = body_.position(static_cast<std::size_t>(p));
      throw values.error("density", values.has("density")
                                        ? fmt::format("found {} at ({:.6g}, {:.6g}, {:.6g}); allowed: a density > 0 [kg/m^3]",
                                                      density, x[0], x[1], x[2])
                                        : "found nothing; allowed: a density > 0 [kg/m^3], which dynamic runs need");
    }
    mass_[static_cast<std::size_t>(p)] = density * body_.volume(static_cast<std::size_t>(p));
  }
  return mass_;
}

double BodyProblem::uniform_mass() {
  if (uniform_mass_ < 0) {
    const auto masses = mass();
    uniform_mass_ = masses[static_cast<std::size_t>(body_.internal().front())];
    for (const std::int32_t p : body_.internal()) {
      if (masses[static_cast<std::size_t>(p)] != uniform_mass_) uniform_mass_ = 0;
    }
  }
  return uniform_mass_;
}

EvaluationStatus BodyProblem::evaluate_forces(ConstFieldView u, FieldView force, double* energy, double time_step) {
  LawHistory* const history = laws_->history();
  if (history) history->set_time_step(time_step);
  EvaluationStatus status = model_->forces(filled(u, with_ghosts_), force, energy);
  if (energy) *energy = communicator().sum(*energy);
  if (history) history->set_time_step(0);
  if (!status.ok()) {
    const auto p = static_cast<std::size_t>(body_.internal()[static_cast<std::size_t>(status.point)]);
    const std::uint16_t id = body_.material_ids().empty() ? std::uint16_t{0} : body_.material_ids()[p];
    const std::string& material = id == 0 || id > scene_.regions.size() ? scene_.material->type : scene_.regions[id - 1u].material->type;
    status.description = fmt::format("inadmissible deformation ({}) at {}, kinematics {}, material {}",
                                     model_->has_gradients() ? "det F <= 0 or not finite" : "a bond of zero or non-finite length", status.description, scene_.kinematics->type, material);
  }
  finish(force, status);
  return status;
}

ConstFieldView BodyProblem::filled(ConstFieldView u, Field& memory) const {
  if (!ghosts_) return u;
  if (memory.size() == 0) memory = body_.make_field(dimension());
  std::copy_n(u.data, u.size(), memory.data());
  ghosts_->forward(memory);
  return memory;
}

void BodyProblem::finish(FieldView force, EvaluationStatus& status) const {
  if (!ghosts_) return;
  if (communicator().largest(status.ok() ? 0.0 : 1.0) == 0) return ghosts_->accumulate(force);
  if (status.ok()) status = {0, "inadmissible deformation on another rank"};
}

bool BodyProblem::advance_history(double time_step, ConstFieldView velocity) {
  if (laws_->history()) laws_->history()->advance();
  return damage_ && update_bonds(time_step, velocity);
}

void BodyProblem::prepare_history(bool quasi_static) {
  LawHistory* const history = laws_->history();
  if (!history) return;
  const auto& records = laws_->records();
  for (std::size_t id = 0; id < records.size(); ++id) {
    if (records[id].material->state_components(body_.space()) == 0) continue;
    const PartValues& part = id == 0 ? *scene_.material : *scene_.regions[id - 1].material;
    const auto refuse = [&](const std::string& with, const std::string& allowed) {
      throw InputError(part.values.position("type"), part.values.path() + ".type",
                       fmt::format("found \"{}\", a law whose stress depends on the path, with {}; allowed: {}", part.type, with, allowed));
    };
    if (quasi_static) {
      refuse(fmt::format("integrator \"{}\", whose iterations are no steps of a path", scene_.integrator->type),
             "an explicit integrator, or another material");
    }
    if (formulation_.force_state == ForceState::local) refuse("force_state = \"local\"", "a material without history, or \"variational\"");
  }
  // The first evaluation only counts.
  model_->forces(displacement_, internal_force_, nullptr);
  history->allocate();
}

EvaluationStatus BodyProblem::tangent_action(ConstFieldView u, ConstFieldView w, FieldView Kw) {
  const ConstFieldView at = filled(u, with_ghosts_), along = filled(w, direction_with_ghosts_);
  EvaluationStatus status = model_->tangent(at, along, Kw);
  finish(Kw, status);
  return status;
}

void BodyProblem::refuse_assembly() const {
  if (partition_) throw RunError("an assembled tangent needs the whole body on one rank; allowed: matrix-free solvers without a preconditioner");
}

AssembledSize BodyProblem::assembled_size() {
  refuse_assembly();
  return model_->assembled_size();
}

BodyProblem::~BodyProblem() = default;

void BodyProblem::assemble_companion(ConstFieldView u, BlockMatrix& K) {
  refuse_assembly();
  if (!companion_) companion_ = std::make_unique<Companion>(body_, *laws_);
  companion_->assemble(u, model_->changed_bonds(), K);
}

std::vector<Field> BodyProblem::rigid_motions(ConstFieldView u) {
  const int d = dimension();
  Point middle{};
  for (const std::int32_t p : body_.internal())
    for (std::size_t c = 0; c < 3; ++c) middle[c] += body_.position(static_cast<std::size_t>(p))[c] / static_cast<double>(points());
  double size = spacing();
  for (const std::int32_t p : body_.internal())
    for (std::size_t c = 0; c < 3; ++c) size = std::max(size, std::abs(body_.position(static_cast<std::size_t>(p))[c] - middle[c]));
  std::vector<Field> motions;
  for (int k = 0; k < d * (d + 1) / 2; ++k) motions.push_back(make_field(d));
  for (const std::int32_t index : body_.internal()) {
    const auto p = static_cast<std::size_t>(index);
    Point y = body_.position(p);
    for (int c = 0; c < d; ++c) {
      y[static_cast<std::size_t>(c)] += u.component(c)[p] - middle[static_cast<std::size_t>(c)];
      motions[static_cast<std::size_t>(c)].component(c)[p] = 1;
    }
    std::size_t k = static_cast<std::size_t>(d);
    for (int a = 0; a < d; ++a)
      for (int b = a + 1; b < d; ++b, ++k) {
        motions[k].component(a)[p] = -y[static_cast<std::size_t>(b)] / size;
        motions[k].component(b)[p] = y[static_cast<std::size_t>(a)] / size;
      }
  }
  return motions;
}

double BodyProblem::kinetic_energy(ConstFieldView velocity) {
  const auto masses = mass();
  constexpr std::size_t block = 8192;
  return communicator().sum(ordered_sum((stride() + block - 1) / block, [&](std::size_t b) {
    double sum = 0;
    for (std::size_t p = b * block; p < std::min(stride(), (b + 1) * block); ++p) {
      double v2 = 0;
      for (int c = 0; c < dimension(); ++c) v2 += velocity.component(c)[p] * velocity.component(c)[p];
      sum += 0.5 * masses[p] * v2;
    }
    return sum;
  }));
}

Field BodyProblem::acceleration(double t) {
  Field a = body_.make_field(dimension());
  const auto masses = mass();
  const FieldView external = any_load() ? external_force() : FieldView{};
  for (int c = 0; c < dimension(); ++c)
    for (const std::int32_t index : body_.owned()) {
      const auto p = static_cast<std::size_t>(index);
      a.component(c)[p] = (internal_force_.component(c)[p] + (external.data ? external.component(c)[p] : 0.0)) / masses[p];
    }
  prescribe_acceleration(t, a);
  return a;
}

Field BodyProblem::reaction(bool dynamic, double t) {
  Field r = body_.make_field(dimension());
  if (!any_constraint()) return r;
  const FieldView external = any_load() ? external_force() : FieldView{};
  const Field a = dynamic ? acceleration(t) : Field();
  for (const std::int64_t dof : constrained_) {
    r.data()[dof] = -internal_force_.data()[dof] - (external.data ? external.data[dof] : 0.0);
    if (dynamic) r.data()[dof] += mass_[static_cast<std::size_t>(dof) % stride()] * a.data()[dof];
  }
  return r;
}

std::string BodyProblem::quiet_summary() const {
  const QuietCounts counts = model_->quiet_counts();
  if (counts.quiet == 0) return {};
  return fmt::format("quiet blocks  {} of {} blocks of points left out of force evaluations ({:.2f} %): no wave had reached them\n", counts.quiet, counts.blocks,
                     100.0 * static_cast<double>(counts.quiet) / static_cast<double>(counts.blocks));
}

std::size_t BodyProblem::bytes() const noexcept {
  std::size_t total = body_.bytes() + model_->report().bytes + displacement_.bytes() + internal_force_.bytes() + mass_.size() * 8;
  for (const auto& [name, field] : declared_) total += field.bytes();
  if (laws_->history()) total += laws_->history()->bytes();
  return total;
}

namespace {

void append(std::vector<std::byte>& bytes, const void* data, std::size_t size) {
  const auto* from = static_cast<const std::byte*>(data);
  bytes.insert(bytes.end(), from, from + size);
}

}  // namespace

class BodyProblem::ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  void take(void* to, std::size_t size) {
    if (size > bytes_.size()) throw InputError("the saved state is too short");
    if (size > 0) std::memcpy(to, bytes_.data(), size);   // an empty span may point nowhere
    bytes_ = bytes_.subspan(size);
  }
  template <class T>
  T value() {
    T v;
    take(&v, sizeof v);
    return v;
  }
  bool done() const noexcept { return bytes_.empty(); }

 private:
  std::span<const std::byte> bytes_;
};

void BodyProblem::append_bonds(std::vector<std::byte>& bytes) const {
  const auto scalar = [&](const auto& value) { append(bytes, &value, sizeof value); };
  scalar(gains_);
  scalar(gained_);
  const std::vector<BondChange> bonds = model_->changed_bonds();
  scalar(static_cast<std::uint64_t>(bonds.size()));
  for (const BondChange& b : bonds) {
    scalar(b.point);
    scalar(b.far);
    scalar(b.bond);
    scalar(b.integrity);
  }
}

void BodyProblem::take_bonds(ByteReader& in) {
  gains_ = in.value<std::int64_t>();
  gained_ = in.value<double>();
  std::vector<BondChange> bonds;
  for (auto left = in.value<std::uint64_t>(); left > 0; --left) {
    BondChange b;
    b.point = in.value<std::int32_t>();
    b.far = in.value<std::int32_t>();
    b.bond = in.value<std::int64_t>();
    b.integrity = in.value<double>();
    bonds.push_back(b);
  }
  model_->restore_bonds(bonds);
}

std::vector<std::byte> BodyProblem::bonds() const {
  std::vector<std::byte> bytes;
  if (damage_) append_bonds(bytes);
  return bytes;
}

void BodyProblem::restore_bonds(std::span<const std::byte> bonds) {
  ByteReader in(bonds);
  take_bonds(in);
}

std::vector<std::byte> BodyProblem::snapshot() const {
  std::vector<std::byte> bytes;
  const auto scalar = [&](const auto& value) { append(bytes, &value, sizeof value); };
  scalar(static_cast<std::uint64_t>(stride()));
  scalar(time_);
  scalar(last_step_);
  scalar(step_);
  scalar(energies_);
  append_bonds(bytes);
  scalar(static_cast<std::uint64_t>(numbers_.size()));
  for (const auto& [name, values] : numbers_) {
    scalar(static_cast<std::uint64_t>(name.size()));
    append(bytes, name.data(), name.size());
    scalar(static_cast<std::uint64_t>(values.size()));
    append(bytes, values.data(), values.size() * sizeof(double));
  }
  const std::span<const double> history = laws_->history() ? laws_->history()->values() : std::span<double>();
  scalar(static_cast<std::uint64_t>(history.size()));
  append(bytes, history.data(), history.size_bytes());
  const auto field = [&](const std::string& name, const Field& f) {
    scalar(static_cast<std::uint64_t>(name.size()));
    append(bytes, name.data(), name.size());
    scalar(static_cast<std::int64_t>(f.components()));
    append(bytes, f.data(), f.size() * sizeof(double));
  };
  field("displacement", displacement_);
  field("internal_force", internal_force_);
  if (eigenvector_.size() > 0) field("eigenvector", eigenvector_);
  for (const auto& [name, f] : declared_) field(name, f);
  return bytes;
}

void BodyProblem::restore(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  if (in.value<std::uint64_t>() != stride()) throw InputError("the saved state belongs to another body");
  time_ = in.value<double>();
  last_step_ = in.value<double>();
  step_ = in.value<std::int64_t>();
  energies_ = in.value<Energies>();
  take_bonds(in);
  const auto text = [&] {
    const auto length = in.value<std::uint64_t>();
    if (length > 256) throw InputError("the saved state is damaged");
    std::string name(length, ' ');
    in.take(name.data(), length);
    return name;
  };
  for (auto left = in.value<std::uint64_t>(); left > 0; --left) {
    const std::string name = text();
    const auto count = in.value<std::uint64_t>();
    if (count > 1u << 20) throw InputError("the saved state is damaged");
    const std::span<double> values = declare_numbers(name, count);
    in.take(values.data(), count * sizeof(double));
  }
  const std::span<double> history = laws_->history() ? laws_->history()->values() : std::span<double>();
  if (in.value<std::uint64_t>() != history.size()) throw InputError("the saved state belongs to other materials");
  in.take(history.data(), history.size_bytes());
  eigenvector_ = Field();
  while (!in.done()) {
    const std::string name = text();
    const auto components = in.value<std::int64_t>();
    if (components < 1 || components > 1024) throw InputError("the saved state is damaged");
    Field f = body_.make_field(static_cast<int>(components));
    in.take(f.data(), f.size() * sizeof(double));
    if (name == "displacement") displacement_ = std::move(f);
    else if (name == "internal_force") internal_force_ = std::move(f);
    else if (name == "eigenvector") eigenvector_ = std::move(f);
    else std::copy_n(f.data(), f.size(), declare(name, static_cast<int>(components)).data);   // views stay valid
  }
}

}  // namespace perikit
