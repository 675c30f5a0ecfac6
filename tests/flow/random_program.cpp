#include "random_program.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

namespace unflex::flow::testing {
namespace {

using gcode::E;
using gcode::X;
using gcode::Y;
using gcode::Z;

constexpr double kBed_mm = 200.0;
constexpr double kMargin_mm = 10.0;
constexpr double kFilamentPerMm = 0.04;
constexpr double kLongestMove_s = 0.25;

// An interpreter follows the lines, so that the writer knows what a word means at its place.
class Writer {
 public:
  Writer(Firmware firmware, unsigned seed) : firmware_(firmware), random_(seed) {
    choose_printer();
    interpreter_ = gcode::Interpreter(options());
  }

  RandomProgram program() {
    add("G28\nG21\nG90\nM83\nG1 X100 Y100 Z0.2 F6000\n");
    const std::size_t lines = 8 + pick(22);
    for (std::size_t i = 0; i < lines; ++i) {
      add(next());
    }
    if (pick(2) == 0) {
      add("M104 S0\nM84\n");
    }
    return {std::move(overrides_), std::move(text_)};
  }

 private:
  std::size_t pick(std::size_t choices) {
    return std::uniform_int_distribution<std::size_t>(0, choices - 1)(random_);
  }
  double number(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }
  // A logarithmic distribution: values from 1 to 10 are as likely as from 10 to 100.
  double magnitude(double from, double to) {
    return std::exp(number(std::log(from), std::log(to)));
  }
  template <std::size_t count>
  std::string one_of(const std::array<std::string_view, count>& choices) {
    return std::string(choices[pick(count)]);
  }

  [[nodiscard]] bool is_klipper() const { return firmware_ == Firmware::klipper; }
  [[nodiscard]] bool is_rrf() const { return firmware_ == Firmware::rrf; }

  void set(const std::string& key, double value) {
    overrides_.push_back(fmt::format("{}={:.4g}", key, value));
  }

  void choose_printer() {
    overrides_ = {fmt::format("printer.firmware={}", to_string(firmware_))};
    overrides_.emplace_back("printer.firmware_retraction=true");
    set("printer.retract_length_mm", 0.8);
    if (pick(2) == 0) {
      overrides_.emplace_back("printer.travel_x_mm=[0, 200]");
      overrides_.emplace_back("printer.travel_y_mm=[0, 200]");
    }
    if (pick(2) == 0) {
      set("dynamics.x.freq_hz", number(25, 90));
      set("dynamics.y.freq_hz", number(25, 90));
      set("dynamics.x.damping_ratio", number(0.02, 0.15));
      set("dynamics.y.damping_ratio", number(0.02, 0.15));
    }
    if (pick(3) == 0) {
      set("printer.input_shaper_freq_x_hz", 48.0);
      set("printer.input_shaper_freq_y_hz", is_rrf() ? 48.0 : 39.0);
    }
  }

  [[nodiscard]] gcode::InterpreterOptions options() const {
    gcode::InterpreterOptions options = gcode::default_options(firmware_);
    options.firmware_retraction = true;
    options.retract_length_mm = 0.8;
    return options;
  }

  void add(const std::string& text) {
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = text.find('\n', begin) + 1;
      static_cast<void>(interpreter_.interpret({text.substr(begin, end - begin), 0}));
      begin = end;
    }
    text_ += text;
  }

  [[nodiscard]] const gcode::ModalState& state() const { return interpreter_.state(); }

  // The word that brings the axis to a place.
  std::string word(gcode::Axis axis, double to_mm) {
    const bool absolute = axis == E ? state().e_is_absolute() : state().absolute_xyz;
    const double from = absolute ? state().base_mm[axis] : state().position_mm[axis];
    const double scale = axis == E ? state().filament_per_e_mm() : state().unit_mm;
    return fmt::format(" {}{:.{}f}", "XYZE"[axis], (to_mm - from) / scale, axis == E ? 5 : 3);
  }

  std::string speed_word(double speed_mm_s) {
    speed_mm_s_ = speed_mm_s;
    return fmt::format(" F{:.1f}", speed_mm_s * 60.0 / state().unit_mm);
  }
  std::string maybe_speed() { return pick(3) == 0 ? speed_word(magnitude(1, 500)) : ""; }

