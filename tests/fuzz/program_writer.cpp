#include "program_writer.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace unflex::fuzz {
namespace {

using gcode::E;
using gcode::X;
using gcode::Y;
using gcode::Z;

constexpr double kLow_mm = 20.0;
constexpr double kHigh_mm = 80.0;
constexpr std::size_t kMostLines = 60;
// Approximate time for gaining speed and losing it.
constexpr double kRamps_s = 0.02;
// For 1.75 mm filament and a line of 0.4 by 0.2 mm.
constexpr double kFilamentPerMm = 0.033;

}  // namespace

ProgramWriter::ProgramWriter(const gcode::InterpreterOptions& options, double duration_s)
    : firmware_(options.firmware), interpreter_(options), left_s_(duration_s) {
  add("G28\nG90\nM83\nG1 X50 Y50 Z0.3 F6000\n");
}

std::string ProgramWriter::program(Bytes source) {
  for (std::size_t line = 0; line < kMostLines && !source.empty() && left_s_ > 0.0; ++line) {
    add(next(source));
  }
  return text_;
}

void ProgramWriter::add(const std::string& text) {
  Bytes lines(text);
  while (!lines.empty()) {
    const gcode::Event event = interpreter_.interpret({std::string(lines.line()) + "\n", 0});
    for (const gcode::Segment& segment : event.segments) {
      left_s_ -= segment.start_known ? segment.length_xy_mm() / segment.feed_mm_s : 0.0;
    }
    left_s_ -= event.kind == gcode::EventKind::move ? kRamps_s : 0.0;
  }
  text_ += text;
}

std::string ProgramWriter::next(Bytes& source) {
  const gcode::Position& at = interpreter_.state().position_mm;
  switch (source.byte() % 24) {
    case 0:
      return mode(source);
    case 1:
      return limits(source);
    case 2:
      return stop(source);
    case 3:
      return "G1" + word(E, at[E] - 0.8) + "\n";
    case 4:
      return "G1" + word(E, at[E] + 0.8) + "\n";
    case 5:
      return "G1" + word(Z, source.number(0.2, 3.0)) + "\n";
    case 6:
      return fmt::format("M106 S{}\n", source.byte());
    case 7:
      return source.byte() % 2 == 0 ? ";TYPE:External perimeter\n" : "\n";
    case 8:
      return "G1" + speed(source) + "\n";
    case 9:
      // An arbitrary line; it stands between known ones.
      return std::string(source.line()) + "\n";
    case 10:
    case 11:
      return arc(source);
    case 12:
    case 13:
      return draw(source, 4.0, 20.0);
    case 14:
      return draw(source, 0.0, 0.02);
    default:
      return draw(source, 0.1, 4.0);
  }
}

// A straight move that turns by a usual angle.
std::string ProgramWriter::draw(Bytes& source, double least_mm, double most_mm) {
  const gcode::Position& at = interpreter_.state().position_mm;
  const double length = source.number(least_mm, most_mm);
  const std::size_t turn = source.byte();
  heading_ += turn % 2 == 0 ? std::numbers::pi / 8.0 * static_cast<double>(turn / 16)
                            : 0.002 * (static_cast<double>(turn) - 128.0);
  const double to_x = std::clamp(at[X] + length * std::cos(heading_), kLow_mm, kHigh_mm);
  const double to_y = std::clamp(at[Y] + length * std::sin(heading_), kLow_mm, kHigh_mm);
  return "G1" + word(X, to_x) + word(Y, to_y) +
         filament(source, std::hypot(to_x - at[X], to_y - at[Y])) + speed(source) + "\n";
}

// An arc around a centre to the left or right.
std::string ProgramWriter::arc(Bytes& source) {
  const gcode::ModalState& state = interpreter_.state();
  const gcode::Position& at = state.position_mm;
  const double radius = source.number(0.2, 4.0);
  const double begin = source.number(0.0, 2.0 * std::numbers::pi);
  const double angle = source.number(0.05, 2.0 * std::numbers::pi);
  const bool clockwise = source.byte() % 2 == 0;
  const double centre_x = at[X] + radius * std::cos(begin);
  const double centre_y = at[Y] + radius * std::sin(begin);
  const double end = begin + std::numbers::pi + (clockwise ? -angle : angle);
  return (clockwise ? "G2" : "G3") + word(X, centre_x + radius * std::cos(end)) +
         word(Y, centre_y + radius * std::sin(end)) +
         fmt::format(" I{:.5f} J{:.5f}", (centre_x - at[X]) / state.unit_mm,
                     (centre_y - at[Y]) / state.unit_mm) +
         filament(source, radius * angle) + speed(source) + "\n";
}

