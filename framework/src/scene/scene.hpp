#pragma once
/// A scene file, read and checked: every value typed, in range, with its place in the file. Nothing is built yet.

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "output_fields/state_field.hpp"
#include "perikit/core/space.hpp"
#include "perikit/plugin/parameters.hpp"
#include "perikit/plugin/part.hpp"
#include "scene/expressions/column_expression.hpp"
#include "scene/expressions/expression.hpp"

namespace perikit {

struct LatticeDescription {
  double spacing = 0;                       ///< [m]
  std::array<double, 3> lower{}, upper{};   ///< [m]; unused axes 0
  std::optional<Expression> inside;         ///< kept where nonzero
  double jitter = 0;                        ///< fraction of the spacing
  std::int64_t seed = 1;
  SourcePosition position;                  ///< of `inside` where it is given, else of the table
};

struct BodyDescription {
  int dimension = 3;
  Space space = Space::solid;
  double section = 1.0;                     ///< thickness (2D) [m], area (1D) [m^2], 1 in 3D
  std::optional<LatticeDescription> lattice;
  std::optional<std::filesystem::path> points_file;
  std::optional<std::array<double, 3>> points_lower, points_upper;  ///< of the body that the points of a file are in [m]
  std::optional<Expression> points_inside;                          ///< likewise where it is
  bool voronoi = false;            ///< volumes are those of Voronoi cells, not those of lattice cells or of the file
  SourcePosition volume_position;  ///< of the key that says so
  SourcePosition position;
};

/// Exactly one of expression, nearest, points.
struct SetDescription {
  std::string name;
  std::optional<Expression> expression;
  std::optional<std::array<double, 3>> nearest;
  std::vector<std::int64_t> points;
  SourcePosition position;
};

struct RegionDescription {
  std::string set;
  std::shared_ptr<const PartValues> material;
  SourcePosition position;
};

/// Bonds between the regions of two sets; "rest": what belongs to no region.
struct InterfaceDescription {
  std::array<std::string, 2> between;
  std::shared_ptr<const PartValues> damage;
  SourcePosition position;
};

struct CrackDescription {  ///< 2 vertices: segment; more: polygon
  std::vector<std::array<double, 3>> vertices;
  SourcePosition position;
};

/// Whether values of a boundary or load grow in proportion to the load parameter of a quasi-static run: as given, else those do
/// that do not mention t.
struct RampDescription {
  std::optional<bool> given;
  SourcePosition position;
};

/// One component of a prescribed motion: nullopt where "free".
struct BoundaryDescription {
  std::string set;
  std::string face;                          ///< "+x" ... "-z": of the set, is held; empty: the points of the set are
  std::optional<double> at;                  ///< where the face lies [m]
  std::optional<Expression> surface;         ///< zero on the surface that is held, negative in the body
  bool velocity = false;                     ///< else displacement
  std::vector<std::optional<Expression>> components;
  RampDescription ramp;
  SourcePosition position, face_position;  ///< of the displacement or velocity; of `at`, of the surface, else of the face

