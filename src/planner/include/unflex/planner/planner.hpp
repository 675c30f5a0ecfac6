// Velocity planning with lookahead, as the firmware does it.
//
//   v_s, v_c, v_e   speed at the start, in the cruise and at the end of a move, mm/s
//   a               acceleration of both ramps, mm/s²
//   T_a, T_c, T_d   durations of acceleration, cruise and deceleration, s
//   T_l, v_l        duration of the lead, s; speed right behind it, mm/s
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "unflex/core/axes.hpp"
#include "unflex/core/firmware.hpp"
#include "unflex/core/kinematics.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::planner {

inline constexpr double kNoLimit = std::numeric_limits<double>::infinity();

// Limits that a file may change. Arrays are per axis X Y Z E.
struct Limits {
  // Klipper.
  double max_velocity_mm_s = 300.0;
  double max_accel_mm_s2 = 5000.0;
  double square_corner_velocity_mm_s = 5.0;
  double minimum_cruise_ratio = 0.5;
  // Before March 2024 Klipper had this in place of minimum_cruise_ratio. The planner follows later
  // versions, which do without it.
  double accel_to_decel_mm_s2 = 2500.0;
  // Marlin and RepRapFirmware. These defaults, and those for Marlin alone, are from Marlin 2.1.2:
  // Configuration.h (DEFAULT_MAX_FEEDRATE, DEFAULT_MAX_ACCELERATION, DEFAULT_ACCELERATION,
  // DEFAULT_XJERK, JUNCTION_DEVIATION_MM) and Configuration_adv.h (DEFAULT_MINIMUMFEEDRATE,
  // DEFAULT_MINSEGMENTTIME).
  std::array<double, 4> axis_max_velocity_mm_s{300.0, 300.0, 5.0, 25.0};       // M203
  std::array<double, 4> axis_max_accel_mm_s2{3000.0, 3000.0, 100.0, 10000.0};  // M201
  std::array<double, 4> axis_jerk_mm_s{10.0, 10.0, 0.3, 5.0};                  // M205 X Y Z E, M566
  double print_accel_mm_s2 = 3000.0;                                           // M204 P
  double travel_accel_mm_s2 = 3000.0;                                          // M204 T
  // Marlin.
  double retract_accel_mm_s2 = 3000.0;    // M204 R: moves of filament alone
  double junction_deviation_mm = 0.013;   // M205 J
  double min_velocity_mm_s = 0.0;         // M205 S: moves with filament
  double min_travel_velocity_mm_s = 0.0;  // M205 T
  double min_segment_time_s = 0.02;       // M205 B
  // RepRapFirmware.
  double min_movement_velocity_mm_s = 0.5;  // M203 I
  int jerk_policy = 0;                      // M566 P
  // M566 from 3.6: upper bound of axis_jerk_mm_s, which M205 sets there.
  std::array<double, 4> axis_max_jerk_mm_s{kNoLimit, kNoLimit, kNoLimit, kNoLimit};

  friend bool operator==(const Limits&, const Limits&) = default;
};

// Puts the limits that the change sets in place of those in force.
void apply(const gcode::LimitChange& change, Limits& limits);

// The printer's own input shaper as its configuration has it, unless a file sets another. The
// defaults are Klipper's (klippy/extras/shaper_defs.py).
struct InstalledShaper {
  Axes<std::string> type{"mzv", "mzv"};  // as the firmware spells it, in lower case
  Axes<double> damping_ratio{0.1, 0.1};
};

