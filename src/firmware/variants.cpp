// Sources of each row: docs/compatibility.md.
#include "variants.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <string>

#include "key_table.hpp"
#include "text_lines.hpp"
#include "unflex/gcode/command.hpp"

namespace unflex::machine {
namespace {

constexpr std::string_view kKalico = "kalico";
constexpr std::string_view kKalicoLimited = "kalico_limited";
constexpr std::string_view kKalicoSmooth = "kalico_smooth";
constexpr std::string_view kBuddy = "prusa_buddy";
constexpr std::string_view kSnapmakerJ1 = "snapmaker_j1";
constexpr std::string_view kMarlin10 = "marlin_1_0";

// Printers of Prusa's with a Buddy board, as PrusaSlicer and M862.3 write them, in lower case. The
// older ones (MK3S, MK2.5) run an 8 bit Marlin of Prusa's own.
constexpr std::array<std::string_view, 7> kBuddyModels = {"mini", "mk3.5", "mk3.9",  "mk4",
                                                          "xl",   "ix",    "coreone"};
// Endings that may follow a model: its revision, tools, multi material unit.
constexpr std::array<std::string_view, 14> kModelEndings = {
    "", "s", "is", "mmu3", "smmu3", "ismmu3", "l", "lmmu3", "2", "5", "2is", "5is", "+", "plus"};

std::string without(std::string text, std::string_view part) {
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part)) {
    text.erase(at, part.size());
  }
  return text;
}

// "Prusa CORE One" is "coreone".
std::string model_name(std::string_view text) {
  std::string name = lower(text);
  for (const std::string_view part : {"original", "prusa", "i3", " ", "\"", "_"}) {
    name = without(std::move(name), part);
  }
  return name;
}

std::string_view variant_of_model(std::string_view model) {
  const std::string name = model_name(model);
  const auto is_buddy = [&](std::string_view buddy) {
    return name.starts_with(buddy) &&
           std::ranges::find(kModelEndings, std::string_view(name).substr(buddy.size())) !=
               kModelEndings.end();
  };
  if (std::ranges::any_of(kBuddyModels, is_buddy)) {
    return kBuddy;
  }
  return name == "snapmakerj1" || name == "snapmakerj1s" ? kSnapmakerJ1 : std::string_view{};
}

// The text between a mark and the character that ends it.
std::optional<std::string> behind(std::string_view line, std::string_view mark, char end) {
  const std::size_t at = line.find(mark);
  if (at == std::string_view::npos) {
    return std::nullopt;
  }
  line.remove_prefix(at + mark.size());
  line = trimmed(line);
  return std::string(trimmed(line.substr(0, line.find(end))));
}

// Numbers parted by points or dashes at a version's beginning: "v0.13.0-631-gdb10e92e9".
std::array<int, 4> numbers_of(std::string_view version) {
  std::array<int, 4> numbers{-1, -1, -1, -1};
  version.remove_prefix(version.starts_with('v') ? 1 : 0);
  for (int& number : numbers) {
    const auto [end, error] =
        std::from_chars(version.data(), version.data() + version.size(), number);
    if (error != std::errc{}) {
      break;
    }
    version.remove_prefix(static_cast<std::size_t>(end - version.data()));
    if (version.empty() || (version.front() != '.' && version.front() != '-')) {
      break;
    }
    version.remove_prefix(1);
  }
  return numbers;
}

const std::optional<SourcePlace>& place_of(const Draft& draft, std::string_view key) {
  return draft.places[*find_key(key)];
}

SourcePlace first_place(const Draft& draft, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (const std::optional<SourcePlace>& place = place_of(draft, key)) {
      return *place;
    }
  }
  return {};
}

bool may_have_shaper(const Settings& s) {
  return any_axis([](double freq_hz, bool is_unknown) { return freq_hz > 0.0 || is_unknown; },
                  s.shaper_freq_hz(), s.shaper_unknown());
}

