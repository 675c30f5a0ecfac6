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

namespace unflex::study {
namespace {

using Moves = std::vector<planner::PlannedMove>;

// Knots of a filtered spline per period of the nozzle, and the length of its lead-in and of its
// tail in knots.
constexpr double kKnotsPerPeriod = 10.0;
constexpr double kSplineEndKnots = 5.0;

Result<BaseMotion> shaped_base(const dynamics::Shaper& shaper, const Moves& plan,
                               const compensate::Setup& setup) {
  const Result<BuiltShaper> x = built_shaper(shaper, setup.x.axis);
  const Result<BuiltShaper> y = built_shaper(shaper, setup.y.axis);
  if (!x || !y) {
    return tl::unexpected(x ? y.error() : x.error());
  }
  return BaseMotion{rivals::shaped(rivals::reference_path(plan, gcode::X), x->pulses),
                    rivals::shaped(rivals::reference_path(plan, gcode::Y), y->pulses),
                    {},
                    0,
                    x->remark.empty() ? y->remark : x->remark};
}

// Makes the base of both axes by a function of an axis's reference and dynamics that solves
// something.
template <class Make>
BaseMotion both_axes(const Moves& plan, const compensate::Setup& setup, const Make& make) {
  rivals::SolvedPath x = make(rivals::reference_path(plan, gcode::X), setup.x.axis);
  rivals::SolvedPath y = make(rivals::reference_path(plan, gcode::Y), setup.y.axis);
  x.size.add(y.size);
  return {std::move(x.path), std::move(y.path), x.size, x.iterations + y.iterations};
}

rivals::SolvedPath spline(const rivals::AxisPath& reference, const dynamics::FlexibleAxis& axis) {
  const double knot_s = 2.0 * std::numbers::pi / axis.main_rad_s() / kKnotsPerPeriod;
  return rivals::filtered_spline(reference, axis,
                                 {knot_s, kSplineEndKnots * knot_s, kSplineEndKnots * knot_s});
}

Result<BaseMotion> limited_base(double multiple, compensate::Setup setup, const Moves& plan,
                                const BenchSetup& bench, const compensate::Engine& engine) {
  setup.x.limits.max_accel_mm_s2 = multiple * bench.plan_accel_mm_s2;
  setup.y.limits.max_accel_mm_s2 = multiple * bench.plan_accel_mm_s2;
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

Result<BaseMotion> unflex_base(const compensate::Setup& setup, const Moves& plan, int parts,
                               const compensate::Engine& engine) {
  const compensate::NodeGrid grid = compensate::node_grid(plan, setup);
  const auto spans = compensate::mesh(plan, grid, setup);
  const gcode::Position& start = plan.front().segment.start_mm;
  const dynamics::NozzleXY nozzle{setup.x.axis.riding(start[gcode::X]),
                                  setup.y.axis.riding(start[gcode::Y])};
  std::vector<dynamics::AxisTrajectory> x;
  std::vector<dynamics::AxisTrajectory> y;
  BaseMotion result;
  auto windows = compensate::windows(plan, spans, nozzle, setup);
  for (std::size_t i = 0; i < windows.size(); ++i) {
    auto [of_x, of_y] = compensate::solve(engine, spans[i], windows[i]);
    if (!of_x || !of_y) {
      return tl::unexpected(of_x ? of_y.error() : of_x.error());
    }
    for (const compensate::AxisSolution* const of : {&*of_x, &*of_y}) {
      result.size.add(of->size);
      result.iterations += of->iterations;
    }
    x.push_back(std::move(of_x->base));
    y.push_back(std::move(of_y->base));
  }
  const std::size_t more = compensate::nodes_of_shaping(setup, grid.period_s);
  const auto path = [&](const dynamics::AxisTrajectory& solutions) {
    return rivals::through_nodes(solutions,
                                 -setup.lead_in_s - static_cast<double>(more) * grid.period_s,
                                 grid.period_s, parts);
  };
  const dynamics::BaseTrajectory base = compensate::shaped(
      {grid.period_s, compensate::join(spans, x), compensate::join(spans, y)}, setup, more, more);
  result.x = path(base.x);
  result.y = path(base.y);
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
      return BaseMotion{rivals::s_curve(run.plan, gcode::X), rivals::s_curve(run.plan, gcode::Y)};
    case Method::slow_s_curve:
      if (run.slow_plan.empty()) {
        return fail(ErrorKind::input, "needs a plan of its own");
      }
      return BaseMotion{rivals::s_curve(run.slow_plan, gcode::X),
                        rivals::s_curve(run.slow_plan, gcode::Y)};
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
      first.x.pulses.clear();
      first.y.pulses.clear();
      return limited_base(4.0, std::move(first), run.plan, setup, engine);
    }
    default:
      return BaseMotion{rivals::reference_path(run.plan, gcode::X),
                        rivals::reference_path(run.plan, gcode::Y)};
  }
}

}  // namespace unflex::study
