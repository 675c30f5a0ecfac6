// How fast a print may go: the least print time at which the nozzle of each contender still keeps a
// tolerance. For shapers, acceleration and square corner velocity are chosen from a grid and hold
// for the whole print, planned by Klipper's rules. unflex chooses a timing of its own.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/report/report.hpp"
#include "unflex/study/bench.hpp"

namespace unflex::study {

// Limits of Klipper's planner that hold for a whole print.
struct PlanLimits {
  double accel_mm_s2 = 0.0;
  double corner_mm_s = 0.0;  // square_corner_velocity

  friend bool operator==(const PlanLimits&, const PlanLimits&) = default;
};

// The grid that limits are chosen from: preferred numbers, ten to a decade.
inline constexpr std::array kGridAccels_mm_s2 = {
    250.0,   320.0,   400.0,   500.0,   630.0,   800.0,   1000.0, 1250.0,
    1600.0,  2000.0,  2500.0,  3200.0,  4000.0,  5000.0,  6300.0, 8000.0,
    10000.0, 12500.0, 16000.0, 20000.0, 25000.0, 32000.0, 40000.0};
inline constexpr std::array kGridCorners_mm_s = {0.5,  0.63, 0.8,  1.0,  1.25, 1.6, 2.0,
                                                 2.5,  3.2,  4.0,  5.0,  6.3,  8.0, 10.0,
                                                 12.5, 16.0, 20.0, 25.0, 32.0, 40.0};

// Distances of the nozzle from the path while filament is laid.
struct PathErrors {
  double p999_mm = 0.0;  // 99.9 % of the time it is at most this
  double max_mm = 0.0;
};

// Decides whether a motion keeps a tolerance. No other place says what that means.
struct ToleranceRule {
  // The errors are within the tolerance for this share of the extruding time.
  static constexpr double kShareWithin = 0.999;
  // In the rest of the time they are at most this many times the tolerance. 1: always within it.
  double largest_times = 1.1;

  [[nodiscard]] bool keeps(const PathErrors& errors, double tolerance_mm) const {
    return errors.p999_mm <= tolerance_mm && errors.max_mm <= largest_times * tolerance_mm;
  }
};

// A motion of the whole print: how long it takes, how far the nozzle strays.
struct TimedMotion {
  std::optional<PlanLimits> limits;  // nullopt: the motion does not come from such limits
  double time_s = 0.0;
  PathErrors errors;
};

// The name of unflex among the contenders.
inline constexpr std::string_view kUnflex = "unflex";

// A way to move the base, with the fastest motions that it is found to allow.
struct FastestOfContender {
  std::string name;
  std::vector<std::optional<TimedMotion>> at;  // one for each tolerance; nullopt: none keeps it
  std::optional<TimedMotion> advised;          // with the acceleration that Klipper advises
};

struct FastestOutcome {
  std::string version;
  std::string input;
  std::vector<report::Setting> printer;
  std::string description;  // the axes
  // The share that frequencies may be off for unflex. Shapers are made for exact ones.
  double freq_error = 0.0;
  std::vector<double> tolerances_mm;
  ToleranceRule rule;
  TimedMotion as_sliced;   // without a shaper, with the limits of settings and file
  double at_feed_s = 0.0;  // the print's time if the nozzle were always at F
  std::vector<FastestOfContender> contenders;
  std::vector<std::string> warnings;
  double wall_s = 0.0;

  // By what share of the time of the best other contender unflex is faster. nullopt: one of the two
  // does not keep the tolerance.
  [[nodiscard]] std::optional<double> unflex_saves(std::size_t tolerance) const;
};

// A stretch of the print's path from one stop of the machine to the next.
using Stretch = std::vector<gcode::Segment>;
using StretchPlan = std::vector<planner::PlannedMove>;

// The path of the print, which is planned anew for each point of the grid.
struct PrintPath {
  std::vector<Stretch> stretches;
  double dwell_s = 0.0;            // pauses between them
  planner::FirmwareConfig config;  // what the limits do not say
};

struct FastestSetup {
  Nozzle nozzle;  // shapers are tuned to its main modes
  std::vector<double> tolerances_mm;
  ToleranceRule rule;
  unsigned workers = 1;  // threads; the result does not depend on them
};

// A point of the grid and the print's time there.
struct Candidate {
  PlanLimits limits;
  double time_s = 0.0;
};

// The errors with these limits. nullopt as soon as it is certain that they break the tolerance.
using Measure =
    std::function<std::optional<PathErrors>(const PlanLimits& limits, double tolerance_mm)>;

// The fastest candidate that keeps each tolerance. No candidate is measured twice, and none after
// every tolerance has its candidate.
[[nodiscard]] std::vector<std::optional<TimedMotion>> fastest(
    std::vector<Candidate> candidates, const std::vector<double>& tolerances_mm,
    const ToleranceRule& rule, const Measure& measure);

// Finds the fastest motions without a shaper and with ZV, MZV and EI, and measures the plan as it
// was sliced. Each stretch begins with the nozzle at rest. A contender whose shaper is not defined
// for the nozzle is left out, with a warning. An error of kind internal if it is cancelled.
[[nodiscard]] Result<FastestOutcome> study_fastest(const PrintPath& path,
                                                   const std::vector<StretchPlan>& as_sliced,
                                                   const FastestSetup& setup, Progress& progress);

// The print's time if each move ran at its F throughout. No timing that keeps F takes less. Pauses
// count. Moves of filament alone count as planned.
[[nodiscard]] double time_at_feed_s(const PrintPath& path,
                                    const std::vector<StretchPlan>& as_sliced);

[[nodiscard]] std::string to_text(const FastestOutcome& outcome);
// The keys are those of docs/report.md.
[[nodiscard]] std::string to_json(const FastestOutcome& outcome);
// A page with table and picture, and the picture alone as the text of an SVG file.
[[nodiscard]] std::string to_html(const FastestOutcome& outcome);
[[nodiscard]] std::string to_svg(const FastestOutcome& outcome);

}  // namespace unflex::study
