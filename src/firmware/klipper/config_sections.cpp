#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "generic_cartesian.hpp"
#include "klipper_config.hpp"
#include "klipper_reader.hpp"
#include "klipper_shaper.hpp"
#include "text_lines.hpp"
#include "unflex/dynamics/shapers.hpp"

namespace unflex::machine {
namespace {

struct Row {
  std::string_view section;
  std::string_view option;
  std::string_view key;
};

// Options that are keys under another name. toolhead.py, kinematics/extruder.py,
// extras/firmware_retraction.py, extras/gcode_arcs.py.
constexpr std::array kRows = {
    Row{"printer", "max_velocity", "limits.max_velocity_mm_s"},
    Row{"printer", "max_accel", "limits.max_accel_mm_s2"},
    Row{"printer", "square_corner_velocity", "limits.square_corner_velocity_mm_s"},
    Row{"printer", "max_z_velocity", "limits.max_z_velocity_mm_s"},
    Row{"printer", "max_z_accel", "limits.max_z_accel_mm_s2"},
    Row{"extruder", "nozzle_diameter", "extruder.nozzle_diameter_mm"},
    Row{"extruder", "filament_diameter", "extruder.filament_diameter_mm"},
    Row{"extruder", "max_extrude_cross_section", "extruder.max_extrude_cross_section_mm2"},
    Row{"extruder", "max_extrude_only_velocity", "extruder.max_extrude_only_velocity_mm_s"},
    Row{"extruder", "max_extrude_only_accel", "extruder.max_extrude_only_accel_mm_s2"},
    Row{"extruder", "instantaneous_corner_velocity", "extruder.instantaneous_corner_velocity_mm_s"},
    Row{"extruder", "pressure_advance", "extruder.pressure_advance_s"},
    Row{"extruder", "pressure_advance_smooth_time", "extruder.pressure_advance_smooth_s"},
    Row{"firmware_retraction", "retract_length", "printer.retract_length_mm"},
    Row{"firmware_retraction", "retract_speed", "printer.retract_speed_mm_s"},
    Row{"firmware_retraction", "unretract_extra_length", "printer.unretract_extra_length_mm"},
    Row{"firmware_retraction", "unretract_speed", "printer.unretract_speed_mm_s"},
    Row{"gcode_arcs", "resolution", "printer.arc_resolution_mm"},
};

struct KnownKinematics {
  std::string_view name;
  Kinematics type;
};

// HelgeKeck/klipper_hybrid_corexy has ratos_hybrid_corexy, and for both names a section of its own
// with the option `inverted`. Kalico's limited_ kinematics move like those without that word
// (klippy/kinematics).
constexpr std::array kKinematics = {
    KnownKinematics{"cartesian", Kinematics::cartesian},
    KnownKinematics{"corexy", Kinematics::corexy},
    KnownKinematics{"corexz", Kinematics::corexz},
    KnownKinematics{"hybrid_corexy", Kinematics::hybrid_corexy},
    KnownKinematics{"ratos_hybrid_corexy", Kinematics::hybrid_corexy},
    KnownKinematics{"hybrid_corexz", Kinematics::hybrid_corexz},
    KnownKinematics{"generic_cartesian", Kinematics::cartesian},
    KnownKinematics{"limited_cartesian", Kinematics::cartesian},
    KnownKinematics{"limited_corexy", Kinematics::corexy},
    KnownKinematics{"limited_corexz", Kinematics::corexz},
};

// Klipper's getboolean() (Python's configparser).
bool is_true(std::string_view text) {
  const std::string value = lower(text);
  return value == "1" || value == "yes" || value == "true" || value == "on";
}

// Python's float(), as far as printers use it.
std::optional<double> number_of(std::string_view text) {
  if (text.starts_with('+')) {
    text.remove_prefix(1);
  }
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc{} && end == text.data() + text.size();
  return whole ? std::optional(value) : std::nullopt;
}

// Whether a macro gives an input shaper a frequency of its own. One that switches it off, or back
// to what the configuration says, does not.
bool sets_shaper(std::string_view macro) {
  const std::string text = lower(macro);
  constexpr std::string_view kFrequency = "shaper_freq_";
  for (std::size_t at = text.find("set_input_shaper"); at != std::string::npos;
       at = text.find("set_input_shaper", at + 1)) {
    const std::string_view line = std::string_view(text).substr(at, text.find('\n', at) - at);
    const std::size_t word = line.find(kFrequency);
    const std::size_t value = word == std::string_view::npos ? word : line.find('=', word);
    if (value == std::string_view::npos) {
      continue;
    }
    const std::size_t digit = line.find_first_not_of(" 0.", value + 1);
    if (digit != std::string_view::npos && line[digit] >= '1' && line[digit] <= '9') {
      return true;
    }
  }
  return false;
}

// "57:11, 2:1": the product of the ratios.
std::optional<double> gear_ratio(std::string_view text) {
  double product = 1.0;
  for (;;) {
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::string_view gear = text.substr(0, comma);
    const std::size_t colon = gear.find(':');
    if (colon == std::string_view::npos) {
      return std::nullopt;
    }
    const std::optional<double> driven = number_of(trimmed(gear.substr(0, colon)));
    const std::optional<double> driving = number_of(trimmed(gear.substr(colon + 1)));
    if (!driven || !driving) {
      return std::nullopt;
    }
    product *= *driven / *driving;
    if (comma == text.size()) {
      return product;
    }
    text.remove_prefix(comma + 1);
  }
}

// "; it may be in a.cfg (printer.cfg:3), …" if includes lead to no file, else "".
std::string maybe_elsewhere(const std::vector<MissingInclude>& missing) {
  std::vector<std::string> names;
  for (const MissingInclude& include : missing) {
    names.push_back(
        fmt::format("{} ({}:{})", include.path, include.place.file, include.place.line));
  }
  const bool several = names.size() > 1;
  return names.empty()
             ? ""
             : fmt::format(
                   "; it may be in {}, which {} included but not there: copy {} "
                   "from the printer to that place",
                   fmt::join(names, " or "), several ? "are" : "is", several ? "them" : "it");
}

class Reader {
 public:
  Reader(const KlipperConfig& config, std::string file)
      : config_(&config),
        file_(std::move(file)),
        is_whole_(std::ranges::all_of(config.missing, &MissingInclude::is_allowed)) {
    reading_.maybe_elsewhere = maybe_elsewhere(config.missing);
  }