// Values that only the firmware's configuration decides.
struct FirmwareConfig {
  Firmware firmware = Firmware::klipper;
  Motors motors;
  // Klipper; for a 0.4 mm nozzle, 1.75 mm filament, max_velocity 300 and max_accel 5000.
  double max_z_velocity_mm_s = 300.0;
  double max_z_accel_mm_s2 = 5000.0;
  double max_extrude_only_velocity_mm_s = 79.8243241107433;
  double max_extrude_only_accel_mm_s2 = 1330.40540184572;
  double instantaneous_corner_velocity_mm_s = 1.0;
  double pressure_advance_s = 0.0;
  double pressure_advance_smooth_s = 0.04;
  InstalledShaper shaper;
  // Marlin and RepRapFirmware, per axis X Y Z E; Marlin's DEFAULT_AXIS_STEPS_PER_UNIT.
  std::array<double, 4> steps_per_mm{80.0, 80.0, 400.0, 500.0};
  // Marlin; defaults of its Configuration.h and Configuration_adv.h.
  bool classic_jerk = false;                 // CLASSIC_JERK instead of junction deviation
  int min_steps_per_segment = 6;             // MIN_STEPS_PER_SEGMENT
  int block_buffer_size = 16;                // BLOCK_BUFFER_SIZE; at least 4
  bool jd_handle_small_segments = true;      // JD_HANDLE_SMALL_SEGMENTS
  double minimum_planner_speed_mm_s = 0.05;  // MINIMUM_PLANNER_SPEED, above 0
  // RepRapFirmware 3.5.3 on a Duet 3 with a SAME70 (MB6HC, MB6XD). Other boards have 40 moves, and
  // a Duet 2 has 937500 clocks per second (src/Movement/Move.h: InitialDdaRingLength, M595 P;
  // src/RepRapFirmware.h: StepClockRate).
  int ring_length = 60;         // at least 4
  bool has_print_jerk = false;  // from 3.6: Limits::axis_max_jerk_mm_s is a limit of its own
  bool rounds_phases = false;   // from 3.6: each phase of a move lasts whole step clocks, rounded
  double step_clock_hz = 750000.0;
};

// A time of constant acceleration.
struct Phase {
  double duration_s = 0.0;
  double speed_mm_s = 0.0;  // where it begins
  double accel_mm_s2 = 0.0;
};

// A block of Marlin's in whole steps. Rates in steps/s.
struct StepBlock {
  std::uint32_t step_events = 0;  // 0: the move is none of Marlin's
  std::uint32_t accel_steps_s2 = 0;
  std::uint32_t nominal_rate_steps_s = 0;
  std::uint32_t initial_rate_steps_s = 0;
  std::uint32_t final_rate_steps_s = 0;
  std::uint32_t accel_steps = 0;
  std::uint32_t decel_steps = 0;
};

// A segment with its trapezoid.
struct PlannedMove {
  gcode::Segment segment;
  std::array<double, 4> direction{};  // per axis X Y Z E: travel per mm of length
  double length_mm = 0.0;             // in X, Y and Z; of filament when nothing else moves
  bool kinematic = true;              // moves X, Y or Z
  double start_v_mm_s = 0.0;
  double cruise_v_mm_s = 0.0;
  double end_v_mm_s = 0.0;
  double accel_mm_s2 = 0.0;
  // The lead: time at the speed of the start, which then leaps by leap_mm_s. Marlin makes the first
  // step of a line at its entry rate and counts that time as time of acceleration.
  double lead_s = 0.0;
  double leap_mm_s = 0.0;
  bool has_whole_steps = false;  // its ramps are made of them: as_played() of a move of Marlin's
  double accel_s = 0.0;
  double cruise_s = 0.0;
  double decel_s = 0.0;
  StepBlock block = {};

  [[nodiscard]] double duration_s() const { return lead_s + accel_s + cruise_s + decel_s; }
  // The ramps' own accelerations, which differ from accel_mm_s2 where they have whole steps.
  [[nodiscard]] double ramp_up_mm_s2() const {
    return has_whole_steps && accel_s > 0.0 ? (cruise_v_mm_s - ramp_v_mm_s()) / accel_s
                                            : accel_mm_s2;
  }
  [[nodiscard]] double ramp_down_mm_s2() const {
    return has_whole_steps && decel_s > 0.0 ? (cruise_v_mm_s - end_v_mm_s) / decel_s : accel_mm_s2;
  }
  // Speed at which the ramp up begins.
  [[nodiscard]] double ramp_v_mm_s() const { return start_v_mm_s + leap_mm_s; }
  // Lead, acceleration, cruise and deceleration, in this order. Any of them may last no time.
  [[nodiscard]] std::array<Phase, 4> phases() const;
  // Distance covered t seconds after the start of the move; t is clamped to the move.
  [[nodiscard]] double distance_mm(double t) const;
  [[nodiscard]] double velocity_mm_s(double t) const;
  // X, Y, Z, E at t seconds after the start of the move; exact at both ends.
  [[nodiscard]] gcode::Position position_mm(double t) const;
  // Time after the start at which the distance is covered; the inverse of distance_mm.
  [[nodiscard]] double time_s(double distance_mm) const;
};

