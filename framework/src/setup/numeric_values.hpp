#pragma once
/// The numbers and expressions of a part by key, and the constants that it makes of them.

#include <fmt/format.h>

#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>

#include "perikit/core/errors.hpp"
#include "scene/scene.hpp"

namespace perikit {

using NumericValues = std::map<std::string, Expression, std::less<>>;

/// with_time: expressions may mention t.
NumericValues numeric_values(const PartValues& part, const Constants& constants, bool with_time);

/// make() lets the part make its constants; what it throws becomes an InputError, at the key that it speaks of, as it knows it: "found NAME = ...". kind: of
/// the part, in words; where(): what follows the words of the part, asked for where there are any.
template <class Where, class Make>
void make_constants(const PartValues& part, std::string_view kind, const NumericValues& values, const Where& where, const Make& make) {
  const auto failed = [&](std::string_view what) {
    return InputError(part.values.position(""), part.values.path(), fmt::format("{} '{}' failed: {}", kind, part.type, what));
  };
  try {
    make();
  } catch (const std::domain_error& error) {
    const std::string text = error.what() + where();
    for (const auto& [key, value] : values)
      if (text.starts_with(fmt::format("found {} = ", key))) throw part.values.error(key, text);
    throw InputError(part.values.position(""), part.values.path(), text);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    throw failed(error.what());
  } catch (...) {
    throw failed("it threw something that is no std::exception");
  }
}

}  // namespace perikit