  Result<Reading> read() {
    if (const Status usable = kinematics(); !usable) {
      return tl::unexpected(usable.error());
    }
    reading_.add("printer.firmware", "klipper", config_->find("printer")->place);
    for (const Row& row : kRows) {
      if (const auto value = number(row.section, row.option)) {
        reading_.add(std::string(row.key), *value, place(row.section, row.option));
      }
    }
    minimum_cruise_ratio();
    firmware_retraction();
    kalico();
    heads();
    travel("x");
    travel("y");
    input_shaper("x");
    input_shaper("y");
    steps_per_mm("stepper_x", "printer.x_steps_per_mm");
    steps_per_mm("stepper_y", "printer.y_steps_per_mm");
    steps_per_mm("stepper_z", "printer.z_steps_per_mm");
    steps_per_mm("extruder", "printer.e_steps_per_mm");
    if (failure_) {
      return tl::unexpected(*failure_);
    }
    return std::move(reading_);
  }

 private:
  [[nodiscard]] const KlipperOption* option(std::string_view section, std::string_view name) const {
    const KlipperSection* const found = config_->find(std::string(section));
    return found == nullptr ? nullptr : found->find(std::string(name));
  }

  [[nodiscard]] SourcePlace place(std::string_view section, std::string_view name) const {
    const KlipperOption* const found = option(section, name);
    return found == nullptr ? SourcePlace{file_, 0} : found->place;
  }

  // The number of an option; nullopt if there is no such option. Text that is no number becomes
  // failure_.
  std::optional<double> number(std::string_view section, std::string_view name) {
    const KlipperOption* const found = option(section, name);
    if (found == nullptr) {
      return std::nullopt;
    }
    const std::optional<double> value = number_of(found->text);
    if ((!value || !std::isfinite(*value)) && !failure_) {
      failure_ =
          Error{ErrorKind::usage, found->place,
                fmt::format("{} in [{}] must be a number, not '{}'", name, section, found->text)};
    }
    return value;
  }

