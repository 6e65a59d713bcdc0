#pragma once
/// Expressions of scenes: + - * / ^, comparisons, && ||, the usual functions, x y z t pi and the scene's [constants].

#include <array>
#include <map>
#include <memory>
#include <string>
#include <variant>

#include "perikit/core/errors.hpp"

namespace perikit {

using Constants = std::map<std::string, double>;

/// A number, or a parsed expression in x, y, z and (where allowed) t. Cheap to copy; copies share
/// the parsed form, so that an expression and its copies must not be evaluated by two threads at once.
class Expression {
 public:
  Expression() : Expression(0.0) {}
  explicit Expression(double number);
  /// Throws InputError at `position` (with `key`) for text that does not parse or names an unknown variable.
  Expression(const std::string& text, const Constants& constants, bool with_time, SourcePosition position, std::string key);
  Expression(const std::variant<double, std::string>& value, const Constants& constants, bool with_time, SourcePosition position,
             std::string key);

  bool is_number() const noexcept { return !parser_; }
  /// Whether the value can change with t.
  bool depends_on_time() const noexcept { return uses_t_; }
  bool depends_on_position() const noexcept { return uses_position_; }
  /// Throws InputError naming the key and the point where the value is NaN or infinite.
  double operator()(const std::array<double, 3>& x, double t = 0.0) const;

 private:
  struct Parser;
  double number_ = 0.0;
  std::shared_ptr<Parser> parser_;
  bool uses_t_ = false, uses_position_ = false;
};

}  // namespace perikit
