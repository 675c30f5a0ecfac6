#include <fmt/format.h>

#include "draft.hpp"
#include "file_text.hpp"
#include "key_table.hpp"
#include "key_values.hpp"
#include "klipper_reader.hpp"
#include "source_kind.hpp"
#include "toml_reader.hpp"
#include "unflex/machine/machine.hpp"
#include "validate.hpp"

namespace unflex::machine {
namespace {

std::string origin_text(const std::optional<SourcePlace>& place) {
  if (!place) {
    return "default";
  }
  if (place->file.starts_with(kOverrideMark)) {
    return "--set";
  }
  return place->line == 0 ? place->file : fmt::format("{}:{}", place->file, place->line);
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

// Stores what a printer file says, whatever kind it is of.
Status read_printer(std::string_view text, const std::string& name, Draft& draft) {
  switch (source_kind(text)) {
    case SourceKind::klipper:
      return read_klipper(text, name).and_then([&](const Reading& reading) {
        return apply(reading, draft);
      });
    case SourceKind::print:
      return fail(ErrorKind::usage, {name, 0},
                  "is a print, not a printer file; what its slicer says of the printer is read "
                  "from the print that is compensated");
    default:
      return read_toml(text, name, draft);
  }
}

std::string_view section_of(std::string_view key) { return key.substr(0, key.rfind('.')); }

}  // namespace

Result<Settings> load(const std::optional<std::filesystem::path>& printer_file,
                      const std::vector<std::string>& overrides) {
  if (!printer_file) {
    return finish(defaults(), overrides);
  }
  const Result<std::string> text = read_printer_file(*printer_file);
  if (!text) {
    return tl::unexpected(text.error());
  }
  return parse(*text, printer_file->string(), overrides);
}

Result<Settings> parse(std::string_view text, const std::string& name,
                       const std::vector<std::string>& overrides) {
  Draft draft = defaults();
  if (Status read = read_printer(text, name, draft); !read) {
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