  void note(SourcePlace at, std::string message, std::vector<std::string> keys = {}) {
    reading_.note(std::move(at), std::move(message), std::move(keys));
  }

  Status kinematics() {
    if (config_->find("printer") == nullptr && config_->missing.empty()) {
      return fail(
          ErrorKind::usage, {file_, 0},
          "has no [printer], so it is a part of Klipper's configuration that says nothing of "
          "the machine; give printer.cfg, which includes it");
    }
    for (const std::string_view required : {"kinematics", "max_velocity", "max_accel"}) {
      if (option("printer", required) == nullptr) {
        return fail(ErrorKind::usage, {file_, 0},
                    fmt::format("{} in [printer] is missing{}", required,
                                config_->missing.empty() ? "; give the printer's whole "
                                                           "configuration, with what it includes"
                                                         : reading_.maybe_elsewhere));
      }
    }
    const KlipperOption& given = *option("printer", "kinematics");
    const auto known = std::ranges::find(kKinematics, given.text, &KnownKinematics::name);
    if (known == kKinematics.end()) {
      return fail(
          ErrorKind::usage, given.place,
          fmt::format("unflex does not support kinematics '{}' yet, only cartesian, corexy, "
                      "corexz, hybrid_corexy, hybrid_corexz and generic_cartesian; print the "
                      "sliced file as it is on this machine",
                      given.text));
    }
    if (given.text == "generic_cartesian") {
      return carriages(given);
    }
    const KlipperOption* const inverted = option(known->name, "inverted");
    const bool is_inverted = inverted != nullptr && is_true(inverted->text);
    const bool is_hybrid = known->type == Kinematics::hybrid_corexy;
    const Kinematics type =
        is_hybrid && is_inverted ? Kinematics::hybrid_corexy_inverted : known->type;
    reading_.add("kinematics.type", std::string(to_string(type)),
                 is_hybrid && is_inverted ? inverted->place : given.place);
    return {};
  }

  // generic_cartesian: the motors are told by the carriages that each stepper moves.
  Status carriages(const KlipperOption& given) {
    const Result<std::vector<GenericMotor>> motors =
        generic_motors(*config_, reading_.maybe_elsewhere);
    if (!motors) {
      return tl::unexpected(motors.error());
    }
    if (motors->empty() && !config_->missing.empty()) {
      return fail(ErrorKind::usage, given.place,
                  fmt::format("the steppers of this {} and their carriages are missing{}",
                              given.text, reading_.maybe_elsewhere));
    }
    const Kinematics type = kinematics_of(*motors);
    reading_.add("kinematics.type", std::string(to_string(type)), given.place);
    if (type != Kinematics::linear) {
      return {};
    }
    if (motors->size() != Motors::kCount) {
      return fail(
          ErrorKind::usage, given.place,
          fmt::format("its steppers make {} different sums of carriages, and unflex knows machines "
                      "with three{}",
                      motors->size(), reading_.maybe_elsewhere));
    }
    for (std::size_t i = 0; i < motors->size(); ++i) {
      const GenericMotor& motor = (*motors)[i];
      reading_.add(fmt::format("kinematics.joint_{}", "abc"[i]),
                   std::vector<Value>(motor.row.begin(), motor.row.end()), motor.place);
      steps_per_mm(motor.section, fmt::format("printer.{}_steps_per_mm", "xyz"[i]));
    }
    return {};
  }

  // Recognises Kalico by sections, kinematics and shapers that Klipper does not have. The last
  // variant found counts, so the ones that unflex cannot work with come last (variants.cpp).
  void kalico() {
    const auto recognised = [&](const char* variant, const SourcePlace& at) {
      reading_.add("printer.variant", variant, at);
    };
    for (const std::string section : {"danger_options", "kalico"}) {
      if (const KlipperSection* const found = config_->find(section)) {
        recognised("kalico", found->place);
      }
    }
    for (const std::string name : {"shaper_type", "shaper_type_x", "shaper_type_y"}) {
      const KlipperOption* const type = option("input_shaper", name);
      if (type != nullptr && (type->text.starts_with("smooth_") || type->text == "smoother")) {
        recognised("kalico_smooth", type->place);
      }
    }
    const KlipperOption& kinematics = *option("printer", "kinematics");
    if (kinematics.text.starts_with("limited_")) {
      recognised("kalico_limited", kinematics.place);
    }
  }

