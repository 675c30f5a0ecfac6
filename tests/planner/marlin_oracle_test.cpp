// The plan against the blocks that Marlin's own planner makes of the same moves.
//
// planner_marlin_cases.csv: one command per row.
//   case,<name>,<classic jerk>,<BLOCK_BUFFER_SIZE>,<MIN_STEPS_PER_SEGMENT>   default limits again
//   steps | max_accel | max_velocity | jerk,<X>,<Y>,<Z>,<E>      accel,<M204 P>,<R>,<T>
//   deviation,<mm>      minimum,<M205 S>,<T>,<B in µs>      move,<X>,<Y>,<Z>,<E>,<feed>[,<radius>]
//   stop
// planner_marlin_blocks.csv: one block of Marlin 2.1.2.5's src/module/planner.cpp per row.
//   <case>,<move>,<steps X>,<Y>,<Z>,<E>,<step_event_count>,<nominal_rate>,<initial_rate>,
//   <final_rate>,<accelerate_until>,<decelerate_after>,<acceleration_steps_per_s2>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "planner/csv_rows.hpp"
#include "unflex/planner/marlin_planner.hpp"

namespace unflex::planner {
namespace {

using testing::axes;
using testing::number;
using testing::Row;
using testing::rows;

// The motion that the stepper interrupt makes of a block, step by step (stepper.cpp,
// block_phase_isr): rates of the first step, the fastest and the last, and the time.
struct Profile {
  double initial = 0.0;
  double peak = 0.0;
  double last = 0.0;
  double duration_s = 0.0;
};

Profile profile(const Row& row) {
  const auto steps = static_cast<int>(number(row, 6));
  const double nominal = number(row, 7);
  const double accel_until = number(row, 10);
  const double decel_after = number(row, 11);
  const double final_rate = std::min(number(row, 9), nominal);
  const double a = number(row, 12);
  Profile p;
  p.initial = p.last = std::min(number(row, 8), nominal);
  p.duration_s = 1.0 / p.initial;
  double reached = p.initial;
  double accel_s = p.duration_s;
  double decel_s = 0.0;
  for (int made = 1; made < steps; ++made) {
    if (made <= accel_until) {
      reached = std::min(nominal, p.initial + a * accel_s);
      p.last = reached;
      accel_s += 1.0 / p.last;
    } else if (made > decel_after) {
      p.last = std::max(final_rate, reached - a * decel_s);
      decel_s += 1.0 / p.last;
    } else {
      p.last = nominal;
    }
    p.duration_s += 1.0 / p.last;
    p.peak = std::max(p.peak, p.last);
  }
  p.peak = std::max(p.peak, p.initial);
  return p;
}

struct Plan {
  std::array<double, 4> steps_per_mm{};
  std::vector<PlannedMove> moves;
};

// One case's planner, fed row by row.
class Run {
 public:
  explicit Run(const Row& row) {
    config_.firmware = Firmware::marlin;
    config_.steps_per_mm = {80.0, 80.0, 400.0, 93.0};
    config_.classic_jerk = row.at(2) == "1";
    config_.block_buffer_size = static_cast<int>(number(row, 3));
    config_.min_steps_per_segment = static_cast<int>(number(row, 4));
  }

  void feed(const Row& row) {
    const std::string& kind = row.at(0);
    gcode::LimitChange change;
    if (kind == "steps") {
      config_.steps_per_mm = axes(row);
    } else if (kind == "move") {
      move(row);
    } else if (kind == "stop") {
      planner().stop();
    } else {
      if (kind == "max_accel") std::ranges::copy(axes(row), change.axis_max_accel_mm_s2.begin());
      if (kind == "max_velocity") {
        std::ranges::copy(axes(row), change.axis_max_velocity_mm_s.begin());
      }
      if (kind == "jerk") std::ranges::copy(axes(row), change.axis_jerk_mm_s.begin());
      if (kind == "deviation") change.junction_deviation_mm = number(row, 1);
      if (kind == "accel") {
        change.print_accel_mm_s2 = number(row, 1);
        change.retract_accel_mm_s2 = number(row, 2);
        change.travel_accel_mm_s2 = number(row, 3);
      }
      if (kind == "minimum") {
        change.min_velocity_mm_s = number(row, 1);
        change.min_travel_velocity_mm_s = number(row, 2);
        change.min_segment_time_s = 1e-6 * number(row, 3);
      }
      planner().apply(change);
    }
  }

  Plan plan() {
    Plan result{config_.steps_per_mm, {}};
    planner().take_played(result.moves);
    return result;
  }

