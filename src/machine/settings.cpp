// Values that follow from others while their own key is unset.
//
// The extruder's follow Klipper's [extruder] section (docs/Config_Reference.md there):
//   S_max = 4 d²                     d  nozzle diameter
//   v_max = V · 4 d² / (π D² / 4)    D  filament diameter, V  max_velocity
//   a_max = A · 4 d² / (π D² / 4)    A  max_accel
// v_max and a_max use the default cross-section even where another one is configured.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/math.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/dynamics/frequency_field.hpp"
#include "unflex/machine/machine.hpp"
#include "validate.hpp"
#include "variants.hpp"

namespace unflex::machine {
namespace {

// Filament per path length at the default cross-section.
double default_extrude_ratio(const ExtruderSettings& extruder) {
  const double nozzle = extruder.nozzle_diameter_mm;
  const double filament = extruder.filament_diameter_mm;
  return 4.0 * nozzle * nozzle / (std::numbers::pi * filament * filament / 4.0);
}

// The zero of the axis' transfer function lies at −ω/2ζ; after four of its time constants, 8ζ/ω,
// what the base still does is below a fiftieth.
double settling_time_s(const AxisDynamics& axis) {
  double longest_s = 8.0 * axis.damping_ratio / (2.0 * std::numbers::pi * axis.freq_hz);
  for (const ModeSettings& mode : axis.modes) {
    longest_s =
        std::max(longest_s, 8.0 * mode.damping_ratio / (2.0 * std::numbers::pi * mode.freq_hz));
  }
  return longest_s;
}

std::array<double, 4> or_default(const AxisOptions& own, const std::array<double, 4>& otherwise) {
  std::array<double, 4> values{};
  for (std::size_t axis = 0; axis < values.size(); ++axis) {
    values[axis] = own[axis].value_or(otherwise[axis]);
  }
  return values;
}

// The default of M204 P and T.
double default_command_accel(const Settings& settings) {
  return settings.spec().defaults.command_accel_mm_s2.value_or(settings.limits.max_accel_mm_s2);
}

// emit.accel_mm_s2 where it does not follow the base.
constexpr double kEmitAccel_mm_s2 = 1e6;

}  // namespace

const FirmwareSpec& Settings::spec() const { return spec_of(printer.firmware); }

std::array<double, 4> Settings::axis_max_velocity_mm_s() const {
  const double v = limits.max_velocity_mm_s;
  const FirmwareDefaults& defaults = spec().defaults;
  return or_default(limits.axis_max_velocity_mm_s, {v, v, defaults.max_z_velocity_mm_s.value_or(v),
                                                    defaults.max_e_velocity_mm_s.value_or(v)});
}

std::array<double, 4> Settings::axis_max_accel_mm_s2() const {
  const double a = limits.max_accel_mm_s2;
  const FirmwareDefaults& defaults = spec().defaults;
  return or_default(limits.axis_max_accel_mm_s2, {a, a, defaults.max_z_accel_mm_s2.value_or(a),
                                                  defaults.max_e_accel_mm_s2.value_or(a)});
}

std::array<double, 4> Settings::jerk_mm_s() const {
  return or_default(limits.jerk_mm_s, spec().defaults.jerk_mm_s);
}

// Movement/Move.cpp, SetInstantDv: the jerk of prints is at most that of M566. Before 3.6 there is
// one jerk, which both M205 and M566 set; unknown versions are taken to be that old.
std::array<double, 4> Settings::print_jerk_mm_s() const {
  if (!spec().motion.has_two_jerks) {
    return jerk_mm_s();
  }
  std::array<double, 4> values = or_default(limits.print_jerk_mm_s, jerk_mm_s());
  if (has_print_jerk()) {
    std::ranges::transform(values, jerk_mm_s(), values.begin(),
                           [](double own, double most) { return std::min(own, most); });
  }
  return values;
}

bool Settings::has_print_jerk() const {
  return spec().motion.has_two_jerks && is_at_least(printer.version, 3, 6);
}

std::array<double, 4> Settings::steps_per_mm() const {
  return or_default(printer.steps_per_mm, spec().defaults.steps_per_mm);
}

double Settings::queue_length() const {
  return printer.queue_length.value_or(spec().defaults.queue_length);
}

double Settings::retract_length_mm() const {
  return printer.retract_length_mm.value_or(spec().defaults.retract_length_mm);
}

double Settings::retract_speed_mm_s() const {
  return printer.retract_speed_mm_s.value_or(spec().defaults.retract_speed_mm_s);
}

double Settings::unretract_speed_mm_s() const {
  return printer.unretract_speed_mm_s.value_or(spec().defaults.unretract_speed_mm_s);
}

double Settings::print_accel_mm_s2() const {
  return limits.print_accel_mm_s2.value_or(default_command_accel(*this));
}

double Settings::travel_accel_mm_s2() const {
  return limits.travel_accel_mm_s2.value_or(default_command_accel(*this));
}

double Settings::retract_accel_mm_s2() const {
  return limits.retract_accel_mm_s2.value_or(limits.max_accel_mm_s2);
}

// docs/firmware.md says where these numbers are from.
double Settings::max_lines_per_s() const {
  const auto by_transport = [this] {
    if (printer.transport == "serial") {
      return 100.0;
    }
    const FirmwareDefaults& defaults = spec().defaults;
    return printer.transport == "sbc"
               ? defaults.max_lines_per_s_of_sbc.value_or(defaults.max_lines_per_s)
               : defaults.max_lines_per_s;
  };
  return emit.max_lines_per_s.value_or(by_transport());
}

double Settings::min_line_s() const {
  return std::max(period_ms() * 1e-3, kClockRoom / max_lines_per_s());
}

double Settings::least_speed_step_mm_s() const {
  // The base always has to accelerate this many times as much as the plan.
  constexpr double kLeastHeadroom = 1.2;
  return kLeastHeadroom * limits.max_accel_mm_s2 * min_line_s() / kSpeedStepShare;
}

double Settings::filament_g_per_mm() const {
  constexpr double kCm3PerMm3 = 1e-3;
  return kCm3PerMm3 * extruder.filament_density_g_cm3 * filament_area_mm2();
}

bool Settings::changes() const {
  return any_axis([](const AxisDynamics& axis) { return axis.changes(); }, dynamics);
}

double Settings::filament_area_mm2() const {
  return extruder.filament_area_mm2.value_or(
      std::numbers::pi / 4.0 * extruder.filament_diameter_mm * extruder.filament_diameter_mm);
}

double Settings::max_extrude_cross_section_mm2() const {
  return extruder.max_extrude_cross_section_mm2.value_or(4.0 * extruder.nozzle_diameter_mm *
                                                         extruder.nozzle_diameter_mm);
}

double Settings::max_extrude_only_velocity_mm_s() const {
  return extruder.max_extrude_only_velocity_mm_s.value_or(limits.max_velocity_mm_s *
                                                          default_extrude_ratio(extruder));
}

double Settings::max_extrude_only_accel_mm_s2() const {
  return extruder.max_extrude_only_accel_mm_s2.value_or(limits.max_accel_mm_s2 *
                                                        default_extrude_ratio(extruder));
}

bool Settings::printer_presses() const {
  return spec().filters.advances_in_runs && pressure.shape == kLinearPressure;
}

bool Settings::writes_pressure() const { return pressure.written.value_or(printer_presses()); }

Motors Settings::motors() const {
  const Motors named(kinematics.type, printer.firmware);
  Motors::Rows rows = named.rows();
  bool is_named = true;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    is_named = is_named && !kinematics.joints[i];
    rows[i] = kinematics.joints[i].value_or(rows[i]);
  }
  return is_named ? named : Motors(rows);
}

