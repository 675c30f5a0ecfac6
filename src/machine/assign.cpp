#include "assign.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "key_table.hpp"
#include "key_values.hpp"
#include "suggestion.hpp"
#include "tool_keys.hpp"
#include "unflex/core/number.hpp"

namespace unflex::machine {
namespace {

constexpr std::size_t kFewestModes = 2;
constexpr std::size_t kMostPlants = 8;

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

std::string store(const Value& value, const Key& key, std::optional<bool>& target) {
  bool flag = false;
  std::string wrong = store(value, key, flag);
  if (wrong.empty()) {
    target = flag;
  }
  return wrong;
}

std::string store(const Value& value, const Key& key, Firmware& target) {
  if (const auto* text = std::get_if<std::string>(&value.content)) {
    for (const Firmware firmware : kFirmwares) {
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
  const auto is_allowed = [&](std::string_view given) {
    return std::ranges::find(key.words, given) != key.words.end() ||
           (key.or_text != nullptr && key.or_text(given));
  };
  if (text == nullptr || !is_allowed(*text)) {
    return fmt::format("{} must be one of {}, not {}", key.name, range_text(key), value.kind);
  }
  target = *text;
  return {};
}

// The numbers of a list; nothing if it is no list or has anything else.
std::optional<std::vector<double>> numbers_of(const Value& value) {
  const auto* list = std::get_if<std::vector<Value>>(&value.content);
  if (list == nullptr) {
    return std::nullopt;
  }
  std::vector<double> numbers;
  for (const Value& element : *list) {
    const auto* number = std::get_if<double>(&element.content);
    if (number == nullptr || !std::isfinite(*number)) {
      return std::nullopt;
    }
    numbers.push_back(*number);
  }
  return numbers;
}

std::string store(const Value& value, const Key& key, std::optional<Motors::Row>& target) {
  Motors::Row row{};
  const auto numbers = numbers_of(value);
  if (!numbers || numbers->size() != row.size()) {
    return fmt::format("{} must be three numbers, as in [1, -1, 0]", key.name);
  }
  std::ranges::copy(*numbers, row.begin());
  target = row;
  return {};
}

// Lengths.
std::string store(const Value& value, const Key& key, std::optional<Pair>& target) {
  const auto numbers = numbers_of(value);
  const auto is_length = [](double number) { return number > 0.0; };
  if (!numbers || numbers->size() != 2 || !std::ranges::all_of(*numbers, is_length)) {
    return fmt::format("{} must be two numbers > 0, as in [150, 150]", key.name);
  }
  target = Pair{numbers->front(), numbers->back()};
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

using Table = std::vector<NamedValue>;

// One value of a mode; `row` has the bounds of the key that stands for one mode.
std::string store(const NamedValue& value, const Key& key, const std::string& whose,
                  ModeSettings& mode) {
  const std::string name = fmt::format("{}: {}", whose, value.name);
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
  return fmt::format("{}: unknown value '{}'; a mode has freq_hz, damping_ratio and gain", whose,
                     value.name);
}

// The tables of a list; nothing if it is none, or has fewer or more.
std::optional<std::vector<const Table*>> tables_of(const Value& value, std::size_t fewest,
                                                   std::size_t most) {
  const auto* list = std::get_if<std::vector<Value>>(&value.content);
  if (list == nullptr || list->size() < fewest || list->size() > most) {
    return std::nullopt;
  }
  std::vector<const Table*> tables;
  for (const Value& element : *list) {
    const auto* table = std::get_if<Table>(&element.content);
    if (table == nullptr) {
      return std::nullopt;
    }
    tables.push_back(table);
  }
  return tables;
}

const NamedValue* find(const Table& table, std::string_view name) {
  const auto found = std::ranges::find(table, name, &NamedValue::name);
  return found == table.end() ? nullptr : &*found;
}

// `whose` stands before the number of a mode in messages.
std::string store_modes(const std::vector<const Table*>& tables, const Key& key,
                        const std::string& whose, std::vector<ModeSettings>& target) {
  std::vector<ModeSettings> modes;
  double sum = 0.0;
  for (const Table* table : tables) {
    ModeSettings& mode = modes.emplace_back();
    const std::string number = fmt::format("{}, number {}", whose, modes.size());
    for (const std::string_view needed : {"freq_hz", "damping_ratio", "gain"}) {
      if (find(*table, needed) == nullptr) {
        return fmt::format("{}: {} is missing", number, needed);
      }
    }
    for (const NamedValue& given : *table) {
      if (std::string wrong = store(given, key, number, mode); !wrong.empty()) {
        return wrong;
      }
    }
    sum += mode.gain;
  }
  constexpr double kRounding = 2e-3;
  if (std::abs(sum - 1.0) > kRounding) {
    return fmt::format("the gains of {} add up to {:.4g}, but must add up to 1", whose, sum);
  }
  for (ModeSettings& mode : modes) {
    mode.gain /= sum;
  }
  target = std::move(modes);
  return {};
}

std::string store(const Value& value, const Key& key, std::vector<ModeSettings>& target) {
  const auto tables = tables_of(value, kFewestModes, kMostModes);
  if (!tables) {
    return fmt::format(
        "{} must be {} to {} tables, [[{}]], each with freq_hz, damping_ratio and gain; give one "
        "mode as freq_hz and damping_ratio",
        key.name, kFewestModes, kMostModes, key.name);
  }
  return store_modes(*tables, key, std::string(key.name), target);
}

std::string store(const Table& table, const Key& key, const std::string& whose,
                  PlantSettings& plant) {
  for (const NamedValue& given : table) {
    if (given.name != "share" && given.name != "mode") {
      return fmt::format("{}: unknown value '{}'; a plant has share and mode", whose, given.name);
    }
  }
  const NamedValue* const share = find(table, "share");
  const NamedValue* const mode = find(table, "mode");
  if (share == nullptr || mode == nullptr) {
    return fmt::format("{}: {} is missing", whose, share == nullptr ? "share" : "mode");
  }
  const auto* number = std::get_if<double>(&share->value.content);
  if (number == nullptr || !(*number > 0.0 && *number < 1.0)) {
    return fmt::format("{}: share must be a number above 0 and below 1", whose);
  }
  plant.share = *number;
  const auto modes = tables_of(mode->value, 1, kMostModes);
  if (!modes) {
    return fmt::format(
        "{}: mode must be a list of 1 to {} tables, each {{freq_hz = …, damping_ratio = …, gain = "
        "…}}",
        whose, kMostModes);
  }
  return store_modes(*modes, key, whose + ", mode", plant.modes);
}

std::string store(const Value& value, const Key& key, std::vector<PlantSettings>& target) {
  const auto tables = tables_of(value, 1, kMostPlants);
  if (!tables) {
    return fmt::format("{} must be 1 to {} tables, [[{}]], each with share and mode", key.name,
                       kMostPlants, key.name);
  }
  std::vector<PlantSettings> plants;
  double sum = 0.0;
  for (const Table* table : *tables) {
    PlantSettings& plant = plants.emplace_back();
    const std::string whose = fmt::format("{}, number {}", key.name, plants.size());
    if (std::string wrong = store(*table, key, whose, plant); !wrong.empty()) {
      return wrong;
    }
    sum += plant.share;
  }
  if (!(sum < 1.0)) {
    return fmt::format(
        "the shares of {} add up to {:.4g}, but must leave some for the axis as it is given",
        key.name, sum);
  }
  target = std::move(plants);
  return {};
}

// The numbers of a list of a map; empty if it is no such list.
std::vector<double> points_of(const Table& table, std::string_view name) {
  const NamedValue* const given = find(table, name);
  return given == nullptr ? std::vector<double>{}
                          : numbers_of(given->value).value_or(std::vector<double>{});
}

std::string store(const Table& table, const std::string& whose, FrequencyMap& map) {
  constexpr std::size_t kMostPoints = 100;
  const Key& frequency = key_table()[*find_key("dynamics.x.freq_hz")];
  for (const NamedValue& given : table) {
    if (given.name != "along" && given.name != "at_mm" && given.name != "freq_hz") {
      return fmt::format("{}: unknown value '{}'; a map has along, at_mm and freq_hz", whose,
                         given.name);
    }
  }
  const NamedValue* const along = find(table, "along");
  const auto* axis = along != nullptr ? std::get_if<std::string>(&along->value.content) : nullptr;
  if (axis == nullptr || (*axis != "x" && *axis != "y" && *axis != "z")) {
    return fmt::format("{}: along must be \"x\", \"y\" or \"z\"", whose);
  }
  map.along = axis->front();
  map.at_mm = points_of(table, "at_mm");
  map.freq_hz = points_of(table, "freq_hz");
  if (map.at_mm.size() < 2 || map.at_mm.size() > kMostPoints ||
      map.at_mm.size() != map.freq_hz.size()) {
    return fmt::format("{}: at_mm and freq_hz must be lists of 2 to {} numbers, as many of each",
                       whose, kMostPoints);
  }
  if (std::ranges::adjacent_find(map.at_mm, std::greater_equal<>{}) != map.at_mm.end()) {
    return fmt::format("{}: at_mm must increase from point to point", whose);
  }
  for (const double hz : map.freq_hz) {
    if (!frequency.bounds.contains(hz)) {
      return fmt::format("{}: freq_hz has {}, but must be {} to {}", whose, hz,
                         frequency.bounds.min, frequency.bounds.max);
    }
  }
  return {};
}

std::string store(const Value& value, const Key& key, std::vector<FrequencyMap>& target) {
  constexpr std::size_t kDirections = 3;
  const auto tables = tables_of(value, 1, kDirections);
  if (!tables) {
    return fmt::format("{} must be 1 to {} tables, [[{}]], with along, at_mm and freq_hz", key.name,
                       kDirections, key.name);
  }
  std::vector<FrequencyMap> maps;
  for (const Table* const table : *tables) {
    FrequencyMap map;
    if (std::string wrong = store(*table, std::string(key.name), map); !wrong.empty()) {
      return wrong;
    }
    if (std::ranges::count(maps, map.along, &FrequencyMap::along) > 0) {
      return fmt::format("{}: two tables are along \"{}\", but there may be one for each direction",
                         key.name, map.along);
    }
    maps.push_back(std::move(map));
  }
  target = std::move(maps);
  return {};
}

}  // namespace

std::string assign(const std::string& name, const Value& value, const SourcePlace& place,
                   Draft& draft) {
  if (is_of_tool(name)) {
    return assign_to_tool(name, value, place, draft);
  }
  const std::optional<std::size_t> index = find_key(name);
  if (!index) {
    return is_section(name) ? fmt::format("'{}' is a section, not a key", name)
                            : fmt::format("unknown key '{}'{}", name, suggest_key(name));
  }
  const Key& key = key_table()[*index];
  draft.places[*index] = place;
  return std::visit([&](auto member) { return store(value, key, member(draft)); }, key.member);
}

double as_written(double value) {
  constexpr int kDigits = 9;
  return parse_number(fmt::format("{:.{}g}", value, kDigits)).value_or(value);
}

void Reading::add_shaper_damping(const std::string& axis, double ratio, const SourcePlace& place) {
  const std::string key = fmt::format("dynamics.{}.damping_ratio", axis);
  if (is_plausible_damping(ratio)) {
    add(key, ratio, place);
    return;
  }
  note(
      place,
      fmt::format("a damping ratio of {} is one that no printer has ({} to {}), so it is not taken "
                  "for that of {}; measure it with unflex identify or unflex tune, or give {} "
                  "with --set",
                  ratio, kLeastDamping, kMostDamping, axis == "x" ? 'X' : 'Y', key),
      {key});
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
