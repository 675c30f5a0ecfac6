// The bench against the closed form: every shaper's base as parabolas, the nozzle on it exactly.
#include "shaper_bench.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "planner/plan_helpers.hpp"
#include "unflex/dynamics/shapers.hpp"
#include "unflex/rivals/axis_path.hpp"

namespace unflex::record {
namespace {

constexpr double kFreq_hz = 45.0;
constexpr double kZeta = 0.06;

std::vector<planner::PlannedMove> corner() {
  std::vector<gcode::Segment> segments =
      planner::testing::polyline({{12.0, 0.0, 0.0, 0.4}, {12.0, 12.0, 0.0, 0.8}}, 100.0);
  return planner::testing::plan(segments, {100.0, 4000.0, 5.0, 0.0});
}

verify::NozzleModel model(double error = 0.0) {
  const dynamics::FlexibleAxis axis = dynamics::from_frequency(kFreq_hz * (1.0 + error), kZeta);
  return {axis, axis};
}

// Runs the bench on the corner, on machines with these errors.
struct Benched {
  explicit Benched(const std::vector<double>& errors,
                   const std::optional<PrinterShaper>& printer_shaper = std::nullopt)
      : bench(model(), dynamics::kShaperKinds, printer_shaper, errors.size()) {
    const std::vector<planner::PlannedMove> moves = corner();
    std::size_t taken = 0;
    verify::ReferencePath path([&](verify::ReferenceMove& next) {
      if (taken == moves.size()) {
        return false;
      }
      next.move = moves[taken++];
      return true;
    });
    path.begin_section();
    path.extend_to(1e9);
    const rivals::AxisPath x = rivals::reference_path(moves, gcode::X);
    const rivals::AxisPath y = rivals::reference_path(moves, gcode::Y);
    const rivals::TimeGrid grid{0.0, 1e-4, static_cast<std::size_t>((path.end_s() + 0.2) / 1e-4)};
    for (std::size_t machine = 0; machine < errors.size(); ++machine) {
      const auto on_x = rivals::nozzle_on(model(errors[machine]).x, x, grid);
      const auto on_y = rivals::nozzle_on(model(errors[machine]).y, y, grid);
      for (std::size_t k = 0; k < grid.count; ++k) {
        bench.add(machine, grid.at(k), {on_x[k].motion(), on_y[k].motion()});
      }
    }
    bench.advance(path, path.end_s() + 0.2);
  }

  ShaperBench bench;
};

struct Exactly {
  report::Spread spread;
  double corner_mm = 0.0;  // how far the nozzle passes from the corner
};

Exactly exactly(dynamics::ShaperKind kind, double error) {
  const std::vector<planner::PlannedMove> moves = corner();
  const dynamics::ShaperPulses pulses = dynamics::shaper_pulses(kind, kFreq_hz, kZeta).value();
  const double end_s = planner::duration_s(moves);
  const rivals::TimeGrid grid{-0.1, 1e-4, static_cast<std::size_t>((end_s + 0.2) / 1e-4)};
  const auto nozzle = [&](gcode::Axis axis) {
    return rivals::nozzle_on(model(error).x,
                             rivals::shaped(rivals::reference_path(moves, axis), pulses), grid);
  };
  const auto x = nozzle(gcode::X);
  const auto y = nozzle(gcode::Y);
  double sum = 0.0;
  double weight = 0.0;
  double most = 0.0;
  double corner_mm = 1e9;
  for (std::size_t k = 0; k < grid.count; ++k) {
    if (grid.at(k) < 0.0 || grid.at(k) > end_s) {
      continue;
    }
    const double p_x = x[k].position();
    const double p_y = y[k].position();
    const double to_first = std::hypot(p_x - std::clamp(p_x, 0.0, 12.0), p_y);
    const double to_second = std::hypot(p_x - 12.0, p_y - std::clamp(p_y, 0.0, 12.0));
    const double contour = std::min(to_first, to_second);
    corner_mm = std::min(corner_mm, std::hypot(p_x - 12.0, p_y));
    sum += contour * contour;
    weight += 1.0;
    most = std::max(most, contour);
  }
  return {{most, std::sqrt(sum / weight)}, corner_mm};
}

TEST(ShaperBench, FindsWhatTheClosedFormFinds) {
  const std::vector<double> errors = {0.0, -0.1, 0.1};
  const std::vector<report::Contender> found = Benched(errors).bench.contenders();
  ASSERT_EQ(found.size(), dynamics::kShaperKinds.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].name, dynamics::name(dynamics::kShaperKinds[i]));
    ASSERT_EQ(found[i].spreads.size(), errors.size());
    const double corner_mm = exactly(dynamics::kShaperKinds[i], 0.0).corner_mm;
    EXPECT_NEAR(found[i].corner_rms_mm.value(), corner_mm, 0.02 * corner_mm) << found[i].name;
    for (std::size_t k = 0; k < errors.size(); ++k) {
      const report::Spread wanted = exactly(dynamics::kShaperKinds[i], errors[k]).spread;
      EXPECT_NEAR(found[i].spreads[k].max_mm, wanted.max_mm, 0.02 * wanted.max_mm) << found[i].name;
      // The tolerance is wide: there is a single corner, with sixteen moments per period.
      EXPECT_NEAR(found[i].spreads[k].rms_mm, wanted.rms_mm, 0.08 * wanted.rms_mm) << found[i].name;
    }
  }
}

