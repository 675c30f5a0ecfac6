#include "assign.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "key_table.hpp"
#include "key_values.hpp"
#include "suggestion.hpp"

namespace unflex::machine {
namespace {

constexpr std::size_t kFewestModes = 2;

// One overload per type a member can have. Each returns what is wrong, or nothing.
std::string store(const Value& value, const Key& key, double& target) {
  const double* const number = std::get_if<double>(&value.content);
  if (number == nullptr) {
    return fmt::format("{} must be a number, not {}", key.name, value.kind);
  }
  if (!std::isfinite(*number)) {
    return fmt::format("{} must be a finite number", key.name);
  }
  if (!key.bounds.contains(*number)) {
    return fmt::format("{} is {}, but must be {}", key.name, *number, range_text(key));
  }
  target = *number + 0.0;  // no zero with a sign
  return {};
}

std::string store(const Value& value, const Key& key, std::optional<double>& target) {
  double number = 0.0;
  std::string wrong = store(value, key, number);
  if (wrong.empty()) {
    target = number;
  }
  return wrong;
}

std::string store(const Value& value, const Key& key, bool& target) {
  const bool* const flag = std::get_if<bool>(&value.content);
  if (flag == nullptr) {
    return fmt::format("{} must be true or false, not {}", key.name, value.kind);
  }
  target = *flag;
  return {};
}

std::string store(const Value& value, const Key& key, Firmware& target) {
  if (const auto* text = std::get_if<std::string>(&value.content)) {
    for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
      if (*text == to_string(firmware)) {
        target = firmware;
        return {};
      }
    }
  }
  return fmt::format("{} must be one of {}, not {}", key.name, range_text(key), value.kind);
}

std::string store(const Value& value, const Key& key, Kinematics& target) {
  if (const auto* text = std::get_if<std::string>(&value.content)) {
    for (const Kinematics kinematics : all_kinematics()) {
      if (*text == to_string(kinematics)) {
        target = kinematics;
        return {};
      }
    }
  }
  return fmt::format("{} must be one of {}, not {}; unflex does not support other machines yet",
                     key.name, range_text(key), value.kind);
}

std::string store(const Value& value, const Key& key, std::string& target) {
  const auto* text = std::get_if<std::string>(&value.content);
  if (key.words.empty()) {
    // Free text is written in quotes as it is, without escapes.
    const auto is_plain = [](char c) { return c >= ' ' && c < 0x7f && c != '"' && c != '\\'; };
    if (text == nullptr || !std::ranges::all_of(*text, is_plain)) {
      return fmt::format("{} must be a text without quotes, not {}", key.name, value.kind);
    }
    target = *text;
    return {};
  }
  if (text == nullptr || std::ranges::find(key.words, *text) == key.words.end()) {
    return fmt::format("{} must be one of {}, not {}", key.name, range_text(key), value.kind);
  }
  target = *text;
  return {};
}

std::string store(const Value& value, const Key& key, std::optional<Range>& target) {
  const auto* list = std::get_if<std::vector<Value>>(&value.content);
  const auto is_number = [](const Value& element) {
    return std::holds_alternative<double>(element.content);
  };
  if (list == nullptr || list->size() != 2 || !std::ranges::all_of(*list, is_number)) {
    return fmt::format("{} must be two numbers, as in [0, 250]", key.name);
  }
  Range range;
  for (std::string wrong :
       {store(list->front(), key, range.min), store(list->back(), key, range.max)}) {
    if (!wrong.empty()) {
      return wrong;
    }
  }
  if (!(range.min < range.max)) {
    return fmt::format("{} is [{}, {}], but the first number must be the smaller", key.name,
                       range.min, range.max);
  }
  target = range;
  return {};
}

// One value of a mode; `row` has the bounds of the key that stands for one mode.
std::string store(const NamedValue& value, const Key& key, std::size_t number, ModeSettings& mode) {
  const std::string name = fmt::format("{}, number {}: {}", key.name, number, value.name);
  const auto number_of = [&](std::string_view row, double& target) {
    Key named = row.empty() ? key : key_table()[*find_key(row)];
    named.name = name;
    return store(value.value, named, target);
  };
  if (value.name == "freq_hz") {
    return number_of("dynamics.x.freq_hz", mode.freq_hz);
  }
  if (value.name == "damping_ratio") {
    return number_of("dynamics.x.damping_ratio", mode.damping_ratio);
  }
  if (value.name == "gain") {
    return number_of("", mode.gain);
  }
  return fmt::format(
      "{}, number {}: unknown value '{}'; a mode has freq_hz, damping_ratio and gain", key.name,
      number, value.name);
}

std::string store(const Value& value, const Key& key, std::vector<ModeSettings>& target) {
  const auto* list = std::get_if<std::vector<Value>>(&value.content);
  const auto is_table = [](const Value& element) {
    return std::holds_alternative<std::vector<NamedValue>>(element.content);
  };
  if (list == nullptr || list->size() < kFewestModes || list->size() > kMostModes ||
      !std::ranges::all_of(*list, is_table)) {
    return fmt::format(
        "{} must be {} to {} tables, [[{}]], each with freq_hz, damping_ratio and gain; give one "
        "mode as freq_hz and damping_ratio",
        key.name, kFewestModes, kMostModes, key.name);
  }
  std::vector<ModeSettings> modes;
  double sum = 0.0;
  for (const Value& element : *list) {
    const auto& table = std::get<std::vector<NamedValue>>(element.content);
    ModeSettings& mode = modes.emplace_back();
    for (const std::string_view needed : {"freq_hz", "damping_ratio", "gain"}) {
      if (std::ranges::find(table, needed, &NamedValue::name) == table.end()) {
        return fmt::format("{}, number {}: {} is missing", key.name, modes.size(), needed);
      }
    }
    for (const NamedValue& given : table) {
      if (std::string wrong = store(given, key, modes.size(), mode); !wrong.empty()) {
        return wrong;
      }
    }
    sum += mode.gain;
  }
  constexpr double kRounding = 2e-3;
  if (std::abs(sum - 1.0) > kRounding) {
    return fmt::format("the gains of {} add up to {:.4g}, but must add up to 1", key.name, sum);
  }
  for (ModeSettings& mode : modes) {
    mode.gain /= sum;
  }
  target = std::move(modes);
  return {};
}

}  // namespace

std::string assign(const std::string& name, const Value& value, const SourcePlace& place,
                   Draft& draft) {
  const std::optional<std::size_t> index = find_key(name);
  if (!index) {
    return is_section(name) ? fmt::format("'{}' is a section, not a key", name)
                            : fmt::format("unknown key '{}'{}", name, suggest_key(name));
  }
  const Key& key = key_table()[*index];
  draft.places[*index] = place;
  return std::visit([&](auto member) { return store(value, key, member(draft)); }, key.member);
}

Status apply(const Reading& reading, Draft& draft) {
  for (const Assignment& assignment : reading.assignments) {
    std::string wrong = assign(assignment.key, assignment.value, assignment.place, draft);
    if (!wrong.empty()) {
      return fail(ErrorKind::usage, assignment.place, std::move(wrong));
    }
  }
  draft.notes.insert(draft.notes.end(), reading.notes.begin(), reading.notes.end());
  std::vector<Diagnostic>& guesses = draft.settings.guesses;
  guesses.insert(guesses.end(), reading.guesses.begin(), reading.guesses.end());
  return {};
}

}  // namespace unflex::machine
