// The modal interpreter: commands to absolute machine positions in mm and speeds in mm/s.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/firmware.hpp"
#include "unflex/gcode/command.hpp"
#include "unflex/gcode/line.hpp"

namespace unflex::gcode {

enum Axis : std::size_t { X = 0, Y = 1, Z = 2, E = 3 };

// X, Y, Z and filament, mm.
using Position = std::array<double, 4>;

// One straight piece of motion in machine coordinates. A G1 gives one, an arc several.
struct Segment {
  Position start_mm{};
  Position end_mm{};
  double feed_mm_s = 0.0;  // what the file asks for, after M220
  std::size_t line = 0;    // line number in the input
  // False when the machine's X, Y or Z at the start is not known from the text (beginning of the
  // file, after homing, a macro or a tool change), or when the filament it takes is not (absolute E
  // after a macro): such a motion must not be rewritten.
  bool start_known = true;

  [[nodiscard]] double delta(Axis axis) const { return end_mm[axis] - start_mm[axis]; }
  [[nodiscard]] double length_xy_mm() const;
  // Length in X, Y and Z.
  [[nodiscard]] double length_mm() const;
  // Lays filament while it moves in X or Y.
  [[nodiscard]] bool extruding() const { return delta(E) > 0.0 && length_xy_mm() > 0.0; }
};

// Per axis X Y Z E, where a line gives one.
using AxisValues = std::array<std::optional<double>, 4>;

// New planner limits; those not set stay as they are. planner::Limits says which are whose.
struct LimitChange {
  std::optional<double> max_velocity_mm_s;
  std::optional<double> max_accel_mm_s2;
  std::optional<double> square_corner_velocity_mm_s;
  std::optional<double> minimum_cruise_ratio;
  AxisValues axis_max_velocity_mm_s;
  AxisValues axis_max_accel_mm_s2;
  AxisValues axis_jerk_mm_s;
  std::optional<double> print_accel_mm_s2;
  std::optional<double> travel_accel_mm_s2;
  std::optional<double> retract_accel_mm_s2;
  std::optional<double> junction_deviation_mm;
  std::optional<double> min_velocity_mm_s;
  std::optional<double> min_travel_velocity_mm_s;
  std::optional<double> min_segment_time_s;
  std::optional<double> min_movement_velocity_mm_s;
  std::optional<int> jerk_policy;
};

enum class EventKind {
  passive,  // neither moves nor stops the machine: comments, modes, fans, M73, G1 with F alone …
  limits,   // changes the planner's limits from here on; does not stop
  barrier,  // all motion is finished first: G4, G28, M400, T, unknown commands and macros
  move,     // one or more segments
};

// What one line of the input means for the machine.
struct Event {
  EventKind kind = EventKind::passive;
  Line line;
  std::vector<Segment> segments;  // move
  LimitChange limits;             // limits
  double dwell_s = 0.0;           // barrier: G4's pause
  // barrier: the machine may be anywhere afterwards, in any mode (homing, macro, tool change).
  bool position_lost = false;
  std::vector<std::string> warnings;  // remarks for the user about this line
};

// What the firmware's configuration decides about the meaning of a line.
struct InterpreterOptions {
  Firmware firmware = Firmware::klipper;
  // [firmware_retraction] is configured: G10 and G11 move the filament (and so stop the machine);
  // otherwise Klipper ignores them.
  bool firmware_retraction = true;
  double retract_length_mm = 0.0;
  double retract_speed_mm_s = 20.0;
  double unretract_extra_length_mm = 0.0;
  double unretract_speed_mm_s = 10.0;
  // Klipper's [gcode_arcs] resolution: arcs become straight pieces about this long.
  double arc_resolution_mm = 1.0;
  // [input_shaper] frequencies; 0: the printer has none.
  double shaper_freq_x_hz = 0.0;
  double shaper_freq_y_hz = 0.0;
};

// The state a line is read in.
struct ModalState {
  Position position_mm{};  // machine
  // Whether the axis' machine position is known from the text. E counts from the file's beginning.
  std::array<bool, 4> known{false, false, false, true};
  Position base_mm{};  // machine position of the G-code zero (G92, offsets)
  std::array<bool, 4> base_known{true, true, true, true};
  Position offset_mm{};           // SET_GCODE_OFFSET: the zero that homing restores
  bool absolute_xyz = true;       // G90 / G91
  bool absolute_e = true;         // M82 / M83
  double unit_mm = 1.0;           // 25.4 after G20
  double feed_mm_s = 25.0;        // modal F, before M220
  double speed_factor = 1.0;      // M220
  double flow_factor = 1.0;       // M221
  int plane = 17;                 // G17, G18, G19
  bool retracted = false;         // firmware retraction
  double shaper_freq_x_hz = 0.0;  // SET_INPUT_SHAPER; 0: off
  double shaper_freq_y_hz = 0.0;
};

// Reads lines in the order of the file and says what each means to a Klipper printer
// (klippy/extras/gcode_move.py, gcode_arcs.py, firmware_retraction.py, toolhead.py).
class Interpreter {
 public:
  explicit Interpreter(InterpreterOptions options = {});

  // Never fails: a line that cannot be understood passes as a barrier with a warning.
  [[nodiscard]] Event interpret(Line line);

  [[nodiscard]] const ModalState& state() const { return state_; }

 private:
  // One handler per command or family of commands; each reads command_ and fills the event.
  void traditional(Event& event);
  void g_code(Event& event);
  void m_code(Event& event);
  void extended(Event& event);
  void linear_move(Event& event);
  void arc_move(Event& event, bool clockwise);
  void firmware_retraction(Event& event, bool retract);
  void dwell(Event& event);
  void home(Event& event);
  void set_position(Event& event);
  void acceleration(Event& event);
  void speed_factor(Event& event);
  void flow_factor(Event& event);
  void velocity_limit(Event& event);
  void pressure_advance(Event& event);
  void retraction_settings(Event& event);
  void gcode_offset(Event& event);
  void input_shaper(Event& event);
  void object_label(Event& event);
  void restore_state(Event& event);

  void set_feed(Event& event, std::optional<double> feed_word);
  // Adds the straight piece to `target`, unless it has no length, and moves the state there.
  void append_segment(Event& event, const Position& target, double feed_mm_s, bool start_known);
  void lose_position(Event& event);
  void not_understood(Event& event, std::string_view problem);

  InterpreterOptions options_;
  ModalState state_;
  std::map<std::string, ModalState, std::less<>> saved_states_;  // SAVE_GCODE_STATE, by name
  // Whether the last SET_PRESSURE_ADVANCE switched it on, and on which extruder.
  std::optional<bool> pressure_advance_on_;
  std::string pressure_advance_extruder_;
  Command command_;  // of the line being read; kept for its storage
};

}  // namespace unflex::gcode
