#include "unflex/tune/tower.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include "tower_writer.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/math.hpp"

namespace unflex::tune {
namespace {

constexpr double kPi = std::numbers::pi;

// Length of even wall before its waves begin.
constexpr double kLeadIn_mm = 3.0;
// Number of swings of the axis that can be seen behind the waves.
constexpr double kSwingsSeen = 7.0;
// Length of a swing on the wall, so that waves can be told apart.
constexpr double kSwing_mm = 2.2;
constexpr double kSlowest_mm_s = 50.0;
constexpr double kFastest_mm_s = 160.0;
// The speed while nothing is known of the axis: swings of 22 to 104 Hz are 5.5 to 1.2 mm long.
constexpr double kBroadSpeed_mm_s = 120.0;
constexpr double kLongestRunUp_mm = 10.0;

double speed_of(const TowerSettings& settings, const Trial& trial) {
  const double wanted = trial.known.has_freq() ? std::clamp(kSwing_mm * trial.known.freq_hz,
                                                            kSlowest_mm_s, kFastest_mm_s)
                                               : kBroadSpeed_mm_s;
  return std::min({wanted, settings.max_velocity_mm_s,
                   std::sqrt(2.0 * settings.accel_mm_s2 * kLongestRunUp_mm)});
}

// Marlin slows down for the angle between short lines. With whole steps that angle is mostly
// rounding, and large where lines are short.
int lines_per_wave(Firmware firmware) { return spec_of(firmware).motion.slows_at_angles ? 6 : 16; }

// The parts of a wall, one behind the other.
struct Parts {
  double speed_mm_s = 0.0;
  double lead_in_mm = 0.0;  // with the way it takes to come up to speed
  double wave_mm = 0.0;     // length of one wave
  double straight_mm = 0.0;
  double run_out_mm = 0.0;

  [[nodiscard]] double length_mm(const Waves& waves) const {
    return lead_in_mm + waves.count * wave_mm + straight_mm + run_out_mm;
  }
};

Parts parts_of(const TowerSettings& settings, const Trial& trial) {
  Parts parts;
  parts.speed_mm_s = speed_of(settings, trial);
  const double run_up_mm = parts.speed_mm_s * parts.speed_mm_s / (2.0 * settings.accel_mm_s2);
  parts.lead_in_mm = run_up_mm + kLeadIn_mm;
  parts.wave_mm = parts.speed_mm_s / trial.waves.freq_hz;
  parts.straight_mm =
      kSwingsSeen * parts.speed_mm_s / std::min(trial.freq_hz(1), trial.freq_hz(trial.bands));
  parts.run_out_mm = run_up_mm + 1.0;
  return parts;
}

// Walls along X show Y.
std::size_t axis_of(int wall) { return wall % 2 == 0 ? 1 : 0; }

void write_wall(TowerWriter& writer, int wall, double inset_mm, const Parts& parts,
                const Waves& waves, int per_wave) {
  const XY start = writer.corner(wall + 2, inset_mm, 1.0);
  const auto to = [&](double distance_mm, double inward_mm) {
    writer.extrude(TowerWriter::on_wall(wall, start, distance_mm, inward_mm), parts.speed_mm_s);
  };
  to(parts.lead_in_mm, 0.0);
  const int lines = per_wave * waves.count;
  for (int i = 1; i <= lines; ++i) {
    const double waves_done = static_cast<double>(i) / per_wave;
    to(parts.lead_in_mm + parts.wave_mm * waves_done,
       0.5 * waves.height_mm() * (1.0 - math::cos(2.0 * kPi * waves_done)));
  }
  writer.extrude(writer.corner(wall + 3, inset_mm, 0.0), parts.speed_mm_s);
}

// The straight part of a wall of the outer ring: 0 bottom, 1 right.
Wall straight_part(const TowerWriter& writer, int wall, const Parts& parts, const Waves& waves) {
  const std::size_t shown = axis_of(wall);
  const XY start = writer.corner(wall + 2, 0.0, 1.0);
  const double from_mm = parts.lead_in_mm + waves.count * parts.wave_mm;
  const double begin_mm = start[1 - shown];
  return {shown == 0, start[shown], begin_mm + from_mm, begin_mm + from_mm + parts.straight_mm,
          parts.speed_mm_s};
}

}  // namespace

Tower tower(const TowerSettings& settings) {
  std::array<Parts, 2> parts;
  double wall_mm = 0.0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    parts[axis] = parts_of(settings, settings.trials[axis]);
    wall_mm = std::max(wall_mm, parts[axis].length_mm(settings.trials[axis].waves));
  }
  TowerWriter writer(settings, wall_mm);
  std::string mark;
  for (const char axis : {'x', 'y'}) {
    mark += to_comment(axis, settings.trials[axis == 'x' ? 0 : 1]) + "\n";
  }
  const auto wall_with_waves = [&](int wall, double inset_mm) {
    const std::size_t axis = axis_of(wall);
    write_wall(writer, wall, inset_mm, parts[axis], settings.trials[axis].waves,
               lines_per_wave(settings.firmware));
  };
  Tower result =
      writer.write(mark, {.count = std::max(settings.trials[0].bands, settings.trials[1].bands),
                          .outer_wall = wall_with_waves});
  // Walls printed first in each ring.
  for (const int wall : {1, 0}) {
    const std::size_t axis = axis_of(wall);
    result.walls.push_back(straight_part(writer, wall, parts[axis], settings.trials[axis].waves));
  }
  return result;
}

Result<TowerRecord> record_of(const std::string& text, const std::string& name) {
  TowerRecord record;
  std::array<bool, 2> found{};
  Result<Codes> codes =
      codes_in(text, name, kTrialMark, [&](std::string_view line, const SourcePlace& place) {
        return from_comment(line, place).map([&](const AxisTrial& trial) {
          const std::size_t axis = trial.axis == 'x' ? 0 : 1;
          record.trials[axis] = trial.trial;
          found[axis] = true;
        });
      });
  if (!codes) {
    return tl::unexpected(codes.error());
  }
  if (!found[0] || !found[1]) {
    return fail(ErrorKind::input, {name, 0}, kNoTower);
  }
  record.codes = std::move(*codes);
  return record;
}

}  // namespace unflex::tune
