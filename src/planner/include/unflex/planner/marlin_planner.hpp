// Marlin's planner.
//
// Notation: Marlin 2.1.2, src/module/planner.cpp. The arithmetic is the firmware's own: 32-bit
// floats and integers in the same order. Rates are rounded up to whole steps per second, and one
// step per second more or less is 100 µs on a move of a second.
//
// Rounding. Targets are rounded to whole steps, and the rounding is carried: the start_mm and
// end_mm of a planned move are where the motors are, not what the file says. A move of fewer than
// min_steps_per_segment steps on every axis is not queued; its motion is added to the next queued
// move. E is rounded in this way for the planning, by what it reads (Segment::reading_of_e), since
// G92 E0 decides which line has a step of E, and whether X and Y may turn back without a stop. But
// the E of a planned move is the file's, so that filament can be accounted for. The firmware rounds
// E anew at each G92 E0, which moves the filament by less than one step (and drops what was too
// short to be queued).
//
// Lookahead. The file is taken to be read faster than it is printed. The buffer of N blocks then
// holds N − 1, including the running one. When a block begins to run, the N − 3 blocks after it are
// known, and the last of these ends at MINIMUM_PLANNER_SPEED. From then on the end speed of the
// running block is fixed. After a stop the buffer is filled before the first block runs, so this
// block has N − 2 known blocks after it. Meanwhile the third to (N/2)-th block are stretched to
// min_segment_time (SLOWDOWN), as they would be in the firmware. A real printer's first block runs
// as soon as three are queued.
//
// Trapezoid. A block's ramps take whole steps: the ramp up is rounded up, the ramp down is rounded
// down (calculate_trapezoid_for_block). Both have the block's acceleration a, and the ramp down
// ends where the steps end. So a move ends faster than the next one begins: v² is higher by up to
// 4a times the length of a step, plus what rounding adds to the rates. (They are rounded up, and to
// 120 steps/s at least.)
//
// The stepper interrupt makes the first step at the entry rate and then accelerates from step to
// step (marlin_trapezoid.cpp has the law).
//
// Left out: what is off by default (S_CURVE_ACCELERATION, LIN_ADVANCE, TRAVEL_EXTRA_XYJERK,
// XY_FREQUENCY_LIMIT, backlash), and the safe exit speed that G2 and G3 hint at: with it the last
// block known, if it is a piece of an arc, need not end at rest.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "unflex/core/kinematics.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::planner {
namespace marlin {

// Steps of the axes X Y Z E, or of the motors. The firmware's 32 bits overflow after 4 km of
// filament.
using Steps = std::array<std::int64_t, 4>;
using Vector = std::array<float, 4>;

// Limits and configuration in the firmware's own types (planner_settings_t). Limits are of motors,
// which on a core are not the axes.
struct Settings {
  std::array<std::array<int, 3>, 3> motors{};  // motors by axes, as in unflex::Motors
  bool shares_motors = false;                  // IS_CORE
  Vector steps_per_mm{};
  Vector mm_per_step{};
  Vector max_velocity_mm_s{};
  Vector jerk_mm_s{};
  std::array<std::uint32_t, 4> max_accel_mm_s2{};
  std::array<std::uint32_t, 4> max_accel_steps_s2{};
  std::uint32_t accel_integer_limit_steps = 0;  // longer blocks: acceleration limits in floats
  float print_accel_mm_s2 = 0.0F;
  float travel_accel_mm_s2 = 0.0F;
  float retract_accel_mm_s2 = 0.0F;
  float junction_deviation_mm = 0.0F;
  float min_velocity_mm_s = 0.0F;
  float min_travel_velocity_mm_s = 0.0F;
  std::int32_t min_segment_time_us = 0;
  float minimum_speed_mm_s = 0.05F;  // MINIMUM_PLANNER_SPEED
  bool classic_jerk = false;
  bool handle_small_segments = true;
  std::uint32_t min_steps_per_segment = 1;
  std::size_t block_buffer_size = 16;
};

// One entry of the buffer (block_t). v2 are squared speeds.
struct Block {
  std::uint32_t step_events = 0;  // steps of the axis that has most
  std::uint32_t nominal_rate_steps_s = 0;
  std::uint32_t accel_steps_s2 = 0;
  float nominal_speed_mm_s = 0.0F;
  float length_mm = 0.0F;
  float accel_mm_s2 = 0.0F;
  float max_entry_v2 = 0.0F;
  float entry_v2 = 0.0F;
  bool nominal_length = false;  // long enough to reach the nominal speed whatever comes
  PlannedMove move;             // without its trapezoid
};

// Data of the previous block that a junction needs.
struct Previous {
  Vector unit{};
  Vector speed_mm_s{};
  float nominal_speed_mm_s = 0.0F;
  float safe_speed_mm_s = 0.0F;
};

}  // namespace marlin

// Marlin 2's planner: junction deviation or classic jerk, limits per axis, a lookahead of one
// buffer, whole steps.
class MarlinPlanner final : public Planner {
 public:
  // config.block_buffer_size must be at least 4.
  MarlinPlanner(const Limits& limits, const FirmwareConfig& config);

  // Also false for a move that is too short to be queued.
  bool add(const gcode::Segment& segment) override;
  void stop() override;
  std::size_t take(std::vector<PlannedMove>& out) override;
  [[nodiscard]] std::size_t pending() const override;

 private:
  [[nodiscard]] marlin::Block& block(std::size_t index) { return ring_[index % ring_.size()]; }
  [[nodiscard]] marlin::Steps rounded(const gcode::Position& position_mm,
                                      std::optional<float> reading_of_e) const;
  void follow_jumps(const gcode::Segment& segment);
  void set_move(const gcode::Segment& segment, const marlin::Steps& target, PlannedMove& move);
  void run_first();
  void drop_first();
  void reverse_pass();
  void forward_pass();

  FirmwareConfig config_;
  Limits settings_limits_;  // the limits that settings_ were made from
  marlin::Settings settings_;
  marlin::Previous previous_;
  marlin::Steps position_{};    // steps after the last queued block
  double filament_mm_ = 0.0;    // E of the file after the last queued block
  gcode::Position asked_mm_{};  // end of the last segment given, queued or not
  std::optional<float> asked_reading_of_e_;
  bool has_position_ = false;   // a segment has been given
  bool start_known_ = true;     // all starts since the last queued block are known
  bool start_assumed_ = false;  // the unknown ones among these starts are all assumed
  std::vector<marlin::Block> ring_;
  // Blocks first_ … end_ − 1 are in the buffer, counted since the beginning.
  std::size_t first_ = 0;
  std::size_t end_ = 0;
  std::size_t planned_ = 0;  // from here on entry speeds can still rise
  bool running_ = false;     // the first block runs; it is among the final moves already
  std::vector<PlannedMove> final_;
};

}  // namespace unflex::planner
