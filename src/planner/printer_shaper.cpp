#include "unflex/planner/printer_shaper.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "unflex/core/firmware_spec.hpp"

namespace unflex::planner {
namespace {

using dynamics::ShaperKind;
using dynamics::ShaperPulses;

constexpr std::array<std::pair<std::string_view, ShaperKind>, 10> kKinds = {
    {{"zv", ShaperKind::zv},
     {"mzv", ShaperKind::mzv},
     {"zvd", ShaperKind::zvd},
     {"ei", ShaperKind::ei},
     {"2hump_ei", ShaperKind::two_hump_ei},
     {"3hump_ei", ShaperKind::three_hump_ei},
     {"ei2", ShaperKind::two_hump_ei},
     {"ei3", ShaperKind::three_hump_ei},
     {"zvdd", ShaperKind::zvdd},
     {"zvddd", ShaperKind::zvddd}}};

std::optional<dynamics::Shaper> shaper_of(std::string_view type) {
  for (const auto& [name, kind] : kKinds) {
    if (name == type) {
      return kind;
    }
  }
  return dynamics::mzv_form(type);
}

// A type that is not known is taken for the one that the firmware has if none is told.
dynamics::Shaper shaper_of(std::string type, Firmware firmware) {
  std::ranges::transform(type, type.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  const std::optional<dynamics::Shaper> shaper = shaper_of(type);
  return shaper ? *shaper : shaper_of(spec_of(firmware).filters.shaper_type).value();
}

ShaperPulses pulses(Firmware firmware, double freq_hz, const std::string& type,
                    double damping_ratio) {
  if (!(freq_hz > 0.0)) {
    return {};
  }
  const dynamics::Shaper shaper = shaper_of(type, firmware);
  ShaperPulses pulses = *dynamics::shaper_pulses(
      shaper, freq_hz, std::min(damping_ratio, dynamics::max_damping_ratio(shaper.kind)));
  if (!spec_of(firmware).filters.shaper_is_centred) {
    const double first_s = pulses.front().time_s;
    for (dynamics::Pulse& pulse : pulses) {
      pulse.time_s -= first_s;
    }
  }
  return pulses;
}

double lead_s(const ShaperPulses& pulses) { return pulses.empty() ? 0.0 : -pulses.front().time_s; }

double reach_s(const ShaperPulses& pulses) {
  return pulses.empty() ? 0.0 : std::max(lead_s(pulses), pulses.back().time_s);
}

double length_s(const ShaperPulses& pulses) {
  return pulses.empty() ? 0.0 : pulses.back().time_s - pulses.front().time_s;
}

bool same(const gcode::Shaper& a, const gcode::Shaper& b) {
  if (!a.is_on() && !b.is_on()) {
    return true;
  }
  return a.freq_hz == b.freq_hz && a.settings == b.settings;
}

}  // namespace

double Shaping::lead_s() const {
  return most_of_axes([](const ShaperPulses& of) { return planner::lead_s(of); }, *this);
}

double Shaping::reach_s() const {
  return most_of_axes([](const ShaperPulses& of) { return planner::reach_s(of); }, *this);
}

double Shaping::length_s() const {
  return most_of_axes([](const ShaperPulses& of) { return planner::length_s(of); }, *this);
}

Shaping shaping(const FirmwareConfig& config, const gcode::Shaper& shaper) {
  const gcode::ShaperSettings& set = shaper.settings;
  const InstalledShaper& installed = config.shaper;
  const Axes<std::string> type =
      map_axes([](const std::string& told,
                  const std::string& built_in) { return told.empty() ? built_in : told; },
               set.type, installed.type);
  return {map_axes(
      [&](double freq_hz, const std::string& of_axis, const std::optional<double>& told,
          double built_in) {
        return pulses(config.firmware, freq_hz, of_axis, told.value_or(built_in));
      },
      shaper.freq_hz, type, set.damping_ratio, installed.damping_ratio)};
}

FirmwareAdvance advance_in_force(const FirmwareConfig& config,
                                 const gcode::PressureAdvance& of_file) {
  const double advance_s = of_file.advance_s.value_or(config.pressure_advance_s);
  if (!(advance_s > 0.0)) {
    return {};
  }
  return {advance_s, spec_of(config.firmware).filters.smooths_advance
                         ? of_file.smooth_s.value_or(config.pressure_advance_smooth_s)
                         : 0.0};
}

double switching_s(const FirmwareConfig& config, const Filters& before, const Filters& after) {
  const double smooth_before_s = advance_in_force(config, before.advance).smooth_s;
  const double smooth_after_s = advance_in_force(config, after.advance).smooth_s;
  if (same(before.shaper, after.shaper) && smooth_before_s == smooth_after_s) {
    return 0.0;
  }
  const Shaping from = shaping(config, before.shaper);
  const FirmwareFilters& filters = spec_of(config.firmware).filters;
  if (filters.least_scan_s == 0.0) {
    return from.length_s() + filters.switching_grace_s;
  }
  const auto scan_s = [&](double smooth_s, const Shaping& of_filters) {
    return std::max({filters.least_scan_s, of_filters.reach_s(), 0.5 * smooth_s});
  };
  return scan_s(smooth_before_s, from) + scan_s(smooth_after_s, shaping(config, after.shaper));
}

}  // namespace unflex::planner
