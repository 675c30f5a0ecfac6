// The modal interpreter: commands to absolute machine positions in mm and speeds in mm/s.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/axes.hpp"
#include "unflex/core/firmware.hpp"
#include "unflex/core/lazy.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/gcode/command.hpp"
#include "unflex/gcode/line.hpp"

namespace unflex::gcode {

enum Axis : std::size_t { X = 0, Y = 1, Z = 2, E = 3 };
inline constexpr std::array kXY{X, Y};
inline constexpr std::array kXYZ{X, Y, Z};
inline constexpr std::array kXYZE{X, Y, Z, E};

// Whether X and Y are known. `known`: for each axis, whether it is known.
[[nodiscard]] inline bool is_xy_known(const std::array<bool, 4>& known) {
  return known[X] && known[Y];
}

// X, Y, Z and filament, mm.
using Position = std::array<double, 4>;

// The readings of E where a motion begins and ends, as Marlin keeps them (current_position.e). It
// adds up relative words in single precision.
struct ReadingOfE {
  float start = 0.0F;
  float end = 0.0F;
  float factor = 1.0F;  // filament per reading: M221, M200
};

// One straight piece of motion in machine coordinates. A G1 gives one, an arc several.
struct Segment {
  Position start_mm{};
  Position end_mm{};
  double feed_mm_s = 0.0;  // speed that the file asks for, after M220
  std::size_t line = 0;    // line number in the input
  // False: the text does not say where the motion starts, so the motion must not be rewritten.
  // Unknown may be X or Y (at the beginning of the file, after homing, a macro or a tool change), Z
  // where the line names Z, or the filament that the line takes (absolute E after a macro).
  bool start_known = true;
  // The start is not known, but taken to be start_mm. The reason is the label of an object, which
  // may have been cancelled, or an unknown command, which may have moved the machine.
  bool start_assumed = false;
  // Radius of the arc this piece continues; 0 for a straight move and an arc's first and last
  // piece. Marlin hands it to its planner, which then limits the junction by centripetal
  // acceleration (PlannerHints::curve_radius).
  double curve_radius_mm = 0.0;
  // More filament than this length of path can take. Klipper ends the print here.
  bool too_much_filament = false;
  // Marlin, where the text says what E reads. Its planner rounds the reading to whole steps, so
  // that the zero of E (G92) decides in which line a step comes.
  std::optional<ReadingOfE> reading_of_e = std::nullopt;

  [[nodiscard]] double delta(Axis axis) const { return end_mm[axis] - start_mm[axis]; }
  [[nodiscard]] XY way_xy_mm() const { return xy_of(end_mm) - xy_of(start_mm); }
  [[nodiscard]] bool moves_xy() const { return way_xy_mm() != XY{}; }
  [[nodiscard]] double length_xy_mm() const;
  // Length in X, Y and Z.
  [[nodiscard]] double length_mm() const;
  // Lays filament while it moves in X or Y.
  [[nodiscard]] bool extruding() const { return delta(E) > 0.0 && moves_xy(); }
};

// Per axis X Y Z E, where a line gives one.
using AxisValues = std::array<std::optional<double>, 4>;

// New planner limits; those not set stay as they are. planner::Limits says which firmware has
// which.
struct LimitChange {
  std::optional<double> max_velocity_mm_s;
  std::optional<double> max_accel_mm_s2;
  std::optional<double> square_corner_velocity_mm_s;
  std::optional<double> minimum_cruise_ratio;
  std::optional<double> accel_to_decel_mm_s2;
  AxisValues axis_max_velocity_mm_s;
  AxisValues axis_max_accel_mm_s2;
  AxisValues axis_jerk_mm_s;
  AxisValues axis_max_jerk_mm_s;  // RepRapFirmware from 3.6: largest axis_jerk_mm_s
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

// The settings that a line must name besides the frequencies to set the input shaper again. A
// setting is empty if the file has not changed the configured one.
struct ShaperSettings {
  Axes<std::string> type;  // Klipper SHAPER_TYPE, RepRapFirmware P (one type for both axes)
  Axes<std::optional<double>> damping_ratio;  // Klipper DAMPING_RATIO, Marlin D, RepRapFirmware S
  // RepRapFirmware keeps the frequency while P"none" switches the shaper off.
  std::optional<double> kept_freq_hz;
  std::string custom_words;  // RepRapFirmware: the words of M593 P"custom", H and T among them

