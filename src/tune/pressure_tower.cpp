#include "unflex/tune/pressure_tower.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "tower_writer.hpp"
#include "unflex/core/firmware_spec.hpp"

namespace unflex::tune {
namespace {

constexpr double kSlow_mm_s = 20.0;
constexpr double kFast_mm_s = 120.0;
// A flow that most hotends melt.
constexpr double kFlow_mm3_s = 11.0;
constexpr double kSlow_mm = 10.0;
// Length of even speed between two changes.
constexpr double kEven_mm = 36.0;
constexpr double kLongestRunUp_mm = 12.0;

std::string advance_command(Firmware firmware, double advance_s) {
  return fmt::format("{}{:.6f}\n", spec_of(firmware).writing.advance_command, advance_s);
}

}  // namespace

PressureWall pressure_wall(const PressureTowerSettings& settings) {
  const TowerWriter lines(settings, 0.0);
  const double flow_mm3_s = settings.max_flow_mm3_s.value_or(kFlow_mm3_s);
  PressureWall wall{.slow_mm = kSlow_mm};
  wall.fast_mm_s = std::min(
      {kFast_mm_s, settings.max_velocity_mm_s, flow_mm3_s / (lines.layer() * lines.width()),
       std::sqrt(kSlow_mm_s * kSlow_mm_s + 2.0 * settings.accel_mm_s2 * kLongestRunUp_mm)});
  wall.slow_mm_s = std::min(kSlow_mm_s, 0.5 * wall.fast_mm_s);
  wall.fast_mm = kEven_mm + (wall.fast_mm_s * wall.fast_mm_s - wall.slow_mm_s * wall.slow_mm_s) /
                                settings.accel_mm_s2;
  return wall;
}

double followed_accel_mm_s2(const PressureTowerSettings& settings, double extruder_mm_s2) {
  constexpr double kSoon_s = 0.008;
  // The advance to use while none is known. A larger advance shows in the first tower all the same.
  constexpr double kUnknown_s = 0.1;
  constexpr double kLeast_s = 1e-3;
  const PressureKnowledge& known = settings.trial.known;
  const double advance_s = known.has_sum() ? std::max(known.advance_s(), kLeast_s) : kUnknown_s;
  return kSoon_s * extruder_mm_s2 / (advance_s * TowerWriter(settings, 0.0).filament_per_mm());
}

Tower tower(const PressureTowerSettings& settings) {
  const PressureWall parts = pressure_wall(settings);
  TowerWriter writer(settings, parts.fast_mm + 2.0 * parts.slow_mm);
  const auto step_wall = [&](int wall, double inset_mm) {
    const XY start = writer.corner(wall + 2, inset_mm, 1.0);
    const auto at = [&](double distance_mm) {
      return TowerWriter::on_wall(wall, start, distance_mm, 0.0);
    };
    writer.extrude(at(parts.slow_mm), parts.slow_mm_s);
    writer.extrude(at(parts.slow_mm + parts.fast_mm), parts.fast_mm_s);
    writer.extrude(writer.corner(wall + 3, inset_mm, 0.0), parts.slow_mm_s);
  };
  return writer.write(to_comment(settings.trial) + "\n",
                      {.count = settings.trial.bands,
                       .corner_speed_mm_s = parts.slow_mm_s,
                       .outer_wall = step_wall,
                       .head =
                           [&](std::size_t band) {
                             return advance_command(settings.firmware,
                                                    settings.trial.advance_s(band));
                           },
                       .after = advance_command(settings.firmware, settings.own_advance_s)});
}

bool is_pressure_tower(const std::string& text) {
  return text.find(kPressureMark) != std::string::npos;
}

Result<PressureTowerRecord> pressure_record_of(const std::string& text, const std::string& name) {
  PressureTowerRecord record;
  bool found = false;
  Result<Codes> codes =
      codes_in(text, name, kPressureMark, [&](std::string_view line, const SourcePlace& place) {
        return pressure_trial(line, place).map([&](const PressureTrial& trial) {
          record.trial = trial;
          found = true;
        });
      });
  if (!codes) {
    return tl::unexpected(codes.error());
  }
  if (!found) {
    return fail(ErrorKind::input, {name, 0}, kNoTower);
  }
  record.codes = std::move(*codes);
  return record;
}

}  // namespace unflex::tune