 private:
  Planner& planner() {
    if (!planner_) planner_ = make_planner(Limits{}, config_);
    return *planner_;
  }

  void move(const Row& row) {
    gcode::Segment segment;
    segment.start_mm = at_mm_;
    segment.end_mm = axes(row);
    segment.feed_mm_s = number(row, 5);
    segment.line = ++count_;
    if (row.size() > 6) segment.curve_radius_mm = number(row, 6);
    planner().add(segment);
    at_mm_ = segment.end_mm;
  }

  FirmwareConfig config_;
  std::unique_ptr<Planner> planner_;
  gcode::Position at_mm_{};
  std::size_t count_ = 0;
};

std::map<std::string, Plan> plans() {
  std::map<std::string, Plan> result;
  std::string name;
  std::unique_ptr<Run> run;
  for (const Row& row : rows("planner_marlin_cases.csv")) {
    if (row.at(0) == "case") {
      if (run) result[name] = run->plan();
      name = row.at(1);
      run = std::make_unique<Run>(row);
    } else {
      run->feed(row);
    }
  }
  if (run) result[name] = run->plan();
  return result;
}

std::map<std::string, std::vector<Row>> blocks() {
  std::map<std::string, std::vector<Row>> result;
  for (Row& row : rows("planner_marlin_blocks.csv")) result[row.at(0)].push_back(std::move(row));
  return result;
}

TEST(MarlinOracle, SameMovesAreQueuedWithTheSameSteps) {
  const auto planned = plans();
  const auto expected = blocks();
  ASSERT_GE(expected.size(), 80U);
  ASSERT_EQ(planned.size(), expected.size());
  for (const auto& [name, plan] : planned) {
    const std::vector<Row>& of_marlin = expected.at(name);
    ASSERT_EQ(plan.moves.size(), of_marlin.size()) << name;
    for (std::size_t i = 0; i < of_marlin.size(); ++i) {
      const gcode::Segment& segment = plan.moves[i].segment;
      ASSERT_EQ(static_cast<double>(segment.line), number(of_marlin[i], 1)) << name;
      for (std::size_t axis = 0; axis < 4; ++axis) {
        const double steps =
            (segment.end_mm[axis] - segment.start_mm[axis]) * plan.steps_per_mm[axis];
        // The plan has the file's own filament. The firmware rounds it at both ends.
        const double rounding = axis == gcode::E ? 1.0 : 1e-9;
        ASSERT_NEAR(std::abs(steps), number(of_marlin[i], 2 + axis), rounding)
            << name << " move " << segment.line << " axis " << axis;
      }
    }
  }
}

TEST(MarlinOracle, EveryBlockTakesTheSameTime) {
  const auto planned = plans();
  for (const auto& [name, of_marlin] : blocks()) {
    const std::vector<PlannedMove>& moves = planned.at(name).moves;
    ASSERT_EQ(moves.size(), of_marlin.size()) << name;
    for (std::size_t i = 0; i < of_marlin.size(); ++i) {
      const double played_s = profile(of_marlin[i]).duration_s;
      ASSERT_NEAR(moves[i].duration_s(), played_s, 1e-9)
          << name << " move " << moves[i].segment.line;
    }
  }
}

TEST(MarlinOracle, EveryBlockHasTheSameRates) {
  const auto planned = plans();
  for (const auto& [name, of_marlin] : blocks()) {
    const std::vector<PlannedMove>& moves = planned.at(name).moves;
    ASSERT_EQ(moves.size(), of_marlin.size()) << name;
    for (std::size_t i = 0; i < of_marlin.size(); ++i) {
      const Row& row = of_marlin[i];
      const PlannedMove& move = moves[i];
      const double steps_per_mm = number(row, 6) / move.length_mm;
      const Profile expected = profile(row);
      ASSERT_NEAR(move.start_v_mm_s * steps_per_mm, expected.initial, 1e-6) << name << ' ' << i;
      // Even ramps are half a step of a ramp away from those in whole steps.
      const double half_step = 0.5 * number(row, 12);
      const auto off_by = [&](double rate) { return half_step / rate + 1e-6; };
      ASSERT_NEAR(move.cruise_v_mm_s * steps_per_mm, expected.peak, 2.0 * off_by(expected.peak))
          << name << ' ' << i;
      ASSERT_NEAR(move.end_v_mm_s * steps_per_mm, expected.last, 2.0 * off_by(expected.last))
          << name << ' ' << i;
      ASSERT_NEAR(move.accel_mm_s2 * steps_per_mm, number(row, 12), 1e-4) << name << ' ' << i;
    }
  }
}

}  // namespace
}  // namespace unflex::planner
