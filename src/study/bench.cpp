#include "unflex/study/bench.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "contour.hpp"
#include "gauge.hpp"
#include "unflex/verify/corners.hpp"

namespace unflex::study {
namespace {

double reach_s(const Nozzle& nozzle) { return reach_of(dynamics::slowest_rad_s(nozzle)); }

double gap_mm(const BaseMotion& base, const std::vector<planner::PlannedMove>& plan) {
  return most_of_axes(
      [](const rivals::AxisPath& path, double target_mm) {
        return std::abs(path.back().motion.position - target_mm);
      },
      base, xy_of(plan.back().segment.end_mm));
}

Trace trace_of(const BaseMotion& base, const std::vector<planner::PlannedMove>& plan,
               const BenchSetup& setup) {
  Trace trace{{setup.trace_from_s, setup.trace_step_s, 0}, {}, {}, {}};
  const auto count = (setup.trace_to_s - setup.trace_from_s) / setup.trace_step_s;
  trace.grid.count = static_cast<std::size_t>(std::ceil(count - 1e-6)) + 1;
  const auto walk = [&](const dynamics::FlexibleAxis& axis, const rivals::AxisPath& path) {
    return rivals::NozzleWalk(axis, path, std::min(path.front().start_s, setup.trace_from_s));
  };
  const Nozzle hung = setup.nozzle();
  Axes<rivals::NozzleWalk> walks = map_axes(walk, hung, base);
  Axes<rivals::PathCursor> cursors =
      map_axes([](const rivals::AxisPath& path) { return rivals::PathCursor(path); }, base);
  ContourGauge gauge(plan, reach_s(hung));
  for (std::size_t k = 0; k < trace.grid.count; ++k) {
    const double t = trace.grid.at(k);
    XY place_mm;
    for_each_axis(
        [&](dynamics::NozzleMotion& of_base, dynamics::NozzleMotion& of_nozzle, double& at_mm,
            rivals::PathCursor& cursor, rivals::NozzleWalk& nozzle) {
          of_base = cursor.at(t);
          of_nozzle = nozzle.at(t).motion();
          at_mm = of_nozzle.position;
        },
        trace.base.emplace_back(), trace.nozzle.emplace_back(), place_mm, cursors, walks);
    trace.error_mm.push_back(gauge.measure(t, place_mm).distance_mm);
  }
  return trace;
}

MethodResult try_one(Method method, const Run& run, const BenchSetup& setup,
                     const compensate::Engine& engine) {
  MethodResult result;
  result.method = method;
  const auto start = std::chrono::steady_clock::now();
  Result<BaseMotion> base = base_by(method, run, setup, engine);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  if (!base && base.error().kind == ErrorKind::internal) {
    // No solution: `compensate` would keep such a run as it is.
    result.failed_runs = 1;
    std::string reason = "uncompensated, as there is no solution: " + base.error().message;
    base = base_by(Method::uncompensated, run, setup, engine);
    base->remark = std::move(reason);
  }
  if (!base) {
    result.remark = base.error().message;
    return result;
  }
  result.used = true;
  result.remark = base->remark;
  result.size = base->size;
  result.iterations = base->iterations;
  result.base_s = took.count();
  const auto& plan = method == Method::slow_s_curve ? run.slow_plan : run.plan;
  for (std::size_t i = 0; i < kFrequencyErrors.size(); ++i) {
    result.straying[i] = straying(*base, plan, setup, kFrequencyErrors[i]);
  }
  if (setup.trace_step_s > 0.0) {
    result.trace = trace_of(*base, plan, setup);
  }
  const auto peaks = map_axes(rivals::peak, *base);
  result.base_peak = {
      most_of_axes([](const rivals::PeakMotion& peak) { return peak.velocity_mm_s; }, peaks),
      most_of_axes([](const rivals::PeakMotion& peak) { return peak.accel_mm_s2; }, peaks)};
  result.end_gap_mm = gap_mm(*base, plan);
  result.longer_s = rivals::end_s(*base) - planner::duration_s(run.plan);
  return result;
}

}  // namespace

Straying straying(const BaseMotion& base, const std::vector<planner::PlannedMove>& plan,
                  const BenchSetup& setup, double frequency_error) {
  const double plan_end_s = planner::duration_s(plan);
  const double start_s = std::min(0.0, rivals::start_s(base));
  const double end_s = std::max(plan_end_s, rivals::end_s(base)) + setup.hold_s;
  // Samples stand at whole steps from the plan's beginning.
  const double before = std::ceil(-start_s / setup.step_s);
  const rivals::TimeGrid grid{
      -before * setup.step_s, setup.step_s,
      static_cast<std::size_t>(before + std::ceil(end_s / setup.step_s - 1e-6)) + 1};
  const Nozzle hung = setup.nozzle();
  const auto detuned = [&](const dynamics::FlexibleAxis& axis) {
    return axis.detuned(1.0 + frequency_error);
  };
  rivals::NozzleWalkXY nozzle(map_axes(detuned, hung), base, grid.start_s);
  ContourGauge gauge(plan, reach_s(hung));
  verify::CornerGauge corners(reach_s(hung));
  double move_start_s = 0.0;
  for (const planner::PlannedMove& move : plan) {
    corners.follow(move, move_start_s, move_start_s + move.duration_s());
    move_start_s += move.duration_s();
  }
  Straying result;
  for (std::size_t k = 0; k < grid.count; ++k) {
    const double t = grid.at(k);
    const XY at_mm = nozzle.place_mm(t);
    corners.sample(t, at_mm);
    const auto reading = gauge.measure(t, at_mm);
    if (t > plan_end_s) {
      result.after_max_mm = std::max(result.after_max_mm, reading.distance_mm);
    } else if (t >= 0.0 && reading.extruding) {
      if (reading.distance_mm > result.max_mm) {
        result.max_mm = reading.distance_mm;
        result.max_at_s = t;
      }
      result.square_sum_mm2s += reading.distance_mm * reading.distance_mm * setup.step_s;
      result.time_s += setup.step_s;
    }
  }
  result.corners.add(corners.stats());
  return result;
}

double Straying::rms_mm() const { return time_s > 0.0 ? std::sqrt(square_sum_mm2s / time_s) : 0.0; }

void CornerSums::add(const verify::CornerStats& run) {
  add(CornerSums{run.count, run.rms_mm * run.rms_mm * static_cast<double>(run.count), run.max_mm});
}

void CornerSums::add(const CornerSums& other) {
  count += other.count;
  square_sum_mm2 += other.square_sum_mm2;
  max_mm = std::max(max_mm, other.max_mm);
}

double CornerSums::rms_mm() const {
  return count > 0 ? std::sqrt(square_sum_mm2 / static_cast<double>(count)) : 0.0;
}

void Straying::merge(const Straying& other) {
  if (other.max_mm > max_mm) {
    max_mm = other.max_mm;
    max_at_s = other.max_at_s;
  }
  square_sum_mm2s += other.square_sum_mm2s;
  time_s += other.time_s;
  after_max_mm = std::max(after_max_mm, other.after_max_mm);
  corners.add(other.corners);
}

BenchResult try_all(const Run& run, const BenchSetup& setup, const compensate::Engine& engine) {
  BenchResult result;
  const std::size_t methods = kMethodCount + (setup.two_stage ? 1 : 0);
  for (std::size_t i = 0; i < methods; ++i) {
    result.push_back(try_one(static_cast<Method>(i), run, setup, engine));
  }
  return result;
}

void merge(BenchResult& into, const BenchResult& run) {
  for (std::size_t i = 0; i < into.size(); ++i) {
    MethodResult& sum = into[i];
    const MethodResult& more = run[i];
    sum.used = sum.used && more.used;
    sum.remark = sum.remark.empty() ? more.remark : sum.remark;
    for (std::size_t e = 0; e < kFrequencyErrors.size(); ++e) {
      sum.straying[e].merge(more.straying[e]);
    }
    sum.base_peak.velocity_mm_s =
        std::max(sum.base_peak.velocity_mm_s, more.base_peak.velocity_mm_s);
    sum.base_peak.accel_mm_s2 = std::max(sum.base_peak.accel_mm_s2, more.base_peak.accel_mm_s2);
    sum.end_gap_mm = std::max(sum.end_gap_mm, more.end_gap_mm);
    sum.longer_s += more.longer_s;
    sum.size.add(more.size);
    sum.iterations += more.iterations;
    sum.base_s += more.base_s;
    sum.failed_runs += more.failed_runs;
  }
}

}  // namespace unflex::study
