// The table of all keys: name, member, bounds, unit, meaning.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "draft.hpp"

namespace unflex::machine {

// Interval a number must lie in; an open end does not belong to it.
struct Bounds {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_open = false;
  bool max_open = false;

  [[nodiscard]] bool contains(double value) const;
};

// The member behind a key. The alternative held says what type of value the key takes.
using Member =
    std::variant<double& (*)(Draft&), std::optional<double>& (*)(Draft&), bool& (*)(Draft&),
                 std::optional<bool>& (*)(Draft&), Firmware& (*)(Draft&), Kinematics& (*)(Draft&),
                 std::optional<Range>& (*)(Draft&), std::optional<Motors::Row>& (*)(Draft&),
                 std::optional<Pair>& (*)(Draft&), std::string& (*)(Draft&),
                 std::vector<ModeSettings>& (*)(Draft&), std::vector<PlantSettings>& (*)(Draft&),
                 std::vector<FrequencyMap>& (*)(Draft&)>;

struct Key {
  std::string_view name;
  Member member;
  Bounds bounds;  // only for numbers
  std::string_view unit;
  std::string_view meaning;
  // For optional members: the value in force while the member is unset, in words, and as a number
  // if there is one. A number that is not finite stands for none.
  std::string_view if_unset = {};
  double (*in_force)(const Settings&) = nullptr;
  // The words that a text may be; empty: any text.
  std::span<const std::string_view> words = {};
  // The key is another form of other keys: its value is converted into theirs and not kept.
  bool converted = false;
  // Whether a key with words may also be this text, which is none of the words.
  bool (*or_text)(std::string_view) = nullptr;
};

[[nodiscard]] std::span<const Key> key_table();

// Position of a key in the table.
[[nodiscard]] std::optional<std::size_t> find_key(std::string_view name);

// Whether keys start with "name.".
[[nodiscard]] bool is_section(std::string_view name);

}  // namespace unflex::machine