// The move as the firmware carries it out. Marlin's stepper interrupt makes another motion of a
// trapezoid than planned: it takes less time, with leaps of speed (marlin_trapezoid.cpp). Other
// firmwares carry out what they plan.
[[nodiscard]] PlannedMove as_played(PlannedMove move);

// How long the moves take, one after the other.
[[nodiscard]] double duration_s(std::span<const PlannedMove> moves);

// The last moves that take at least `duration_s` together, or all moves.
[[nodiscard]] std::span<const PlannedMove> last_moves(std::span<const PlannedMove> moves,
                                                      double duration_s);

// The acceleration that the plan asks of X or Y in the move, whichever is larger.
[[nodiscard]] double asked_accel_mm_s2(const PlannedMove& move);

// Whether the path turns in X and Y by more than 20° between moves in these directions. Beyond such
// a corner an error along the first move leads off the path.
[[nodiscard]] bool turns_sharply(const gcode::Position& before, const gcode::Position& after);

// How long the firmware takes for the first step out of a standstill, with limits as high as those
// of a run. 0: none.
//
// Marlin 2.1.2: 1 / MINIMAL_STEP_RATE (src/module/planner.cpp, calculate_trapezoid_for_block).
[[nodiscard]] double first_step_s(const FirmwareConfig& config);

// How long the machine rests before a run whose first move this is: first_step_s(), or 0 if it
// comes from another move, such as one of filament alone, at some speed.
[[nodiscard]] double wait_s(const PlannedMove& first, const FirmwareConfig& config);

// A firmware's planner. Moves come out in order once nothing that follows can change them. The plan
// does not depend on when, or how often, take() is called.
class Planner {
 public:
  virtual ~Planner() = default;
  Planner(const Planner&) = delete;
  Planner& operator=(const Planner&) = delete;

  // Limits for the moves added from now on.
  void apply(const gcode::LimitChange& change) { planner::apply(change, limits_); }
  // Applies the effects of a line on the moves around it: the line may set limits, and it may have
  // waited for the moves before.
  void apply(const gcode::Event& event) {
    if (event.waits_for_buffer) empty_buffer();
    apply(*event.limits);
  }
  [[nodiscard]] const Limits& limits() const { return limits_; }

  // The line that has been read waits until no move is in front of the queue. Limits set from now
  // on hold for none of the moves added so far.
  virtual void empty_buffer() {}

  // Queues a segment, whose feed must be above zero. False, and nothing queued, if it has no length
  // at all.
  virtual bool add(const gcode::Segment& segment) = 0;

  // The machine comes to rest after the last queued move.
  virtual void stop() = 0;

  // Takes the final moves out, appends them to `out` and returns how many. After stop() these are
  // all moves queued before it.
  virtual std::size_t take(std::vector<PlannedMove>& out) = 0;

  // Does the work of take(), with the moves as_played().
  std::size_t take_played(std::vector<PlannedMove>& out);

  // Moves queued and not yet taken.
  [[nodiscard]] virtual std::size_t pending() const = 0;

 protected:
  explicit Planner(const Limits& limits) : limits_(limits) {}

  Limits limits_;
};

// The limits that the firmware uses if it is told `limits`. RepRapFirmware has a least value of
// each.
[[nodiscard]] Limits as_accepted(Firmware firmware, const Limits& limits);

// The planner of config.firmware.
[[nodiscard]] std::unique_ptr<Planner> make_planner(const Limits& limits,
                                                    const FirmwareConfig& config);

}  // namespace unflex::planner