double Settings::most_of_motor() const {
  if (spec().motion.has_axis_limits) {
    return 1.0;
  }
  const Motors moved = motors();
  return math::hypot(moved.gain_of_xy(), moved.shared_by_xy() ? moved.gain_of_xy() : 0.0);
}

double Settings::motor_max_velocity_mm_s() const {
  return spec().motion.has_axis_limits
             ? least_of_axes(std::identity{}, xy_of(axis_max_velocity_mm_s()))
             : most_of_motor() * limits.max_velocity_mm_s;
}

double Settings::motor_max_accel_mm_s2() const {
  return spec().motion.has_axis_limits
             ? least_of_axes(std::identity{}, xy_of(axis_max_accel_mm_s2()))
             : most_of_motor() * limits.max_accel_mm_s2;
}

std::string_view Settings::motor_max_accel_key() const {
  if (spec().motion.has_axis_limits) {
    const auto [x, y, z, e] = axis_max_accel_mm_s2();
    const AxisOptions& set = limits.axis_max_accel_mm_s2;
    if (set[0] && x <= y) {
      return "limits.max_x_accel_mm_s2";
    }
    if (set[1] && y <= x) {
      return "limits.max_y_accel_mm_s2";
    }
  }
  return "limits.max_accel_mm_s2";
}

double Settings::base_max_velocity_mm_s() const {
  if (base.max_velocity_mm_s) {
    return *base.max_velocity_mm_s;
  }
  const Motors moved = motors();
  double most_mm_s = 2.0 * moved.gain_of_xy() * limits.max_velocity_mm_s;
  for (std::size_t i = 0; i < Motors::kCount; ++i) {
    if (moved.moves_xy(i) && printer.steps_per_mm[i]) {
      most_mm_s = std::min(most_mm_s, step_limits().max_hz / *printer.steps_per_mm[i]);
    }
  }
  // The base has to do what the plan may ask, and runs that make too many steps stay as sliced.
  return std::max(most_mm_s, most_of_motor() * limits.max_velocity_mm_s);
}

