#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <system_error>

#include "draft.hpp"
#include "key_table.hpp"
#include "key_values.hpp"
#include "toml_reader.hpp"
#include "unflex/machine/machine.hpp"
#include "validate.hpp"

namespace unflex::machine {
namespace {

// Printer files have a few hundred bytes; whoever passes a print by mistake hears so at once.
constexpr std::size_t kMaxFileBytes = 1U << 20U;

std::string origin_text(const std::optional<SourcePlace>& place) {
  if (!place) {
    return "default";
  }
  return place->line == 0 ? "--set" : fmt::format("{}:{}", place->file, place->line);
}

void record_origins(Draft& draft) {
  for (std::size_t i = 0; i < key_table().size(); ++i) {
    const Key& key = key_table()[i];
    if (!key.converted) {
      draft.settings.origins.emplace_back(key.name, origin_text(draft.places[i]));
    }
  }
}

Result<Settings> finish(Draft draft, const std::vector<std::string>& overrides) {
  for (const std::string& text : overrides) {
    if (Status applied = apply_override(text, draft); !applied) {
      return tl::unexpected(applied.error());
    }
  }
  if (Status resolved = resolve_dynamics(draft); !resolved) {
    return tl::unexpected(resolved.error());
  }
  if (Status checked = check_consistency(draft); !checked) {
    return tl::unexpected(checked.error());
  }
  record_origins(draft);
  return draft.settings;
}

Draft defaults() {
  Draft draft;
  draft.places.resize(key_table().size());
  return draft;
}

Result<std::string> read_file(const std::filesystem::path& file) {
  const SourcePlace place{file.string(), 0};
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    return fail(ErrorKind::usage, place, "is a directory, not a printer file");
  }
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    return fail(
        ErrorKind::usage, place,
        fmt::format("cannot read the printer file: {}", std::generic_category().message(errno)));
  }
  std::string text;
  std::array<char, 4096> block{};
  while (stream.read(block.data(), block.size()) || stream.gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(stream.gcount()));
    if (text.size() > kMaxFileBytes) {
      return fail(ErrorKind::usage, place, "is too large for a printer file");
    }
  }
  if (stream.bad()) {
    return fail(ErrorKind::usage, place, "cannot read the printer file");
  }
  return text;
}

std::string_view section_of(std::string_view key) { return key.substr(0, key.rfind('.')); }

}  // namespace

Result<Settings> load(const std::optional<std::filesystem::path>& toml_file,
                      const std::vector<std::string>& overrides) {
  if (!toml_file) {
    return finish(defaults(), overrides);
  }
  const Result<std::string> text = read_file(*toml_file);
  if (!text) {
    return tl::unexpected(text.error());
  }
  return parse(*text, toml_file->string(), overrides);
}

Result<Settings> parse(std::string_view toml_text, const std::string& name,
                       const std::vector<std::string>& overrides) {
  Draft draft = defaults();
  if (Status read = read_toml(toml_text, name, draft); !read) {
    return tl::unexpected(read.error());
  }
  return finish(std::move(draft), overrides);
}

std::string to_toml(const Settings& settings) {
  Draft draft{.settings = settings, .mass_x = {}, .mass_y = {}, .places = {}};
  std::string text = "schema_version = 1\n";
  std::string_view section;
  for (const Key& key : key_table()) {
    if (key.converted) {
      continue;
    }
    if (section_of(key.name) != section) {
      section = section_of(key.name);
      text += fmt::format("\n[{}]\n", section);
    }
    const std::string_view name = key.name.substr(section.size() + 1);
    const std::optional<std::string> own = own_value(key, draft);
    const std::optional<std::string> value = value_in_force(key, draft);
    // Unset keys stay unset when the text is read again, and what holds instead is still seen.
    if (own) {
      text += fmt::format("{} = {}\n", name, *own);
    } else if (value) {
      text += fmt::format("# {} = {}  (unset: {})\n", name, *value, key.if_unset);
    } else {
      text += fmt::format("# {} is unset: {}\n", name, key.if_unset);
    }
  }
  return text;
}

std::vector<SettingRow> rows(const Settings& settings) {
  Draft draft{.settings = settings, .mass_x = {}, .mass_y = {}, .places = {}};
  std::vector<SettingRow> rows;
  std::size_t next_origin = 0;
  for (const Key& key : key_table()) {
    if (key.converted) {
      continue;
    }
    // Settings that were not read but built in memory have no origins.
    const std::string origin = next_origin < settings.origins.size()
                                   ? settings.origins[next_origin].second
                                   : std::string("default");
    ++next_origin;
    rows.push_back({.key = std::string(key.name),
                    .value = value_in_force(key, draft).value_or(""),
                    .origin = origin});
  }
  return rows;
}

}  // namespace unflex::machine
