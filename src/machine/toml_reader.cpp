#include "toml_reader.hpp"

#include <fmt/core.h>
#include <toml++/toml.h>

#include <algorithm>
#include <vector>

#include "assign.hpp"
#include "key_table.hpp"
#include "suggestion.hpp"
#include "tool_keys.hpp"
#include "unflex/core/number.hpp"

namespace unflex::machine {
namespace {

constexpr int kSchemaVersion = 1;
constexpr std::string_view kSchemaKey = "schema_version";

Value value_of(const toml::node& node) {
  if (const auto* integer = node.as_integer()) {
    return static_cast<double>(integer->get());
  }
  if (const auto* floating = node.as_floating_point()) {
    return floating->get();
  }
  if (const auto* flag = node.as_boolean()) {
    return flag->get();
  }
  if (const auto* text = node.as_string()) {
    return text->get();
  }
  if (const auto* array = node.as_array()) {
    std::vector<Value> list;
    for (const toml::node& element : *array) {
      list.push_back(value_of(element));
    }
    return list;
  }
  if (const auto* table = node.as_table()) {
    std::vector<NamedValue> values;
    for (const auto& [key, inner] : *table) {
      values.push_back({std::string(key.str()), value_of(inner)});
    }
    return values;
  }
  return Value::other("a date or time");
}

std::string check_schema(const toml::node& node) {
  if (node.value<double>() == static_cast<double>(kSchemaVersion)) {
    return {};
  }
  return fmt::format("{} must be {}, the only one this version of unflex reads", kSchemaKey,
                     kSchemaVersion);
}

// Stores the value of a key, or says what is wrong.
std::string store(const toml::node& node, const std::string& name, const SourcePlace& place,
                  Draft& draft) {
  if (name == kSchemaKey) {
    return check_schema(node);
  }
  return assign(name, value_of(node), place, draft);
}

// A value or a table of the file with its dotted name.
struct Entry {
  std::string name;
  const toml::node* node = nullptr;
};

std::string open_section(const std::string& name, Draft& draft) {
  if (is_of_tool(name)) {
    return open_tool_section(name, draft);
  }
  return is_section(name) ? std::string{}
                          : fmt::format("unknown section '{}'{}", name, suggest_section(name));
}

void flatten(const toml::table& table, const std::string& prefix, std::vector<Entry>& entries) {
  for (const auto& [key, node] : table) {
    const std::string name = prefix + std::string(key.str());
    entries.push_back({name, &node});
    const toml::table* const inner = node.as_table();
    if (inner != nullptr && (is_section(name) || is_tool_section(name))) {
      flatten(*inner, name + ".", entries);
    }
  }
}

std::size_t line_of(const toml::node& node) { return node.source().begin.line; }

Status store_all(const toml::table& table, const std::string& name, Draft& draft) {
  std::vector<Entry> entries;
  flatten(table, "", entries);
  // The library sorts by name; the user reads from the top.
  std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return line_of(*a.node) < line_of(*b.node);
  });
  for (const Entry& entry : entries) {
    const SourcePlace place{name, line_of(*entry.node)};
    const bool section = entry.node->is_table() && !find_key(entry.name);
    std::string wrong =
        section ? open_section(entry.name, draft) : store(*entry.node, entry.name, place, draft);
    if (!wrong.empty()) {
      return fail(ErrorKind::usage, place, std::move(wrong));
    }
  }
  return {};
}

std::string_view trim(std::string_view text) {
  constexpr std::string_view kBlank = " \t";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

// The value of an override as a table with the one key "value".
toml::table parse_override_value(std::string_view text) {
  if (const std::optional<double> number = parse_number(text)) {
    return toml::table{{"value", *number}};
  }
  toml::parse_result parsed = toml::parse(fmt::format("value = {}", text));
  if (parsed && parsed.table().size() == 1) {
    return std::move(parsed).table();
  }
  // Not TOML: a bare word, which the caller takes or rejects by the key's type.
  return toml::table{{"value", std::string(text)}};
}

}  // namespace

Status read_toml(std::string_view text, const std::string& name, Draft& draft) {
  const toml::parse_result parsed = toml::parse(text);
  if (!parsed) {
    return fail(ErrorKind::usage, {name, parsed.error().source().begin.line},
                fmt::format("not valid TOML: {}", parsed.error().description()));
  }
  return store_all(parsed.table(), name, draft);
}

Status apply_override(const std::string& text, Draft& draft) {
  const SourcePlace place{fmt::format("{}{}", kOverrideMark, text), 0};
  const std::size_t equals = text.find('=');
  const std::string key(trim(std::string_view(text).substr(0, equals)));
  if (equals == std::string::npos || key.empty()) {
    return fail(ErrorKind::usage, place, "must have the form key=value");
  }
  const std::string_view value = trim(std::string_view(text).substr(equals + 1));
  if (value.empty()) {
    return fail(ErrorKind::usage, place, fmt::format("{} needs a value", key));
  }
  const toml::table table = parse_override_value(value);
  std::string wrong = store(*table.get("value"), key, place, draft);
  if (!wrong.empty()) {
    return fail(ErrorKind::usage, place, std::move(wrong));
  }
  return {};
}

}  // namespace unflex::machine
