#include "own_limits.hpp"

#include <array>
#include <string>

namespace unflex::testing {
namespace {

using Axes = std::array<double, 4>;

void add(std::map<std::string, double>& limits, const std::string& command, const Axes& values) {
  for (std::size_t axis = 0; axis < values.size(); ++axis) {
    limits[command + " " + "XYZE"[axis]] = values[axis];
  }
}

std::map<std::string, double> klipper(const machine::Settings& settings) {
  const auto& own = settings.limits;
  return {{"velocity", own.max_velocity_mm_s},
          {"accel", own.max_accel_mm_s2},
          {"square corner velocity", own.square_corner_velocity_mm_s},
          {"minimum cruise ratio", own.minimum_cruise_ratio},
          {"accel to decel", (1.0 - own.minimum_cruise_ratio) * own.max_accel_mm_s2}};
}

// The limits of Marlin and RepRapFirmware.
std::map<std::string, double> others(const machine::Settings& settings) {
  const bool is_marlin = settings.printer.firmware == Firmware::marlin;
  std::map<std::string, double> limits;
  add(limits, "M201", settings.axis_max_accel_mm_s2());
  add(limits, "M203", settings.axis_max_velocity_mm_s());
  add(limits, is_marlin ? "M205" : "M566", settings.jerk_mm_s());
  limits["M204 P"] = settings.print_accel_mm_s2();
  limits["M204 T"] = settings.travel_accel_mm_s2();
  if (is_marlin) {
    limits["M204 R"] = settings.retract_accel_mm_s2();
    limits["M205 J"] = settings.limits.junction_deviation_mm;
    limits["M205 S"] = settings.limits.min_velocity_mm_s;
    limits["M205 T"] = settings.limits.min_travel_velocity_mm_s;
    limits["M205 B"] = 1e-3 * settings.limits.min_segment_time_ms;
  } else {
    limits["M203 I"] = settings.limits.min_movement_velocity_mm_s;
    limits["M566 P"] = settings.limits.jerk_policy;
  }
  return limits;
}

}  // namespace

Printer printer_with(const machine::Settings& settings) {
  const bool is_klipper = settings.printer.firmware == Firmware::klipper;
  Printer printer{settings.printer.firmware,
                  {settings.retract_length_mm(), 0.0},
                  is_klipper ? klipper(settings) : others(settings)};
  printer.limits["shaper X freq"] = printer.limits["shaper freq"] = settings.shaper_freq_hz().x;
  const bool is_on = settings.shaper_freq_hz().x > 0.0;
  printer.limits["shaper type"] = shaper_type(is_on ? settings.shaper_type().x : "none");
  printer.limits["shaper Y freq"] = settings.shaper_freq_hz().y;
  return printer;
}

}  // namespace unflex::testing
