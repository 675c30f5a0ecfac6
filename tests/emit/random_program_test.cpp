// Random programs with every mode a file can change: every line outside of runs must find the
// printer in the state that the input would have.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "plain_emission.hpp"

namespace unflex::emit {
namespace {

using gcode::E;
using gcode::X;
using gcode::Y;
using gcode::Z;

// Writes a program of moves between 20 and 80 mm in whatever mode is in force.
class Writer {
 public:
  explicit Writer(unsigned seed) : random_(seed) { add("G28\nG90\nM83\nG1 X50 Y50 Z0.3 F3000\n"); }

  std::string program(int lines) {
    for (int i = 0; i < lines; ++i) {
      add(next());
    }
    return text_;
  }

 private:
  void add(const std::string& text) {
    for (const std::string& line : testing::lines_of(text)) {
      static_cast<void>(interpreter_.interpret({line, 0}));
    }
    text_ += text;
  }

  std::size_t pick(std::size_t choices) {
    return std::uniform_int_distribution<std::size_t>(0, choices - 1)(random_);
  }
  double number(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }

  // The word that brings the axis to a place.
  std::string word(gcode::Axis axis, double to_mm) {
    const gcode::ModalState& state = interpreter_.state();
    const bool absolute = state.absolute_xyz && (axis != E || state.absolute_e);
    const double from = absolute ? state.base_mm[axis] : state.position_mm[axis];
    const double scale = state.unit_mm * (axis == E ? state.flow_factor : 1.0);
    return fmt::format(" {}{:.5f}", "XYZE"[axis], (to_mm - from) / scale);
  }

  std::string speed() {
    return pick(3) == 0 ? fmt::format(" F{:.1f}", number(1200, 6000) / interpreter_.state().unit_mm)
                        : "";
  }

  std::string draw() {
    const gcode::Position& at = interpreter_.state().position_mm;
    const double x = number(20, 80);
    const double y = number(20, 80);
    const double share = pick(2) == 0 ? 1.0 : 0.05;
    const double to_x = at[X] + share * (x - at[X]);
    const double to_y = at[Y] + share * (y - at[Y]);
    const double filament = pick(4) == 0 ? 0.0 : 0.03 * std::hypot(to_x - at[X], to_y - at[Y]);
    return "G1" + word(X, to_x) + word(Y, to_y) +
           (filament > 0.0 ? word(E, at[E] + filament) : "") + speed() + "\n";
  }

  std::string next() {
    const gcode::ModalState& state = interpreter_.state();
    switch (pick(40)) {
      case 0:
        return pick(2) == 0 ? "G90\n" : "G91\n";
      case 1:
        return pick(2) == 0 ? "M82\n" : "M83\n";
      case 2:
        return pick(2) == 0 ? "G20\n" : "G21\n";
      case 3:
        return fmt::format("M221 S{}\n", 60 + pick(90));
      case 4:
        return fmt::format("M220 S{}\n", 60 + pick(90));
      case 5:
        return pick(2) == 0 ? "G92 E0\n" : fmt::format("G92 E{:.3f}\n", number(-3, 3));
      case 6:
        return fmt::format("G92 X{:.3f} Y{:.3f} Z0.1\n", number(-30, 30) / state.unit_mm,
                           number(-30, 30) / state.unit_mm);
      case 7:
        return fmt::format("M204 S{}\n", 500 + 100 * pick(40));
      case 8:
        return fmt::format("SET_VELOCITY_LIMIT VELOCITY={} ACCEL={}\n", 100 + pick(100),
                           500 + pick(4000));
      case 9:
        return fmt::format("SET_VELOCITY_LIMIT SQUARE_CORNER_VELOCITY={}\n", 1 + pick(9));
      case 10:
        return "M106 S" + std::to_string(pick(256)) + "\n";
      case 11:
        return "; a comment\n\n";
      case 12:
        return "G1" + word(E, state.position_mm[E] - 0.8) + "\n";
      case 13:
        return "G1" + word(E, state.position_mm[E] + 0.8) + "\n";
      case 14:
        return "G1" + word(Z, number(0.2, 5.0)) + "\n";
      case 15:
        return "G4 P20\n";
      case 16:
        return pick(5) == 0 ? "SOME_MACRO A=1\nG90\nM83\nG21\nG92 E0\nG1 X50 Y50 Z0.3 F3000\n"
                            : "M400\n";
      case 17:
        return "G1 F" + fmt::format("{:.2f}", number(1200, 6000) / state.unit_mm) + "\n";
      case 18:
        return pick(2) == 0 ? "G10\n" : "G11\n";
      default:
        return draw();
    }
  }