  struct Place {
    double x_mm;
    double y_mm;
  };
  // A place on the bed, near enough for a slow line not to take too long.
  Place place(double distance_mm) {
    const double angle = number(0.0, 2.0 * std::numbers::pi);
    const auto inside = [](double at) { return std::clamp(at, kMargin_mm, kBed_mm - kMargin_mm); };
    return {inside(state().position_mm[X] + distance_mm * std::cos(angle)),
            inside(state().position_mm[Y] + distance_mm * std::sin(angle))};
  }
  double distance() {
    const double longest = std::clamp(speed_mm_s_ * kLongestMove_s, 0.05, 80.0);
    return std::min(longest, magnitude(0.01, 80.0));
  }
  double away_mm(const Place& to) {
    return std::hypot(to.x_mm - state().position_mm[X], to.y_mm - state().position_mm[Y]);
  }

  std::string move(double filament_per_mm) {
    const std::string speed = maybe_speed();
    const Place to = place(distance());
    const double filament = filament_per_mm * away_mm(to);
    return (pick(8) == 0 ? "G0" : "G1") + word(X, to.x_mm) + word(Y, to.y_mm) +
           (filament != 0.0 ? word(E, state().position_mm[E] + filament) : "") + speed + "\n";
  }

  // Short lines along a curve, as a slicer with a fine resolution writes.
  std::string curve() {
    std::string text;
    const std::size_t lines = 4 + pick(20);
    const double length = magnitude(0.02, 0.8);
    const double turn = number(-0.3, 0.3);
    double angle = number(0.0, 2.0 * std::numbers::pi);
    for (std::size_t i = 0; i < lines; ++i) {
      angle += turn;
      const double x = state().position_mm[X] + length * std::cos(angle);
      const double y = state().position_mm[Y] + length * std::sin(angle);
      add("G1" + word(X, std::clamp(x, kMargin_mm, kBed_mm - kMargin_mm)) +
          word(Y, std::clamp(y, kMargin_mm, kBed_mm - kMargin_mm)) +
          word(E, state().position_mm[E] + kFilamentPerMm * length) + "\n");
    }
    return text;
  }

  // A wall with corners that returns to its start.
  std::string wall() {
    const double side = std::min(distance(), 20.0);
    const double x = std::min(state().position_mm[X], kBed_mm - kMargin_mm - side);
    const double y = std::min(state().position_mm[Y], kBed_mm - kMargin_mm - side);
    for (const Place& corner : {Place{x, y}, Place{x + side, y}, Place{x + side, y + side},
                                Place{x, y + side}, Place{x, y}}) {
      add("G1" + word(X, corner.x_mm) + word(Y, corner.y_mm) +
          word(E, state().position_mm[E] + kFilamentPerMm * away_mm(corner)) + "\n");
    }
    return "";
  }

  std::string arc() {
    if (is_klipper() && !state().absolute_xyz) {
      return move(kFilamentPerMm);
    }
    const double radius = std::clamp(distance(), 0.3, 8.0);
    const double from = number(0.0, 2.0 * std::numbers::pi);
    const double sweep = number(0.3, 6.0);
    const bool clockwise = pick(2) == 0;
    const double to = from + (clockwise ? -sweep : sweep);
    const double i = -radius * std::cos(from);
    const double j = -radius * std::sin(from);
    const double x = state().position_mm[X] + i + radius * std::cos(to);
    const double y = state().position_mm[Y] + j + radius * std::sin(to);
    const double filament = kFilamentPerMm * radius * sweep;
    return (clockwise ? "G2" : "G3") + word(X, x) + word(Y, y) +
           fmt::format(" I{:.4f} J{:.4f}", i / state().unit_mm, j / state().unit_mm) +
           word(E, state().position_mm[E] + filament) + "\n";
  }

  std::string retraction() {
    if (pick(2) == 0) {
      return state().retraction.retracted ? "G11\n" : "G10\n";
    }
    const double length = 0.8;
    add("G1" + word(E, state().position_mm[E] - length) + speed_word(35.0) + "\n");
    add(pick(2) == 0 ? "G1" + word(Z, state().position_mm[Z] + 0.4) + "\n" : "");
    add(speed_word_line());
    add(move(0.0));
    add("G1" + word(E, state().position_mm[E] + length) + speed_word(35.0) + "\n");
    return speed_word_line();
  }
  std::string speed_word_line() { return "G1" + speed_word(magnitude(5, 500)) + "\n"; }

