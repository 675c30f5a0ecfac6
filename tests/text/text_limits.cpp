// The commands that set limits and input shapers.
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "text_machine.hpp"

namespace unflex::testing {

double shaper_type(const std::string& name) {
  constexpr std::array<std::string_view, 12> kTypes = {"NONE", "CUSTOM",   "ZV",       "MZV",
                                                       "EI",   "2HUMP_EI", "3HUMP_EI", "ZVD",
                                                       "ZVDD", "ZVDDD",    "EI2",      "EI3"};
  return static_cast<double>(std::ranges::find(kTypes, capitals(name)) - kTypes.begin());
}

// toolhead.py, cmd_M204: S, or else the lesser of P and T.
void TextMachine::set_klipper_accel() {
  const std::optional<double> printing = number("P");
  const std::optional<double> travel = number("T");
  if (has("S") || (printing && travel)) {
    reading_.limits["accel"] = has("S") ? *number("S") : std::min(*printing, *travel);
  }
}

// toolhead.py, cmd_SET_VELOCITY_LIMIT; input_shaper.py, InputShaperParams.update.
void TextMachine::set_klipper_limits() {
  for (const auto& [word, name] : std::initializer_list<std::pair<const char*, const char*>>{
           {"VELOCITY", "velocity"},
           {"ACCEL", "accel"},
           {"SQUARE_CORNER_VELOCITY", "square corner velocity"},
           {"MINIMUM_CRUISE_RATIO", "minimum cruise ratio"},
           {"ACCEL_TO_DECEL", "accel to decel"},
           {"SHAPER_FREQ_X", "shaper X freq"},
           {"SHAPER_FREQ_Y", "shaper Y freq"},
           {"DAMPING_RATIO_X", "shaper X damping"},
           {"DAMPING_RATIO_Y", "shaper Y damping"}}) {
    if (has(word)) {
      reading_.limits[name] = *number(word);
    }
  }
  for (const std::string axis : {"X", "Y"}) {
    const std::string type = has("SHAPER_TYPE") ? "SHAPER_TYPE" : "SHAPER_TYPE_" + axis;
    if (has(type)) {
      reading_.limits["shaper " + axis + " type"] = shaper_type(line_.text(type));
    }
  }
}

// Marlin, M200-M205.cpp: values are in the line's units, except the time of B. An acceleration of
// M201 becomes a whole number (planner.h, max_acceleration_mm_per_s2). A J out of range changes
// nothing.
// RepRapFirmware, GCodes2.cpp, HandleMcode(), and GCodes5.cpp, ConfigureAccelerations(): values are
// always in mm. M203 and M566 are per minute, M203 S1 and M205 per second. M205 sets the values of
// M566. No value is below its minimum in Configuration.h.
void TextMachine::set_limits() {
  const bool marlin = is(Firmware::marlin);
  const bool minutes = !marlin && (is("M566") || (is("M203") && number("S") != 1.0));
  const auto set = [&](const std::string& word, double value) {
    const std::string name = !marlin && is("M205") ? "M566" : line_.command();
    const double least = marlin ? value : is("M203") ? 0.5 : 0.1;
    reading_.limits[name + " " + word] = std::max(value, least);
  };
  if (const auto both = is("M204") ? number("S") : std::nullopt) {
    set("P", marlin ? in_mm(*both) : *both);
    set("T", marlin ? in_mm(*both) : *both);
  }
  const bool advanced = marlin && is("M205");
  for (const char letter : std::string_view(is("M204") ? "PRT" : advanced ? "XYZEST" : "XYZE")) {
    const std::string word(1, letter);
    if (const std::optional<double> value = number(word); value && marlin) {
      set(word, is("M201") ? std::trunc(in_mm(*value)) : in_mm(*value));
    } else if (value && word != "R") {
      set(word, *value / (minutes ? 60.0 : 1.0));
    }
  }
  const double deviation_mm = advanced ? length_mm("J").value_or(0.0) : 0.0;
  if (deviation_mm >= kept(0.01) && deviation_mm <= kept(0.3)) {
    set("J", deviation_mm);
  }
  if (advanced && number("B")) {
    set("B", std::trunc(*number("B")) * 1e-6);
  }
}

// M593.cpp: sets both axes if none is named.
void TextMachine::set_marlin_shaper() {
  for (const std::string axis : {"X", "Y"}) {
    const bool meant = has(axis) || !has_any_of("XY");
    if (meant && number("D")) {
      reading_.limits["shaper " + axis + " damping"] = *number("D");
    }
    if (meant && number("F")) {
      reading_.limits["shaper " + axis + " freq"] = *number("F");
    }
  }
}

// AxisShaper.cpp, Configure(): one shaper for both axes. It refuses too low a frequency, 0
// included. Any other frequency turns "none" into ZVD.
void TextMachine::set_rrf_shaper() {
  constexpr double kLeast_hz = 750000.0 / (2.0 * 65535.0);
  std::map<std::string, double>& limits = reading_.limits;
  if (number("F").value_or(kLeast_hz) < kLeast_hz) {
    throw Refused{};
  }
  if (has("F")) {
    limits["shaper freq"] = *number("F");
  }
  if (has("S")) {
    limits["shaper damping"] = *number("S");
  }
  if (has("P")) {
    limits["shaper type"] = shaper_type(line_.text("P"));
  } else if (has_any_of("FS") && limits.contains("shaper type") && limits["shaper type"] == 0.0) {
    limits["shaper type"] = shaper_type("zvd");
  }
}

}  // namespace unflex::testing