double Settings::base_accel_times_asked() const {
  // Twice this would make the error smaller by 0.2 µm at most (docs/theory.md, Limits).
  constexpr double kTimes = 2.0;
  return base.max_accel_mm_s2 ? 0.0 : kTimes * most_of_motor();
}

double Settings::base_max_accel_mm_s2(double asked_mm_s2) const {
  if (base.max_accel_mm_s2) {
    return *base.max_accel_mm_s2;
  }
  // If emit.accel_mm_s2 does not follow the base's acceleration, it bounds the base's acceleration.
  const bool bounded = emit.accel_mm_s2 || !spec().defaults.emit_accel_follows_base;
  const double most = bounded ? emit.accel_mm_s2.value_or(kEmitAccel_mm_s2) / kEmitAccelFactor
                              : std::numeric_limits<double>::infinity();
  return std::max(base_accel_times_asked() * limits.max_accel_mm_s2,
                  std::min(base_accel_times_asked() * asked_mm_s2, most));
}

double FrequencyMap::hz_at(double place_mm) const {
  return dynamics::between_places(at_mm, freq_hz, place_mm);
}

// f = f₀ √(m₀ / (m₀ + m)): the belt stays as stiff while the mass on it grows.
double AxisDynamics::frequency_share(const MachineState& state) const {
  double share = moving_mass_g > 0.0
                     ? std::sqrt(moving_mass_g / (moving_mass_g + std::max(state.printed_g, 0.0)))
                     : 1.0;
  for (const FrequencyMap& one : map) {
    share *= one.along == 'z' ? one.hz_at(state.height_mm) / freq_hz : 1.0;
  }
  return share * share_at(state.place_mm);
}

double AxisDynamics::share_at(const Axes<double>& place_mm) const {
  double share = 1.0;
  for (const FrequencyMap& one : map) {
    if (one.is_over_bed()) {
      share *= one.hz_at(one.along == 'x' ? place_mm.x : place_mm.y) / freq_hz;
    }
  }
  return share;
}

double AxisDynamics::slowest_hz() const {
  return modes.empty() ? freq_hz : std::ranges::min(modes, {}, &ModeSettings::freq_hz).freq_hz;
}

double AxisDynamics::fastest_hz() const {
  return modes.empty() ? freq_hz : std::ranges::max(modes, {}, &ModeSettings::freq_hz).freq_hz;
}

double AxisDynamics::good_period_ms() const {
  constexpr double kFewestNodes = 11.0;
  if (modes.empty()) {
    return 1e3 / (kGoodNodesPerPeriod * freq_hz);
  }
  double shortest_ms = std::numeric_limits<double>::infinity();
  for (const ModeSettings& mode : modes) {
    const double nodes = std::clamp(kGoodNodesPerPeriod * std::sqrt(std::abs(mode.gain)),
                                    kFewestNodes, kGoodNodesPerPeriod);
    shortest_ms = std::min(shortest_ms, 1e3 / (nodes * mode.freq_hz));
  }
  return shortest_ms;
}

std::string AxisDynamics::description() const {
  std::string text;
  if (modes.empty()) {
    text = fmt::format("{:.4g} Hz, ζ {:.3g}", freq_hz, damping_ratio);
  }
  for (const ModeSettings& mode : modes) {
    text += fmt::format("{}{:.4g} Hz, ζ {:.3g}, gain {:.3g}", text.empty() ? "" : " + ",
                        mode.freq_hz, mode.damping_ratio, mode.gain);
  }
  if (moving_mass_g > 0.0) {
    text += fmt::format(", on a bed of {:.4g} g that gets heavier", moving_mass_g);
  }
  for (const FrequencyMap& one : map) {
    text += fmt::format(", {:.4g} to {:.4g} Hz along {}", one.freq_hz.front(), one.freq_hz.back(),
                        static_cast<char>(one.along - 'x' + 'X'));
  }
  return text;
}

// Where lines are long, the tail has room for one, which stops the nozzle. On a small print for
// Marlin the largest error is 36 µm with 2 ms, 14 µm with the 5 ms of a line, and 14 µm with 11 ms.
double Settings::tail_s() const {
  constexpr double kLeast_s = 2e-3;
  const double shortest_s =
      spec().motion.rounds_to_steps ? std::max(kLeast_s, 1.0 / max_lines_per_s()) : kLeast_s;
  if (solve.tail_ms) {
    return *solve.tail_ms * 1e-3;
  }
  return std::max(shortest_s, most_of_axes(settling_time_s, dynamics));
}

