// The plan against the moves that RepRapFirmware's own planner makes of the same program.
//
// planner_rrf_cases.csv: one command per row.
//   case,<name>,<DDAs in the ring>,<step clocks per second>      default limits again
//   max_velocity | max_accel | jerk,<X>,<Y>,<Z>,<E>      accel,<M204 P>,<T>
//   minimum,<M203 I>      policy,<M566 P>      move,<X>,<Y>,<Z>,<E>,<feed>      stop
// planner_rrf_moves.csv: one prepared DDA per row, made by the functions of RepRapFirmware 3.5.3's
// src/Movement/DDA.cpp and DDARing.cpp, their task run at every step clock.
//   <case>,<move>,<totalDistance>,<clocksNeeded>,<startSpeed>,<topSpeed>,<endSpeed>,<acceleration>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "planner/csv_rows.hpp"
#include "planner/rrf_limits.hpp"
#include "unflex/planner/rrf_planner.hpp"

namespace unflex::planner {
namespace {

using testing::axes;
using testing::number;
using testing::Row;
using testing::rows;

struct Plan {
  double clock_hz = 0.0;
  std::vector<PlannedMove> moves;
};

gcode::LimitChange change(const Row& row) {
  const std::string& kind = row.at(0);
  gcode::LimitChange result;
  if (kind == "max_velocity") std::ranges::copy(axes(row), result.axis_max_velocity_mm_s.begin());
  if (kind == "max_accel") std::ranges::copy(axes(row), result.axis_max_accel_mm_s2.begin());
  if (kind == "jerk") std::ranges::copy(axes(row), result.axis_jerk_mm_s.begin());
  if (kind == "minimum") result.min_movement_velocity_mm_s = number(row, 1);
  if (kind == "policy") result.jerk_policy = static_cast<int>(number(row, 1));
  if (kind == "accel") {
    result.print_accel_mm_s2 = number(row, 1);
    result.travel_accel_mm_s2 = number(row, 2);
  }
  return result;
}

// The feed of which the planner makes this speed per step clock. The table's functions got mm/s
// divided by the clock, but the firmware multiplies an F in mm/min. The two roundings differ in the
// last bit.
double feed_mm_s(double mm_s, double clock_hz) {
  const float wanted = static_cast<float>(mm_s) / static_cast<float>(clock_hz);
  const float per_mm_min = 1.0F / (60.0F * static_cast<float>(clock_hz));
  const auto nearest = static_cast<float>(60.0 * mm_s);
  for (const float mm_min :
       {nearest, std::nextafter(nearest, 0.0F), std::nextafter(nearest, 2.0F * nearest)}) {
    if (mm_min * per_mm_min == wanted) return static_cast<double>(mm_min) / 60.0;
  }
  return mm_s;
}

// One case's planner, fed row by row.
class Run {
 public:
  explicit Run(const Row& row) {
    FirmwareConfig config;
    config.firmware = Firmware::rrf;
    config.ring_length = static_cast<int>(number(row, 2));
    config.step_clock_hz = number(row, 3);
    clock_hz_ = config.step_clock_hz;
    planner_ = make_planner(testing::rrf_default_limits(), config);
  }

  void feed(const Row& row) {
    if (row.at(0) == "move") {
      gcode::Segment segment;
      segment.start_mm = at_mm_;
      segment.end_mm = axes(row);
      segment.feed_mm_s = feed_mm_s(number(row, 5), clock_hz_);
      segment.line = ++count_;
      planner_->add(segment);
      at_mm_ = segment.end_mm;
    } else if (row.at(0) == "stop") {
      planner_->stop();
    } else {
      // The table's functions have no buffer in front of the ring.
      planner_->empty_buffer();
      planner_->apply(change(row));
    }
  }

  Plan plan() {
    planner_->stop();
    Plan result{clock_hz_, {}};
    planner_->take(result.moves);
    return result;
  }

 private:
  std::unique_ptr<Planner> planner_;
  double clock_hz_ = 0.0;
  gcode::Position at_mm_{};
  std::size_t count_ = 0;
};

std::map<std::string, Plan> plans() {
  std::map<std::string, Plan> result;
  std::string name;
  std::unique_ptr<Run> run;
  for (const Row& row : rows("planner_rrf_cases.csv")) {
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

class RrfOracle : public ::testing::Test {
 protected:
  void SetUp() override {
    for (Row& row : rows("planner_rrf_moves.csv")) of_rrf_[row.at(0)].push_back(std::move(row));
    ASSERT_GE(of_rrf_.size(), 80U);
    ASSERT_EQ(planned_.size(), of_rrf_.size());
    for (const auto& [name, plan] : planned_) {
      ASSERT_TRUE(of_rrf_.contains(name)) << name;
      ASSERT_EQ(plan.moves.size(), of_rrf_.at(name).size()) << name;
    }
  }

  // Calls check(name, plan, move, row) for every move.
  template <class Check>
  void for_each_move(const Check& check) {
    for (const auto& [name, plan] : planned_) {
      for (std::size_t i = 0; i < plan.moves.size(); ++i) {
        check(name, plan, plan.moves[i], of_rrf_.at(name)[i]);
      }
    }
  }

 private:
  std::map<std::string, Plan> planned_ = plans();
  std::map<std::string, std::vector<Row>> of_rrf_;
};

TEST_F(RrfOracle, EveryMoveHasTheSameLength) {
  for_each_move([](const auto& name, const Plan&, const PlannedMove& move, const Row& row) {
    ASSERT_EQ(static_cast<double>(move.segment.line), number(row, 1)) << name;
    ASSERT_NEAR(move.length_mm, number(row, 2), 1e-7 * move.length_mm) << name;
  });
}

TEST_F(RrfOracle, EveryMoveTakesTheSameTime) {
  for_each_move([](const auto& name, const Plan& plan, const PlannedMove& move, const Row& row) {
    ASSERT_NEAR(move.duration_s(), number(row, 3) / plan.clock_hz, 1e-9)
        << name << " move " << move.segment.line;
  });
}

// The plan agrees to the eight digits of the table, but for a few moves whose feed no F gives
// exactly (feed_mm_s). Those, or their neighbours, are off by a millionth.
TEST_F(RrfOracle, EveryMoveHasTheSameSpeedsAndAcceleration) {
  constexpr int kNoExactFeed = 6;
  int off = 0;
  for_each_move([&](const auto& name, const Plan&, const PlannedMove& move, const Row& row) {
    const std::array<double, 4> planned = {move.start_v_mm_s, move.cruise_v_mm_s, move.end_v_mm_s,
                                           move.accel_mm_s2};
    bool is_off = false;
    for (std::size_t i = 0; i < planned.size(); ++i) {
      is_off = is_off || std::abs(planned[i] - number(row, 4 + i)) > 1e-7 * planned[i];
      ASSERT_NEAR(planned[i], number(row, 4 + i), 2e-6 * planned[i])
          << name << " move " << move.segment.line << " column " << 4 + i;
    }
    off += is_off ? 1 : 0;
  });
  EXPECT_LE(off, kNoExactFeed);
}

}  // namespace
}  // namespace unflex::planner