// A firmware that delays the whole motion makes the print late, no worse.
TEST(ShaperBench, MeasuresThePrintersOwnShaperAsAnyOther) {
  const std::vector<double> errors = {0.0, -0.15, 0.15};
  const dynamics::ShaperPulses pulses =
      dynamics::shaper_pulses(dynamics::ShaperKind::mzv, kFreq_hz, kZeta).value();
  dynamics::ShaperPulses late = pulses;
  for (dynamics::Pulse& pulse : late) {
    pulse.time_s -= pulses.front().time_s;
  }
  for (const PrinterShaper& own :
       {PrinterShaper{"own", pulses, pulses}, PrinterShaper{"own", late, late}}) {
    const std::vector<report::Contender> found = Benched(errors, own).bench.contenders();
    ASSERT_EQ(found.size(), dynamics::kShaperKinds.size() + 1);
    EXPECT_EQ(found.back().name, "own");
    EXPECT_TRUE(found.back().drawn);
    const report::Contender& mzv = found[1];
    ASSERT_EQ(mzv.name, "MZV");
    for (std::size_t k = 0; k < errors.size(); ++k) {
      EXPECT_NEAR(found.back().spreads[k].max_mm, mzv.spreads[k].max_mm, 1e-9);
      EXPECT_NEAR(found.back().spreads[k].rms_mm, mzv.spreads[k].rms_mm, 1e-9);
    }
  }
}

TEST(ShaperBench, SaysNothingOfShapersThatTheDampingForbids) {
  const dynamics::FlexibleAxis stiff = dynamics::from_frequency(kFreq_hz, 1.0);
  ShaperBench bench({stiff, stiff}, dynamics::kShaperKinds, std::nullopt, 2);
  for (const report::Contender& contender : bench.contenders()) {
    EXPECT_TRUE(contender.spreads.empty()) << contender.name;
  }
}

TEST(ShaperBench, MeasuresALongPrintOnlyNowAndThen) {
  ShaperBench bench(model(), dynamics::kShaperKinds, std::nullopt, 1);
  constexpr double kLong_s = 400.0;
  planner::PlannedMove move;
  move.segment = planner::testing::segment({}, {kLong_s, 0.0, 0.0, 100.0}, 1.0);
  move.direction = {1.0, 0.0, 0.0, 0.0};
  move.length_mm = kLong_s;
  move.cruise_v_mm_s = 1.0;
  move.cruise_s = kLong_s;
  bool given = false;
  verify::ReferencePath path([&](verify::ReferenceMove& next) {
    next.move = move;
    return !std::exchange(given, true);
  });
  path.begin_section();
  path.extend_to(1.0);
  for (double t = 0.0; t < kLong_s; t += 1e-3) {
    // 1 µm beside the path.
    bench.add(0, t, {{t, 1.0}, {1e-3, 0.0}});
    bench.advance(path, t);
  }
  // All of the first 60 s are measured, half of the next 120 s, and a quarter of the rest.
  EXPECT_NEAR(bench.measured_s(), 175.0, 5.0);
  for (const report::Contender& contender : bench.contenders()) {
    EXPECT_NEAR(contender.spreads[0].rms_mm, 1e-3, 1e-9);
  }
}

}  // namespace
}  // namespace unflex::record
