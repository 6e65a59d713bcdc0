#pragma once
/// Turns a parsed scene into checked values, section by section.

#include <set>

#include "scene/scene.hpp"
#include "scene/toml/resolved.hpp"
#include "scene/toml/toml_reader.hpp"

namespace perikit {

class SceneReader {
 public:
  SceneReader(PartCatalogue& parts, const std::filesystem::path& file, bool trust);

  /// Reads everything; errors are collected in errors().
  void read(toml::table& root);
  Diagnostics& errors() noexcept { return reader_.errors; }
  /// The scene with its resolved text, once there are no errors.
  Scene take();

 private:
  void refuse_reserved(toml::table& root);
  void read_head(const toml::table& root);
  void read_constants(const toml::table& root);
  double constant(const std::string& name, const toml::node& node);
  void read_body(const toml::table& root);
  void read_lattice(const toml::table& body);
  void read_points(const toml::table& body);
  void read_points_box(const ParameterValues& values);
  void read_sets(const toml::table& root);
  void read_family(const toml::table& root);
  void read_parts(const toml::table& root);
  std::shared_ptr<const PartValues> with_second_law(std::shared_ptr<const PartValues> criterion);
  void read_regions(const toml::table& root);
  void read_interfaces(const toml::table& root);
  void read_cracks(const toml::table& root);
  void read_initial(const toml::table& root);
  void read_boundaries(const toml::table& root);
  void read_surface(const ParameterValues& values, BoundaryDescription& boundary);
  /// [[symmetry]] and [[periodic]].
  void read_planes(const toml::table& root);
  void read_loads(const toml::table& root);
  void read_terms(const toml::table& root);
  void read_output(const toml::table& root);
  /// What the laws of the scene remember; null where they cannot be made.
  const std::vector<StateField>* states();
  /// Numbers in a row of a field; 0: not known, or after an error.
  int width_of(const std::string& field);
  /// An error where no law of the scene remembers the variable that `field` names, and nothing of other fields.
  void check_state(const std::string& field, const SourcePosition& position, const std::string& key);
  void read_history(const toml::table& output);
  void read_column(const toml::table& record, const ParameterValues& values, HistoryDescription& column);
  void read_derived(const std::vector<ParameterValues>& columns);
  void read_run(const toml::table& root);
  static void names_below(const toml::node& node, std::set<std::string>& names);
  void find_unused_constants(const toml::table& root);

  /// The table `key` of `parent`; null (after an error if it is no table, or missing though required) where there is none.
  const toml::table* section(const toml::table& parent, const std::string& key, const std::string& path, bool required = false);
  /// The tables of [[key]].
  std::vector<const toml::table*> sections(const toml::table& parent, const std::string& key, const std::string& path);
  /// An error unless `name` is a set.
  void check_set(const std::string& name, const SourcePosition& position, const std::string& key);
  /// An error unless the body has this axis.
  void check_axis(char axis, const ParameterValues& values, const char* key);
  RampDescription ramp_of(const ParameterValues& values, const std::vector<std::optional<Expression>>& components);
  /// The set that `values` names, checked.
  std::string set_of(const ParameterValues& values);
  std::vector<Expression> expressions(const ParameterValues& values, const std::string& key, bool with_time) const;
  std::vector<std::optional<Expression>> components(const ParameterValues& values, const std::string& key) const;
  /// An existing file, relative to the scene, as an absolute path; written so into `values` too.
  std::optional<std::filesystem::path> existing_file(ParameterValues& values, const std::string& key);
  std::filesystem::path from_scene_folder(const std::string& path) const;

  PartCatalogue& parts_;
  TomlReader reader_;
  bool lattice_seed_ = false;  ///< body.lattice has a seed of its own
  ResolvedWriter writer_;
  Scene scene_;
  std::vector<std::string> set_names_;
  bool states_found_ = false;
  bool trust_;
};

}  // namespace perikit
