#pragma once
/// Expressions of the columns of history.csv: + - * / ^, comparisons, && ||, ?:, the usual functions, names of columns, t, pi and the scene's
/// [constants].

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "perikit/core/errors.hpp"
#include "scene/expressions/expression.hpp"

namespace perikit {

/// A number made from other columns of the same row. Copies share the parsed form.
class ColumnExpression {
 public:
  /// `columns`: the names that it may use. Throws InputError at `position` (with `key`) for text that does not parse, for a name that is neither a
  /// column nor a constant, and for one that is both.
  ColumnExpression(const std::string& text, const std::vector<std::string>& columns, const Constants& constants, SourcePosition position, std::string key);

  /// The columns that it uses, each once.
  const std::vector<std::string>& columns() const noexcept { return columns_; }
  const std::string& text() const noexcept { return text_; }
  const SourcePosition& position() const noexcept { return position_; }
  /// The value where columns() have these values, at time t (load parameter t in statics). NaN where it is not finite, as after a division by zero.
  double operator()(std::span<const double> values, double t) const;

 private:
  struct Parser;
  std::vector<std::string> columns_;
  std::string text_;
  SourcePosition position_;
  std::shared_ptr<Parser> parser_;
};

}  // namespace perikit