  std::mt19937_64 random_;
  gcode::Interpreter interpreter_;
  std::string text_;
};

void expect_same_limits(const planner::Limits& a, const planner::Limits& b) {
  EXPECT_EQ(a.max_velocity_mm_s, b.max_velocity_mm_s);
  EXPECT_EQ(a.max_accel_mm_s2, b.max_accel_mm_s2);
  EXPECT_EQ(a.square_corner_velocity_mm_s, b.square_corner_velocity_mm_s);
  EXPECT_EQ(a.minimum_cruise_ratio, b.minimum_cruise_ratio);
  EXPECT_EQ(a.accel_to_decel_mm_s2, b.accel_to_decel_mm_s2);
}

void expect_same_state(const gcode::ModalState& printer, const gcode::ModalState& input) {
  for (const gcode::Axis axis : {X, Y, Z}) {
    EXPECT_NEAR(printer.position_mm[axis], input.position_mm[axis], 0.6e-6) << axis;
    EXPECT_NEAR(printer.base_mm[axis], input.base_mm[axis], 0.6e-6) << axis;
  }
  EXPECT_NEAR(printer.position_mm[E], input.position_mm[E], 1e-5);
  EXPECT_NEAR(printer.base_mm[E], input.base_mm[E], 1e-5);
  EXPECT_EQ(printer.known, input.known);
  EXPECT_EQ(printer.base_known, input.base_known);
  EXPECT_EQ(printer.absolute_xyz, input.absolute_xyz);
  EXPECT_EQ(printer.absolute_e, input.absolute_e);
  EXPECT_EQ(printer.unit_mm, input.unit_mm);
  EXPECT_NEAR(printer.feed_mm_s, input.feed_mm_s, 1e-6);
  EXPECT_EQ(printer.speed_factor, input.speed_factor);
  EXPECT_EQ(printer.flow_factor, input.flow_factor);
  EXPECT_EQ(printer.retraction.retracted, input.retraction.retracted);
}

EmitOptions options() {
  EmitOptions options = testing::options();
  options.interpreter.retract_length_mm = 0.5;
  return options;
}

TEST(RandomProgram, FindsThePrinterOutsideRunsAsItWouldWithoutThem) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const std::string program = Writer(seed).program(400);
    const testing::Emission emission =
        testing::emit(program, options(), [&](const testing::Boundary& boundary) {
          SCOPED_TRACE(fmt::format("seed {}, line {}", seed, boundary.line));
          expect_same_state(boundary.emitter->printer().state(), *boundary.input);
          expect_same_limits(boundary.emitter->printer_limits(), *boundary.input_limits);
        });
    EXPECT_GT(emission.runs, 20U);
    if (HasFailure()) {
      return;
    }
  }
}

// The emitter's model of the printer must equal the state of a printer that reads the text.
TEST(RandomProgram, EndsAsItWouldWithoutRunsWhenTheTextIsRead) {
  for (unsigned seed = 101; seed <= 140; ++seed) {
    const std::string program = Writer(seed).program(300);
    const std::string text = testing::emit(program, options()).text;
    gcode::Interpreter input(options().interpreter);
    gcode::Interpreter printer(options().interpreter);
    planner::Limits input_limits;
    planner::Limits limits;
    for (const std::string& line : testing::lines_of(program)) {
      planner::apply(*input.interpret({line, 0}).limits, input_limits);
    }
    for (const std::string& line : testing::lines_of(text)) {
      const gcode::Event event = printer.interpret({line, 0});
      EXPECT_EQ(event.warnings.empty(), !line.starts_with("G20")) << line;
      planner::apply(*event.limits, limits);
    }
    SCOPED_TRACE(fmt::format("seed {}", seed));
    expect_same_state(printer.state(), input.state());
    expect_same_limits(limits, input_limits);
  }
}

TEST(RandomProgram, KeepsEveryLineThatIsNotRewritten) {
  for (unsigned seed = 201; seed <= 220; ++seed) {
    const std::string program = Writer(seed).program(300);
    const std::vector<std::string> out = testing::lines_of(testing::emit(program, options()).text);
    std::size_t next = 0;
    for (const std::string& line : testing::lines_of(program)) {
      if (line.starts_with("G1 X")) {
        continue;
      }
      while (next < out.size() && out[next] != line) {
        ++next;
      }
      ASSERT_LT(next, out.size()) << "lost: " << line << "seed " << seed;
      ++next;
    }
  }
}

}  // namespace
}  // namespace unflex::emit
