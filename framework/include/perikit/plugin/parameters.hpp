#pragma once
/// Parameter tables: every parameter of a part (and every key of a scene section) is declared once. Parsing, range errors,
/// unknown-key errors, `perikit describe`, the resolved scene and the reference page all come from the table.

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "perikit/core/errors.hpp"

namespace perikit {

enum class Kind { kinematics, stabilization, material, damage, influence, term, integrator };

/// "kinematics", "stabilization", "material", "damage", "influence", "term", "integrator".
std::string_view name(Kind kind) noexcept;
std::optional<Kind> kind_from_name(std::string_view name) noexcept;
inline constexpr std::array all_kinds{Kind::kinematics, Kind::stabilization, Kind::material,  Kind::damage,
                                      Kind::influence,  Kind::term,          Kind::integrator};

enum class ParameterType {
  number,       ///< a float or integer, finite
  integer,      ///< an integer
  boolean,
  text,         ///< any string
  choice,       ///< one of a list of strings
  expression,   ///< a finite number, or a string in x, y, z (and t where `time` is set)
  component,    ///< as expression, or the word "free"
  components,   ///< a list of `component`, as long as the dimension of the body
  expressions,  ///< a list of `expression`
  numbers,      ///< a list of numbers
  integers,     ///< a list of integers
  texts,        ///< a list of strings
  points,       ///< a list of lists of numbers (coordinates)
  part,         ///< a part of `kind`: its name, or a table { type = "name", ... }
};

/// One parameter. Built by the member functions of ParameterTable; plain data afterwards.
struct Parameter {
  std::string name;
  ParameterType type = ParameterType::number;
  std::string unit;                    ///< SI unit, "-" for none
  std::string text;                    ///< one sentence
  bool required = false;
  std::string default_text;            ///< TOML text of the default ("1.0", "\"volume\"", "[1, 2]"); empty: no default
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  bool lower_open = false, upper_open = false;
  std::vector<std::string> choices;
  std::string choice_prefix{};         ///< beside the choices: every text that begins with this; empty: none
  std::size_t min_length = 0, max_length = std::numeric_limits<std::size_t>::max();
  bool time = false;                   ///< expressions may use t
  bool per_point = false;              ///< material parameter that may vary in space; evaluated at set-up
  bool per_axis = false;               ///< numbers, expressions: as long as the dimension of the body; points: each of them
  Kind kind = Kind::influence;         ///< for type part

  // Modifiers, to be chained after ParameterTable::number and its like.
  Parameter& require() { required = true; return *this; }
  Parameter& by_default(std::string toml) { default_text = std::move(toml); return *this; }
  Parameter& at_least(double v) { lower = v; lower_open = false; return *this; }
  Parameter& above(double v) { lower = v; lower_open = true; return *this; }
  Parameter& at_most(double v) { upper = v; upper_open = false; return *this; }
  Parameter& below(double v) { upper = v; upper_open = true; return *this; }
  Parameter& positive() { return above(0.0); }
  Parameter& length(std::size_t least, std::size_t most) { min_length = least; max_length = most; return *this; }
  Parameter& with_time() { time = true; return *this; }
  Parameter& one_per_axis() { per_axis = true; return *this; }
};

/// What a value may be, as messages and the reference page print it: "a number > 0 [m]", "\"strain\" or \"stress\"".
std::string allowed(const Parameter& parameter);

/// "exactly `count` of `names` must be given" (count < 0: at most -count).
struct ParameterGroup {
  int count;
  std::vector<std::string> names;
};

class ParameterTable {
 public:
  Parameter& number(std::string name, std::string unit, std::string text);
  Parameter& integer(std::string name, std::string text);
  Parameter& boolean(std::string name, std::string text);
  Parameter& string(std::string name, std::string text);
  Parameter& choice(std::string name, std::vector<std::string> choices, std::string text);
  Parameter& expression(std::string name, std::string unit, std::string text);
  Parameter& part(std::string name, Kind kind, std::string text);
  /// Any other type.
  Parameter& add(ParameterType type, std::string name, std::string unit, std::string text);
  /// A material parameter: a number, or an expression in x, y, z that is evaluated at every point at set-up.
  Parameter& material(std::string name, std::string unit, std::string text);

