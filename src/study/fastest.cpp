// Searches the grid of limits for the fastest motion that keeps a tolerance.
//
// Planning a print takes a hundredth of the time that swinging a nozzle along it does. So the print
// is planned at all points of the grid first, and the nozzle tries these in order of rising time
// until it keeps the tolerance. A motion that breaks the tolerance is left at the sample that makes
// this certain.
#include "unflex/study/fastest.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <tuple>
#include <utility>

#include "built_shaper.hpp"
#include "contour.hpp"
#include "tasks.hpp"
#include "unflex/core/threads.hpp"
#include "unflex/planner/klipper_planner.hpp"
#include "unflex/rivals/axis_path.hpp"
#include "unflex/rivals/klipper_calibration.hpp"
#include "values_of.hpp"

namespace unflex::study {
namespace {

using dynamics::ShaperKind;
using dynamics::ShaperPulses;

// The contenders: without a shaper and with these.
constexpr std::array kShapers = {ShaperKind::zv, ShaperKind::mzv, ShaperKind::ei};

StretchPlan planned(const Stretch& stretch, const planner::FirmwareConfig& config,
                    const PlanLimits& of) {
  planner::Limits limits;
  limits.max_velocity_mm_s = planner::kNoLimit;  // speeds are those of the path
  limits.max_accel_mm_s2 = of.accel_mm_s2;
  limits.square_corner_velocity_mm_s = of.corner_mm_s;
  limits.minimum_cruise_ratio = 0.0;
  planner::KlipperPlanner planner(limits, config);
  for (const gcode::Segment& segment : stretch) {
    planner.add(segment);
  }
  planner.stop();
  StretchPlan plan;
  planner.take(plan);
  return plan;
}

std::vector<StretchPlan> planned(const PrintPath& path, const PlanLimits& limits) {
  std::vector<StretchPlan> plans;
  for (const Stretch& stretch : path.stretches) {
    plans.push_back(planned(stretch, path.config, limits));
  }
  return plans;
}

double time_of(const PrintPath& path, const std::vector<StretchPlan>& plans) {
  double time_s = path.dwell_s;
  for (const StretchPlan& plan : plans) {
    time_s += planner::duration_s(plan);
  }
  return time_s;
}

std::vector<Candidate> candidates(const PrintPath& path, unsigned workers) {
  std::vector<Candidate> all;
  for (const double accel_mm_s2 : kGridAccels_mm_s2) {
    for (const double corner_mm_s : kGridCorners_mm_s) {
      all.push_back({{accel_mm_s2, corner_mm_s}});
    }
  }
  in_parallel(all.size(), workers, [&](std::size_t i) {
    // One stretch at a time: the plan of a whole print is large.
    all[i].time_s = path.dwell_s;
    for (const Stretch& stretch : path.stretches) {
      all[i].time_s += planner::duration_s(planned(stretch, path.config, all[i].limits));
    }
  });
  return all;
}

// The largest of many errors, as many as the rule lets exceed the tolerance and one more.
class LargestErrors {
 public:
  explicit LargestErrors(double extruding_s)
      : count_(1 + static_cast<std::size_t>((1.0 - ToleranceRule::kShareWithin) * extruding_s /
                                            kPrintStep_s)) {}

  void add(double error_mm) {
    if (least_first_.size() == count_) {
      if (error_mm <= least_first_.front()) {
        return;
      }
      std::ranges::pop_heap(least_first_, std::greater{});
      least_first_.pop_back();
    }
    least_first_.push_back(error_mm);
    std::ranges::push_heap(least_first_, std::greater{});
    max_mm_ = std::max(max_mm_, error_mm);
  }

  // Both figures grow with each error that is added.
  [[nodiscard]] PathErrors errors() const {
    return {least_first_.size() == count_ ? least_first_.front() : 0.0, max_mm_};
  }