  friend bool operator==(const ShaperSettings&, const ShaperSettings&) = default;
};

// The firmware's own input shaper.
struct Shaper {
  Axes<double> freq_hz;  // 0: off
  ShaperSettings settings;
  // The printer may have a shaper that nobody has told of. The frequency is 0 meanwhile.
  Axes<bool> unknown;

  [[nodiscard]] bool is_on() const {
    return any_axis([](double hz) { return hz > 0.0; }, freq_hz);
  }
  [[nodiscard]] bool is_unknown() const { return any_axis(std::identity{}, unknown); }
};

// Whether a macro or a tool change can switch a shaper on, where `own` is the printer's own.
// Without [input_shaper] Klipper has no command for it, and a Marlin that was built without one
// neither. RepRapFirmware always has M593.
[[nodiscard]] bool may_come_on(Firmware firmware, const Shaper& own);

enum class EventKind {
  passive,  // neither moves nor stops the machine: comments, modes, fans, M73, G1 with F alone …
  limits,   // changes the planner's limits from here on; does not stop
  // Does not stop the machine, but no rewritten motion may reach across. Labels of objects are
  // borders, since the printer may leave out what follows. So are lines that save or restore the
  // file's modes.
  border,
  barrier,  // all motion is finished first: G4, G28, M400, T, unknown commands and macros
  move,     // one or more segments
};

// The meaning of one line of the input for the machine.
struct Event {
  EventKind kind = EventKind::passive;
  Line line;
  std::vector<Segment> segments;  // move
  Lazy<LimitChange> limits;       // limits
  bool sets_shaper = false;       // barrier: the line sets the input shaper
  Lazy<Shaper> shaper;            // barrier: the input shaper from here on
  double dwell_s = 0.0;           // barrier: G4's pause
  // barrier: the machine may be anywhere afterwards, in any mode (homing, macro, tool change).
  bool position_lost = false;
  // barrier: a line of motion that is not understood. Extruded path that it draws as far as its
  // words tell, mm.
  double lost_path_mm = 0.0;
  // The line may set limits that are not known here: with Klipper a macro may do so (M205), or
  // ACCEL_TO_DECEL in some of its versions.
  bool may_set_limits = false;
  // RepRapFirmware carries the line out only when no move waits in front of its queue (G1, M106).
  bool waits_for_buffer = false;
  std::vector<std::string> warnings;  // remarks for the user about this line
  bool added = false;                 // not a line of the file, but an Interpreter::approach
  // The tool that the line selects (gcode::selected_tool()), 0 or more.
  std::optional<int> tool = std::nullopt;