  // Texts that are missing, or too many.
  template <class... Texts>
  requires(sizeof...(Texts) != 3)
  Parameter& number(const Texts&...) { return misdeclared<sizeof...(Texts) == 3>(); }
  template <class... Texts>
  requires(sizeof...(Texts) != 3)
  Parameter& material(const Texts&...) { return misdeclared<sizeof...(Texts) == 3>(); }
  template <class... Texts>
  requires(sizeof...(Texts) != 3)
  Parameter& expression(const Texts&...) { return misdeclared<sizeof...(Texts) == 3>(); }
  template <class... Texts>
  requires(sizeof...(Texts) != 2)
  Parameter& integer(const Texts&...) { return misdeclared<true, sizeof...(Texts) == 2>(); }
  template <class... Texts>
  requires(sizeof...(Texts) != 2)
  Parameter& boolean(const Texts&...) { return misdeclared<true, sizeof...(Texts) == 2>(); }
  template <class... Texts>
  requires(sizeof...(Texts) != 2)
  Parameter& string(const Texts&...) { return misdeclared<true, sizeof...(Texts) == 2>(); }

  ParameterTable& exactly(int count, std::vector<std::string> names);
  ParameterTable& at_most_of(int count, std::vector<std::string> names);

  const std::vector<Parameter>& parameters() const noexcept { return parameters_; }
  const std::vector<ParameterGroup>& groups() const noexcept { return groups_; }
  const Parameter* find(std::string_view name) const noexcept;

 private:
  template <bool with_unit, bool without_unit = true>
  Parameter& misdeclared() {
    static_assert(with_unit, "a parameter is declared by its name, its unit and what it is: table.number(\"width\", \"m\", \"Width of the bell.\"); "
                             "\"-\" is no unit");
    static_assert(without_unit, "a parameter without unit is declared by its name and what it is: table.integer(\"order\", \"Order of the gradient.\")");
    return parameters_.front();
  }
  std::vector<Parameter> parameters_;
  std::vector<ParameterGroup> groups_;
};

/// density, and exactly two of youngs_modulus, poisson_ratio, shear_modulus, bulk_modulus, lame_lambda.
ParameterTable elastic_parameters();
/// elastic_parameters(), and volumetric = "quadratic" (kappa/2 (J-1)^2, default) | "logarithmic" (kappa/2 (ln J)^2).
ParameterTable rubber_parameters();

class PartValues;

/// A checked value. expression-like values hold either a number or the text of the expression.
using ParameterValue = std::variant<double, std::int64_t, bool, std::string, std::vector<double>, std::vector<std::int64_t>,
                                    std::vector<std::string>, std::vector<std::vector<double>>,
                                    std::vector<std::variant<double, std::string>>, std::shared_ptr<const PartValues>>;

/// The checked values of one table (defaults filled in), with the place each came from.
/// Asking for a key that is not there, or as another type, throws std::logic_error: the part and its table disagree.
class ParameterValues {
 public:
  bool has(std::string_view key) const noexcept;
  /// True where the scene itself gave the value (not a default).
  bool given(std::string_view key) const noexcept;

  double number(std::string_view key) const;
  std::int64_t integer(std::string_view key) const;
  bool boolean(std::string_view key) const;
  const std::string& text(std::string_view key) const;
  const std::vector<double>& numbers(std::string_view key) const;
  const std::vector<std::int64_t>& integers(std::string_view key) const;
  const std::vector<std::string>& texts(std::string_view key) const;
  const std::vector<std::vector<double>>& points(std::string_view key) const;
  /// True where the value is a text that stands for an expression (never for choices and names).
  bool is_expression(std::string_view key) const noexcept;
  /// number or expression text; also for type component ("free" is the text "free").
  std::variant<double, std::string> expression(std::string_view key) const;
  const std::vector<std::variant<double, std::string>>& expressions(std::string_view key) const;
  const PartValues& part(std::string_view key) const;
  std::shared_ptr<const PartValues> shared_part(std::string_view key) const;

  /// Where the value (or, failing that, the table) stands in the input.
  SourcePosition position(std::string_view key) const;
  /// An InputError at that place: throw values.error("order", "2 needs ...").
  InputError error(std::string_view key, std::string_view message) const;

  void set(std::string key, ParameterValue value, SourcePosition position = {}, bool given = true);
  void mark_expression(std::string_view key);
  void set_path(std::string path) { path_ = std::move(path); }      ///< e.g. "kinematics.base"
  const std::string& path() const noexcept { return path_; }
  void set_table_position(SourcePosition p) { table_position_ = std::move(p); }
  std::vector<std::string> keys() const;
  const ParameterValue* find(std::string_view key) const noexcept;

 private:
  struct Entry {
    ParameterValue value;
    SourcePosition position;
    bool given = true;
    bool expression = false;
  };
  std::map<std::string, Entry, std::less<>> entries_;
  std::string path_;
  SourcePosition table_position_;
};

/// A chosen part: kind, registered name, and its checked parameters.
class PartValues {
 public:
  Kind kind = Kind::influence;
  std::string type;
  ParameterValues values;
};

}  // namespace perikit
