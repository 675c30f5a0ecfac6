#include "filament_flow.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "nozzle_progress.hpp"
#include "plain_base.hpp"
#include "unflex/planner/klipper_planner.hpp"

namespace unflex::emit {
namespace {

// Lines along X from 0 on; `flows` is mm of filament per mm.
std::vector<Stroke> lines(const std::vector<double>& lengths_mm, const std::vector<double>& flows,
                          double speed_mm_s) {
  std::vector<Stroke> result;
  Stroke line;
  for (std::size_t i = 0; i < lengths_mm.size(); ++i) {
    line.place_mm.x += lengths_mm[i];
    line.e_mm += flows[i] * lengths_mm[i];
    line.end_s += lengths_mm[i] / speed_mm_s;
    result.push_back(line);
  }
  return result;
}

std::vector<double> flows_of(const std::vector<Stroke>& strokes) {
  std::vector<double> result;
  Stroke before;
  for (const Stroke& stroke : strokes) {
    result.push_back((stroke.e_mm - before.e_mm) / (stroke.place_mm.x - before.place_mm.x));
    before = stroke;
  }
  return result;
}

double largest_jump(const std::vector<double>& flows) {
  double largest = 0.0;
  for (std::size_t i = 1; i < flows.size(); ++i) {
    largest = std::max(largest, std::abs(flows[i] - flows[i - 1]));
  }
  return largest;
}

TEST(LevelFlow, MakesAStepOfFlowAStair) {
  std::vector<double> flows(40, 0.0);
  std::fill(flows.begin() + 20, flows.end(), 0.033);
  std::vector<Stroke> strokes = lines(std::vector<double>(40, 0.2), flows, 100.0);
  const double all_mm = strokes.back().e_mm;
  level_flow({}, 1.0, strokes);
  const std::vector<double> levelled = flows_of(strokes);
  // A jump of the flow by 0.01 is 1 mm/s of filament at 100 mm/s.
  EXPECT_LE(largest_jump(levelled), 1.02e-2);
  for (std::size_t i = 1; i < levelled.size(); ++i) {
    EXPECT_GE(levelled[i], levelled[i - 1] - 1e-12);
  }
  EXPECT_NEAR(strokes.back().e_mm, all_mm, 1e-12);
  // The ramp is no longer than the jump requires.
  EXPECT_NEAR(levelled[16], 0.0, 1e-12);
  EXPECT_NEAR(levelled[23], 0.033, 1e-12);
}

TEST(LevelFlow, LeavesWhatIsLevelAsItIs) {
  std::vector<double> flows(10, 0.03);
  flows[5] = 0.035;
  const std::vector<Stroke> before = lines(std::vector<double>(10, 0.2), flows, 100.0);
  for (const double most_mm_s : {1.0, std::numeric_limits<double>::infinity()}) {
    std::vector<Stroke> strokes = before;
    level_flow({}, most_mm_s, strokes);
    for (std::size_t i = 0; i < strokes.size(); ++i) {
      EXPECT_NEAR(strokes[i].e_mm, before[i].e_mm, 1e-15);
    }
  }
}

TEST(LevelFlow, KeepsTheFilamentAndTakesNoneBack) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> length(0.05, 0.5);
  std::uniform_real_distribution<double> flow(-0.03, 0.06);
  for (int i = 0; i < 50; ++i) {
    std::vector<double> lengths_mm;
    std::vector<double> flows;
    for (int k = 0; k < 60; ++k) {
      lengths_mm.push_back(length(random));
      flows.push_back(std::max(flow(random), 0.0));
    }
    std::vector<Stroke> strokes = lines(lengths_mm, flows, 80.0);
    const double all_mm = strokes.back().e_mm;
    level_flow({}, 1.0, strokes);
    const std::vector<double> levelled = flows_of(strokes);
    EXPECT_LE(largest_jump(levelled), 1.05 / 80.0);
    EXPECT_GE(*std::min_element(levelled.begin(), levelled.end()), -1e-12);
    EXPECT_DOUBLE_EQ(strokes.back().e_mm, all_mm);
  }
}

TEST(LevelFlow, IsAskedForByKlipperAlone) {
  planner::FirmwareConfig firmware;
  firmware.firmware = Firmware::klipper;
  firmware.instantaneous_corner_velocity_mm_s = 2.0;
  EXPECT_NEAR(most_flow_step_mm_s(firmware), 1.8, 1e-12);
  firmware.firmware = Firmware::marlin;
  EXPECT_EQ(most_flow_step_mm_s(firmware), std::numeric_limits<double>::infinity());
  firmware.firmware = Firmware::rrf;
  EXPECT_EQ(most_flow_step_mm_s(firmware), std::numeric_limits<double>::infinity());
}

// Moves with 0.03 mm of filament per mm, except one without, and the progress of the nozzle along
// them.
struct Nozzle {
  explicit Nozzle(const std::vector<gcode::Position>& points, double how_late_s = 0.0,
                  double freq_hz = 1000.0)
      : late_s(how_late_s), axis(dynamics::from_frequency(freq_hz, 0.1)) {
    planner::KlipperPlanner planner({}, {});
    for (std::size_t i = 1; i < points.size(); ++i) {
      planner.add({points[i - 1], points[i], 60.0, i, true});
    }
    planner.stop();
    planner.take(moves);
    for (const planner::PlannedMove& move : moves) {
      starts_s.push_back(starts_s.back() + move.duration_s());
    }
    base = testing::plan_as_base(moves, late_s);
  }