  // Undoes the interpretation; keeps the line and the storage.
  void reset();
};

// How Marlin cuts arcs (Configuration_adv.h, ARC_SUPPORT).
struct MarlinArcs {
  double min_segment_mm = 0.1;   // MIN_ARC_SEGMENT_MM
  double max_segment_mm = 1.0;   // MAX_ARC_SEGMENT_MM
  double segments_per_s = 0.0;   // ARC_SEGMENTS_PER_SEC; 0: not configured
  int min_circle_segments = 72;  // MIN_CIRCLE_SEGMENTS
  int correction_interval = 25;  // N_ARC_CORRECTION
  bool circles = false;          // ARC_P_CIRCLES: P is a number of full circles
};

// Pressure advance while a compensated run prints. It decides which lines a run may hold, so the
// sliced file and the emitted one have to be read with the same value.
enum class RunAdvance {
  as_sliced,
  on,   // also behind a macro, so the next value of the file does not stop the machine
  off,  // a line that sets it ends a run, since it must be off again behind that line
};

// The parts of the firmware's configuration that decide about the meaning of a line.
struct InterpreterOptions {
  Firmware firmware = Firmware::klipper;
  // The mode of E before the file's first M82 or M83.
  bool relative_e = false;
  // Klipper's [firmware_retraction], Marlin's FWRETRACT: G10 and G11 move the filament (and so stop
  // the machine); otherwise they do nothing. RepRapFirmware always has it.
  bool firmware_retraction = true;
  double retract_length_mm = 0.0;
  // Klipper: somebody has said how long it is, be it 0. Then G10 neither moves nor stops.
  bool retract_length_is_told = false;
  double retract_speed_mm_s = 20.0;
  double unretract_extra_length_mm = 0.0;
  double unretract_speed_mm_s = 10.0;
  // Klipper's [gcode_arcs] resolution: arcs become straight pieces about this long.
  double arc_resolution_mm = 1.0;
  // The firmware's input shaper; 0: the printer has none, or it is not known which.
  Axes<double> shaper_freq_hz{};
  Axes<bool> shaper_unknown{};
  double retract_z_hop_mm = 0.0;  // Marlin and RepRapFirmware, M207 Z
  MarlinArcs marlin_arcs{};
  // RepRapFirmware's M593 P in config.g. P"none", which switches the shaper off, replaces the type,
  // so a line that switches it on again must give this type.
  std::string shaper_type{};
  // RepRapFirmware from 3.6: M205 sets the jerk of prints alone; M566 sets it and its upper bound.
  bool has_print_jerk = false;
  RunAdvance advance_of_runs = RunAdvance::as_sliced;
  // Pressure advance is on before the file sets it.
  bool begins_advanced = false;
  // Filament diameter of M200 without D: DEFAULT_NOMINAL_FILAMENT_DIA, DefaultFilamentDiameter.
  double filament_diameter_mm = 1.75;
  // A move has too much filament if it lays more mm per mm than this, and more than
  // max_extrude_dab_mm. Klipper ends the print at such a move (kinematics/extruder.py, check_move).
  double max_extrude_ratio = std::numeric_limits<double>::infinity();
  double max_extrude_dab_mm = 0.0;
  // The tools that the printer file tells of. Empty: it tells of none, and any may be selected.
  std::vector<int> tools{};
  // How long the nozzle swings after a move. 0: it is not waited for.
  double settling_s = 0.0;
  // Steps per mm of the configuration; an M92 must agree with them.
  std::array<double, 4> steps_per_mm{80.0, 80.0, 400.0, 500.0};
};

// The options with the default values of the firmware's source.
[[nodiscard]] InterpreterOptions default_options(Firmware firmware);

// The firmware's pressure advance, where the file sets it: SET_PRESSURE_ADVANCE, M900 K, M572 S.
// nullopt: as the printer's configuration has it.
struct PressureAdvance {
  std::optional<double> advance_s;
  std::optional<double> smooth_s;  // Klipper: SMOOTH_TIME
  std::string extruder{};          // Klipper: EXTRUDER, as the last line has it

  friend bool operator==(const PressureAdvance&, const PressureAdvance&) = default;
};

// G10 and G11.
struct FirmwareRetraction {
  bool retracted = false;
  double hop_mm = 0.0;     // how far G10 has lifted Z
  bool automatic = false;  // Marlin, M209: moves of E alone are firmware retraction
};

// The state a line is read in.
struct ModalState {
  Position position_mm{};  // machine position
  // Whether the axis' machine position is known from the text. E counts from the file's beginning.
  std::array<bool, 4> known{false, false, false, true};
  Position base_mm{};  // machine position of the G-code zero (G92, offsets, hop of G10)
  std::array<bool, 4> base_known{true, true, true, true};
  Position offset_mm{};                // SET_GCODE_OFFSET: the zero that homing restores
  bool absolute_xyz = true;            // G90 / G91; Marlin: also sets absolute_e
  bool absolute_e = true;              // M82 / M83
  bool g91_covers_e = true;            // Klipper: under G91, E is relative whatever M82 says
  double unit_mm = 1.0;                // 25.4 after G20
  double feed_mm_s = 25.0;             // modal F, before M220
  double speed_factor = 1.0;           // M220
  double kept_speed_factor = 1.0;      // Marlin, M220 B
  double flow_factor = 1.0;            // M221
  bool volumetric = false;             // M200: E is in mm³
  double filament_diameter_mm = 1.75;  // M200 D
  double e_unit = 1.0;                 // unit of E words: unit_mm, or its cube if Marlin reads mm³
  float e_reading_single = 0.0F;       // Marlin: the reading of E as the firmware has it
  int plane = 17;                      // G17, G18, G19
  FirmwareRetraction retraction;
  Shaper shaper;  // SET_INPUT_SHAPER, M593; unknown until the file sets it
  // A macro, a tool change or the like may have set the shaper after the text did.
  Axes<bool> shaper_touched{true, true};
  PressureAdvance pressure_advance;
  AxisValues steps_per_mm;    // M92, where the file sets it
  bool inverse_time = false;  // RepRapFirmware, G93: F is one over minutes

