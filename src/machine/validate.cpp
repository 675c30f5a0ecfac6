#include "validate.hpp"

#include <fmt/core.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <utility>

#include "conflict.hpp"
#include "key_table.hpp"
#include "toml_reader.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/math.hpp"
#include "unflex/core/number.hpp"
#include "unflex/gcode/feature.hpp"
#include "unflex/machine/recommend.hpp"

namespace unflex::machine {
namespace {

// With fewer nodes per period of resonance, the optimum is worse than a ZV shaper's.
constexpr double kLeastNodesPerPeriod = 10.0;

// Rounds a bound to three digits that a user may type, so that the result keeps the bound.
double typed(double value, double (*round)(double)) {
  const double unit = math::pow(10.0, std::floor(math::log10(value)) - 2.0);
  return round(value / unit) * unit;
}
std::string at_most(double value) { return readable(typed(value, std::floor)); }
std::string at_least(double value) { return readable(typed(value, std::ceil)); }

constexpr std::array<std::string_view, 2> kModalKeys = {"freq_hz", "damping_ratio"};
constexpr std::array<std::string_view, 3> kMassKeys = {"mass_g", "stiffness_n_mm",
                                                       "damping_n_s_mm"};

// ω = √(k/m), ζ = c/(2√(km)), with the prefixes of g, N/mm and N·s/mm.
AxisDynamics from_mass(double mass_g, double stiffness_n_mm, double damping_n_s_mm) {
  const double m = mass_g * 1e-3;
  const double k = stiffness_n_mm * 1e3;
  const double c = damping_n_s_mm * 1e3;
  return {.freq_hz = std::sqrt(k / m) / (2.0 * std::numbers::pi),
          .damping_ratio = c / (2.0 * std::sqrt(k * m))};
}

bool is_overridden(const Draft& draft, std::string_view key) {
  const std::optional<SourcePlace> place = place_of(draft, key);
  return place && place->file.starts_with(kOverrideMark);
}

// Checks that an axis is given in one form, and that form completely. A form given by --set
// overrides the other form in a file.
Status check_mass_keys(const Draft& draft, const std::string& section) {
  std::optional<std::string> given;
  std::optional<std::string> missing;
  bool overridden = false;
  for (const std::string_view key : kMassKeys) {
    std::string name = fmt::format("{}.{}", section, key);
    overridden = overridden || is_overridden(draft, name);
    (place_of(draft, name) ? given : missing) = std::move(name);
  }
  if (given && missing) {
    return conflict(draft, {*given},
                    fmt::format("{} is missing: mass_g, stiffness_n_mm and damping_n_s_mm go "
                                "together",
                                *missing));
  }
  for (const std::string_view key : kModalKeys) {
    const std::string name = fmt::format("{}.{}", section, key);
    if (given && place_of(draft, name) && is_overridden(draft, name) == overridden) {
      return conflict(draft, {name},
                      fmt::format("{} cannot stand beside mass_g, stiffness_n_mm and "
                                  "damping_n_s_mm; give one form only",
                                  name));
    }
  }
  return {};
}

// Decides between the forms of an axis, several modes or one. The form that an override gives
// counts. Both forms from the same kind of source are an error. Sets the frequency and damping of
// an axis with several modes to those of its largest mode.
Status resolve_modes(const Draft& draft, const std::string& section, AxisDynamics& axis) {
  if (axis.modes.empty()) {
    return {};
  }
  const std::string modes_key = section + ".mode";
  const bool override = is_overridden(draft, modes_key);
  for (const std::string_view name :
       {kModalKeys[0], kModalKeys[1], kMassKeys[0], kMassKeys[1], kMassKeys[2]}) {
    const std::string key = fmt::format("{}.{}", section, name);
    if (!place_of(draft, key) || (override && !is_overridden(draft, key))) {
      continue;
    }
    if (is_overridden(draft, key) && !override) {
      axis.modes.clear();
      return {};
    }
    return conflict(draft, {key, modes_key},
                    fmt::format("{} and {} are both given, but an axis is either of one mode or "
                                "of several; remove one of them",
                                key, modes_key));
  }
  const ModeSettings& main = *std::ranges::max_element(
      axis.modes, {}, [](const ModeSettings& mode) { return std::abs(mode.gain); });
  axis.freq_hz = main.freq_hz;
  axis.damping_ratio = main.damping_ratio;
  return {};
}

// The plants of a file belong to its model. An override of the model drops them.
void resolve_plants(const Draft& draft, const std::string& section, AxisDynamics& axis) {
  const auto is_set = [&](std::string_view name) {
    return is_overridden(draft, fmt::format("{}.{}", section, name));
  };
  const bool other_model = std::ranges::any_of(kModalKeys, is_set) ||
                           std::ranges::any_of(kMassKeys, is_set) || is_set("mode");
  if (other_model && !is_set("plant")) {
    axis.plants.clear();
  }
}

Status resolve_axis(Draft& draft, const std::string& section, const MassSpringDamper& mass,
                    AxisDynamics& axis) {
  resolve_plants(draft, section, axis);
  if (Status checked = check_mass_keys(draft, section); !checked) {
    return checked;
  }
  if (Status checked = resolve_modes(draft, section, axis); !checked || !axis.modes.empty()) {
    return checked;
  }
  if (!mass.mass_g || !mass.stiffness_n_mm || !mass.damping_n_s_mm) {
    return {};
  }
  const AxisDynamics alone = from_mass(*mass.mass_g, *mass.stiffness_n_mm, *mass.damping_n_s_mm);
  const std::string mass_key = fmt::format("{}.{}", section, kMassKeys[0]);
  const std::array<std::pair<double, double*>, 2> values = {
      std::pair{alone.freq_hz, &axis.freq_hz}, std::pair{alone.damping_ratio, &axis.damping_ratio}};
  for (std::size_t i = 0; i < kModalKeys.size(); ++i) {
    const std::size_t index = *find_key(fmt::format("{}.{}", section, kModalKeys[i]));
    if (is_overridden(draft, key_table()[index].name)) {
      continue;
    }
    if (!key_table()[index].bounds.contains(values[i].first)) {
      return conflict(draft, {mass_key},
                      fmt::format("mass, stiffness and damping give {} = {:.4g}, which is out of "
                                  "range; check their units",
                                  key_table()[index].name, values[i].first));
    }
    *values[i].second = values[i].first;
    draft.places[index] = place_of(draft, mass_key);
  }
  return {};
}

Status check_printer(const Draft& draft) {
  const Settings& s = draft.settings;
  constexpr std::size_t kZ = 2;
  const bool has_one_limit = !s.spec().motion.has_axis_limits;
  if (has_one_limit && s.axis_max_velocity_mm_s()[kZ] > s.limits.max_velocity_mm_s) {
    return conflict(draft, {"limits.max_z_velocity_mm_s", "limits.max_velocity_mm_s"},
                    "limits.max_z_velocity_mm_s must not exceed limits.max_velocity_mm_s");
  }
  if (has_one_limit && s.axis_max_accel_mm_s2()[kZ] > s.limits.max_accel_mm_s2) {
    return conflict(draft, {"limits.max_z_accel_mm_s2", "limits.max_accel_mm_s2"},
                    "limits.max_z_accel_mm_s2 must not exceed limits.max_accel_mm_s2");
  }
  for (const auto& [key, value] :
       {std::pair{"printer.min_steps_per_segment", s.printer.junctions.min_steps_per_segment},
        std::pair{"printer.min_circle_segments", s.printer.arcs.min_circle_segments},
        std::pair{"printer.arc_correction_interval", s.printer.arcs.correction_interval},
        std::pair{"printer.queue_length", s.queue_length()},
        std::pair{"limits.jerk_policy", s.limits.jerk_policy}}) {
    if (value != std::floor(value)) {
      return conflict(draft, {key},
                      fmt::format("{} is {}, but must be a whole number", key, value));
    }
  }
  if (s.printer.arcs.min_segment_mm > s.printer.arcs.max_segment_mm) {
    return conflict(draft, {"printer.min_arc_segment_mm", "printer.max_arc_segment_mm"},
                    fmt::format("printer.min_arc_segment_mm is {}, but must not exceed "
                                "printer.max_arc_segment_mm, {}",
                                s.printer.arcs.min_segment_mm, s.printer.arcs.max_segment_mm));
  }
  const double least_extra_mm = s.spec().defaults.unretracts_less ? -s.retract_length_mm() : 0.0;
  if (s.printer.unretract_extra_length_mm < least_extra_mm) {
    return conflict(draft, {"printer.unretract_extra_length_mm"},
                    fmt::format("printer.unretract_extra_length_mm is {}, but must be at least {}",
                                s.printer.unretract_extra_length_mm, readable(least_extra_mm)));
  }
  if (s.extruder.filament_area_mm2 && !s.extruder.filament_profile.empty()) {
    return conflict(draft, {"extruder.filament_area_mm2", "extruder.filament_profile"},
                    "extruder.filament_area_mm2 and extruder.filament_profile both say what the "
                    "filament holds; give one of them");
  }
  if (s.extruder.filament_diameter_mm < s.extruder.nozzle_diameter_mm) {
    return conflict(draft, {"extruder.filament_diameter_mm", "extruder.nozzle_diameter_mm"},
                    "extruder.filament_diameter_mm must not be below nozzle_diameter_mm");
  }
  return {};
}

// Checks that M593 of RepRapFirmware takes the shaper (AxisShaper::Configure).
Status check_shaper(const Draft& draft) {
  const Settings& s = draft.settings;
  if (!s.spec().filters.shapes_both_axes_alike) {
    return {};
  }
  const double freq_hz = s.shaper_freq_hz().x;
  if (freq_hz != s.shaper_freq_hz().y) {
    return conflict(draft, {"printer.input_shaper_freq_y_hz"},
                    fmt::format("printer.input_shaper_freq_y_hz is {}, but RepRapFirmware has one "
                                "input shaper for both axes; set "
                                "printer.input_shaper_freq_x_hz, now {}, alone",
                                s.shaper_freq_hz().y, freq_hz));
  }
  // Half a period has to be a 16 bit number of step clocks.
  const double least_hz = s.printer.step_clock_hz / (2.0 * 65535.0);
  constexpr double kMost_hz = 1000.0;
  if (freq_hz != 0.0 && (freq_hz < least_hz || freq_hz > kMost_hz)) {
    return conflict(draft, {"printer.input_shaper_freq_x_hz"},
                    fmt::format("printer.input_shaper_freq_x_hz is {}, but must be 0 for none or "
                                "{} to {}, what RepRapFirmware takes",
                                freq_hz, at_least(least_hz), kMost_hz));
  }
  return {};
}

Status check_base(const Draft& draft) {
  const Settings& s = draft.settings;
  const double most = s.most_of_motor();
  // `most` is 1 or √2.
  const std::string_view times = most > 1.0 ? "√2 × " : "";
  if (s.base_max_velocity_mm_s() < most * s.limits.max_velocity_mm_s) {
    return conflict(draft, {"base.max_velocity_mm_s", "limits.max_velocity_mm_s"},
                    fmt::format("base.max_velocity_mm_s is {}, but must be at least {}"
                                "limits.max_velocity_mm_s, {}",
                                readable(s.base_max_velocity_mm_s()), times,
                                readable(s.limits.max_velocity_mm_s)));
  }
  if (s.base_max_accel_mm_s2() < most * s.limits.max_accel_mm_s2) {
    return conflict(
        draft, {"base.max_accel_mm_s2", "limits.max_accel_mm_s2"},
        fmt::format("base.max_accel_mm_s2 is {}, but must be at least {}"
                    "limits.max_accel_mm_s2, {}; 2 to 10 times that is usual",
                    readable(s.base_max_accel_mm_s2()), times, readable(s.limits.max_accel_mm_s2)));
  }
  return {};
}

Status check_emission(const Draft& draft) {
  const Settings& s = draft.settings;
  const double least_accel = kEmitAccelFactor * s.base_max_accel_mm_s2();
  if (s.emit_accel_mm_s2() < least_accel) {
    return conflict(
        draft, {"emit.accel_mm_s2", "base.max_accel_mm_s2", "limits.max_accel_mm_s2"},
        fmt::format("emit.accel_mm_s2 is {}, but must be at least {} ({} × "
                    "base.max_accel_mm_s2); raise it or lower base.max_accel_mm_s2",
                    readable(s.emit_accel_mm_s2()), readable(least_accel), kEmitAccelFactor));
  }
  // On the other firmwares lines end on whole steps, too coarse for this key.
  if (!s.spec().motion.rounds_to_steps && place_of(draft, "emit.max_speed_step_mm_s") &&
      s.emit.max_speed_step_mm_s < s.least_speed_step_mm_s()) {
    return conflict(
        draft, {"emit.max_speed_step_mm_s"},
        fmt::format("emit.max_speed_step_mm_s is {}, but must be at least {}, what "
                    "limits.max_accel_mm_s2, {}, needs in lines of {:.3g} ms; raise it, "
                    "or emit.max_lines_per_s if that makes lines so long",
                    s.emit.max_speed_step_mm_s, at_least(s.least_speed_step_mm_s()),
                    readable(s.limits.max_accel_mm_s2), 1e3 * s.min_line_s()));
  }
  if (s.emit.square_corner_velocity_mm_s < s.limits.square_corner_velocity_mm_s) {
    return conflict(
        draft, {"emit.square_corner_velocity_mm_s", "limits.square_corner_velocity_mm_s"},
        "emit.square_corner_velocity_mm_s must not be below limits.square_corner_velocity_mm_s");
  }
  if (s.emit.checkpoints && !s.spec().writing.can_pause_behind_run) {
    return conflict(draft, {"emit.checkpoints", "printer.firmware"},
                    fmt::format("emit.checkpoints is true, but printer.firmware is {}, on which no "
                                "pause can wait for a run's end; set it to false, docs/pausing.md "
                                "says where to pause",
                                to_string(s.printer.firmware)));
  }
  return {};
}

// A second mode must be another one, and there must be room for it.
Status check_second(const Draft& draft) {
  constexpr double kNear = 0.05;
  const Settings& s = draft.settings;
  const auto check = [&](const AxisDynamics& axis, std::string_view name,
                         double second_hz) -> Status {
    if (second_hz == 0.0) {
      return {};
    }
    const std::string key = fmt::format("second.{}_freq_hz", name);
    std::vector<double> known_hz = {axis.freq_hz};
    std::size_t most = axis.modes.size();
    const auto add = [&](const std::vector<ModeSettings>& modes) {
      most = std::max(most, modes.size());
      for (const ModeSettings& mode : modes) {
        known_hz.push_back(mode.freq_hz);
      }
    };
    add(axis.modes);
    for (const PlantSettings& plant : axis.plants) {
      add(plant.modes);
    }
    if (most >= kMostModes) {
      return conflict(draft, {key},
                      fmt::format("{} is {}, but the axis has {} modes already, the most there may "
                                  "be; leave it out",
                                  key, second_hz, most));
    }
    for (const double hz : known_hz) {
      if (std::abs(math::log(second_hz / hz)) < kNear) {
        return conflict(draft, {key},
                        fmt::format("{} is {}, the same as the axis' own {:.4g} Hz; measure the "
                                    "axis again instead",
                                    key, second_hz, hz));
      }
    }
    return {};
  };
  return each_in_turn(check, s.dynamics, kAxisKeys, s.second.freq_hz);
}

Status check_timing(const Draft& draft) {
  if (draft.settings.timing.features == kAllFeatures) {
    return {};
  }
  for (const std::string_view word : draft.settings.timing.feature_words()) {
    if (!gcode::feature_by_word(word)) {
      return conflict(draft, {"timing.features"},
                      fmt::format("timing.features has \"{}\" in it, but must be \"{}\" or some of "
                                  "{}, with commas between",
                                  word, kAllFeatures, fmt::join(gcode::kFeatureWords, ", ")));
    }
  }
  return {};
}

double fastest_freq_hz(const Settings& settings) {
  return most_of_axes([](const AxisDynamics& axis) { return axis.fastest_hz(); },
                      settings.dynamics);
}

Status check_grid(const Draft& draft) {
  const Settings& s = draft.settings;
  const double longest_ms = 1e3 / (kLeastNodesPerPeriod * fastest_freq_hz(s));
  if (s.period_ms() > longest_ms) {
    return conflict(draft, {"emit.period_ms", "dynamics.x.freq_hz", "dynamics.y.freq_hz"},
                    fmt::format("emit.period_ms is {}, too long for a resonance at {:.4g} Hz; "
                                "at most {}, better {}",
                                readable(s.period_ms()), fastest_freq_hz(s), at_most(longest_ms),
                                at_most(s.good_period_ms())));
  }
  if (s.solve.overlap_s > s.solve.window_s) {
    return conflict(draft, {"solve.overlap_s", "solve.window_s"},
                    "solve.overlap_s must not exceed solve.window_s");
  }
  return {};
}

}  // namespace

Status resolve_dynamics(Draft& draft) {
  const auto resolve = [&](std::string_view axis, const MassSpringDamper& mass,
                           AxisDynamics& dynamics) {
    return resolve_axis(draft, fmt::format("dynamics.{}", axis), mass, dynamics);
  };
  return each_in_turn(resolve, kAxisKeys, draft.mass, draft.settings.dynamics);
}

Status check_consistency(const Draft& draft) {
  for (auto* check : {check_printer, check_shaper, check_machine, check_base, check_emission,
                      check_second, check_timing, check_grid}) {
    if (Status checked = check(draft); !checked) {
      return checked;
    }
  }
  return {};
}

std::vector<std::string> recommendations(const Settings& settings) {
  std::vector<std::string> remarks;
  const double good_ms = settings.good_period_ms();
  if (settings.period_ms() > good_ms) {
    remarks.push_back(
        fmt::format("emit.period_ms is {}; at {:.4g} Hz {} or less follows the path better",
                    readable(settings.period_ms()), fastest_freq_hz(settings), at_most(good_ms)));
  }
  const double least_lines_per_s = 2.0 * fastest_freq_hz(settings);
  if (settings.emit.max_lines_per_s && *settings.emit.max_lines_per_s < least_lines_per_s) {
    remarks.push_back(fmt::format(
        "emit.max_lines_per_s is {}, and lines so long cannot follow a resonance at {:.4g} Hz, so "
        "that runs stay as sliced; give {} or more, as many as unflex printer line-test shows",
        *settings.emit.max_lines_per_s, fastest_freq_hz(settings), at_least(least_lines_per_s)));
  }
  if (settings.hotend.ahead && !settings.hotend.has_model()) {
    remarks.emplace_back(
        "hotend.ahead is true, but does nothing without a model of the hotend; give hotend.gain_c, "
        "hotend.time_constant_s and hotend.dead_time_s, as unflex hotend finds them in a log");
  }
  const AxisOptions& steps = settings.printer.steps_per_mm;
  if (settings.step_limits().is_any() && !(steps[0] && steps[1])) {
    remarks.emplace_back(
        "a limit of step rates is given, but not the steps of both X and Y, so that it is not "
        "checked for all motors; give printer.x_steps_per_mm and printer.y_steps_per_mm");
  }
  return remarks;
}

}  // namespace unflex::machine