  [[nodiscard]] NozzleProgress progress() const {
    Run run;
    run.moves = &moves;
    run.base = &base;
    return {run, starts_s, on_all_axes(axis), {}};
  }

  // Filament of the sliced path at time t of the plan.
  [[nodiscard]] double filament_mm(double t) const {
    std::size_t i = 0;
    while (i + 1 < moves.size() && t > starts_s[i + 1]) {
      ++i;
    }
    return moves[i].position_mm(std::clamp(t - starts_s[i], 0.0, moves[i].duration_s()))[gcode::E];
  }

  double late_s;
  dynamics::FlexibleAxis axis;
  std::vector<planner::PlannedMove> moves;
  std::vector<double> starts_s{0.0};
  dynamics::BaseTrajectory base;
};

TEST(NozzleProgress, GivesThePlaceOfANozzleThatIsLateItsOwnFilament) {
  const Nozzle nozzle(
      {{0.0, 0.0, 0.2, 0.0}, {20.0, 0.0, 0.2, 0.6}, {40.0, 0.0, 0.2, 0.6}, {40.0, 20.0, 0.2, 1.2}},
      3e-3);
  const NozzleProgress progress = nozzle.progress();
  double largest_mm = 0.0;
  for (double t = 0.0; t < nozzle.starts_s.back(); t += 1e-3) {
    // The progress misses about 1 % of the lag.
    EXPECT_NEAR(progress.filament_mm(t), nozzle.filament_mm(t - nozzle.late_s), 2e-4) << t;
    largest_mm = std::max(largest_mm, std::abs(progress.filament_mm(t) - nozzle.filament_mm(t)));
  }
  // A lag of 3 ms at 60 mm/s is 0.18 mm.
  EXPECT_NEAR(largest_mm, 0.03 * 0.18, 3e-4);
}

TEST(NozzleProgress, NeverGoesBack) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> place(0.0, 10.0);
  for (int i = 0; i < 10; ++i) {
    std::vector<gcode::Position> points{{0.0, 0.0, 0.2, 0.0}};
    for (int k = 0; k < 20; ++k) {
      points.push_back({place(random), place(random), 0.2, points.back()[gcode::E] + 0.1});
    }
    const Nozzle nozzle(points, 0.0, 30.0);
    const NozzleProgress progress = nozzle.progress();
    double before_mm = 0.0;
    for (double t = 0.0; t < nozzle.starts_s.back() + 2e-3; t += 1e-4) {
      const double filament_mm = progress.filament_mm(t);
      EXPECT_GE(filament_mm, before_mm - 1e-12);
      before_mm = filament_mm;
    }
    EXPECT_LE(before_mm, points.back()[gcode::E] + 1e-12);
    EXPECT_GE(before_mm, points.back()[gcode::E] - 0.05);
  }
}

TEST(NozzleProgress, TellsWhenTheFirstMoveIsLeftBehind) {
  const Nozzle nozzle({{0.0, 0.0, 0.2, 0.0}, {20.0, 0.0, 0.2, 0.6}, {40.0, 0.0, 0.2, 0.6}});
  const NozzleProgress progress = nozzle.progress();
  EXPECT_FALSE(progress.past_first_move(nozzle.starts_s[1] - 5e-3));
  EXPECT_TRUE(progress.past_first_move(nozzle.starts_s[1] + 5e-3));
}

}  // namespace
}  // namespace unflex::emit