  // Whether an E word is a reading of the axis and not a difference.
  [[nodiscard]] bool e_is_absolute() const { return absolute_e && (absolute_xyz || !g91_covers_e); }
  // Filament per unit of E before unit and mode: M221 times, if E is a volume, one over the
  // filament's cross-section. mm/mm or mm/mm³.
  [[nodiscard]] double filament_factor() const;
  // Filament, in mm, that one unit of an E word stands for.
  [[nodiscard]] double filament_per_e_mm() const { return e_unit * filament_factor(); }
  // The reading of E in mm or mm³, whatever the unit of its words.
  [[nodiscard]] double e_reading() const {
    return (position_mm[E] - base_mm[E]) / filament_factor();
  }
};

// Reads lines in the order of the file and says what each means to the firmware:
//   Klipper  klippy/extras/gcode_move.py, gcode_arcs.py, firmware_retraction.py, toolhead.py;
//   Marlin 2.1.2  src/gcode: gcode.cpp, parser.cpp and the file of each command;
//   RepRapFirmware 3.5  src/GCodes: GCodes.cpp to GCodes7.cpp, GCodeBuffer/StringParser.cpp.
//
// Not modelled: soft end stops (M211, M208, M564: a target outside is clipped), bed levelling, tool
// offsets, cold extrusion, and 32 bit arithmetic except where it decides how many pieces an arc
// has.
class Interpreter {
 public:
  explicit Interpreter(InterpreterOptions options = {});

  // Never fails: a line that cannot be understood passes as a barrier with a warning.
  [[nodiscard]] Event interpret(Line line);
  // Interprets event.line and fills the event, whose storage is used again.
  void interpret(Event& event);

  // A travel whose start is only assumed (Segment::start_assumed) cannot be rewritten, and so the
  // nozzle would swing where extrusion begins. For such a travel this gives an approach: a line to
  // put before it that makes all of the way but the end. The end then starts at a known place. The
  // approach leads nowhere that the travel does not lead. Behind an object's label, a line that
  // draws from such a place gets an approach as well: it leads to that place, where the machine is
  // unless the object was cancelled. A line that draws right behind a move from an unknown place
  // gets a pause, in which the nozzle's swing dies away. nullopt for any other line.
  [[nodiscard]] std::optional<std::string> approach(const Line& line) const;

  [[nodiscard]] const ModalState& state() const { return state_; }
  // The options, with the changes that M207 and similar commands have made.
  [[nodiscard]] const InterpreterOptions& options() const { return options_; }

  // Each reads the line as one firmware does: entries of its table (FirmwareReader).
  void read_klipper(Event& event, std::string_view content);
  void read_marlin(Event& event, std::string_view content);
  void read_rrf(Event& event, std::string_view content);

 private:
  // One handler per command or family of commands; each reads command_ and fills the event.
  void klipper_traditional(Event& event);
  void klipper_g_code(Event& event);
  void klipper_m_code(Event& event);
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

  // Shared by the firmwares.
  void note_lost_motion(Event& event, const std::array<bool, 4>& known);
  void other_m_code(Event& event);
  void set_units(bool inches);
  void update_e_unit();
  void set_flow_factor(double factor);
  void set_volumetric(bool on, double filament_diameter_mm);
  void retraction_and_hop(Event& event, bool retract);
  void steps_per_mm(Event& event);
  void select_tool(Event& event, int tool);
  void lose_tool();
  void set_flow_of(std::optional<double> tool, double factor);
  void limits_unknown(Event& event);
  void uncertain_modes(Event& event, std::string_view cause);
  void note_shaper(Event& event);
  // Reads one limit; a value below `least` is left out with a warning.
  void limit(Event& event, char letter, double scale, double least, std::optional<double>& value);
  void axis_limits(Event& event, double scale, double least, AxisValues& values);

  void marlin_command(Event& event);
  void marlin_g_code(Event& event);
  void marlin_m_code(Event& event);
  void marlin_linear_move(Event& event);
  void marlin_acceleration(Event& event);
  void marlin_advanced_settings(Event& event);
  void marlin_speed_factor(Event& event);
  void marlin_flow_factor(Event& event);
  void marlin_volumetric(Event& event);
  void marlin_retraction_settings(Event& event);
  void marlin_shaper(Event& event);
  void marlin_pressure_advance(Event& event);
  void marlin_fixed_time_motion(Event& event);
  void marlin_dwell(Event& event);

