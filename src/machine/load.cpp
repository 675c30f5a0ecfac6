#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <tuple>
#include <utility>

#include "draft.hpp"
#include "file_text.hpp"
#include "key_table.hpp"
#include "key_values.hpp"
#include "klipper_reader.hpp"
#include "marlin_dump.hpp"
#include "rrf_config.hpp"
#include "slicer_reader.hpp"
#include "source_kind.hpp"
#include "toml_reader.hpp"
#include "tool_keys.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/utf8.hpp"
#include "unflex/machine/machine.hpp"
#include "validate.hpp"
#include "variants.hpp"

namespace unflex::machine {
namespace {

// The end of the key of several modes. This key is the origin of the values that follow from it.
constexpr std::string_view kModes = ".mode";
constexpr std::string_view kPlants = ".plant";

std::string_view section_of(std::string_view key) { return key.substr(0, key.rfind('.')); }

std::string origin_text(const std::optional<SourcePlace>& place) {
  if (!place) {
    return std::string(kDefaultOrigin);
  }
  if (place->file.starts_with(kOverrideMark)) {
    return "--set";
  }
  return place->line == 0 ? place->file : fmt::format("{}:{}", place->file, place->line);
}

// Whether the key describes one mode, but its axis has several. The key's value is then the largest
// mode's.
bool is_of_modes(const Draft& draft, std::string_view key) {
  const auto is_of = [&](std::string_view axis, const AxisDynamics& dynamics) {
    return !dynamics.modes.empty() && key.starts_with(fmt::format("dynamics.{}.", axis)) &&
           !key.ends_with(kModes) && !key.ends_with(kPlants);
  };
  return any_axis(is_of, kAxisKeys, draft.settings.dynamics);
}

void record_origins(Draft& draft) {
  for (std::size_t i = 0; i < key_table().size(); ++i) {
    const Key& key = key_table()[i];
    if (!key.converted) {
      draft.settings.origins.emplace_back(
          key.name, is_of_modes(draft, key.name)
                        ? std::string(key.name.substr(0, key.name.rfind('.'))) + std::string(kModes)
                        : origin_text(draft.places[i]));
    }
  }
  for (const ToolSettings& tool : draft.settings.tools) {
    for (const ToolRow& row : rows_of(tool)) {
      draft.settings.origins.emplace_back(row.key, origin_text(draft.tool_places.at(row.key)));
    }
  }
}

Draft defaults() {
  Draft draft;
  draft.places.resize(key_table().size());
  return draft;
}

// Stores what a printer file says, whatever kind it is of.
Status read_printer(std::string_view text, const std::string& name, Draft& draft) {
  draft.printer_file = name;
  const auto store = [&](Reading reading) {
    recognise_firmware(text, name, reading);
    draft.maybe_elsewhere = reading.maybe_elsewhere;
    return apply(reading, draft);
  };
  switch (source_kind(text)) {
    case SourceKind::klipper:
      return read_klipper(text, name).and_then(store);
    case SourceKind::marlin_dump:
      return read_marlin_dump(text, name).and_then(store);
    case SourceKind::rrf_config:
      return read_rrf_config(text, name).and_then(store);
    case SourceKind::m115_answer:
      return fail(ErrorKind::usage, {name, 0},
                  "holds what M115 answers and nothing else, which tells the firmware and none of "
                  "its limits; of a Marlin append what M503 answers, of another firmware give "
                  "printer.cfg or config.g, and give dynamics.x.freq_hz and dynamics.y.freq_hz, "
                  "which unflex identify finds, where they tell of no input shaper");
    case SourceKind::print:
      return fail(ErrorKind::usage, {name, 0},
                  "is a print, not a printer file; what its slicer says of the printer is read "
                  "from the print that is compensated");
    case SourceKind::record:
      return fail(
          ErrorKind::usage, {name, 0},
          "is a record of an accelerometer, not a printer file; unflex identify finds the "
          "resonances in it, and unflex printer init --record puts them into a printer file");
    case SourceKind::toml:
      break;
  }
  return read_toml(text, name, draft);
}

// "dynamics.x.freq_hz" for "x" and "freq_hz".
std::string dynamics_key(std::string_view axis, std::string_view name) {
  return fmt::format("dynamics.{}.{}", axis, name);
}

// A wrong resonance makes a print worse than it was sliced, so the default is for measuring alone.
void note_unknown_resonances(Draft& draft) {
  std::vector<std::string_view> axes;
  std::vector<std::string> overrides;
  for_each_axis(
      [&](std::string_view letter, std::string_view axis, const AxisDynamics& dynamics) {
        const std::string key = dynamics_key(axis, "freq_hz");
        if (!draft.places[*find_key(key)] && dynamics.modes.empty() &&
            !tell_frequency(draft.settings.tools, axis == kAxisKeys.x ? 0 : 1)) {
          axes.push_back(letter);
          overrides.push_back(fmt::format("--set {}=...", key));
        }
      },
      kAxisLetters, kAxisKeys, draft.settings.dynamics);
  if (axes.empty()) {
    return;
  }
  draft.settings.guesses.push_back(
      {{draft.printer_file, 0},
       fmt::format("the resonance along {} is not given, and {} Hz is assumed, a guess that "
                   "compensate refuses; find it with unflex identify or unflex tune, take it from "
                   "the printer's own configuration with unflex printer init, or give {}{}",
                   fmt::join(axes, " and "), AxisDynamics{}.freq_hz, fmt::join(overrides, " "),
                   draft.maybe_elsewhere)});
}

// Printers swing between some 20 and 120 Hz. A value far from this range is mostly in another unit.
void note_odd_frequencies(Draft& draft) {
  constexpr double kLeast_hz = 10.0;
  constexpr double kMost_hz = 200.0;
  const auto note = [&](std::string_view axis, const AxisDynamics& dynamics) {
    const std::string key = dynamics_key(axis, dynamics.modes.empty() ? "freq_hz" : "mode");
    const std::optional<SourcePlace>& place = draft.places[*find_key(key)];
    for (const double freq_hz : {dynamics.slowest_hz(), dynamics.fastest_hz()}) {
      if (place && (freq_hz < kLeast_hz || freq_hz > kMost_hz)) {
        draft.settings.notes.push_back(
            {*place,
             fmt::format("{} is {:.4g}, but printers swing at {} to {} Hz; look whether it is "
                         "in Hz and of this axis, or measure it with unflex identify",
                         key, freq_hz, kLeast_hz, kMost_hz)});
        break;
      }
    }
  };
  for_each_axis(note, kAxisKeys, draft.settings.dynamics);
}

// Notes odd damping ratios. They count all the same.
void note_odd_dampings(Draft& draft) {
  const auto note = [&](std::string_view axis, const AxisDynamics& dynamics) {
    const std::string key = dynamics_key(axis, "damping_ratio");
    const std::optional<SourcePlace>& place = draft.places[*find_key(key)];
    const double ratio = dynamics.damping_ratio;
    if (place && !is_plausible_damping(ratio)) {
      draft.settings.notes.push_back(
          {*place, fmt::format("{} is {:.4g}, but printers have {} to {}; measure it with unflex "
                               "identify or unflex tune",
                               key, ratio, kLeastDamping, kMostDamping)});
    }
  };
  for_each_axis(note, kAxisKeys, draft.settings.dynamics);
}

// Neither M503 nor a slicer tells which motors of a Marlin move what, and the limits of a run are
// those of motors. config.g and printer.cfg tell it.
void note_assumed_kinematics(Draft& draft) {
  constexpr std::string_view kKey = "kinematics.type";
  if (draft.settings.spec().printers.is_told_kinematics || draft.places[*find_key(kKey)]) {
    return;
  }
  draft.settings.notes.push_back(
      {{draft.printer_file, 0},
       fmt::format("nothing tells which motors of this {} move what, and cartesian is assumed; "
                   "set {} to that, or to what the printer is, such as corexy",
                   draft.settings.spec().brand, kKey)});
}

// Firmwares that limit motors hold X to the limits of a Z motor that moves it too. Runs leave Z's
// limits as they are.
void note_slow_z_motor(Draft& draft) {
  const Settings& s = draft.settings;
  constexpr std::size_t kZ = 2;
  constexpr std::string_view kKey = "limits.max_z_accel_mm_s2";
  const double z_mm_s2 = s.axis_max_accel_mm_s2()[kZ];
  if (draft.is_firmware_plain || !s.spec().motion.has_axis_limits || !s.motors().moves_xy(kZ) ||
      z_mm_s2 >= s.base_max_accel_mm_s2()) {
    return;
  }
  const std::optional<SourcePlace>& place = draft.places[*find_key(kKey)];
  draft.settings.notes.push_back(
      {place ? *place : SourcePlace{draft.printer_file, 0},
       fmt::format(
           "{} (M201 Z) is {}, and on a {} the Z motor moves X too, so that the firmware "
           "holds X to it and compensated lines, which need up to base.max_accel_mm_s2, {}, "
           "come out wrong; raise M201 Z on the printer if its motor can do it, and the key",
           kKey, z_mm_s2, to_string(s.kinematics.type), s.base_max_accel_mm_s2())});
}

bool is_known(const Note& note, const Draft& draft) {
  const SourcePlace& noted = note.diagnostic.place;
  const auto has_other_place = [&](std::string_view key) {
    const std::optional<SourcePlace>& place = draft.places[*find_key(key)];
    // A value before the note in the same file is the one that the note calls outdated.
    return place && (place->file != noted.file || place->line > noted.line);
  };
  const auto given_by_others = [&](const std::string& key) {
    if (key == kToolSection) {
      return !draft.settings.tools.empty();
    }
    // Modes tell of frequency and damping, too.
    const std::string modes = fmt::format("{}{}", section_of(key), kModes);
    return has_other_place(key) ||
           (key.starts_with("dynamics.") && find_key(modes) && has_other_place(modes));
  };
  return !note.keys.empty() && std::ranges::all_of(note.keys, given_by_others);
}

void tell_notes(Draft& draft) {
  for (const Note& note : draft.notes) {
    if (!is_known(note, draft)) {
      draft.settings.notes.push_back(note.diagnostic);
    }
  }
}

// Lowers what the slicer says about Z. To Klipper a Z that is faster than the tool may be is a
// mistake, but slicers say what the axis can do.
void bound_z(const Reading& slicer, Draft& draft) {
  const Settings& s = draft.settings;
  if (s.spec().motion.has_axis_limits) {
    return;
  }
  constexpr std::size_t kZ = 2;
  for (const auto& [key, value, most] :
       {std::tuple{"limits.max_z_velocity_mm_s", s.axis_max_velocity_mm_s()[kZ],
                   s.limits.max_velocity_mm_s},
        std::tuple{"limits.max_z_accel_mm_s2", s.axis_max_accel_mm_s2()[kZ],
                   s.limits.max_accel_mm_s2}}) {
    const auto said = std::ranges::find(slicer.assignments, key, &Assignment::key);
    if (said != slicer.assignments.end() && value > most) {
      static_cast<void>(assign(key, most, said->place, draft));
    }
  }
}

void note_late_settings(const PrintText& print, Reading& reading) {
  const std::string_view late = slicer_with_late_settings(print);
  if (!late.empty()) {
    reading.note({print.name, 0},
                 fmt::format("{} writes its settings at the end, where a pipe's come too late; "
                             "give a file or --printer",
                             late));
  }
}

Status apply_overrides(const std::vector<std::string>& overrides, Draft& draft) {
  for (const std::string& text : overrides) {
    if (Status applied = apply_override(text, draft); !applied) {
      return applied;
    }
  }
  return {};
}

// Takes what a print's slicer says of the printer, for keys that no other source gives.
Status read_print(const Sources& sources, Draft& draft) {
  const bool by_default = !draft.places[*find_key("printer.firmware")];
  const std::optional<Firmware> runs =
      sources.firmware_as_sliced ? std::nullopt : std::optional(draft.settings.printer.firmware);
  Reading reading = read_slicer(*sources.print, runs, by_default);
  if (!sources.printer_file) {
    note_late_settings(*sources.print, reading);
  }
  std::erase_if(reading.assignments, [&](const Assignment& assignment) {
    return draft.places[*find_key(assignment.key)].has_value();
  });
  std::ranges::move(std::exchange(draft.notes, {}), std::back_inserter(reading.notes));
  Status applied = apply(reading, draft);
  if (applied) {
    bound_z(reading, draft);
    read_start_code(*sources.print, draft);
  }
  return applied;
}

// A firmware whose own configuration tells of other motors than those of X, Y and Z reckons with
// them itself.
Status check_plain(const std::string& text, const Draft& draft) {
  const std::optional<SourcePlace>& place = draft.places[*find_key("kinematics.type")];
  const Kinematics type = draft.settings.kinematics.type;
  if (!draft.is_firmware_plain || source_kind(text) == SourceKind::toml || !place ||
      type == Kinematics::cartesian) {
    return {};
  }
  return fail(ErrorKind::usage, *place,
              fmt::format("the firmware knows itself that the machine is {}, so print the sliced "
                          "file as it is; unflex translate is for a firmware that does not",
                          to_string(type)));
}

Status read_sources(const Sources& sources, Draft& draft) {
  if (sources.printer_file) {
    const Result<std::string> text = read_printer_file(*sources.printer_file);
    const Status read = text ? read_printer(*text, *sources.printer_file, draft).and_then([&] {
      return check_plain(*text, draft);
    })
                             : Status(tl::unexpected(text.error()));
    if (!read) {
      return read;
    }
  }
  if (Status applied = apply_overrides(sources.overrides, draft); !applied) {
    return applied;
  }
  return sources.print != nullptr ? read_print(sources, draft) : Status{};
}

Result<Settings> finish(Draft draft) {
  if (Status resolved = resolve_dynamics(draft).and_then([&] { return resolve_masses(draft); });
      !resolved) {
    return tl::unexpected(resolved.error());
  }
  if (Status checked = check_consistency(draft).and_then([&] { return check_tools(draft); });
      !checked) {
    return tl::unexpected(checked.error());
  }
  judge_variant(draft);
  tell_notes(draft);
  note_odd_frequencies(draft);
  note_odd_dampings(draft);
  note_assumed_kinematics(draft);
  note_slow_z_motor(draft);
  // They do not matter to a print that is only translated.
  if (!draft.is_firmware_plain) {
    note_unknown_resonances(draft);
  }
  record_origins(draft);
  return draft.settings;
}

}  // namespace

bool describes_printer(const PrintText& text) {
  return text.tail_line == 1 && source_kind(text.tail) != SourceKind::print;
}

Result<Settings> load(const Sources& sources) {
  Draft draft = defaults();
  draft.is_firmware_plain = sources.is_firmware_plain;
  if (Status read = read_sources(sources, draft); !read) {
    return tl::unexpected(read.error());
  }
  return finish(std::move(draft));
}

Result<Settings> load(const std::optional<std::string>& printer_file,
                      const std::vector<std::string>& overrides) {
  return load(Sources{.print = nullptr, .printer_file = printer_file, .overrides = overrides});
}

Result<Settings> parse(std::string_view text, const std::string& name,
                       const std::vector<std::string>& overrides) {
  Draft draft = defaults();
  const Status read =
      read_printer(text, name, draft).and_then([&] { return apply_overrides(overrides, draft); });
  return read ? finish(std::move(draft)) : Result<Settings>(tl::unexpected(read.error()));
}

namespace {

// A file's name may be any bytes. In a comment it must neither end the comment nor hold what TOML
// refuses.
std::string printable(std::string_view text) {
  std::string shown;
  while (!text.empty()) {
    const std::size_t length = first_utf8(text).length;
    const bool is_control = static_cast<unsigned char>(text.front()) < 0x20 || text.front() == 0x7f;
    shown += length == 0 || is_control ? "?" : text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return shown;
}

// Keys left at their default are written as comments. So they stay at their default when the text
// is read again, and the value in force is still seen.
std::string toml_line(const Key& key, std::string_view name, const std::string& origin,
                      Draft& draft) {
  const std::optional<std::string> own = own_value(key, draft);
  const std::optional<std::string> value = value_in_force(key, draft);
  if (own && (origin == kDefaultOrigin || origin.ends_with(kModes))) {
    return fmt::format("# {} = {}\n", name, *own);
  }
  if (own) {
    return fmt::format("{} = {}{}\n", name, *own, origin.empty() ? "" : "  # " + printable(origin));
  }
  return value ? fmt::format("# {} = {}  (unset: {})\n", name, *value, key.if_unset)
               : fmt::format("# {} is unset: {}\n", name, key.if_unset);
}

// The origin of a key that is not in the table; empty: not known.
std::string origin_of(const Settings& settings, std::string_view key) {
  const auto found =
      std::ranges::find(settings.origins, key, &std::pair<std::string, std::string>::first);
  return found == settings.origins.end() ? std::string{} : found->second;
}

}  // namespace

std::string to_toml(const Settings& settings) {
  Draft draft;
  draft.settings = settings;
  std::string text =
      "# A printer as unflex sees it; docs/configuration.md explains each key. Behind a value "
      "stands\n"
      "# where it is from, and keys that are comments are at their default.\n\nschema_version = "
      "1\n";
  std::string_view section;
  std::size_t next_origin = 0;
  for (const Key& key : key_table()) {
    if (key.converted) {
      continue;
    }
    if (section_of(key.name) != section) {
      section = section_of(key.name);
      text += fmt::format("\n[{}]\n", section);
    }
    // Settings that were not read but built in memory have no origins.
    const std::string origin = next_origin < settings.origins.size()
                                   ? settings.origins[next_origin].second
                                   : std::string{};
    ++next_origin;
    if (settings.swing.has_masses() && is_of_axes(key.name)) {
      continue;
    }
    text += toml_line(key, key.name.substr(section.size() + 1), origin, draft);
  }
  for (const ToolSettings& tool : settings.tools) {
    const std::string tool_section = fmt::format("tool.{}", tool.number);
    text += fmt::format("\n[{}]\n", tool_section);
    for (const auto& [key, value] : rows_of(tool)) {
      const std::string origin = origin_of(settings, key);
      text += fmt::format("{} = {}{}\n", key.substr(tool_section.size() + 1), value,
                          origin.empty() ? "" : "  # " + printable(origin));
    }
  }
  return text;
}

std::vector<SettingRow> rows(const Settings& settings) {
  Draft draft;
  draft.settings = settings;
  std::vector<SettingRow> rows;
  std::size_t next_origin = 0;
  for (const Key& key : key_table()) {
    if (key.converted) {
      continue;
    }
    const std::string origin = next_origin < settings.origins.size()
                                   ? settings.origins[next_origin].second
                                   : std::string(kDefaultOrigin);
    ++next_origin;
    rows.push_back({.key = std::string(key.name),
                    .value = value_in_force(key, draft).value_or(""),
                    .origin = origin});
  }
  for (const ToolSettings& tool : settings.tools) {
    for (const auto& [key, value] : rows_of(tool)) {
      rows.push_back({.key = key, .value = value, .origin = origin_of(settings, key)});
    }
  }
  return rows;
}

}  // namespace unflex::machine
