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

// The motion that a block describes: rates at the start, the peak and the end, and the time.
struct Profile {
  double initial = 0.0;
  double peak = 0.0;
  double last = 0.0;
  double duration_s = 0.0;
};

Profile profile(const Row& row) {
  const double steps = number(row, 6);
  const double nominal = number(row, 7);
  const double accel_until = number(row, 10);
  const double decel_steps = steps - number(row, 11);
  const double a = number(row, 12);
  Profile p{std::min(number(row, 8), nominal), nominal, 0.0, 0.0};
  const double to_nominal = (nominal * nominal - p.initial * p.initial) / (2.0 * a);
  if (to_nominal <= accel_until) {
    p.duration_s = (nominal - p.initial) / a + (accel_until - to_nominal) / nominal;
  } else {
    p.peak = std::sqrt(p.initial * p.initial + 2.0 * a * accel_until);
    p.duration_s = 2.0 * accel_until / (p.initial + p.peak);
  }
  // The stepper interrupt makes the first step at the initial rate.
  if (const double ramp_s = (p.peak - p.initial) / a; ramp_s > 0.0 && ramp_s * p.initial < 0.25) {
    p.duration_s = 1.0 / p.initial + (accel_until - 1.0) / p.peak;
  }
  p.last = std::sqrt(std::max(p.peak * p.peak - 2.0 * a * decel_steps, 0.0));
  p.duration_s += (steps - decel_steps - accel_until) / p.peak;
  p.duration_s += 2.0 * decel_steps / (p.peak + p.last);
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
    planner().take(result.moves);
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
      ASSERT_NEAR(moves[i].duration_s(), profile(of_marlin[i]).duration_s, 1e-9)
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
      ASSERT_NEAR(move.cruise_v_mm_s * steps_per_mm, expected.peak, 1e-6) << name << ' ' << i;
      ASSERT_NEAR(move.end_v_mm_s * steps_per_mm, expected.last, 1e-6) << name << ' ' << i;
      ASSERT_NEAR(move.accel_mm_s2 * steps_per_mm, number(row, 12), 1e-4) << name << ' ' << i;
    }
  }
}

}  // namespace
}  // namespace unflex::planner
