// Properties of RepRapFirmware's plans of random programs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "planner/plan_helpers.hpp"
#include "planner/rrf_limits.hpp"
#include "unflex/planner/rrf_planner.hpp"

namespace unflex::planner {
namespace {

using enum gcode::Axis;

constexpr double kClock_hz = 750000.0;
// Rounding of the difference of two coordinates below 256 that are floats.
constexpr double kCoordinate_mm = 3.2e-5;

Limits some_limits(std::mt19937_64& random, int policy) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Limits limits = testing::rrf_default_limits();
  limits.jerk_policy = policy;
  limits.axis_max_velocity_mm_s = {uniform(50, 300), uniform(50, 300), 20.0, uniform(10, 100)};
  limits.axis_max_accel_mm_s2 = {uniform(500, 9000), uniform(500, 9000), 200.0, uniform(500, 9000)};
  limits.axis_jerk_mm_s = {uniform(2, 20), uniform(2, 20), 2.0, uniform(0.5, 10)};
  limits.print_accel_mm_s2 = uniform(500, 9000);
  limits.travel_accel_mm_s2 = uniform(500, 9000);
  return limits;
}

// Curves, corners, tiny pieces, travels, Z and filament alone, in a random mixture.
std::vector<gcode::Segment> program(std::mt19937_64& random, int count) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<gcode::Segment> segments;
  gcode::Position at{100.0, 100.0, 0.2, 0.0};
  double heading = 0.0;
  double size_mm = 1.0;
  for (int i = 0; i < count; ++i) {
    if (uniform(0.0, 1.0) < 0.1) size_mm = std::exp(uniform(-3.5, 2.0));
    heading += uniform(0.0, 1.0) < 0.2 ? uniform(0.0, 6.3) : uniform(-0.2, 0.2);
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
    segments.push_back(testing::segment(at, to, uniform(3.0, 250.0)));
    segments.back().line = static_cast<std::size_t>(i);
    at = to;
  }
  return segments;
}

FirmwareConfig some_config(std::mt19937_64& random) {
  FirmwareConfig config;
  config.firmware = Firmware::rrf;
  config.step_clock_hz = kClock_hz;
  config.ring_length = std::uniform_int_distribution<int>(4, 60)(random);
  return config;
}

// Calls check(limits, segments, moves) for random programs of both policies.
template <class Check>
void for_each_plan(unsigned seed, const Check& check) {
  std::mt19937_64 random(seed);
  for (int round = 0; round < 30; ++round) {
    const Limits limits = some_limits(random, round % 2);
    const auto segments = program(random, 300);
    RrfPlanner planner(limits, some_config(random));
    for (const gcode::Segment& segment : segments) ASSERT_TRUE(planner.add(segment));
    planner.stop();
    std::vector<PlannedMove> moves;
    planner.take(moves);
    ASSERT_EQ(moves.size(), segments.size());
    check(limits, segments, moves);
  }
}

TEST(RrfProperties, SpeedsAgreeAtEveryJointAndVanishAtTheEnds) {
  for_each_plan(1, [](const Limits&, const auto&, const auto& moves) {
    ASSERT_EQ(moves.front().start_v_mm_s, 0.0);
    ASSERT_EQ(moves.back().end_v_mm_s, 0.0);
    for (std::size_t i = 1; i < moves.size(); ++i) {
      ASSERT_EQ(moves[i - 1].end_v_mm_s, moves[i].start_v_mm_s) << i;
    }
  });
}

TEST(RrfProperties, TrapezoidsCoverTheirLengthToWithinElevenClocks) {
  for_each_plan(2, [](const Limits&, const auto&, const auto& moves) {
    for (const PlannedMove& move : moves) {
      const double covered = 0.5 * (move.start_v_mm_s + move.cruise_v_mm_s) * move.accel_s +
                             move.cruise_v_mm_s * move.cruise_s +
                             0.5 * (move.cruise_v_mm_s + move.end_v_mm_s) * move.decel_s;
      // Rounding takes up to one clock. A ramp that set_top_speed removes takes up to ten.
      const double clock_mm = move.cruise_v_mm_s / kClock_hz;
      ASSERT_NEAR(covered, move.length_mm, 11.5 * clock_mm + 1e-6 * move.length_mm)
          << move.segment.line;
      ASSERT_LE(covered, move.length_mm * (1.0 + 1e-6)) << move.segment.line;
      ASSERT_GE(std::min({move.accel_s, move.cruise_s, move.decel_s}), 0.0);
    }
  });
}