std::string ProgramWriter::mode(Bytes& source) {
  constexpr std::array<const char*, 9> kModes = {"G90\n",    "G91\n",       "M82\n",
                                                 "M83\n",    "G20\n",       "G21\n",
                                                 "G92 E0\n", "G92 E-2.5\n", "G92 X40 Y60\n"};
  const std::size_t which = source.byte() % (kModes.size() + 2);
  if (which < kModes.size()) {
    return kModes[which];
  }
  return fmt::format("M{} S{}\n", which == kModes.size() ? 220 : 221, 60 + source.byte() % 90);
}

std::string ProgramWriter::limits(Bytes& source) const {
  const std::size_t which = source.byte();
  const int value = static_cast<int>(source.byte());
  if (firmware_ == Firmware::klipper) {
    constexpr std::array<const char*, 3> kNames = {"ACCEL", "VELOCITY", "SQUARE_CORNER_VELOCITY"};
    const std::array<int, 3> values = {300 + 30 * value, 20 + value, value % 12};
    const std::size_t i = which % kNames.size();
    return fmt::format("SET_VELOCITY_LIMIT {}={}\n", kNames[i], values[i]);
  }
  switch (which % 4) {
    case 0:
      return fmt::format("M204 P{} T{}\n", 300 + 30 * value, 500 + 30 * value);
    case 1:
      return fmt::format("M201 X{} Y{}\n", 300 + 30 * value, 400 + 30 * value);
    case 2:
      return firmware_ == Firmware::marlin ? fmt::format("M203 X{} Y{}\n", 30 + value, 30 + value)
                                           : fmt::format("M203 X{0} Y{0}\n", 1800 + 60 * value);
    default:
      return firmware_ == Firmware::marlin ? fmt::format("M205 X{0} Y{0}\n", 1 + value % 12)
                                           : fmt::format("M566 X{0} Y{0}\n", 60 + 10 * value);
  }
}

std::string ProgramWriter::stop(Bytes& source) {
  constexpr std::array<const char*, 6> kStops = {
      "M400\n",
      "G4 P20\n",
      "G10\n",
      "G11\n",
      "T0\nG90\nG21\nM83\nG92 E0\nG1 X50 Y50 Z0.3 F6000\n",
      "SOME_MACRO A=1\nG90\nG21\nM83\nG92 E0\nG1 X50 Y50 Z0.3 F6000\n"};
  return kStops[source.byte() % kStops.size()];
}

// The word that moves the axis to a place.
std::string ProgramWriter::word(gcode::Axis axis, double to_mm) const {
  const gcode::ModalState& state = interpreter_.state();
  const bool absolute = axis == E ? state.e_is_absolute() : state.absolute_xyz;
  const double from = absolute ? state.base_mm[axis] : state.position_mm[axis];
  const double scale = axis == E ? state.filament_per_e_mm() : state.unit_mm;
  return fmt::format(" {}{:.5f}", "XYZE"[axis], (to_mm - from) / scale);
}

std::string ProgramWriter::filament(Bytes& source, double length_mm) const {
  const std::size_t kind = source.byte() % 8;
  const double share = kind == 0 ? 0.0 : kind == 1 ? -1.0 : kind == 2 ? 2.0 : 1.0;
  const double from = interpreter_.state().position_mm[E];
  return share == 0.0 ? "" : word(E, from + share * kFilamentPerMm * length_mm);
}

std::string ProgramWriter::speed(Bytes& source) const {
  const std::size_t value = source.byte();
  return value % 3 == 0 ? fmt::format(" F{:.1f}", (1200.0 + 60.0 * static_cast<double>(value)) /
                                                      interpreter_.state().unit_mm)
                        : "";
}

}  // namespace unflex::fuzz
