#include "key_values.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <cmath>

#include "assign.hpp"
#include "unflex/machine/keys.hpp"

namespace unflex::machine {
namespace {

template <class T>
std::optional<std::string> text_of(const T& value) {
  return to_toml_value(value);
}

template <class T>
std::optional<std::string> text_of(const std::optional<T>& value) {
  return value ? std::optional(to_toml_value(*value)) : std::nullopt;
}

std::optional<std::string> text_of(const std::vector<ModeSettings>& value) {
  return value.empty() ? std::nullopt : std::optional(to_toml_value(value));
}

std::optional<std::string> text_of(const std::vector<PlantSettings>& value) {
  return value.empty() ? std::nullopt : std::optional(to_toml_value(value));
}

std::optional<std::string> text_of(const std::vector<FrequencyMap>& value) {
  return value.empty() ? std::nullopt : std::optional(to_toml_value(value));
}

std::string bounds_text(const Bounds& bounds) {
  const std::string low = std::isfinite(bounds.min)
                              ? fmt::format("{}{}", bounds.min_open ? "> " : "≥ ", bounds.min)
                              : std::string{};
  const std::string high = std::isfinite(bounds.max)
                               ? fmt::format("{}{}", bounds.max_open ? "< " : "≤ ", bounds.max)
                               : std::string{};
  return low.empty() || high.empty() ? low + high : low + ", " + high;
}

}  // namespace

std::string to_toml_value(double value) { return fmt::format("{}", value); }

std::string to_toml_value(bool value) { return value ? "true" : "false"; }

std::string to_toml_value(Firmware value) { return fmt::format("\"{}\"", to_string(value)); }

std::string to_toml_value(Kinematics value) { return fmt::format("\"{}\"", to_string(value)); }

std::string to_toml_value(const std::string& value) { return fmt::format("\"{}\"", value); }

std::string to_toml_value(const Range& value) {
  return fmt::format("[{}, {}]", value.min, value.max);
}

std::string to_toml_value(const Motors::Row& value) {
  return fmt::format("[{}]", fmt::join(value, ", "));
}

std::string to_toml_value(const Pair& value) { return fmt::format("[{}]", fmt::join(value, ", ")); }

std::string to_toml_value(const std::vector<ModeSettings>& value) {
  std::string text;
  for (const ModeSettings& mode : value) {
    text += fmt::format("{}{{freq_hz = {}, damping_ratio = {}, gain = {}}}",
                        text.empty() ? "" : ", ", mode.freq_hz, mode.damping_ratio, mode.gain);
  }
  return "[" + text + "]";
}

std::string to_toml_value(const std::vector<PlantSettings>& value) {
  std::string text;
  for (const PlantSettings& plant : value) {
    text += fmt::format("{}{{share = {}, mode = {}}}", text.empty() ? "" : ", ", plant.share,
                        to_toml_value(plant.modes));
  }
  return "[" + text + "]";
}

std::string to_toml_value(const std::vector<FrequencyMap>& value) {
  std::string text;
  for (const FrequencyMap& map : value) {
    text +=
        fmt::format("{}{{along = \"{}\", at_mm = [{}], freq_hz = [{}]}}", text.empty() ? "" : ", ",
                    map.along, fmt::join(map.at_mm, ", "), fmt::join(map.freq_hz, ", "));
  }
  return "[" + text + "]";
}

std::optional<std::string> own_value(const Key& key, Draft& draft) {
  return std::visit([&](auto member) { return text_of(member(draft)); }, key.member);
}

std::optional<std::string> value_in_force(const Key& key, Draft& draft) {
  std::optional<std::string> own = own_value(key, draft);
  if (!own && key.in_force != nullptr) {
    const double value = key.in_force(draft.settings);
    return std::isfinite(value) ? std::optional(to_toml_value(as_written(value))) : std::nullopt;
  }
  return own;
}

std::string range_text(const Key& key) {
  if (std::holds_alternative<bool& (*)(Draft&)>(key.member) ||
      std::holds_alternative<std::optional<bool>& (*)(Draft&)>(key.member)) {
    return "true, false";
  }
  if (std::holds_alternative<Firmware& (*)(Draft&)>(key.member)) {
    return "\"klipper\", \"marlin\", \"rrf\"";
  }
  if (std::holds_alternative<Kinematics& (*)(Draft&)>(key.member)) {
    std::vector<std::string> words;
    for (const Kinematics kinematics : all_kinematics()) {
      words.push_back(to_toml_value(kinematics));
    }
    return fmt::format("{}", fmt::join(words, ", "));
  }
  if (std::holds_alternative<std::optional<Range>& (*)(Draft&)>(key.member)) {
    return "min < max";
  }
  if (std::holds_alternative<std::optional<Motors::Row>& (*)(Draft&)>(key.member)) {
    return "three numbers";
  }
  if (std::holds_alternative<std::optional<Pair>& (*)(Draft&)>(key.member)) {
    return "two numbers > 0";
  }
  if (std::holds_alternative<std::vector<ModeSettings>& (*)(Draft&)>(key.member)) {
    return "2 or 3 modes";
  }
  if (std::holds_alternative<std::vector<FrequencyMap>& (*)(Draft&)>(key.member)) {
    return "2 to 100 points";
  }
  if (std::holds_alternative<std::vector<PlantSettings>& (*)(Draft&)>(key.member)) {
    return "shares > 0 with a sum < 1, 1 to 3 modes each";
  }
  if (std::holds_alternative<std::string& (*)(Draft&)>(key.member)) {
    return key.words.empty() ? "a text" : fmt::format("\"{}\"", fmt::join(key.words, "\", \""));
  }
  return bounds_text(key.bounds);
}

std::vector<KeyDescription> describe_keys() {
  std::vector<KeyDescription> descriptions;
  Draft defaults;
  for (const Key& key : key_table()) {
    descriptions.push_back(
        {.name = std::string(key.name),
         .unit = std::string(key.unit),
         .range = range_text(key),
         .default_value = own_value(key, defaults).value_or(std::string(key.if_unset)),
         .meaning = std::string(key.meaning)});
  }
  return descriptions;
}

}  // namespace unflex::machine