TEST(RrfProperties, NoAxisExceedsItsSpeedOrAcceleration) {
  for_each_plan(3, [](const Limits& limits, const auto& segments, const auto& moves) {
    for (std::size_t i = 0; i < moves.size(); ++i) {
      const PlannedMove& move = moves[i];
      ASSERT_LE(move.cruise_v_mm_s, std::max(segments[i].feed_mm_s, 0.5) * (1 + 1e-5));
      for (const auto axis : {X, Y, Z, E}) {
        const double part = std::abs(segments[i].delta(axis)) / move.length_mm;
        ASSERT_LE(move.cruise_v_mm_s * part, limits.axis_max_velocity_mm_s[axis] * (1 + 1e-4));
        // Rounding of a single ramp: RecalculateMove allows 2 % before it counts an error.
        ASSERT_LE(move.accel_mm_s2 * part, limits.axis_max_accel_mm_s2[axis] * 1.02);
      }
    }
  });
}

TEST(RrfProperties, NoMotorJumpsByMoreThanItsJerk) {
  for_each_plan(4, [](const Limits& limits, const auto& segments, const auto& moves) {
    for (std::size_t i = 1; i < moves.size(); ++i) {
      for (const auto axis : {X, Y, Z, E}) {
        const double jump = std::abs(segments[i].delta(axis) / moves[i].length_mm -
                                     segments[i - 1].delta(axis) / moves[i - 1].length_mm);
        // The direction of a short move is coarse: it is made of coordinates in floats.
        const double coarse =
            kCoordinate_mm / moves[i].length_mm + kCoordinate_mm / moves[i - 1].length_mm;
        ASSERT_LE(moves[i].start_v_mm_s * std::max(jump - coarse, 0.0),
                  limits.axis_jerk_mm_s[axis] * (1 + 1e-5))
            << i;
      }
    }
  });
}

TEST(RrfProperties, MotorsFollowTheFileToWithinHalfAStep) {
  const FirmwareConfig config;
  for_each_plan(5, [&](const Limits&, const auto& segments, const auto& moves) {
    for (std::size_t i = 0; i < moves.size(); ++i) {
      for (const auto axis : {X, Y, Z}) {
        const double half_step = 0.5 / config.steps_per_mm[axis] + kCoordinate_mm;
        ASSERT_NEAR(moves[i].segment.end_mm[axis], segments[i].end_mm[axis], half_step);
        if (i > 0) {
          ASSERT_EQ(moves[i - 1].segment.end_mm[axis], moves[i].segment.start_mm[axis]);
        }
      }
      ASSERT_EQ(moves[i].segment.end_mm[E], segments[i].end_mm[E]);
    }
  });
}

TEST(RrfProperties, PlanDoesNotDependOnWhenMovesAreTaken) {
  std::mt19937_64 random(6);
  for (int round = 0; round < 10; ++round) {
    const Limits limits = some_limits(random, round % 2);
    const FirmwareConfig config = some_config(random);
    RrfPlanner at_once(limits, config);
    RrfPlanner bit_by_bit(limits, config);
    std::vector<PlannedMove> expected;
    std::vector<PlannedMove> moves;
    for (const gcode::Segment& segment : program(random, 300)) {
      at_once.add(segment);
      bit_by_bit.add(segment);
      if (std::uniform_int_distribution<int>(0, 4)(random) == 0) bit_by_bit.take(moves);
    }
    at_once.stop();
    bit_by_bit.stop();
    at_once.take(expected);
    bit_by_bit.take(moves);
    ASSERT_EQ(moves.size(), expected.size());
    for (std::size_t i = 0; i < moves.size(); ++i) {
      ASSERT_EQ(moves[i].segment.line, expected[i].segment.line);
      ASSERT_EQ(moves[i].start_v_mm_s, expected[i].start_v_mm_s);
      ASSERT_EQ(moves[i].cruise_v_mm_s, expected[i].cruise_v_mm_s);
      ASSERT_EQ(moves[i].duration_s(), expected[i].duration_s());
    }
  }
}

}  // namespace
}  // namespace unflex::planner