void refuse(Draft& draft, SourcePlace place, std::string message) {
  if (!draft.settings.refusal) {
    draft.settings.refusal = Diagnostic{std::move(place), std::move(message)};
  }
}

// Klipper from db10e92e9 to 77d5d942e, 631 to 642 commits after v0.13.0, does not switch its shaper
// off.
void klipper_ignores_shaper_off(Draft& draft) {
  const Settings& s = draft.settings;
  constexpr std::array kTag = {0, 13, 0};
  constexpr int kBroken = 631;
  constexpr int kMended = 642;
  const std::array<int, 4> version = numbers_of(s.printer.version);
  const bool is_after_tag = std::equal(kTag.begin(), kTag.end(), version.begin());
  if (s.printer.firmware == Firmware::klipper && !s.printer.variant.starts_with(kKalico) &&
      is_after_tag && version.back() >= kBroken && version.back() < kMended && may_have_shaper(s)) {
    refuse(draft, first_place(draft, {"printer.version"}),
           fmt::format("Klipper {} does not carry out SET_INPUT_SHAPER SHAPER_FREQ_X=0, so that a "
                       "compensated print would be shaped twice; update it to v0.13.0-{} or later, "
                       "or take [input_shaper] out of printer.cfg and set "
                       "printer.input_shaper_freq_x_hz = 0 and printer.input_shaper_freq_y_hz = 0",
                       s.printer.version, kMended));
  }
}

// kinematics/limited_*.py: check_move caps what SET_VELOCITY_LIMIT ACCEL allows by max_x_accel and
// max_y_accel, or scales it by them; extras/input_shaper.py of the branch bleeding-edge-v2.
void kalico(Draft& draft) {
  const std::string& variant = draft.settings.printer.variant;
  if (variant == kKalicoLimited) {
    refuse(draft, first_place(draft, {"printer.variant"}),
           "Kalico's limited_* kinematics slow compensated lines down to max_x_accel and "
           "max_y_accel, whatever acceleration a run asks for; for compensated prints set "
           "kinematics in printer.cfg without limited_, with the weaker axis' acceleration as "
           "max_accel");
  } else if (variant == kKalicoSmooth) {
    refuse(draft, first_place(draft, {"printer.variant"}),
           "Kalico's smooth shapers are not switched off by SHAPER_FREQ_X=0, so that a compensated "
           "print would be shaped twice; set shaper_type in [input_shaper] to one without smooth_, "
           "such as mzv, which unflex switches off");
  }
}

void prusa_buddy(Draft& draft) {
  if (draft.settings.printer.variant == kBuddy) {
    refuse(draft, first_place(draft, {"printer.variant"}),
           "a printer with Prusa's Buddy firmware (MK4, MK3.9, MK3.5, XL, MINI, CORE One) caps "
           "M201, M203 and M205 without a word (MK4 7000 mm/s², CORE One 10000, jerk 10 mm/s), so "
           "that compensated lines would be slowed down and drawn wrong; print the sliced file as "
           "it is, with the printer's own input shaper; if the printer runs something else, say so "
           "with printer.firmware = \"klipper\" or, for a Marlin without such caps, "
           "printer.variant = \"mainline\"");
  }
}

void snapmaker_j1(Draft& draft) {
  const Settings& s = draft.settings;
  if (s.printer.variant == kSnapmakerJ1 && may_have_shaper(s)) {
    refuse(draft, first_place(draft, {"printer.input_shaper_freq_x_hz", "printer.variant"}),
           "on the Snapmaker J1 M593 F0, which switches input shaping off, stops X and Y for the "
           "rest of the print; switch its shaping off on its display before the print and set "
           "printer.input_shaper_freq_x_hz = 0 and printer.input_shaper_freq_y_hz = 0, and unflex "
           "writes no M593");
  } else if (s.printer.variant == kSnapmakerJ1) {
    draft.notes.push_back(
        {{first_place(draft, {"printer.variant"}),
          "on the Snapmaker J1 M593 F0 stops X and Y for the rest of the print; unflex writes none "
          "as long as the print has no M593, so take those out of its start code, and switch "
          "vibration compensation off on the printer's display"},
         {}});
  }
}

