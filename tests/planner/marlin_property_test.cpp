// Properties of Marlin's plans of random programs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "planner/marlin_helpers.hpp"

namespace unflex::planner {
namespace {

using enum gcode::Axis;
using testing::axis_steps;
using testing::marlin_config;
using testing::step_mm;

struct Step {
  std::optional<gcode::LimitChange> change;
  gcode::Segment segment;
  bool stop_before = false;
};

// Curves, corners, tiny pieces, travels, Z and filament alone, in a random mixture.
std::vector<Step> program(unsigned seed, int count) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<Step> steps;
  gcode::Position at{};
  double heading = 0.0;
  double size_mm = 1.0;
  for (int i = 0; i < count; ++i) {
    Step step;
    step.stop_before = uniform(0.0, 1.0) < 0.01;
    if (uniform(0.0, 1.0) < 0.05) {
      step.change.emplace();
      step.change->print_accel_mm_s2 = uniform(200.0, 9000.0);
      step.change->travel_accel_mm_s2 = uniform(200.0, 9000.0);
      step.change->junction_deviation_mm = uniform(0.01, 0.3);
      step.change->axis_jerk_mm_s = {uniform(1, 20), uniform(1, 20), uniform(0.1, 2),
                                     uniform(1, 9)};
      step.change->axis_max_accel_mm_s2 = {uniform(500, 9000), uniform(500, 9000), 100.0, 8000.0};
    }
    if (uniform(0.0, 1.0) < 0.1) size_mm = std::exp(uniform(-3.5, 3.0));
    heading += uniform(0.0, 1.0) < 0.2 ? uniform(0.0, 2.0 * std::numbers::pi) : uniform(-0.2, 0.2);
    gcode::Position to = at;
    const double kind = uniform(0.0, 1.0);
    if (kind < 0.05) {
      to[E] += uniform(-2.0, 2.0);
    } else if (kind < 0.08) {
      to[Z] += uniform(-0.5, 0.5);
    } else {
      to[X] += size_mm * std::cos(heading);
      to[Y] += size_mm * std::sin(heading);
      if (kind < 0.8) to[E] += 0.033 * size_mm;
    }
    step.segment = testing::segment(at, to, uniform(3.0, 250.0));
    step.segment.line = static_cast<std::size_t>(i);
    at = to;
    steps.push_back(step);
  }
  return steps;
}

void feed(Planner& planner, const Step& step) {
  if (step.stop_before) planner.stop();
  if (step.change) planner.apply(*step.change);
  planner.add(step.segment);
}

std::vector<PlannedMove> plan(const std::vector<Step>& steps, const FirmwareConfig& config) {
  MarlinPlanner planner(Limits{}, config);
  for (const Step& step : steps) feed(planner, step);
  planner.stop();
  std::vector<PlannedMove> moves;
  planner.take(moves);
  return moves;
}

bool same(const PlannedMove& a, const PlannedMove& b) {
  return a.segment.line == b.segment.line && a.segment.start_mm == b.segment.start_mm &&
         a.segment.end_mm == b.segment.end_mm && a.start_v_mm_s == b.start_v_mm_s &&
         a.cruise_v_mm_s == b.cruise_v_mm_s && a.end_v_mm_s == b.end_v_mm_s &&
         a.accel_s == b.accel_s && a.cruise_s == b.cruise_s && a.decel_s == b.decel_s;
}

// Both junction rules, each with several seeds.
class MarlinProgram : public ::testing::TestWithParam<unsigned> {
 protected:
  MarlinProgram() {
    config_.classic_jerk = GetParam() % 2 == 1;
    steps_ = program(GetParam(), 3000);
    moves_ = plan(steps_, config_);
  }
  FirmwareConfig config_ = marlin_config();
  std::vector<Step> steps_;
  std::vector<PlannedMove> moves_;
};

TEST_P(MarlinProgram, MovesFollowOneAnotherInWholeSteps) {
  ASSERT_GT(moves_.size(), steps_.size() / 2);
  for (std::size_t i = 0; i < moves_.size(); ++i) {
    if (i > 0) {
      ASSERT_EQ(moves_[i].segment.start_mm, moves_[i - 1].segment.end_mm);
    }
    const gcode::Position& asked = steps_[moves_[i].segment.line].segment.end_mm;
    for (std::size_t axis = 0; axis < 4; ++axis) {
      const double off = moves_[i].segment.end_mm[axis] - asked[axis];
      // Half a step, and the resolution of the firmware's floats at some 10 000 steps.
      ASSERT_LE(std::abs(off) * config_.steps_per_mm[axis], 0.51);
    }
    // The plan has the file's own filament, so its steps are known to within one.
    std::array<double, 4> steps = axis_steps(moves_[i], config_);
    steps[gcode::E] += 1.0;
    ASSERT_GE(std::ranges::max(steps), config_.min_steps_per_segment);
  }
}

void expect_ramps_add_up(const PlannedMove& move) {
  const double accel_mm = move.start_v_mm_s * move.lead_s +
                          0.5 * (move.ramp_v_mm_s() + move.cruise_v_mm_s) * move.accel_s;
  const double decel_mm = 0.5 * (move.end_v_mm_s + move.cruise_v_mm_s) * move.decel_s;
  ASSERT_NEAR(accel_mm + move.cruise_v_mm_s * move.cruise_s + decel_mm, move.length_mm,
              1e-10 * std::max(1.0, move.length_mm));
  ASSERT_GE(std::min({move.accel_s, move.cruise_s, move.decel_s}), 0.0);
}

TEST_P(MarlinProgram, RampsAddUpToTheLength) {
  for (const PlannedMove& move : moves_) {
    ASSERT_NO_FATAL_FAILURE(expect_ramps_add_up(move));
    if (move.lead_s == 0.0) {
      ASSERT_NEAR(move.cruise_v_mm_s - move.start_v_mm_s, move.accel_mm_s2 * move.accel_s, 1e-9);
    }
  }
}

TEST_P(MarlinProgram, RampsAddUpToTheLengthAsPlayedToo) {
  for (const PlannedMove& planned : moves_) {
    const PlannedMove move = as_played(planned);
    ASSERT_NO_FATAL_FAILURE(expect_ramps_add_up(move));
    ASSERT_EQ(move.segment.end_mm, planned.segment.end_mm);
    ASSERT_EQ(as_played(move).duration_s(), move.duration_s());
    ASSERT_EQ(move.distance_mm(move.duration_s()), move.length_mm);
    // In many steps a ramp is as steep as planned.
    const double many_mm = 20.0 * step_mm(move, config_);
    if (0.5 * (move.ramp_v_mm_s() + move.cruise_v_mm_s) * move.accel_s > many_mm) {
      ASSERT_NEAR(move.ramp_up_mm_s2(), move.accel_mm_s2, 0.08 * move.accel_mm_s2);
    }
    if (0.5 * (move.end_v_mm_s + move.cruise_v_mm_s) * move.decel_s > many_mm) {
      ASSERT_NEAR(move.ramp_down_mm_s2(), move.accel_mm_s2, 0.08 * move.accel_mm_s2);
    }
  }
}

// A move's end may be faster because ramps have whole steps (4a steps at most) and rates are
// rounded up.
TEST_P(MarlinProgram, SpeedsAtJunctionsAgreeUpToTheRoundingToSteps) {
  for (std::size_t i = 1; i < moves_.size(); ++i) {
    if (steps_[moves_[i].segment.line].stop_before) continue;
    const PlannedMove& before = moves_[i - 1];
    const PlannedMove& after = moves_[i];
    if (before.kinematic != after.kinematic) continue;  // speeds of the tool and of filament
    const double rounding = 3.0 * (step_mm(before, config_) + step_mm(after, config_));
    const double slowest = 120.0 * step_mm(before, config_);
    const double shared = std::max(after.start_v_mm_s + rounding, slowest);
    const double ramp = 4.0 * before.accel_mm_s2 * step_mm(before, config_);
    const auto steps = axis_steps(before, config_);
    const auto steps_after = axis_steps(after, config_);
    const bool filament_length =
        std::max({steps[X], steps[Y], steps[Z]}) < config_.min_steps_per_segment ||
        std::max({steps_after[X], steps_after[Y], steps_after[Z]}) < config_.min_steps_per_segment;
    if (filament_length) continue;  // the firmware compares speeds of different kinds there
    ASSERT_LE(before.end_v_mm_s, std::sqrt(shared * shared + ramp) + rounding) << i;
  }
}

TEST_P(MarlinProgram, NothingIsFasterThanAskedOrAllowed) {
  Limits limits;
  std::size_t next = 0;
  for (const PlannedMove& move : moves_) {
    for (; next <= move.segment.line; ++next) {
      if (steps_[next].change) apply(*steps_[next].change, limits);
    }
    const double rounding = step_mm(move, config_);
    const auto steps = axis_steps(move, config_);
    if (std::max({steps[X], steps[Y], steps[Z]}) >= config_.min_steps_per_segment) {
      ASSERT_LE(move.cruise_v_mm_s, move.segment.feed_mm_s * (1.0 + 1e-6) + rounding);
    }
    const double peak = std::max({move.start_v_mm_s, move.cruise_v_mm_s, move.end_v_mm_s});
    for (std::size_t axis = 0; axis < 4; ++axis) {
      const double share = std::abs(move.direction[axis]);
      ASSERT_LE(share * peak,
                limits.axis_max_velocity_mm_s[axis] * (1.0 + 1e-5) + share * rounding);
      if (!move.kinematic) continue;
      // Limits are whole mm/s², rates whole steps/s².
      ASSERT_LE(share * move.accel_mm_s2,
                limits.axis_max_accel_mm_s2[axis] * (1.0 + 1e-5) + share * rounding);
    }
  }
}

TEST_P(MarlinProgram, PlanDoesNotDependOnWhenItIsTaken) {
  MarlinPlanner planner(Limits{}, config_);
  std::vector<PlannedMove> taken;
  std::mt19937_64 random(7);
  for (const Step& step : steps_) {
    feed(planner, step);
    if (random() % 3 == 0) planner.take(taken);
    ASSERT_LE(planner.pending(), 40U);
  }
  planner.stop();
  planner.take(taken);
  EXPECT_EQ(planner.pending(), 0U);
  ASSERT_EQ(taken.size(), moves_.size());
  for (std::size_t i = 0; i < taken.size(); ++i) ASSERT_TRUE(same(taken[i], moves_[i])) << i;
}

TEST_P(MarlinProgram, WhatLiesBeyondTheBufferChangesNothing) {
  const std::vector<Step> head(steps_.begin(), steps_.begin() + 1500);
  const std::vector<PlannedMove> cut = plan(head, config_);
  ASSERT_GT(cut.size(), 100U);
  for (std::size_t i = 0; i + 14 < cut.size(); ++i) ASSERT_TRUE(same(cut[i], moves_[i])) << i;
}

INSTANTIATE_TEST_SUITE_P(Seeds, MarlinProgram, ::testing::Range(1U, 9U));

}  // namespace
}  // namespace unflex::planner
