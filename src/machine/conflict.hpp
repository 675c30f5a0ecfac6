// Errors about keys that do not go together.
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "draft.hpp"
#include "key_table.hpp"
#include "unflex/core/axes.hpp"

namespace unflex::machine {

// The first failure of check(v, …), which is asked for each axis in turn.
template <typename Check, typename... Values>
Status each_in_turn(Check&& check, Values&&... values) {
  Status first;
  for_each_axis(
      [&](auto&&... value) {
        if (first) {
          first = check(value...);
        }
      },
      values...);
  return first;
}

inline std::optional<SourcePlace> place_of(const Draft& draft, std::string_view key) {
  const std::optional<std::size_t> index = find_key(key);
  return index ? draft.places[*index] : std::nullopt;
}

// An error at the first of the keys that was given anywhere. If all are defaults, it has no place.
inline tl::unexpected<Error> conflict(const Draft& draft,
                                      std::initializer_list<std::string_view> keys,
                                      std::string message) {
  SourcePlace first;
  for (const std::string_view key : keys) {
    if (const std::optional<SourcePlace> place = place_of(draft, key)) {
      first = *place;
      break;
    }
  }
  return fail(ErrorKind::usage, std::move(first), std::move(message));
}

}  // namespace unflex::machine
