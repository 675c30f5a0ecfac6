#include "tool_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <utility>

#include "key_table.hpp"
#include "key_values.hpp"
#include "unflex/core/suggestion.hpp"
#include "unflex/machine/as_printer.hpp"
#include "validate.hpp"

namespace unflex::machine {
namespace {

constexpr std::string_view kOffset = "offset_mm";

// Keys that a tool has as the printer has them.
struct SharedKey {
  std::string_view name;
  double AxisDynamics::*of_printer;
  Axes<std::optional<double>> ToolSettings::*of_tool;
  std::size_t axis;
};
constexpr std::array kShared = {
    SharedKey{"dynamics.x.freq_hz", &AxisDynamics::freq_hz, &ToolSettings::freq_hz, 0},
    SharedKey{"dynamics.x.damping_ratio", &AxisDynamics::damping_ratio,
              &ToolSettings::damping_ratio, 0},
    SharedKey{"dynamics.y.freq_hz", &AxisDynamics::freq_hz, &ToolSettings::freq_hz, 1},
    SharedKey{"dynamics.y.damping_ratio", &AxisDynamics::damping_ratio,
              &ToolSettings::damping_ratio, 1},
};

// A name as "tool.3.dynamics.x" in parts.
struct ToolName {
  std::optional<int> number;  // unset: no number that a tool can have
  std::string_view rest;      // "dynamics.x"; empty: the section of the tool
};

ToolName split(std::string_view name) {
  name.remove_prefix(std::min(kToolSection.size() + 1, name.size()));
  const std::string_view digits = name.substr(0, name.find('.'));
  ToolName parts;
  parts.rest = name.substr(std::min(digits.size() + 1, name.size()));
  int number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool is_plain = digits.size() == 1 || (digits.size() == 2 && digits.front() != '0');
  if (error == std::errc() && end == digits.data() + digits.size() && is_plain && number >= 0 &&
      number < kMostTools) {
    parts.number = number;
  }
  return parts;
}

std::string wrong_number(std::string_view name) {
  return fmt::format("unknown tool '{}'; tools are [tool.0] to [tool.{}]", name, kMostTools - 1);
}

ToolSettings& tool_of(int number, Draft& draft) {
  std::vector<ToolSettings>& tools = draft.settings.tools;
  const auto place = std::ranges::lower_bound(tools, number, {}, &ToolSettings::number);
  if (place != tools.end() && place->number == number) {
    return *place;
  }
  return *tools.insert(place, ToolSettings{.number = number});
}

std::string store_offset(const std::string& name, const Value& value, Axes<double>& offset_mm) {
  const auto* const list = std::get_if<std::vector<Value>>(&value.content);
  const auto number = [&](std::size_t i) { return std::get_if<double>(&(*list)[i].content); };
  if (list == nullptr || list->size() != 2 || number(0) == nullptr || number(1) == nullptr ||
      !std::isfinite(*number(0)) || !std::isfinite(*number(1))) {
    return fmt::format("{} must be two numbers, as in [17.5, 0]", name);
  }
  offset_mm = {*number(0), *number(1)};
  return {};
}

std::string unknown_key(const std::string& name, std::string_view rest) {
  std::vector<std::string_view> names = {kOffset};
  for (const SharedKey& key : kShared) {
    names.push_back(key.name);
  }
  const std::string meant = suggestion(rest, names);
  return fmt::format("unknown key '{}'{}", name,
                     meant.empty() ? "; a tool has dynamics.x.freq_hz, dynamics.x.damping_ratio, "
                                     "the same of dynamics.y, and offset_mm"
                                   : meant);
}

}  // namespace

bool is_of_tool(std::string_view name) {
  return name == kToolSection ||
         (name.starts_with(kToolSection) && name.substr(kToolSection.size()).starts_with('.'));
}

bool is_tool_section(std::string_view name) {
  if (!is_of_tool(name)) {
    return false;
  }
  const ToolName parts = split(name);
  const auto is_in = [&](const SharedKey& key) {
    return key.name.starts_with(parts.rest) && key.name.substr(parts.rest.size()).starts_with('.');
  };
  return name == kToolSection ||
         (parts.number && (parts.rest.empty() || std::ranges::any_of(kShared, is_in)));
}

std::string open_tool_section(const std::string& name, Draft& draft) {
  if (name == kToolSection) {
    return {};
  }
  const ToolName parts = split(name);
  if (!parts.number) {
    return wrong_number(name);
  }
  if (!is_tool_section(name)) {
    return unknown_key(name, parts.rest);
  }
  tool_of(*parts.number, draft);
  return {};
}

std::string assign_to_tool(const std::string& name, const Value& value, const SourcePlace& place,
                           Draft& draft) {
  const ToolName parts = split(name);
  if (is_tool_section(name)) {
    return fmt::format("'{}' is a section, not a key", name);
  }
  if (!parts.number) {
    return wrong_number(name);
  }
  const auto note_origin = [&] { draft.tool_places.insert_or_assign(name, place); };
  if (parts.rest == kOffset) {
    std::string wrong = store_offset(name, value, tool_of(*parts.number, draft).offset_mm);
    note_origin();
    return wrong;
  }
  const auto key = std::ranges::find(kShared, parts.rest, &SharedKey::name);
  if (key == kShared.end()) {
    return unknown_key(name, parts.rest);
  }
  // The printer's own key tells what the value may be.
  Draft own;
  own.places.resize(key_table().size());
  if (const std::string wrong = assign(std::string(key->name), value, place, own); !wrong.empty()) {
    return fmt::format("{}.{}.{}", kToolSection, *parts.number, wrong);
  }
  (tool_of(*parts.number, draft).*key->of_tool)[key->axis] =
      own.settings.dynamics[key->axis].*key->of_printer;
  note_origin();
  return {};
}

Status check_tools(const Draft& draft) {
  for (const ToolSettings& tool : draft.settings.tools) {
    Draft own = draft;
    own.settings = with_tool(draft.settings, tool.number);
    for (const SharedKey& key : kShared) {
      const auto given =
          draft.tool_places.find(fmt::format("{}.{}.{}", kToolSection, tool.number, key.name));
      if (given != draft.tool_places.end()) {
        own.places[*find_key(key.name)] = given->second;
      }
    }
    if (const Status checked = check_consistency(own); !checked) {
      Error error = checked.error();
      error.message = fmt::format("with tool {}: {}", tool.number, error.message);
      return tl::unexpected(std::move(error));
    }
  }
  return {};
}

std::vector<ToolRow> rows_of(const ToolSettings& tool) {
  std::vector<ToolRow> rows;
  const auto add = [&](std::string_view key, std::string value) {
    rows.push_back({fmt::format("{}.{}.{}", kToolSection, tool.number, key), std::move(value)});
  };
  for (const SharedKey& key : kShared) {
    if (const std::optional<double> value = (tool.*key.of_tool)[key.axis]) {
      add(key.name, to_toml_value(*value));
    }
  }
  if (tool.offset_mm != Axes<double>{}) {
    add(kOffset, fmt::format("[{}, {}]", tool.offset_mm.x, tool.offset_mm.y));
  }
  return rows;
}

bool tell_frequency(const std::vector<ToolSettings>& tools, std::size_t axis) {
  return !tools.empty() && tools.front().number == 0 &&
         std::ranges::all_of(
             tools, [&](const ToolSettings& tool) { return tool.freq_hz[axis].has_value(); });
}

}  // namespace unflex::machine