 private:
  std::size_t count_;
  std::vector<double> least_first_;  // a heap
  double max_mm_ = 0.0;
};

using AxisShapers = Axes<ShaperPulses>;  // empty: none

Axes<rivals::AxisPath> base_paths(const StretchPlan& plan, const AxisShapers& shapers) {
  return map_axes(
      [](const rivals::AxisPath& path, const ShaperPulses& pulses) {
        return pulses.empty() ? path : rivals::shaped(path, pulses);
      },
      rivals::on_axes_of(plan, rivals::reference_path), shapers);
}

double extruding_s(const std::vector<StretchPlan>& plans) {
  double sum_s = 0.0;
  for (const StretchPlan& plan : plans) {
    for (const planner::PlannedMove& move : plan) {
      sum_s += move.segment.extruding() ? move.duration_s() : 0.0;
    }
  }
  return sum_s;
}

// Swings the nozzle along the plans. `breaks` is asked after each error and ends it.
template <class Breaks>
std::optional<PathErrors> measured(const std::vector<StretchPlan>& plans,
                                   const AxisShapers& shapers, const Nozzle& nozzle,
                                   const Breaks& breaks) {
  const double reach_s = reach_of(dynamics::slowest_rad_s(nozzle));
  LargestErrors largest(extruding_s(plans));
  for (const StretchPlan& plan : plans) {
    if (std::ranges::none_of(plan, [](const auto& move) { return move.segment.extruding(); })) {
      continue;
    }
    const Axes<rivals::AxisPath> base = base_paths(plan, shapers);
    rivals::NozzleWalkXY walk(nozzle, base, std::min(0.0, rivals::start_s(base)));
    ContourGauge gauge(plan, reach_s);
    const double end_s = planner::duration_s(plan);
    for (std::size_t k = 0; static_cast<double>(k) * kPrintStep_s < end_s; ++k) {
      const double t = static_cast<double>(k) * kPrintStep_s;
      const auto reading = gauge.measure(t, walk.place_mm(t));
      if (!reading.extruding) {
        continue;
      }
      largest.add(reading.distance_mm);
      if (breaks(largest.errors())) {
        return std::nullopt;
      }
    }
  }
  return largest.errors();
}

// Shapers of one kind, tuned to the axes.
Result<AxisShapers> tuned(ShaperKind kind, const Nozzle& nozzle) {
  const auto built = map_axes(
      [&](const dynamics::FlexibleAxis& axis) { return built_shaper(kind, axis); }, nozzle);
  return values_of(built).map([](const Axes<BuiltShaper>& shapers) {
    return map_axes([](const BuiltShaper& shaper) { return shaper.pulses; }, shapers);
  });
}

// The limits that Klipper's calibration advises for the axis that smooths more.
PlanLimits advised_limits(const AxisShapers& shapers) {
  const auto advised = [](const ShaperPulses& pulses) {
    return rivals::advised_accel_mm_s2(pulses);
  };
  return {least_of_axes(advised, shapers), rivals::kCalibrationCorner_mm_s};
}

}  // namespace

std::optional<double> FastestOutcome::unflex_saves(std::size_t tolerance) const {
  std::optional<double> unflex_s;
  std::optional<double> rival_s;
  for (const FastestOfContender& contender : contenders) {
    if (const std::optional<TimedMotion>& motion = contender.at[tolerance]) {
      std::optional<double>& least_s = contender.name == kUnflex ? unflex_s : rival_s;
      least_s = std::min(motion->time_s, least_s.value_or(motion->time_s));
    }
  }
  return unflex_s && rival_s ? std::optional(1.0 - *unflex_s / *rival_s) : std::nullopt;
}

double time_at_feed_s(const PrintPath& path, const std::vector<StretchPlan>& as_sliced) {
  double time_s = path.dwell_s;
  for (const Stretch& stretch : path.stretches) {
    for (const gcode::Segment& segment : stretch) {
      const double length_mm = segment.length_mm();
      time_s += length_mm > 0.0 ? length_mm / segment.feed_mm_s : 0.0;
    }
  }
  for (const StretchPlan& plan : as_sliced) {
    for (const planner::PlannedMove& move : plan) {
      time_s += move.kinematic ? 0.0 : move.duration_s();
    }
  }
  return time_s;
}

std::vector<std::optional<TimedMotion>> fastest(std::vector<Candidate> candidates,
                                                const std::vector<double>& tolerances_mm,
                                                const ToleranceRule& rule, const Measure& measure) {
  // Among equals the gentlest counts.
  std::ranges::sort(candidates, {}, [](const Candidate& one) {
    return std::tuple(one.time_s, one.limits.accel_mm_s2, one.limits.corner_mm_s);
  });
  // The widest tolerance that has no motion yet comes first: a motion that breaks it breaks the
  // others too.
  std::vector<std::size_t> open(tolerances_mm.size());
  std::iota(open.begin(), open.end(), 0U);
  std::ranges::sort(open, {}, [&](std::size_t i) { return tolerances_mm[i]; });
  std::vector<std::optional<TimedMotion>> result(tolerances_mm.size());
  for (const Candidate& one : candidates) {
    if (open.empty()) {
      break;
    }
    const std::optional<PathErrors> errors = measure(one.limits, tolerances_mm[open.back()]);
    while (errors && !open.empty() && rule.keeps(*errors, tolerances_mm[open.back()])) {
      result[open.back()] = TimedMotion{one.limits, one.time_s, *errors};
      open.pop_back();
    }
  }
  return result;
}

Result<FastestOutcome> study_fastest(const PrintPath& path,
                                     const std::vector<StretchPlan>& as_sliced,
                                     const FastestSetup& setup, Progress& progress) {
  FastestOutcome outcome;
  outcome.tolerances_mm = setup.tolerances_mm;
  outcome.rule = setup.rule;
  outcome.at_feed_s = time_at_feed_s(path, as_sliced);
  std::vector<AxisShapers> shapers = {{}};
  outcome.contenders.push_back({"no shaper", {}, {}});
  for (const ShaperKind kind : kShapers) {
    Result<AxisShapers> built = tuned(kind, setup.nozzle);
    if (built) {
      shapers.push_back(std::move(*built));
      outcome.contenders.push_back({std::string(dynamics::name(kind)), {}, {}});
    } else {
      outcome.warnings.push_back(
          fmt::format("warning: {} is left out: {}", dynamics::name(kind), built.error().message));
    }
  }
  const std::vector<Candidate> grid = candidates(path, setup.workers);
  const auto never = [](const PathErrors&) { return false; };
  Mutex mutex;
  std::size_t tried = 0;
  // The longest searches, those of the slowest contenders, begin first; the sliced plan comes last.
  const std::size_t count = shapers.size();
  in_parallel(count + 1, setup.workers, [&](std::size_t task) {
    if (task == count) {
      outcome.as_sliced = {std::nullopt, time_of(path, as_sliced),
                           *measured(as_sliced, {}, setup.nozzle, never)};
      return;
    }
    const std::size_t number = count - 1 - task;
    const AxisShapers& of = shapers[number];
    FastestOfContender& contender = outcome.contenders[number];
    contender.at = fastest(
        grid, setup.tolerances_mm, setup.rule,
        [&](const PlanLimits& limits, double tolerance_mm) -> std::optional<PathErrors> {
          if (progress.cancelled()) {
            return std::nullopt;
          }
          {
            const Lock lock(mutex);
            progress.update("studying", static_cast<double>(tried++) /
                                            static_cast<double>(count * grid.size()));
          }
          return measured(planned(path, limits), of, setup.nozzle, [&](const PathErrors& errors) {
            return !setup.rule.keeps(errors, tolerance_mm);
          });
        });
    if (!of.x.empty() && !progress.cancelled()) {
      const PlanLimits limits = advised_limits(of);
      const std::vector<StretchPlan> plans = planned(path, limits);
      contender.advised = {limits, time_of(path, plans), *measured(plans, of, setup.nozzle, never)};
    }
  });
  if (progress.cancelled()) {
    return fail(ErrorKind::internal, "cancelled");
  }
  return outcome;
}

}  // namespace unflex::study