  std::string wipe() {
    std::string text = ";WIPE_START\n" + move(-0.1);
    return text + ";WIPE_END\n";
  }

  std::string modes() {
    switch (pick(is_klipper() ? 4 : 5)) {
      case 0:
        return "G91\n";
      case 1:
        return "G90\n";
      case 2:
        return "M82\n";
      case 3:
        return "M83\n";
      default:
        return state().unit_mm == 1.0 ? "G20\n" : "G21\n";
    }
  }

  std::string limits() {
    const double unit = state().unit_mm;
    switch (pick(5)) {
      case 0:
        return is_klipper() ? fmt::format("M204 S{}\n", 500 + 250 * pick(30))
                            : fmt::format("M204 P{:.1f} T{:.1f}\n", number(500, 8000) / unit,
                                          number(500, 8000) / unit);
      case 1:
        return is_klipper() ? fmt::format("SET_VELOCITY_LIMIT ACCEL={} VELOCITY={}\n",
                                          500 + 250 * pick(30), 50 + 10 * pick(45))
                            : fmt::format("M201 X{:.1f} Y{:.1f}\n", number(500, 8000) / unit,
                                          number(500, 8000) / unit);
      case 2:
        return is_klipper() ? fmt::format("SET_VELOCITY_LIMIT SQUARE_CORNER_VELOCITY={:.2f}\n",
                                          number(0.5, 12.0))
               : is_rrf()   ? fmt::format("M566 X{:.0f} Y{:.0f}\n", number(60, 900) / unit,
                                          number(60, 900) / unit)
                            : fmt::format("M205 X{:.2f} Y{:.2f}\n", number(1, 15) / unit,
                                          number(1, 15) / unit);
      case 3:
        return fmt::format("M220 S{}\n", 60 + pick(90));
      default:
        return fmt::format("M221 S{}\n", 80 + pick(40));
    }
  }

  std::string label() {
    const std::string name = fmt::format("part_{}", pick(3));
    if (is_klipper()) {
      return (pick(2) == 0 ? "EXCLUDE_OBJECT_START NAME=" : "EXCLUDE_OBJECT_END NAME=") + name +
             "\n";
    }
    return fmt::format("M486 S{}\n", static_cast<int>(pick(4)) - 1);
  }

  std::string no_motion() {
    constexpr std::array<std::string_view, 12> kLines = {
        "M106 S128\n",         "M107\n",       "M104 S210\n",       "M105\n",
        "M73 P12 R34\n",       "\n",           ";TYPE:Perimeter\n", "; a (comment) with *stars\n",
        "M117 layer 1 of 2\n", "M106 S77.5\n", "M140 S60\n",        "   ; indented\n"};
    return one_of(kLines);
  }

  std::string next() {
    switch (pick(32)) {
      case 0:
      case 1:
        return modes();
      case 2:
      case 3:
        return limits();
      case 4:
      case 5:
      case 6:
        return no_motion();
      case 7:
      case 8:
        return retraction();
      case 9:
        return wipe();
      case 10:
      case 11:
        return arc();
      case 12:
      case 13:
        return curve();
      case 14:
      case 15:
        return wall();
      case 16:
        return fmt::format("G92 E{:.3f}\n", number(-3, 3));
      case 17:
        return pick(3) == 0 ? fmt::format("G92 X{:.3f}\n", number(-3, 3)) : "G92 E0\n";
      case 18:
        return pick(2) == 0 ? "G4 P30\n" : "M400\n";
      case 19:
        return "G1" + word(Z, number(0.2, 3.0)) + "\n";
      case 20:
        return label();
      case 21:
        return speed_word_line();
      case 22:
      case 23:
      case 24:
        return move(0.0);
      default:
        return move(kFilamentPerMm);
    }
  }

  Firmware firmware_;
  std::mt19937_64 random_;
  gcode::Interpreter interpreter_;
  std::vector<std::string> overrides_;
  std::string text_;
  double speed_mm_s_ = 100.0;
};

}  // namespace

RandomProgram random_program(Firmware firmware, unsigned seed) {
  return Writer(firmware, seed).program();
}

}  // namespace unflex::flow::testing