  // Looks for signs of more than one head, or of more than one resonance: a second carriage, a tool
  // changer (viesturz/klipper-toolchanger), and macros that set input shapers.
  void heads() {
    for (const auto& [name, section] : config_->sections) {
      const bool changes_heads =
          name == "dual_carriage" || name.starts_with("dual_carriage ") || name == "toolchanger";
      const KlipperOption* const text =
          name.starts_with("gcode_macro ") ? section.find("gcode") : nullptr;
      const std::string_view sign = changes_heads ? ": this printer has more than one head"
                                    : text != nullptr && sets_shaper(text->text)
                                        ? " sets an input shaper of its own"
                                        : "";
      if (!sign.empty()) {
        note(section.place,
             fmt::format("[{}]{}, and unflex takes one resonance for all; measure each head, and "
                         "give each its own by tool.1.dynamics.x.freq_hz and so on",
                         name, sign),
             {std::string(kToolSection)});
      }
    }
  }

  // Before minimum_cruise_ratio Klipper had max_accel_to_decel.
  void minimum_cruise_ratio() {
    constexpr std::string_view kKey = "limits.minimum_cruise_ratio";
    if (const auto ratio = number("printer", "minimum_cruise_ratio")) {
      reading_.add(std::string(kKey), *ratio, place("printer", "minimum_cruise_ratio"));
      return;
    }
    const auto to_decel = number("printer", "max_accel_to_decel");
    const auto accel = number("printer", "max_accel");
    if (to_decel && accel && *accel > 0.0) {
      reading_.add(std::string(kKey), 1.0 - std::min(1.0, *to_decel / *accel),
                   place("printer", "max_accel_to_decel"));
    }
  }

  void firmware_retraction() {
    const KlipperSection* const section = config_->find("firmware_retraction");
    if (section != nullptr || is_whole_) {
      reading_.add("printer.firmware_retraction", section != nullptr,
                   section == nullptr ? SourcePlace{file_, 0} : section->place);
    }
    if (section != nullptr && section->find("retract_length") == nullptr) {
      reading_.add("printer.retract_length_mm", 0.0, section->place);
    }
  }

  // generic_cartesian has carriages instead of steppers.
  [[nodiscard]] std::string rail_of(const std::string& axis) const {
    for (const auto& [name, section] : config_->sections) {
      if (name.starts_with("carriage ") && axis_of_carriage(name, section) == axis[0] - 'x') {
        return name;
      }
    }
    return "stepper_" + axis;
  }

  void travel(const std::string& axis) {
    const std::string rail = rail_of(axis);
    const auto max = number(rail, "position_max");
    if (max) {
      const double min = number(rail, "position_min").value_or(0.0);
      reading_.add("printer.travel_" + axis + "_mm", Range{min, *max}, place(rail, "position_max"));
    }
  }

  // Klipper's stepper.py, parse_step_distance. What cannot be read is left out, because these
  // numbers decide over nothing but the check of step rates.
  void steps_per_mm(std::string_view section, std::string_view key) {
    constexpr double kFullSteps = 200.0;
    const KlipperOption* const distance = option(section, "rotation_distance");
    const KlipperOption* const microsteps = option(section, "microsteps");
    if (distance == nullptr || microsteps == nullptr) {
      return;
    }
    const KlipperOption* const full_steps = option(section, "full_steps_per_rotation");
    const KlipperOption* const gears = option(section, "gear_ratio");
    const std::optional<double> rotation_mm = number_of(distance->text);
    const std::optional<double> per_step = number_of(microsteps->text);
    const std::optional<double> steps =
        full_steps != nullptr ? number_of(full_steps->text) : kFullSteps;
    const std::optional<double> ratio = gears != nullptr ? gear_ratio(gears->text) : 1.0;
    if (!rotation_mm || !per_step || !steps || !ratio) {
      return;
    }
    const double value = *steps * *per_step * *ratio / *rotation_mm;
    if (value > 0.0 && std::isfinite(value)) {
      reading_.add(std::string(key), as_written(value), distance->place);
    }
  }