// Marlin 1.0, Marlin_main.cpp, M204 reads S and T alone, and planner.cpp takes junctions otherwise.
void marlin_1_0(Draft& draft) {
  if (draft.settings.printer.variant == kMarlin10) {
    refuse(draft, first_place(draft, {"printer.variant"}),
           "this M204 is of Marlin 1.0, which does not know M204 P, with which a run raises the "
           "acceleration, so that compensated lines would be slowed down and drawn wrong; update "
           "the printer to Marlin 2, or set printer.variant = \"mainline\" if it runs that "
           "already");
  }
}

void marlin_ft_motion(Draft& draft) {
  const Settings& s = draft.settings;
  if (s.printer.firmware == Firmware::marlin && s.printer.ft_motion) {
    refuse(
        draft, first_place(draft, {"printer.ft_motion"}),
        "Marlin's fixed-time motion is on (M493 S1), which plans and shapes motion otherwise than "
        "unflex reckons; write M493 S0 into the start code of the print, or send M493 S0 and "
        "M500, and set printer.ft_motion = false");
  }
}

// module/planner.cpp: a line with filament is accelerated by at most jerk_E / (K · e), with e the
// filament per mm, and with junction deviation jerk_E² = √½ · deviation · a_E / (1 − √½). Inside a
// run the values behind this limit are raised, so that it is far above what a run needs.
void marlin_linear_advance(Draft& draft) {
  const Settings& s = draft.settings;
  if (s.printer.firmware != Firmware::marlin || s.printer.linear_advance_s <= 0.0) {
    return;
  }
  constexpr std::size_t kE = 3;
  const double root = std::numbers::sqrt2 / 2.0;
  const double jerk_mm_s = s.printer.junctions.classic_jerk
                               ? s.jerk_mm_s()[kE]
                               : std::sqrt(root * s.limits.junction_deviation_mm *
                                           s.axis_max_accel_mm_s2()[kE] / (1.0 - root));
  // A bead as wide as the nozzle and half as high.
  const double nozzle_mm = s.extruder.nozzle_diameter_mm;
  const double radius_mm = s.extruder.filament_diameter_mm / 2.0;
  const double filament_per_mm =
      nozzle_mm * nozzle_mm / 2.0 / (std::numbers::pi * radius_mm * radius_mm);
  const double most_mm_s2 = jerk_mm_s / (s.printer.linear_advance_s * filament_per_mm);
  if (most_mm_s2 < s.print_accel_mm_s2()) {
    draft.notes.push_back(
        {{first_place(draft, {"printer.linear_advance_s"}),
          fmt::format(
              "with LIN_ADVANCE and K {} Marlin accelerates lines of filament by some {:.0f} "
              "mm/s² at most, and unflex plans the sliced print with {:.0f}; set "
              "limits.print_accel_mm_s2 = {:.0f} and M204 P in the slicer to the same, or "
              "raise the extruder's jerk",
              s.printer.linear_advance_s, most_mm_s2, s.print_accel_mm_s2(),
              std::floor(most_mm_s2 / 100.0) * 100.0)},
         {}});
  }
}

// Adds the version, if the text can be one.
void add_version(const std::string& version, const SourcePlace& place, Reading& reading) {
  constexpr std::string_view kInVersions =
      "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.+-_";
  if (!version.empty() && version.find_first_not_of(kInVersions) == std::string::npos) {
    reading.add("printer.version", version, place);
  }
}

}  // namespace

