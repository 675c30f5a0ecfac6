// RepRapFirmware's planner.
//
// Notation: RepRapFirmware 3.5.3, src/Movement/DDA.cpp and DDARing.cpp. A queued move is a DDA; it
// is provisional until it is prepared, and frozen from then on. Speeds are in mm per step clock and
// in 32-bit floats, as in the firmware: its decisions ("does this move reach its requested speed",
// "is it nothing but a deceleration") depend on the last bits. They agree with the firmware's up to
// the fused multiply-adds that its compiler may have chosen.
//
// Rounding. A motor ends each move on a whole step: X, Y and Z each end on the step nearest to what
// the file says. start_mm and end_mm of a planned move are these places. Lengths and speeds are
// those of the file's path, so the direction of a planned move is a unit vector only up to a step
// over the length. The extruder's remainders are carried: it follows the file's E to within a step
// and is not rounded. An axis with 0 steps per mm is not rounded either.
//
// Duration. A move lasts a whole number of step clocks, rounded down (DDA::Prepare). What is cut
// off (less than one clock) is taken from its longest phase. Where RecalculateMove drops a ramp of
// less than ten clocks, the other ramp's distance stays that of the requested speed, and the move
// falls short of its length by as much as ten clocks of motion (2.7 µm at 200 mm/s). The firmware's
// motors make up for both at once when the next move begins. A planned move makes up for them where
// it starts to slow down.
//
// Lookahead. A move can change while it is provisional. The file is taken to be read faster than it
// is printed, and the task that fills the ring (Move::MoveLoop) to run at every clock; in a real
// printer it runs every 2 ms. So before each instant the ring holds what CanAddMove allows:
// ring_length moves, of which at most about two seconds are provisional. Moves are frozen 50 ms
// before they begin, or 100 ms if they do not slow down, but never more than half the ring
// (PrepareMoves). If the moves before a stop are too few to fill the ring, they begin when the stop
// is read.
//
// The buffer. A line's moves wait in front of the ring while that is full (GCodes.cpp, ReadMove).
// The firmware reads on until the next line that needs the buffer: a move, or a command that is
// tied to its place among them (GCodes2.cpp, HandleGcode and HandleMcode; GCodeQueue.cpp).
//
// Limits. M201, M203, M204 and M203 I count when a move leaves the buffer for the ring
// (DDA::InitStandardMove), so also for a move that was read before them and waits. M205, M566 and
// its P count for all junctions that are computed after them: that of the move that waits, and
// those of provisional moves where a later move raises them (DoLookahead, MatchSpeeds). A frozen
// move keeps its trapezoid.
//
// Left out: pressure advance (its default of 0 leaves acceleration alone; M572), input shaping, the
// reduced accelerations of M201.1, kinematics that are not linear, tools with several X
// or Y motors or extruders, M595 R (grace period), babystepping, movements of drives on CAN boards,
// which may last one clock longer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "unflex/core/kinematics.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::planner {
namespace rrf {

using Vector = std::array<float, 4>;  // X Y Z E

// Limits in the firmware's own units: mm and step clocks.
struct Settings {
  Motors motors;
  std::array<bool, Motors::kCount> shares_motor{};  // of each axis: HasSharedMotor
  float clock_hz = 0.0F;
  Vector max_speed{};     // M203
  Vector max_accel{};     // M201
  Vector allowed_jerk{};  // M566
  float print_accel = 0.0F;
  float travel_accel = 0.0F;
  float min_speed = 0.0F;      // M203 I
  bool join_all = false;       // jerk policy other than 0
  bool rounds_phases = false;  // FirmwareConfig::rounds_phases
};

// One move of the ring.
struct Dda {
  Vector direction{};
  float length_mm = 0.0F;
  float accel = 0.0F;
  float decel = 0.0F;
  float requested_speed = 0.0F;
  float start_speed = 0.0F;
  float top_speed = 0.0F;
  float end_speed = 0.0F;
  float accel_distance_mm = 0.0F;
  float decel_distance_mm = 0.0F;
  float target_end_speed = 0.0F;    // end speed that the next move asks for
  std::int64_t clocks = 0;          // duration of the whole move
  bool moves_xy = false;            // xyMoving
  bool prints = false;              // isPrintingMove
  bool extruder_not_print = false;  // isNonPrintingExtruderMove
  PlannedMove move;                 // without its trapezoid
};

}  // namespace rrf

// The limits that the firmware really uses when given `limits`: it raises each to a floor
// (src/Platform/Platform.h: SetMaxFeedrate, SetInstantDv and so on).
[[nodiscard]] Limits rrf_raised(Limits limits);

// RepRapFirmware 3's planner: limits per axis, jerk per motor with policy 0 or not, lookahead
// within the ring.
class RrfPlanner final : public Planner {
 public:
  // config.ring_length must be at least 4, config.step_clock_hz above 0.
  RrfPlanner(const Limits& limits, const FirmwareConfig& config);

  bool add(const gcode::Segment& segment) override;
  void empty_buffer() override;
  void stop() override;
  std::size_t take(std::vector<PlannedMove>& out) override;
  [[nodiscard]] std::size_t pending() const override;

 private:
  // Puts the first segment of the buffer into the ring, which must have room.
  void admit();
  void wait_for_space();
  [[nodiscard]] bool can_add() const;
  [[nodiscard]] bool can_freeze() const;
  void freeze();
  [[nodiscard]] std::int64_t next_event() const;
  [[nodiscard]] std::int64_t last_finish() const;
  // The place to which the motors' whole steps round the position.
  [[nodiscard]] gcode::Position on_steps(const gcode::Position& position_mm) const;

  FirmwareConfig config_;
  Motors motors_;
  Limits settings_limits_;  // the limits that settings_ were made from
  rrf::Settings settings_;
  std::size_t ring_length_;
  std::int64_t clock_hz_;
  std::deque<gcode::Segment> buffer_;  // of one line: an arc may have many
  std::deque<rrf::Dda> provisional_;
  bool frozen_extrudes_ = false;  // the move frozen last lays filament
  std::vector<PlannedMove> final_;
  // Step clocks since the machine last stood still.
  std::int64_t now_ = 0;
  std::deque<std::int64_t> finish_;  // ends of frozen moves that have not ended yet; the first runs
  bool moving_ = false;
};

}  // namespace unflex::planner
