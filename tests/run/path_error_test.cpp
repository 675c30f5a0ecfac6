#include "unflex/run/path_error.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace unflex::run {
namespace {

constexpr double kPeriod_s = 1e-3;
constexpr std::size_t kNodes = 201;

verify::NozzleModel model() {
  return {dynamics::from_frequency(45.0, 0.06), dynamics::from_frequency(30.0, 0.1), 1e-4, 0.5};
}

// A move from 0 at constant speed, longer than the base.
std::vector<planner::PlannedMove> move_at(double speed_mm_s, bool extruding,
                                          gcode::Axis axis = gcode::X) {
  planner::PlannedMove move;
  move.segment.end_mm[axis] = speed_mm_s;
  move.segment.end_mm[gcode::E] = extruding ? 1.0 : 0.0;
  move.direction[axis] = 1.0;
  move.length_mm = speed_mm_s;
  move.start_v_mm_s = move.cruise_v_mm_s = move.end_v_mm_s = speed_mm_s;
  move.cruise_s = 1.0;
  return {move};
}

dynamics::BaseTrajectory base_at(double speed_mm_s) {
  dynamics::BaseTrajectory base;
  base.period_s = kPeriod_s;
  for (std::size_t k = 0; k < kNodes; ++k) {
    base.x.position_mm.push_back(speed_mm_s * kPeriod_s * static_cast<double>(k));
    base.x.velocity_mm_s.push_back(speed_mm_s);
  }
  base.x.accel_mm_s2.assign(kNodes, 0.0);
  base.y.position_mm = base.y.velocity_mm_s = base.y.accel_mm_s2 = base.x.accel_mm_s2;
  return base;
}

// The nozzle rests when the base begins.
void add_run(const std::vector<planner::PlannedMove>& plan, double lead_in_s,
             const dynamics::BaseTrajectory& base,
             const std::vector<planner::PlannedMove>& replayed, PathError& error) {
  add_emission_error({plan, lead_in_s, base, dynamics::NozzleXY{}}, replayed, 0.0, model(), error);
}

TEST(EmissionError, IsNothingForLinesThatDoWhatTheBaseDoes) {
  PathError cost;
  add_run(move_at(50.0, true), 0.0, base_at(50.0), move_at(50.0, true), cost);
  EXPECT_LT(cost.max_mm, 1e-12);
  EXPECT_LE(cost.rms_mm(), cost.max_mm);
}

TEST(EmissionError, IsNothingAlongThePath) {
  PathError cost;
  add_run(move_at(50.0, true), 0.0, base_at(50.0), move_at(51.0, true), cost);
  EXPECT_EQ(cost.max_mm, 0.0);
}

TEST(EmissionError, IsWhatTheDifferenceOfTheBasesMakesOfTheNozzleAcrossThePath) {
  PathError cost;
  add_run(move_at(50.0, true, gcode::Y), 0.0, base_at(50.0), move_at(51.0, true), cost);
  // The bases differ by 1 mm/s. The model is linear, so the nozzle's error is the response to a
  // base at 1 mm/s.
  double sum = 0.0;
  double largest = 0.0;
  for (std::size_t k = 1; k < kNodes; ++k) {
    const double off =
        dynamics::exact_step(model().x, {}, {0.0, 1.0, 0.0}, kPeriod_s * static_cast<double>(k))
            .position();
    sum += off * off;
    largest = std::max(largest, std::abs(off));
  }
  EXPECT_NEAR(cost.rms_mm(), std::sqrt(sum / (kNodes - 1)), 1e-12);
  EXPECT_NEAR(cost.max_mm, largest, 1e-12);
}

TEST(EmissionError, CountsWhereFilamentIsLaid) {
  PathError cost;
  add_run(move_at(50.0, false, gcode::Y), 0.0, base_at(50.0), move_at(51.0, true), cost);
  EXPECT_EQ(cost.rms_mm(), 0.0);
  // Only the samples of the first of two runs count.
  add_run(move_at(50.0, true, gcode::Y), 0.0, base_at(50.0), move_at(51.0, true), cost);
  const double alone = cost.rms_mm();
  add_run(move_at(50.0, false, gcode::Y), 0.0, base_at(50.0), move_at(55.0, true), cost);
  EXPECT_EQ(cost.rms_mm(), alone);
  // Nothing is laid during a lead-in, so its samples, the first ones, do not count.
  PathError late;
  add_run(move_at(50.0, true, gcode::Y), 0.1, base_at(50.0), move_at(51.0, true), late);
  EXPECT_GT(late.rms_mm(), alone);
}

// A base that goes along with the plan leaves the nozzle of a stiff axis on the path; one that goes
// across it takes the nozzle along.
TEST(PathError, IsHowFarTheNozzleIsAcrossThePath) {
  const std::vector<planner::PlannedMove> along = move_at(50.0, true);
  const std::vector<planner::PlannedMove> across = move_at(50.0, true, gcode::Y);
  const dynamics::BaseTrajectory base = base_at(50.0);
  const dynamics::NozzleXY rest;
  EXPECT_EQ(path_error({along, 0.0, base, rest}, model(), {}).max_mm, 0.0);
  const PathError error = path_error({across, 0.0, base, rest}, model(), {});
  EXPECT_EQ(error.samples, kNodes - 1);
  const double last_mm =
      dynamics::exact_step(model().x, {}, {0.0, 50.0, 0.0}, kPeriod_s * (kNodes - 1)).position();
  EXPECT_NEAR(error.max_mm, last_mm, 1e-9);
}

}  // namespace
}  // namespace unflex::run
