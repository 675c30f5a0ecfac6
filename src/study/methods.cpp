// Makes the base of a run by each method.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "built_shaper.hpp"
#include "unflex/compensate/second_stage.hpp"
#include "unflex/dynamics/shapers.hpp"
#include "unflex/rivals/filtered_spline.hpp"
#include "unflex/rivals/s_curve.hpp"
#include "unflex/rivals/thesis_method.hpp"
#include "unflex/study/bench.hpp"
#include "unflex_base.hpp"
#include "values_of.hpp"

namespace unflex::study {
namespace {

using Moves = std::vector<planner::PlannedMove>;

// Knots of a filtered spline per period of the nozzle, and the length of its lead-in and of its
// tail in knots.
constexpr double kKnotsPerPeriod = 10.0;
constexpr double kSplineEndKnots = 5.0;

Result<BaseMotion> shaped_base(const dynamics::Shaper& shaper, const Moves& plan,
                               const compensate::Setup& setup) {
  const auto built = map_axes(
      [&](const compensate::AxisSetup& of) { return built_shaper(shaper, of.axis); }, setup);
  return values_of(built).map([&](const Axes<BuiltShaper>& shapers) {
    BaseMotion result{
        map_axes([](const rivals::AxisPath& reference,
                    const BuiltShaper& of) { return rivals::shaped(reference, of.pulses); },
                 rivals::on_axes_of(plan, rivals::reference_path), shapers)};
    for_each_axis(
        [&](const BuiltShaper& of) {
          result.remark = result.remark.empty() ? of.remark : result.remark;
        },
        shapers);
    return result;
  });
}

// Makes the base of both axes by a function of an axis's reference and dynamics that solves
// something.
template <class Make>
BaseMotion both_axes(const Moves& plan, const compensate::Setup& setup, const Make& make) {
  BaseMotion result;
  for_each_axis(
      [&](rivals::AxisPath& path, const rivals::AxisPath& reference,
          const compensate::AxisSetup& of) {
        rivals::SolvedPath solved = make(reference, of.axis);
        path = std::move(solved.path);
        result.size.add(solved.size);
        result.iterations += solved.iterations;
      },
      result, rivals::on_axes_of(plan, rivals::reference_path), setup);
  return result;
}

rivals::SolvedPath spline(const rivals::AxisPath& reference, const dynamics::FlexibleAxis& axis) {
  const double knot_s = 2.0 * std::numbers::pi / axis.main_rad_s() / kKnotsPerPeriod;
  return rivals::filtered_spline(reference, axis,
                                 {knot_s, kSplineEndKnots * knot_s, kSplineEndKnots * knot_s});
}

Result<BaseMotion> limited_base(double multiple, compensate::Setup setup, const Moves& plan,
                                const BenchSetup& bench, const compensate::Engine& engine) {
  limit_accel(setup, multiple * bench.plan_accel_mm_s2);
  return unflex_base(setup, plan, bench.parts, engine);
}

struct MzvMethod {
  Method method;
  std::string_view name;
  dynamics::MzvForm form;
};

// The examples of Klipper's documentation that are not close to plain MZV: of
// docs/Config_Reference.md the first, of docs/Resonance_Compensation.md the others.
constexpr std::array<MzvMethod, 3> kMzvMethods = {
    {{Method::mzv_4_pulses, "MZV(n=4,t=0.9)", {4, 0.9}},
     {Method::mzv_5_pulses, "MZV(n=5,t=1.1)", {5, 1.1}},
     {Method::mzv_6_pulses, "MZV(n=6,t=1.0)", {6, 1.0}}}};

struct ShaperMethod {
  dynamics::Shaper shaper;
  std::string_view name;
};

std::optional<ShaperMethod> shaper_of(Method method) {
  const auto form = std::ranges::find(kMzvMethods, method, &MzvMethod::method);
  if (form != kMzvMethods.end()) {
    return ShaperMethod{form->form, form->name};
  }
  const int number = static_cast<int>(method) - static_cast<int>(Method::zv);
  if (number < 0 || number >= static_cast<int>(dynamics::kShaperKinds.size())) {
    return std::nullopt;
  }
  const dynamics::ShaperKind kind = dynamics::kShaperKinds[static_cast<std::size_t>(number)];
  return ShaperMethod{kind, dynamics::name(kind)};
}

}  // namespace

void limit_accel(compensate::Setup& setup, double accel_mm_s2) {
  for_each_axis([&](compensate::AxisSetup& axis) { axis.limits.max_accel_mm_s2 = accel_mm_s2; },
                setup);
}

dynamics::NozzleXY at_rest(const compensate::Setup& setup, const gcode::Position& place_mm) {
  return map_axes(
      [](const compensate::AxisSetup& of, double at_mm) { return of.axis.riding(at_mm); }, setup,
      xy_of(place_mm));
}

Result<BaseMotion> unflex_base(const compensate::Setup& setup, const Moves& plan, int parts,
                               const compensate::Engine& engine) {
  const compensate::NodeGrid grid = compensate::node_grid(plan, setup);
  const auto spans = compensate::mesh(plan, grid, setup);
  const dynamics::NozzleXY nozzle = at_rest(setup, plan.front().segment.start_mm);
  BaseMotion result;
  auto windows = compensate::windows(plan, spans, nozzle, setup);
  const auto first_stage =
      compensate::solve_all(engine, spans, windows, [&](const compensate::AxisSolution& of) {
        result.size.add(of.size);
        result.iterations += of.iterations;
      });
  if (!first_stage) {
    return tl::unexpected(first_stage.error());
  }
  const std::size_t more = compensate::nodes_of_shaping(setup, grid.period_s);
  const auto path = [&](const dynamics::AxisTrajectory& solutions) {
    return rivals::through_nodes(solutions,
                                 -setup.lead_in_s - static_cast<double>(more) * grid.period_s,
                                 grid.period_s, parts);
  };
  const dynamics::BaseTrajectory base = compensate::shaped(*first_stage, setup, more, more);
  for_each_axis([&](rivals::AxisPath& own,
                    const dynamics::AxisTrajectory& solutions) { own = path(solutions); },
                result, base);
  return result;
}

std::string_view name(Method method) {
  if (const auto of = shaper_of(method)) {
    return of->name;
  }
  switch (method) {
    case Method::s_curve:
      return "S-curve, equal time";
    case Method::slow_s_curve:
      return "S-curve, equal acceleration";
    case Method::filtered_spline:
      return "filtered B-spline";
    case Method::thesis_least_squares:
      return "thesis, all equations";
    case Method::thesis_velocity_defects:
      return "thesis, velocity defects";
    case Method::unflex_2x:
      return "unflex 2×";
    case Method::unflex_4x:
      return "unflex 4×";
    case Method::unflex_10x:
      return "unflex 10×";
    case Method::unflex_band_4x:
      return "unflex 4×, ±10 %";
    case Method::first_stage_4x:
      return "unflex 4×, first stage";
    default:
      return "uncompensated";
  }
}

Result<BaseMotion> base_by(Method method, const Run& run, const BenchSetup& setup,
                           const compensate::Engine& engine) {
  if (const auto of = shaper_of(method)) {
    return shaped_base(of->shaper, run.plan, setup.unflex);
  }
  switch (method) {
    case Method::s_curve:
      return BaseMotion{rivals::on_axes_of(run.plan, rivals::s_curve)};
    case Method::slow_s_curve:
      if (run.slow_plan.empty()) {
        return fail(ErrorKind::input, "needs a plan of its own");
      }
      return BaseMotion{rivals::on_axes_of(run.slow_plan, rivals::s_curve)};
    case Method::filtered_spline:
      return both_axes(run.plan, setup.unflex, &spline);
    case Method::thesis_least_squares:
      return both_axes(run.plan, setup.unflex, [&](const auto& reference, const auto& axis) {
        return rivals::thesis_least_squares(reference, axis, setup.thesis_period_s,
                                            setup.plan_accel_mm_s2);
      });
    case Method::thesis_velocity_defects:
      return both_axes(run.plan, setup.unflex, [&](const auto& reference, const auto& axis) {
        return rivals::thesis_velocity_defects(reference, axis, setup.thesis_period_s);
      });
    case Method::unflex_2x:
      return limited_base(2.0, setup.unflex, run.plan, setup, engine);
    case Method::unflex_4x:
      return limited_base(4.0, setup.unflex, run.plan, setup, engine);
    case Method::unflex_10x:
      return limited_base(10.0, setup.unflex, run.plan, setup, engine);
    case Method::unflex_band_4x:
      return limited_base(4.0, setup.unflex_band, run.plan, setup, engine);
    case Method::first_stage_4x: {
      compensate::Setup first = setup.unflex;
      for_each_axis([](compensate::AxisSetup& axis) { axis.pulses.clear(); }, first);
      return limited_base(4.0, std::move(first), run.plan, setup, engine);
    }
    default:
      return BaseMotion{rivals::on_axes_of(run.plan, rivals::reference_path)};
  }
}

}  // namespace unflex::study