double Settings::freq_error() const {
  constexpr double kUsual = 0.1;
  return dynamics_error.freq.value_or(kUsual);
}

bool Settings::has_several_models() const {
  return any_axis([](const AxisDynamics& axis) { return !axis.plants.empty(); }, dynamics) ||
         freq_error() > 0.0 || dynamics_error.damping > 0.0;
}

std::vector<std::string_view> TimingSettings::feature_words() const {
  std::vector<std::string_view> words;
  std::string_view rest = features;
  for (;;) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    std::string_view word = rest.substr(0, comma);
    while (word.starts_with(' ')) {
      word.remove_prefix(1);
    }
    while (word.ends_with(' ')) {
      word.remove_suffix(1);
    }
    words.push_back(word);
    if (comma == rest.size()) {
      return words;
    }
    rest.remove_prefix(comma + 1);
  }
}

double TimingSettings::tolerance_of_um(gcode::FeatureKind kind) const {
  return kind == gcode::FeatureKind::outer_wall ? outer_wall_tolerance_um.value_or(tolerance_um)
                                                : tolerance_um;
}

bool TimingSettings::is_free(gcode::FeatureKind kind) const {
  return features == kAllFeatures ||
         std::ranges::any_of(feature_words(), [&](std::string_view word) {
           return gcode::feature_by_word(word) == kind;
         });
}

double Settings::largest_tolerance_um() const {
  return is_timing_free()
             ? std::max(timing.tolerance_um, timing.outer_wall_tolerance_um.value_or(0.0))
             : 0.0;
}

double Settings::along_weight() const {
  constexpr double kRobust = 0.01;
  return solve.along_weight.value_or(has_several_models() && !is_timing_free() ? kRobust : 1.0);
}

double Settings::jerk_weight() const {
  constexpr double kOfContour = 15.0;
  return along_weight() < 1.0 ? solve.jerk_weight.value_or(kOfContour) : tracking_jerk_weight();
}

double Settings::tracking_jerk_weight() const {
  constexpr double kOfTracking = 1.5;
  return solve.jerk_weight.value_or(kOfTracking);
}

double Settings::emit_accel_mm_s2(double asked_mm_s2) const {
  // RepRapFirmware leaves out short ramps. The lower its acceleration, the fewer it leaves out.
  return emit.accel_mm_s2.value_or(spec().defaults.emit_accel_follows_base
                                       ? kEmitAccelFactor * base_max_accel_mm_s2(asked_mm_s2)
                                       : kEmitAccel_mm_s2);
}

double Settings::good_period_ms() const {
  return least_of_axes([](const AxisDynamics& axis) { return axis.good_period_ms(); }, dynamics);
}

double Settings::period_ms() const {
  constexpr double kLongest_ms = 1.0;
  return emit.period_ms.value_or(std::min(kLongest_ms, good_period_ms()));
}

double Settings::tolerance_um() const {
  constexpr double kPerHz = 0.25 / 45.0;
  return emit.tolerance_um.value_or(
      kPerHz * least_of_axes([](const AxisDynamics& axis) { return axis.freq_hz; }, dynamics));
}

Axes<std::string> Settings::shaper_type() const {
  Axes<std::string> type = printer.input_shaper.type;
  type.x = type.x == "auto" ? std::string(spec().filters.shaper_type) : type.x;
  type.y = type.y == "auto" ? type.x : type.y;
  return type;
}

Axes<double> Settings::shaper_damping_ratio() const {
  return map_axes(
      [&](const std::optional<double>& told) {
        return told.value_or(spec().filters.shaper_damping_ratio);
      },
      printer.input_shaper.damping_ratio);
}

// One shaper may be for both axes.
Axes<double> Settings::shaper_freq_hz() const {
  const double x_hz = printer.input_shaper.freq_hz.x.value_or(0.0);
  return {x_hz, printer.input_shaper.freq_hz.y.value_or(
                    spec().filters.shapes_both_axes_alike ? x_hz : 0.0)};
}

// Any printer may have a shaper. On the Snapmaker J1 the command that switches it off does harm
// (variants.cpp), so on this printer a shaper counts only if a source tells of it.
Axes<bool> Settings::shaper_unknown() const {
  Axes<bool> unknown = map_axes(
      [&](const std::optional<double>& told) { return !told && printer.variant != "snapmaker_j1"; },
      printer.input_shaper.freq_hz);
  if (spec().filters.shapes_both_axes_alike) {
    unknown.y = unknown.y && unknown.x;
  }
  return unknown;
}

}  // namespace unflex::machine
