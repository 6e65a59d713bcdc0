#include "run/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string_view>

#include "perikit/core/communicator.hpp"
#include "perikit/core/memory.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/warnings.hpp"
#include "run/earlier_results.hpp"
#include "setup/conditions.hpp"
#include "setup/problem.hpp"
#include "warnings/doubts.hpp"
#include "warnings/small_strains.hpp"

namespace perikit {

Simulation::Simulation(const Scene& scene, const PartFactory& factory, WorkSteps::Show show)
    : set_up_(std::move(show)), scene_(scene) {
  if (scene_.threads) set_thread_count(*scene_.threads);
  integrator_ = factory.integrator(*scene_.integrator);
  traits_ = integrator_->traits();
  problem_ = build_problem(scene_, factory, traits_, set_up_);
  if (traits_.dynamic) problem_->masses().by_point();   // refuses missing densities
  if (traits_.quasi_static && !scene_.initial_velocity.empty()) {
    throw InputError(
        scene_.initial_velocity_position, "initial.velocity",
        fmt::format("found with integrator \"{}\", which knows no velocities; allowed: with integrators of dynamic runs",
                    scene_.integrator->type));
  }
  if (!problem_->terms().has_gradients()) refuse_shapes();
  small_strains_ = std::make_unique<SmallStrains>(scene_, factory, *problem_);
  carried_ = carry_from_earlier_run(scene_, *problem_);
  evaluate_conditions();
  watch_pieces();
  set_up_.end();
}

Simulation::~Simulation() = default;

void Simulation::tell_limits(PartCatalogue& parts) { small_strains_->tell_limits(parts); }

void Simulation::watch_pieces() {
  if (!traits_.quasi_static) {
    if (scene_.weak_springs == 0) return;
    throw InputError(scene_.weak_springs_position, "run.weak_springs",
                     fmt::format("found with integrator \"{}\", which looks for no equilibrium; allowed: in quasi-static runs", scene_.integrator->type));
  }
  loose_ = problem_->watch_pieces(scene_.weak_springs);
  if (loose_.empty() || scene_.weak_springs > 0) return;
  throw InputError({scene_.file.string()}, "boundary",
                   fmt::format("found nothing that holds {}: it can move as a whole, and a quasi-static run has no answer; allowed: boundaries that hold every piece "
                               "of the body against translation and rotation, or [run] weak_springs",
                               loose_));
}

void Simulation::evaluate_conditions() {
  const double end = end_of(scene_, traits_.quasi_static);
  Field scratch = problem_->make_field();
  for (const double t : {0.0, end}) problem_->loads().evaluate(t, scratch);
  // What is prescribed of displacements in time is asked for from the first step on.
  if (traits_.dynamic)
    problem_->constraints().prescribe_velocity(0, scratch);
  else
    problem_->constraints().prescribe_displacement(0, scratch);
  problem_->constraints().prescribe_displacement(end, scratch);
  const Body& body = problem_->body();
  for (std::size_t k = 0; k < scene_.output.history.size(); ++k) {
    const HistoryDescription& record = scene_.output.history[k];
    if (record.reduce == "mass") problem_->masses().by_point();   // throws where a density is missing
    if (record.value && !problem_->dissipates() && std::ranges::find(record.value->columns(), "dissipated_by_laws") != record.value->columns().end())
      throw InputError(record.value->position(), fmt::format("output.history.{}.value", k),
                       "found the column dissipated_by_laws, which there is only where a law or a term dissipates; allowed: the other columns");
    if (!record.exact) continue;
    for (const std::int32_t p : body.set(record.set)) (*record.exact)(body.position(static_cast<std::size_t>(p)), 0);
  }
}

void Simulation::refuse_shapes() const {
  const auto check = [&](const std::string& field, const SourcePosition& position, const std::string& key) {
    if (!names_state(field) && !find_point_field(field)->of_shapes) return;
    std::vector<std::string> others;
    for (const PointField& other : point_fields())
      if (!other.of_shapes) others.push_back(other.name);
    throw InputError(position, key, fmt::format("found \"{}\", but kinematics \"{}\" is a pair law without shape tensors; allowed: {}",
                                                field, scene_.kinematics->type, fmt::join(others, ", ")));
  };
  for (const std::string& field : scene_.output.fields) check(field, scene_.output.fields_position, "output.fields");
  for (std::size_t k = 0; k < scene_.output.history.size(); ++k) {
    if (!scene_.output.history[k].value) check(scene_.output.history[k].quantity, scene_.output.history[k].position, fmt::format("output.history.{}.quantity", k));
  }
}

double Simulation::refuse_memory() {
  const double bytes = communicator().largest(integrator_->memory(*problem_)), limit = memory_limit();   // refused by all ranks or by none
  if (bytes <= limit) return bytes;
  throw RunError(fmt::format("{}: matrices, factors and vectors of its solver need about {:.3g} GB; this machine offers {:.3g} GB; jfnk with preconditioner = \"companion\", or newton "
                             "with linear_solver = \"krylov\", take least",
                             scene_.integrator->type, bytes / 1e9, limit / 1e9));
}

void Simulation::run(Observer& observer) {
  const auto failed = [&](std::string_view what) { return RunError(fmt::format("integrator {}: {}", scene_.integrator->type, what)); };
  try {
    integrator_->run(*problem_, observer);
  } catch (const RunError&) {
    throw;
  } catch (const InputError&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw failed(error.what());
  } catch (...) {
    throw failed("it threw something that is no std::exception");
  }
}

namespace {

/// On rank 0 those of the lines that all ranks have. All of them must call it.
std::vector<std::string> said_by_all(const std::vector<std::string>& lines) {
  const std::string mine = fmt::format("{}\n", fmt::join(lines, "\n"));
  std::vector<std::string> left = lines;
  for (const std::vector<std::byte>& bytes : communicator().gather(std::as_bytes(std::span(mine)))) {
    const std::string other = fmt::format("\n{}", std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    std::erase_if(left, [&](const std::string& line) { return other.find(fmt::format("\n{}\n", line)) == std::string::npos; });
  }
  return left;
}

/// How the body lies on ranks. All of them must call it.
std::string ranks_summary(const BodyProblem& problem) {
  const Partition& partition = *problem.partition();
  const std::vector<std::int64_t>& points = partition.points();
  const double mean = static_cast<double>(problem.points().size_on_all_ranks()) / static_cast<double>(points.size());
  const auto ghosts = static_cast<double>(problem.ghosts()->size());
  const auto bytes = static_cast<double>(problem.bytes());
  const double most_ghosts = communicator().largest(ghosts), most_bytes = communicator().largest(bytes);
  const double sent = communicator().largest(8.0 * problem.dimension() * static_cast<double>(problem.ghosts()->sent()));
  return fmt::format(
      "ranks         {} with {} threads each\n"
      "balance       {} points on the largest rank, {:.3f} of the mean\n"
      "ghosts        at most {:.0f} points a rank, {:.2f} of the mean number of its own\n"
      "exchange      at most {:.3g} MB a rank and step\n"
      "memory        at most {:.3g} MB a rank ({:.0f} bytes a point of all)\n",
      points.size(), thread_count(), *std::ranges::max_element(points),
      static_cast<double>(*std::ranges::max_element(points)) / mean, most_ghosts, most_ghosts / mean, sent / 1e6,
      most_bytes / 1e6, most_bytes / mean);
}

}  // namespace

std::string Simulation::summary() {
  const Body& body = problem_->body();
  const ModelReport report = problem_->report();
  std::string text = fmt::format("points        {} ({}, {}D, spacing {:.6g} m, horizon {:.6g} m)\n", body.points_of_all_ranks(),
                                 body.lattice() ? "lattice" : "cloud", body.dimension(), body.spacing(), body.horizon());
  if (problem_->images())
    text += fmt::format("images        {} points beyond faces, planes of symmetry and periodic sides\n",
                        problem_->partition() ? problem_->partition()->images() : body.points() - body.points_of_all_ranks());
  std::int64_t singular = static_cast<std::int64_t>(report.singular_families);
  communicator().sum({&singular, 1});
  std::vector<std::string> lines, warnings;
  if (singular > 0)
    warnings.push_back(named("lone_points", fmt::format("{} points, {:.2g} % of all, have {}; a larger horizon, or points that lie closer", singular,
                                                        100.0 * static_cast<double>(singular) / static_cast<double>(body.points_of_all_ranks()),
                                                        problem_->terms().has_gradients() ? "a family too poor for a gradient; they carry no strain of their own" : "no bonds")));
  for (const std::vector<std::string>& more : {scene_.warnings, problem_->warnings(), doubts(scene_, *problem_), report.warnings})
    warnings.insert(warnings.end(), more.begin(), more.end());
  if (!loose_.empty())
    warnings.push_back(named("loose_pieces", fmt::format("nothing but weak springs ({:g} of a point's stiffness) holds {}", scene_.weak_springs, loose_)));
  if (problem_->terms().material_points() && carried_.find("history") == std::string::npos && (!scene_.initial_displacement.empty() || scene_.initial_from))
    warnings.push_back(named("first_step", "the displacement at the start is one increment from the undeformed body for materials whose stress depends on the path"));
  for (const std::string& note : problem_->notes()) lines.push_back(fmt::format("side          {}", note));
  for (const auto& [label, note] : report.notes) lines.push_back(fmt::format("{:<13} {}", label, note));
  for (const std::string& warning : without_silenced(std::move(warnings), scene_.silence)) lines.push_back(fmt::format("warning       {}", warning));
  if (problem_->partition()) {
    text += ranks_summary(*problem_);
    // Counts of bonds and of evaluation points are of each rank, with its ghosts.
    for (const std::string& line : said_by_all(lines)) text += line + "\n";
    if (!carried_.empty()) text += fmt::format("carried       {}\n", carried_);
    return text + plan();
  }
  text += fmt::format("bonds         {} ({:.1f} a point)\n", report.bonds,
                      static_cast<double>(report.bonds) / static_cast<double>(body.points()));
  if (report.broken_bonds > 0) text += fmt::format("cut bonds     {} by pre-cracks\n", report.broken_bonds);
  for (const std::string& line : lines) text += line + "\n";
  if (!carried_.empty()) text += fmt::format("carried       {}\n", carried_);
  if (report.fallbacks > 0) text += fmt::format("fallbacks     {} evaluation points fall back to the whole family, or to a lower order\n", report.fallbacks);
  if (report.dropped_parts > 0) text += fmt::format("dropped parts {} parts of families are too poor for a gradient; the other parts share their weight\n", report.dropped_parts);
  text += fmt::format("evaluations   {} a force evaluation\n", report.evaluation_points);
  const double bytes = static_cast<double>(problem_->bytes());
  text += fmt::format("memory        {:.3g} MB ({:.0f} bytes a point)\n", bytes / 1e6, bytes / static_cast<double>(body.owned().size()));
  return text + plan();
}

std::string Simulation::plan() {
  const std::string plan = integrator_->plan(*problem_);
  return plan.empty() ? plan : fmt::format("integration   {}: {}\n", scene_.integrator->type, plan);
}

std::string Simulation::explanation(const Registry& registry) const {
  std::vector<SkipNote> notes = problem_->report().skips;
  std::size_t known = 0;
  for (const Kind kind : all_kinds) known += registry.names(kind).size();
  notes.push_back({"libraries that the scene does not name", "parts are found by manifest", fmt::format("{} libraries opened for {} known parts", registry.opened().size(), known)});
  if (!scene_.damage) notes.push_back({"bond state, damage checks, recomputed shape tensors", "no [damage]", "a bit a bond and one pass a step"});
  if (scene_.damage) notes.push_back({"checks of bonds that cannot have failed yet", "each group of eight points knows how far its nearest bond is from failing", "counted in run.log at the end"});
  if (scene_.skip && traits_.dynamic && problem_->terms().conservative()) {
    notes.push_back({"parts of the body that no wave has reached", "blocks of points at rest whose families' families are at rest have no forces", "counted in run.log at the end"});
    if (const std::size_t held = problem_->constraints().points_held_at_rest(); held > 0) {
      notes.push_back({"points held at rest", "no wave ever reaches them; within the reach of others their stress acts on those, and reactions come with it",
                       fmt::format("the blocks of {} points, less those in reach of others", held)});
    }
  }
  if (!traits_.dynamic) notes.push_back({"velocity, mass", "not a dynamic run", fmt::format("{:.3g} MB", static_cast<double>(problem_->points().stride()) * 8e-6 * (2 * problem_->dimension() + 1))});
  if (problem_->constant_stiffness()) notes.push_back({"new estimates of the stable step", "every law has a constant tangent", "one Lanczos run in 500 steps"});
  notes.push_back({"energies", "only summed where history samples", "one psi an evaluation point and step"});
  const std::size_t fields = point_fields().size() + scene_.output.states.size(), written = std::max<std::size_t>(scene_.output.fields.size(), 3);
  notes.push_back({"fields that nobody asked for", "computed when written",
                   fmt::format("{} of {} point fields", fields - std::min(fields, written), fields)});
  std::string text = "skipped:\n";
  for (const SkipNote& note : notes) text += fmt::format("  {}: {} - saves {}\n", note.what, note.why, note.saves);
  return text;
}

}  // namespace perikit
