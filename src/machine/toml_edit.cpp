#include "unflex/machine/toml_edit.hpp"

#include <fmt/core.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <ranges>
#include <utility>

#include "source_kind.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::machine {
namespace {

// Where a line of the text begins, and where its ending does. Lines count from 1.
std::pair<std::size_t, std::size_t> line_bounds(std::string_view text, std::size_t number) {
  std::size_t begin = 0;
  for (std::size_t line = 1; line < number && begin != std::string_view::npos; ++line) {
    begin = text.find('\n', begin);
    begin = begin == std::string_view::npos ? begin : begin + 1;
  }
  begin = std::min(begin, text.size());
  std::size_t end = std::min(text.find('\n', begin), text.size());
  if (end > begin && text[end - 1] == '\r') {
    --end;
  }
  return {begin, end};
}

std::pair<std::string, std::string> section_and_name(const std::string& key) {
  const std::size_t dot = key.rfind('.');
  return {key.substr(0, dot), key.substr(dot + 1)};
}

std::string line_of(const TomlEdit& edit) {
  return fmt::format("{} = {}  # {}", section_and_name(edit.key).second, edit.value, edit.remark);
}

std::string_view line_ending(std::string_view text) {
  return text.find("\r\n") == std::string_view::npos ? "\n" : "\r\n";
}

// Puts the value in place of the one that stands there.
std::string replaced(std::string_view text, const toml::source_region& source,
                     const TomlEdit& edit) {
  const auto [begin, end] = line_bounds(text, source.begin.line);
  const std::size_t from = std::min(begin + source.begin.column - 1, end);
  const std::size_t to = std::min(begin + source.end.column - 1, end);
  const std::string_view behind = text.substr(to, end - to);
  const std::size_t next = behind.find_first_not_of(" \t");
  // A comment told of the value before. Within an inline table there is room for none.
  const bool alone = next == std::string_view::npos || behind[next] == '#';
  return fmt::format("{}{}{}{}", text.substr(0, from), edit.value,
                     alone ? "  # " + edit.remark : std::string(behind), text.substr(end));
}

std::string inserted(std::string_view text, const toml::table& root, const TomlEdit& edit) {
  const auto [section, name] = section_and_name(edit.key);
  const toml::node_view<const toml::node> table = root.at_path(section);
  const std::string_view ending = line_ending(text);
  if (table.is_table()) {
    const auto [begin, end] = line_bounds(text, table.node()->source().begin.line);
    if (text.substr(begin).starts_with(fmt::format("[{}]", section))) {
      return fmt::format("{}{}{}{}", text.substr(0, end), ending, line_of(edit), text.substr(end));
    }
  }
  return fmt::format("{}{}{}[{}]{}{}{}", text,
                     text.empty() || text.ends_with('\n') ? std::string_view{} : ending, ending,
                     section, ending, line_of(edit), ending);
}

// The values that the text gives, without those that are edited. nullopt if it is no printer file.
std::optional<std::map<std::string, std::string>> others(std::string_view text,
                                                         std::span<const TomlEdit> edits) {
  const Result<Settings> settings = parse(text, "", {});
  if (!settings) {
    return std::nullopt;
  }
  std::map<std::string, std::string> values;
  for (SettingRow& row : rows(*settings)) {
    // A default may depend on what is edited.
    if (row.origin != kDefaultOrigin &&
        std::ranges::find(edits, row.key, &TomlEdit::key) == edits.end()) {
      values[std::move(row.key)] = std::move(row.value);
    }
  }
  return values;
}

}  // namespace

Result<std::string> with_values(std::string_view text, const std::string& name,
                                std::span<const TomlEdit> edits) {
  std::string by_hand;
  for (const TomlEdit& edit : edits) {
    by_hand += fmt::format("{}{} = {}", by_hand.empty() ? "" : ", ", edit.key, edit.value);
  }
  const auto refused = [&] {
    return fail(ErrorKind::usage, {name, 0},
                fmt::format("cannot be changed in place; write into it by hand: {}", by_hand));
  };
  if (source_kind(text) != SourceKind::toml) {
    return fail(ErrorKind::usage, {name, 0},
                fmt::format("is not a printer file of unflex's own, which alone can be written "
                            "to; make one of it with unflex printer init, and give it {}",
                            by_hand));
  }
  std::string result(text);
  // Each new line goes right below its section's name, so the last comes first.
  for (const TomlEdit& edit : edits | std::views::reverse) {
    const toml::parse_result parsed = toml::parse(result);
    if (!parsed) {
      return refused();
    }
    const toml::table& root = parsed.table();
    const toml::node_view<const toml::node> node = root.at_path(edit.key);
    result = node ? replaced(result, node.node()->source(), edit) : inserted(result, root, edit);
  }
  // The file is the user's. So what was written is read again before anyone relies on it.
  const auto before = others(text, edits);
  const auto after = others(result, edits);
  if (!after || (before && *before != *after)) {
    return refused();
  }
  return result;
}

}  // namespace unflex::machine