  /// Whether a side of the body is held, by images, and not points.
  bool holds_side() const noexcept { return !face.empty() || surface; }
};

struct SymmetryDescription {
  int axis = 0;
  std::optional<double> at;                  ///< of the plane [m]; else below the lowest points
  SourcePosition position;
};

struct PeriodicDescription {
  int axis = 0;
  std::optional<double> lower, upper;        ///< [m]; else the ends of the body
  SourcePosition position;
};

struct LoadDescription {
  enum class Type { force, body_force, traction, pressure } type = Type::force;
  std::string set;
  std::vector<Expression> components;  ///< of a pressure one
  bool follower = false;               ///< a pressure on the deformed surface
  std::string face;                    ///< "+x" ... "-z" for traction and, where given, for pressure
  RampDescription ramp;
  SourcePosition position;  ///< of it
};

/// A point term and the points that it acts on.
struct TermDescription {
  std::string set;
  std::shared_ptr<const PartValues> part;
};

struct HistoryDescription {
  std::string name, set, quantity, component, reduce;
  SourcePosition position;                   ///< of the quantity
  std::optional<ColumnExpression> value;     ///< of other columns; then nothing but the name is set besides
  std::optional<Expression> exact;           ///< with reduce "error"
  std::array<double, 3> at{};                ///< with reduce "fit" [m]
  std::array<double, 3> about{};             ///< with reduce "moment" [m]
  std::array<double, 3> direction{};         ///< with reduce "extent" and "tip", of length 1
  double above = 0;                          ///< likewise, in the unit of the quantity
  std::int64_t piece = 0;                    ///< with reduce "mass"
  /// Whether a row may have no value, which is written as nan, or an infinite one.
  bool may_be_missing() const noexcept { return value || reduce == "tip" || quantity == "shape_tensor_condition"; }
};

struct OutputDescription {
  std::optional<std::int64_t> frames, every;
  std::vector<double> times;
  std::int64_t history_every = 0;            ///< 0: default (every step for statics, about 1000 samples for explicit runs)
  std::int64_t checkpoint_every = 0;         ///< 0: none
  std::vector<std::string> fields;           ///< empty: default
  SourcePosition fields_position;
  std::vector<HistoryDescription> history;
  std::vector<StateField> states;            ///< what the laws of the scene remember, where fields or history ask for any of it
  std::vector<std::size_t> derived;          ///< those with a value from other columns, each after the ones that it uses
};

/// The columns that every history.csv begins with, and dissipated_by_laws, which follows where a law or a term dissipates.
const std::vector<std::string>& fixed_history_columns();

struct Scene {
  std::filesystem::path file;
  std::string text;                          ///< the file as read
  std::string resolved;                      ///< TOML with overrides applied and every default written out
  std::string title;
  Constants constants;
  BodyDescription body;
  std::vector<SetDescription> sets;
  double horizon = 0;              ///< [m]; 0: horizon_ratio given
  double horizon_ratio = 0;        ///< to the lattice spacing (or mean spacing of a cloud)
  std::optional<bool> consistent;  ///< nullopt where the scene does not say: as random_points()
  bool partial_volume = false;
  std::optional<bool> laminates;   ///< [family] interfaces; nullopt where the scene does not say
  SourcePosition laminates_position;
  SourcePosition consistent_position, partial_volume_position, horizon_position;
  std::shared_ptr<const PartValues> influence, kinematics, material, integrator;
  std::shared_ptr<const PartValues> stabilization, damage;   ///< null where the scene has none
  std::vector<RegionDescription> regions;
  std::vector<InterfaceDescription> interfaces;
  std::vector<CrackDescription> cracks;
  std::vector<std::string> no_fail;          ///< [damage] no_fail
  std::vector<std::optional<Expression>> initial_displacement, initial_velocity;   ///< empty or `dimension` long
  std::optional<std::filesystem::path> initial_from;
  SourcePosition initial_from_position;
  SourcePosition initial_velocity_position;
  std::vector<BoundaryDescription> boundaries;
  std::vector<SymmetryDescription> symmetries;
  std::vector<PeriodicDescription> periodics;
  std::vector<LoadDescription> loads;
  std::vector<TermDescription> terms;
  OutputDescription output;
  bool skip = true;                          ///< [run]: leave out work whose result is known
  bool share = true;                         ///< [run]: compute what is equal once
  double weak_springs = 0;                   ///< [run]: of loose pieces, share of a point's stiffness; 0: refused
  SourcePosition weak_springs_position;
  std::optional<int> threads;
  std::int64_t seed = 1;
  std::vector<std::string> silence;          ///< [run]: kinds of warnings that are not told
  std::vector<std::string> warnings;         ///< of what the scene itself says

  /// Whether points lie at random: [body.points], or a lattice with jitter.
  bool random_points() const noexcept { return body.points_file || (body.lattice && body.lattice->jitter > 0); }
};

struct SceneOptions {
  std::vector<std::string> overrides;        ///< "integrator.steps=20": values are TOML, or else taken as strings
  bool trust = false;                        ///< open the libraries that the scene lists
};

/// Reads and checks a scene. Opens (through the catalogue) the libraries of the parts it names and no others.
/// Throws InputErrors with every error found, each with file, line, column, key, what was found and what is allowed.
Scene read_scene(const std::filesystem::path& file, PartCatalogue& parts, const SceneOptions& options = {});
/// The same from memory; `file` is only used in messages and for relative paths.
Scene parse_scene(const std::string& text, const std::filesystem::path& file, PartCatalogue& parts,
                  const SceneOptions& options = {});

/// Checked values of one part from TOML text of its table without `type` - for contract suites and tests.
/// Throws InputErrors.
std::shared_ptr<const PartValues> parse_part(Kind kind, const std::string& type, const std::string& toml, PartCatalogue& parts);

/// The keys of the scene's own sections ("" for the top level, "body", "body.lattice", "family", "output", ...), for `describe`
/// and the reference page. "kinematics", "damage" and "term" hold the keys that the framework adds to every part of
/// these kinds.
const std::vector<std::pair<std::string, ParameterTable>>& scene_sections();

}  // namespace perikit