  // Types that Klipper has (shaper_defs.py); mzv may carry parameters, "mzv(n=4,t=0.9)".
  // Returns the type as it is written, "mzv" if none is.
  std::string shaper_type(const std::string& axis) {
    constexpr std::array<std::string_view, 6> kTypes = {"zv", "mzv",      "zvd",
                                                        "ei", "2hump_ei", "3hump_ei"};
    const KlipperSection* const section = config_->find("input_shaper");
    if (section == nullptr) {
      return "mzv";
    }
    const KlipperOption* type = section->find("shaper_type_" + axis);
    type = type != nullptr ? type : section->find("shaper_type");
    const std::string_view text = type != nullptr ? std::string_view(type->text) : "mzv";
    const SourcePlace at = type != nullptr ? type->place : section->place;
    const std::string key =
        axis == "x" ? "printer.input_shaper_type" : "printer.input_shaper_type_y";
    if (std::ranges::find(kTypes, text) != kTypes.end() || dynamics::mzv_form(text)) {
      reading_.add(key, std::string(text), at);
    } else {
      reading_.note(at,
                    fmt::format("the input shaper '{}' is not known to unflex; what the printer "
                                "plays by it is reckoned with as if it were mzv",
                                text),
                    {key});
    }
    return std::string(text);
  }

  // A shaper's frequency suits the shaper; the resonance follows from it within a few percent.
  void resonance(const std::string& axis, const std::string& type, double shaper_freq_hz,
                 const SourcePlace& at) {
    const std::string key = "dynamics." + axis + ".freq_hz";
    const std::optional<ShaperResonance> found = resonance_of_shaper(type, shaper_freq_hz);
    if (!found) {
      return reading_.note(at,
                           fmt::format("what resonance Klipper chooses '{}' for is not known to "
                                       "unflex; find it with unflex identify and give {}",
                                       type, key),
                           {key});
    }
    reading_.add(key, found->freq_hz, at);
    reading_.note(
        at,
        fmt::format("Klipper chooses {} at some {} times the resonance, so {} of {} Hz is taken "
                    "for {} Hz ± {:.0f} %; unflex identify finds it exactly in the same "
                    "measurement, and if the shaper was set by hand give {} as you measured it",
                    type, found->ratio, frequency_name(axis), shaper_freq_hz, found->freq_hz,
                    100.0 * found->freq_error, key),
        {key});
  }

  static std::string frequency_name(const std::string& axis) { return "shaper_freq_" + axis; }

  // input_shaper.py, shaper_defs.py.
  void input_shaper(const std::string& axis) {
    constexpr double kDefaultDampingRatio = 0.1;
    const std::string frequency = frequency_name(axis);
    const std::string damping = "damping_ratio_" + axis;
    const double freq_hz = number("input_shaper", frequency).value_or(0.0);
    const SourcePlace at = place("input_shaper", frequency);
    if (config_->find("input_shaper") != nullptr || is_whole_) {
      reading_.add("printer.input_shaper_freq_" + axis + "_hz", freq_hz, at);
    }
    const std::string type = shaper_type(axis);
    if (freq_hz > 0.0) {
      const auto ratio = number("input_shaper", damping);
      reading_.add("printer.input_shaper_damping_ratio_" + axis,
                   ratio.value_or(kDefaultDampingRatio),
                   ratio ? place("input_shaper", damping) : at);
      resonance(axis, type, freq_hz, at);
      reading_.add_shaper_damping(axis, ratio.value_or(kDefaultDampingRatio),
                                  ratio ? place("input_shaper", damping) : at);
    }
  }

  const KlipperConfig* config_;
  std::string file_;
  bool is_whole_;  // no include is missing that Klipper would need
  Reading reading_;
  std::optional<Error> failure_;
};

}  // namespace

Result<Reading> read_klipper(std::string_view text, const std::string& file) {
  const Result<KlipperConfig> config = parse_klipper_config(text, file);
  if (!config) {
    return tl::unexpected(config.error());
  }
  Result<Reading> reading = Reader(*config, file).read();
  if (reading) {
    for (const Diagnostic& note : config->notes) {
      reading->note(note.place, note.message);
    }
  }
  return reading;
}

}  // namespace unflex::machine