  void read_rrf_line(Event& event, std::string_view content);
  bool rrf_meta_line(Event& event, std::string_view content);
  void rrf_conditional_line(Event& event, std::string_view content);
  void rrf_expression(Event& event);
  void rrf_command(Event& event);
  void rrf_as_meant(Event& event);
  void rrf_several_commands(Event& event);
  void rrf_g_code(Event& event);
  void rrf_m_code(Event& event);
  void rrf_setting(Event& event);
  void rrf_arc_move(Event& event);
  void rrf_linear_move(Event& event);
  void rrf_g10(Event& event);
  void rrf_plane(Event& event);
  void rrf_dwell(Event& event);
  void rrf_axis_acceleration(Event& event);
  void rrf_max_velocity(Event& event);
  void rrf_acceleration(Event& event);
  void rrf_jerk(Event& event, double scale);
  void rrf_speed_factor(Event& event);
  void rrf_flow_factor(Event& event);
  void rrf_volumetric();
  void rrf_retraction_settings(Event& event);
  void rrf_pressure_advance(Event& event);
  void rrf_shaper(Event& event);
  void rrf_wait_for_heater(Event& event);
  void rrf_message_box(Event& event);
  void rrf_push(Event& event);
  void rrf_pop();

  // False behind a line that may or may not have set a mode or F.
  [[nodiscard]] bool modes_certain() const { return !modes_uncertain_ && !feed_uncertain_; }
  // For a line that the printer may or may not carry out. Its effect is tried on a copy.
  void maybe(Event& event, void (Interpreter::*carry_out)(Event&), std::string_view cause);
  // Like maybe(), but there is always a warning.
  void doubtful_line(Event& event, void (Interpreter::*carry_out)(Event&),
                     std::string_view problem);
  void keep_reading_of_e(bool e_absolute, double before_mm);
  void set_feed(std::optional<double> feed_word);
  // How well a motion's start is known: Segment::start_known, Segment::start_assumed.
  struct Start {
    bool known = true;
    bool assumed = false;
  };
  // ModalState::known, as if no object had been cancelled and no unknown command moved anything.
  [[nodiscard]] std::array<bool, 4> known_or_assumed() const;
  [[nodiscard]] std::string go_where_assumed() const;
  [[nodiscard]] bool swings() const;
  [[nodiscard]] Start start_of_retraction() const;
  // Adds a straight segment to `target`, unless it has no length, and moves the state there.
  void append_segment(Event& event, const Position& target, double feed_mm_s, const Start& start,
                      double curve_radius_mm = 0.0);
  void lose_position(Event& event);
  // Loses the position after an unknown command. X and Y are assumed to be where they were.
  void doubt_position(Event& event);
  void not_understood(Event& event, std::string_view problem);

  InterpreterOptions options_;
  ModalState state_;
  std::map<std::string, ModalState, std::less<>> saved_states_;  // SAVE_GCODE_STATE, by name
  // Whether the last SET_PRESSURE_ADVANCE switched pressure advance on.
  std::optional<bool> pressure_advance_on_;
  std::vector<ModalState> pushed_states_;  // RepRapFirmware, M120
  std::optional<int> tool_;                // the tool in use, where the file selects it
  std::map<int, double> flow_factors_;     // M221 of the tools not in use
  // RepRapFirmware: the indentation of the outermost `if`, `while` or `else` whose block is open.
  std::optional<std::size_t> block_indent_;
  // Marlin: true behind the label of an object, until a line names Z. Marlin leaves out the motion
  // of a cancelled object along Z too and does not make up for it (gcode.cpp,
  // get_destination_from_command).
  bool z_left_out_ = false;
  // X and Y: whether labels and unknown commands are the only reasons for an unknown position.
  std::array<bool, 2> assumed_{};
  double swinging_s_ = 0.0;          // for how much longer an uncompensated nozzle swings
  bool modes_uncertain_ = false;     // a line that may or may not run has set a mode or a limit
  bool feed_uncertain_ = false;      // a line that may or may not run has set F
  bool told_of_retraction_ = false;  // Klipper: the file has a G10 or G11 that does nothing
  Command command_;                  // command of the line being read; kept for its storage
};

}  // namespace unflex::gcode
