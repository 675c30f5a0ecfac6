// What a printer does with G-code, read from the text alone. This interpreter is written from the
// firmwares' own sources (Klipper, Marlin 2.1.2, RepRapFirmware 3.5) and shares nothing with
// unflex's. Tests compare a sliced print with its emitted text by it.
//
// Assumptions: the printer homes at 0; it has one tool, which is selected and hot; it has no limits
// of travel; all commands are compiled in (Marlin: INCH_MODE_SUPPORT, ARC_SUPPORT, FWRETRACT, input
// shaping, CLASSIC_JERK beside junction deviation). Klipper and RepRapFirmware refuse a move before
// homing. Here it is carried out from 0, because a macro that is not followed may have homed.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "text_line.hpp"

namespace unflex::testing {

// The state of a printer after some lines.
struct Reading {
  std::array<double, 3> position_mm{};  // machine coordinates, which G92 does not change
  std::array<bool, 3> known{};          // homed, and motors not off since
  std::array<double, 3> offset_mm{};    // where X0 Y0 Z0 is in the machine's coordinates
  double filament_mm = 0.0;   // pushed less pulled back, after flow factors, with G10 and G11
  double e_reading_mm = 0.0;  // what an absolute E word is counted from, in mm
  double feed_mm_s = 0.0;     // for the next line without F, before the speed factor
  double speed_factor = 1.0;
  double flow_factor = 1.0;
  bool absolute_xyz = true;
  bool absolute_e = true;  // how the next E word is read
  bool inches = false;
  bool retracted = false;  // by G10
  // The limits and shapers that lines have set, in mm and s whatever the units of the lines.
  // Klipper: "velocity", "accel", "square corner velocity", "minimum cruise ratio",
  //   "shaper X freq", "shaper X damping", "shaper X type".
  // Marlin: "M201 X", "M203 X", "M204 P" R T, "M205 X" J S T B, "shaper X freq" damping.
  // RepRapFirmware: "M201 X", "M203 X", "M204 P" T, "M566 X" (of M205 too), "shaper freq"
  //   damping type. A shaper's type is a number, 0 for none.
  std::map<std::string, double> limits;
};

// The number that stands for a shaper's type in limits.
[[nodiscard]] double shaper_type(const std::string& name);

class TextMachine {
 public:
  struct Retraction {
    double length_mm = 0.0;  // pulled back by G10
    double extra_mm = 0.0;   // pushed by G11 beyond length_mm
  };

  TextMachine(Firmware firmware, Retraction retraction);

  // Reads a line, given without its ending.
  void read(std::string_view text);

  [[nodiscard]] const Reading& reading() const { return reading_; }
  // The ends of the last line's moves in machine coordinates: one for a straight line, many along
  // an arc, none if X, Y and Z rest. Homing is no move.
  [[nodiscard]] const std::vector<std::array<double, 3>>& path() const { return path_; }
  // Whether the last move may still be in the buffer in front of RepRapFirmware's queue of moves
  // (GCodes.cpp, ReadMove). Limits that are set meanwhile hold for this move already. The next move
  // waits until the buffer is empty.
  [[nodiscard]] bool move_waits() const { return move_waits_; }
  // Commands that this machine does not know. The reading may be wrong after them.
  [[nodiscard]] const std::set<std::string>& not_followed() const { return not_followed_; }
  // The number of lines that the firmware answers with an error.
  [[nodiscard]] std::size_t refused() const { return refused_; }

 private:
  using Coordinates = std::array<double, 4>;  // X, Y, Z, E
  struct Goal {
    Coordinates at;
    double filament_mm;
  };
  struct Saved {
    Reading reading;
    bool absolute_e_words;
    Coordinates at, base, homing;
  };

  void carry_out();
  [[nodiscard]] bool is_special() const;

  [[nodiscard]] bool is(Firmware firmware) const { return firmware_ == firmware; }
  [[nodiscard]] bool is(std::string_view command) const { return line_.command() == command; }
  [[nodiscard]] bool has(std::string_view word) const { return line_.has(word); }
  [[nodiscard]] bool has_any_of(std::string_view letters) const {
    return line_.has_any_of(letters);
  }
  [[nodiscard]] auto number(std::string_view word) const { return line_.number(word); }
  [[nodiscard]] std::optional<double> length_mm(std::string_view word) const;
  [[nodiscard]] double in_mm(double value) const;
  [[nodiscard]] double kept(double value) const { return testing::kept(firmware_, value); }

  [[nodiscard]] Goal goal() const;
  void take_feed();
  void go_to(const Goal& goal);
  void update();
  void note_waiting(const Reading& before);

  void straight();
  void arc();
  void retract(bool back, double length_mm);
  void home();
  void motors_off();
  void set_relative(bool relative);
  void use_inches();
  void klipper_g92();
  void marlin_g92();
  void rrf_g92();
  [[nodiscard]] double percentage(double current) const;
  void set_flow();
  void save_state();
  void restore_state();
  void set_gcode_offset();
  void set_klipper_accel();
  void set_klipper_limits();
  void set_limits();
  void set_marlin_shaper();
  void set_rrf_shaper();

  Firmware firmware_;
  Retraction retraction_;
  Reading reading_;
  std::vector<std::array<double, 3>> path_;
  bool move_waits_ = false;
  std::set<std::string> not_followed_;
  std::size_t refused_ = 0;

  TextLine line_;  // the last line

  // The firmware's own coordinates: Klipper's last_position, Marlin's current_position,
  // RepRapFirmware's currentUserPosition and latestVirtualExtruderPosition.
  Coordinates at_{};
  // Added to an absolute word: Klipper's base_position, or Marlin's workspace_offset negated.
  Coordinates base_{};
  Coordinates homing_{};  // Klipper's homing_position
  // Offset from the firmware's coordinates to the machine's. RepRapFirmware's G92 moves the former.
  std::array<double, 3> shift_mm_{};
  bool absolute_e_words_ = true;  // M82 or M83
  std::map<std::string, Saved> saved_;
};

}  // namespace unflex::testing
