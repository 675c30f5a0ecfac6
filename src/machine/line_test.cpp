#include "unflex/machine/line_test.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "test_place.hpp"
#include "unflex/core/firmware_spec.hpp"

namespace unflex::machine {
namespace {

constexpr std::array kRates = {50.0,  75.0,  100.0, 150.0,  200.0,  300.0,
                               400.0, 500.0, 700.0, 1000.0, 1400.0, 2000.0};
constexpr double kStroke_mm = 40.0;
constexpr double kLeastSpeed_mm_s = 20.0;
constexpr double kMostSpeed_mm_s = 100.0;
constexpr double kStage_s = 6.0;
constexpr double kPause_ms = 500.0;
constexpr double kLayer_mm = 0.2;
constexpr double kRow_mm = 2.0;

// The shortest line of the test. Marlin joins lines of too few steps to the next
// (MIN_STEPS_PER_SEGMENT).
double least_line_mm(const Settings& settings) {
  const FirmwareMotion& motion = settings.spec().motion;
  if (motion.rounds_to_steps) {
    const double more =
        motion.skips_short_moves ? settings.printer.junctions.min_steps_per_segment : 0.0;
    return (more + 1.0) / settings.steps_per_mm()[0];
  }
  return 1e-3;
}

double acceleration_mm_s2(const Settings& settings) {
  return settings.spec().motion.has_axis_limits
             ? std::min(settings.axis_max_accel_mm_s2()[0], settings.travel_accel_mm_s2())
             : settings.limits.max_accel_mm_s2;
}

// How many lines the firmware can brake over; Klipper's queue is as long as it needs.
std::optional<double> lines_ahead(const Settings& settings) {
  return settings.spec().motion.has_short_queue ? std::optional(settings.queue_length() / 2.0)
                                                : std::nullopt;
}

double rounds(const LineTestStage& stage) {
  return std::max(1.0, std::round(kStage_s * stage.speed_mm_s / (2.0 * kStroke_mm)));
}

std::optional<LineTestStage> stage_of(double lines_per_s, const Settings& settings) {
  const double accel_mm_s2 = acceleration_mm_s2(settings);
  LineTestStage stage{.lines_per_s = lines_per_s};
  stage.speed_mm_s = std::max(kLeastSpeed_mm_s, std::ceil(lines_per_s * least_line_mm(settings)));
  const double braking_mm = stage.speed_mm_s * stage.speed_mm_s / (2.0 * accel_mm_s2);
  const auto ahead = lines_ahead(settings);
  if (stage.speed_mm_s > std::min(kMostSpeed_mm_s, settings.limits.max_velocity_mm_s) ||
      (ahead && *ahead * stage.speed_mm_s / lines_per_s < braking_mm) ||
      2.0 * braking_mm > kStroke_mm) {
    return std::nullopt;
  }
  // Each stroke goes from rest to rest. Its ramps take twice as long as cruising over their length
  // v²/a would, so they add v/a.
  stage.duration_s =
      2.0 * rounds(stage) * (kStroke_mm / stage.speed_mm_s + stage.speed_mm_s / accel_mm_s2);
  return stage;
}

void write_stroke(const LineTestStage& stage, double from_mm, double to_mm, double y_mm,
                  std::string& text) {
  const double lines = std::round(kStroke_mm * stage.lines_per_s / stage.speed_mm_s);
  for (double line = 1.0; line <= lines; line += 1.0) {
    // This line of text is as long as a compensated one.
    text += fmt::format("G1 X{:.4f} Y{:.4f} F{:.1f}\n", from_mm + (to_mm - from_mm) * line / lines,
                        y_mm, 60.0 * stage.speed_mm_s);
  }
}

}  // namespace

std::vector<LineTestStage> line_test_stages(const Settings& settings) {
  std::vector<LineTestStage> stages;
  for (const double rate : kRates) {
    if (const auto stage = stage_of(rate, settings)) {
      stages.push_back(*stage);
    }
  }
  return stages;
}

Result<std::string> line_test(const Settings& settings) {
  const std::vector<LineTestStage> stages = line_test_stages(settings);
  if (stages.empty()) {
    return fail(ErrorKind::usage,
                "the limits leave no rate to test; limits.max_velocity_mm_s or the acceleration "
                "is too low");
  }
  const Result<double> x_mm =
      begin_of(settings.printer.travel_mm.x, kStroke_mm, "printer.travel_x_mm");
  const Result<double> y_mm =
      begin_of(settings.printer.travel_mm.y, kRow_mm * static_cast<double>(kRates.size()),
               "printer.travel_y_mm");
  if (!x_mm || !y_mm) {
    return tl::unexpected(x_mm ? y_mm.error() : x_mm.error());
  }
  std::string text = fmt::format(
      "; unflex line-test: how many lines per second does the printer take?\n"
      "; No heat, no filament. Each stage goes back and forth along X at an even speed; one that\n"
      "; stutters, or takes longer than it says, is more than the printer takes.\n"
      "G28\nG21\nG90\nG1 Z{:.2f} F600\n",
      kTestHeight_mm);
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const LineTestStage& stage = stages[i];
    const double row_mm = *y_mm + kRow_mm * static_cast<double>(i);
    text += fmt::format(";LAYER_CHANGE\n;LAYER:{}\nG1 X{:.4f} Y{:.4f} Z{:.2f} F1200\nM400\n", i,
                        *x_mm, row_mm, kTestHeight_mm + kLayer_mm * static_cast<double>(i + 1));
    const std::string label =
        fmt::format("{} lines/s, {:.1f} s", stage.lines_per_s, stage.duration_s);
    text += fmt::format("M117 {0}\nM118 unflex line-test begins: {0}\nG4 P{1}\n", label, kPause_ms);
    for (double round = 0.0; round < rounds(stage); round += 1.0) {
      write_stroke(stage, *x_mm, *x_mm + kStroke_mm, row_mm, text);
      write_stroke(stage, *x_mm + kStroke_mm, *x_mm, row_mm, text);
    }
    text += "M400\nM118 unflex line-test ends\n";
  }
  return text + "M117 unflex line-test done\n";
}

}  // namespace unflex::machine
