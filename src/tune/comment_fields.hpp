// Fields of a comment by which a tower's file tells what it tries: " name=value" one after another.
#pragma once

#include <cmath>
#include <optional>
#include <string_view>

#include "unflex/core/number.hpp"

namespace unflex::tune {

// Takes " name=value" from the front of a line.
[[nodiscard]] inline std::optional<std::string_view> take(std::string_view& line,
                                                          std::string_view name) {
  if (!line.starts_with(' ')) {
    return std::nullopt;
  }
  line.remove_prefix(1);
  if (!line.starts_with(name) || line.substr(name.size(), 1) != "=") {
    return std::nullopt;
  }
  line.remove_prefix(name.size() + 1);
  const std::string_view value = line.substr(0, line.find(' '));
  line.remove_prefix(value.size());
  return value;
}

// Takes a number that is finite. False if there is none.
[[nodiscard]] inline bool take_number(std::string_view& line, std::string_view name,
                                      double& number) {
  const std::optional<std::string_view> text = take(line, name);
  const std::optional<double> value = text ? parse_number(*text) : std::nullopt;
  number = value.value_or(0.0);
  return value && std::isfinite(*value);
}

}  // namespace unflex::tune