void recognise_firmware(std::string_view text, const std::string& file, Reading& reading) {
  for_each_line(text, 1, [&](std::string_view line, std::size_t number) {
    const SourcePlace place{file, number};
    // This line is from klippy.log.
    if (const auto version = behind(line, "Git version: '", '\'')) {
      add_version(*version, place, reading);
    }
    const auto name = behind(line, "FIRMWARE_NAME:", '\0');
    if (!name) {
      return;
    }
    if (name->find("Prusa-Firmware-Buddy") != std::string::npos) {
      reading.add("printer.variant", std::string(kBuddy), place);
    } else if (lower(*name).find("snapmaker") != std::string::npos &&
               name->find("J1") != std::string::npos) {
      reading.add("printer.variant", std::string(kSnapmakerJ1), place);
    }
    if (const auto version = behind(line, "FIRMWARE_VERSION:", ' ')) {
      add_version(*version, place, reading);
    } else if (const auto marlin = behind(*name, "Marlin ", ' ')) {
      add_version(*marlin, place, reading);
    }
  });
}

void recognise_print(const PrintText& print, std::string_view printer_model,
                     const SourcePlace& model_place, std::optional<Firmware> runs,
                     Reading& reading) {
  if (runs && *runs != Firmware::marlin) {
    return;
  }
  std::string_view variant = variant_of_model(printer_model);
  SourcePlace place = model_place;
  for_each_line(print.head, 1, [&](std::string_view line, std::size_t number) {
    // M862.3 P "MK4": the printer refuses the print if it is another model.
    const gcode::Command command = gcode::parse(line);
    const bool is_check = command.kind == gcode::CommandKind::traditional &&
                          command.letter == 'M' && command.number == 862 && command.subnumber == 3;
    if (variant.empty() && is_check) {
      const std::size_t p = line.find_first_of("Pp");
      const std::string_view model = p == std::string_view::npos ? "" : line.substr(p + 1);
      variant = variant_of_model(model.substr(0, model.find(';')));
      place = {print.name, number};
    }
  });
  if (!variant.empty()) {
    reading.add("printer.variant", std::string(variant), place);
  }
}

void read_start_code(const PrintText& print, Draft& draft) {
  if (draft.settings.printer.firmware != Firmware::marlin) {
    return;
  }
  for_each_line(print.head, 1, [&](std::string_view line, std::size_t number) {
    const gcode::Command command = gcode::parse(line);
    if (command.kind != gcode::CommandKind::traditional || command.letter != 'M') {
      return;
    }
    const auto set = [&](std::string_view key, const Value& value) {
      // A value out of its bounds is ignored, since Marlin does not take it either.
      static_cast<void>(assign(std::string(key), value, {print.name, number}, draft));
    };
    if (command.number == 493 && command.value('S')) {
      set("printer.ft_motion", *command.value('S') != 0.0);
    } else if (command.number == 900 && command.value('K') && *command.value('K') >= 0.0) {
      set("printer.linear_advance_s", *command.value('K'));
    } else if (command.number == 593 && draft.settings.printer.variant == kSnapmakerJ1) {
      refuse(draft, {print.name, number},
             "on the Snapmaker J1 M593 F0, with which unflex switches shaping off, stops X and Y "
             "for the rest of the print; take this line out of the start code");
    }
  });
}

void judge_variant(Draft& draft) {
  for (auto* row : {klipper_ignores_shaper_off, kalico, prusa_buddy, snapmaker_j1, marlin_1_0,
                    marlin_ft_motion, marlin_linear_advance}) {
    row(draft);
  }
  if (const std::optional<Diagnostic>& refusal = draft.settings.refusal) {
    draft.notes.push_back({{refusal->place, "compensate refuses: " + refusal->message}, {}});
  }
}

bool is_at_least(std::string_view version, int major, int minor) {
  const std::array<int, 4> numbers = numbers_of(version);
  return numbers[0] > major || (numbers[0] == major && numbers[1] >= minor);
}

}  // namespace unflex::machine
