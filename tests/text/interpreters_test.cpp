// Compares unflex's interpreter with the text machine, line by line. Both are written from the
// firmwares' sources, independently of each other.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <random>
#include <string>
#include <string_view>

#include "random_program.hpp"
#include "text_machine.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::testing {
namespace {

constexpr unsigned kPrograms = 2000;
constexpr unsigned kLines = 20000;
constexpr double kRetraction_mm = 0.8;
// Tolerance for single precision, for places some 1000 mm away in the file's own coordinates.
constexpr double kSingle_mm = 2e-3;

// Writes lines like those of careless people and programs, and worse.
class Scribbler {
 public:
  explicit Scribbler(unsigned seed) : random_(seed) {}

  std::string line() {
    std::string command = one_of(kCommands);
    command.insert(1, rarely(" ") + rarely("0"));
    std::string text = rarely("(a) ") + rarely(" ") + command;
    for (std::size_t words = pick(5); words > 0; --words) {
      text += (pick(4) == 0 ? "" : " ") + one_of(kLetters) + rarely(one_of(kLetters)) +
              rarely(" ") + one_of(kNumbers) + rarely(" (E5)") + rarely(" 5") + rarely("%");
    }
    if (pick(20) == 0) {
      std::ranges::transform(text, text.begin(),
                             [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    }
    return text + rarely(" ; X5");
  }

 private:
  static constexpr std::array<std::string_view, 18> kCommands = {
      "G0",  "G1",  "G1",  "G1",  "G1",  "G1",  "G20",  "G21",  "G90",
      "G91", "G92", "G92", "G92", "M82", "M83", "M220", "M221", "G28"};
  static constexpr std::array<std::string_view, 12> kLetters = {"X", "Y", "Z", "E", "E", "F",
                                                                "S", "X", "Y", "K", "P", "N"};
  static constexpr std::array<std::string_view, 12> kNumbers = {
      "1", "2.5", "-3", "+4", ".5", "006", "7.", "80", "120", "3000", "0", ""};

  std::size_t pick(std::size_t choices) {
    return std::uniform_int_distribution<std::size_t>(0, choices - 1)(random_);
  }
  template <std::size_t count>
  std::string one_of(const std::array<std::string_view, count>& choices) {
    return std::string(choices[pick(count)]);
  }
  std::string rarely(const std::string& text) { return pick(25) == 0 ? text : ""; }

  std::mt19937_64 random_;
};

class Interpreters : public ::testing::TestWithParam<Firmware> {
 protected:
  void read_both(std::string_view text) {
    for (std::size_t number = 1; !text.empty() && !HasFailure(); ++number) {
      const std::string line(take_line(text));
      SCOPED_TRACE(fmt::format("line {}: {}", number, line));
      static_cast<void>(interpreter_.interpret({line + "\n", number}));
      machine_.read(line);
      expect_same(interpreter_.state(), machine_.reading());
    }
  }

  // Reads a line with copies of both readers. False if nothing can be compared: the line causes a
  // warning, or may be a macro.
  bool read_alone(const std::string& line) {
    SCOPED_TRACE(line);
    gcode::Interpreter interpreter = interpreter_;
    TextMachine machine = machine_;
    const gcode::Event event = interpreter.interpret({line + "\n", 1});
    if (!event.warnings.empty() || event.position_lost) {
      return false;
    }
    machine.read(line);
    EXPECT_EQ(machine.refused(), 0U);
    EXPECT_TRUE(machine.not_followed().empty());
    expect_same(interpreter.state(), machine.reading());
    return true;
  }

  static gcode::InterpreterOptions options() {
    gcode::InterpreterOptions options = gcode::default_options(GetParam());
    options.firmware_retraction = true;
    options.retract_length_mm = kRetraction_mm;
    return options;
  }

  static TextMachine fresh_machine() { return {GetParam(), {kRetraction_mm, 0.0}}; }

  static void expect_same(const gcode::ModalState& state, const Reading& reading) {
    const double leeway_mm = GetParam() == Firmware::klipper ? 1e-9 : kSingle_mm;
    for (const gcode::Axis axis : {gcode::X, gcode::Y, gcode::Z}) {
      if (state.known[axis]) {
        EXPECT_NEAR(state.position_mm[axis], reading.position_mm[axis], leeway_mm) << axis;
        EXPECT_NEAR(state.base_mm[axis], reading.offset_mm[axis], leeway_mm) << axis;
      }
    }
    if (state.known[gcode::E]) {
      EXPECT_NEAR(state.position_mm[gcode::E], reading.filament_mm, leeway_mm);
      EXPECT_NEAR(state.e_reading(), reading.e_reading_mm, leeway_mm);
    }
    EXPECT_NEAR(state.feed_mm_s, reading.feed_mm_s, 1e-6 * reading.feed_mm_s);
    EXPECT_NEAR(state.speed_factor, reading.speed_factor, 1e-6);
    EXPECT_NEAR(state.flow_factor, reading.flow_factor, 1e-6);
    EXPECT_EQ(state.absolute_xyz, reading.absolute_xyz);
    EXPECT_EQ(state.e_is_absolute(), reading.absolute_e);
    EXPECT_EQ(state.unit_mm != 1.0, reading.inches);
    EXPECT_EQ(state.retraction.retracted, reading.retracted);
  }

  gcode::Interpreter interpreter_{options()};
  TextMachine machine_ = fresh_machine();
};

TEST_P(Interpreters, ReadProgramsAlike) {
  for (unsigned seed = 1; seed <= kPrograms && !HasFailure(); ++seed) {
    SCOPED_TRACE(fmt::format("seed {}", seed));
    interpreter_ = gcode::Interpreter(options());
    machine_ = fresh_machine();
    read_both(flow::testing::random_program(GetParam(), seed).text);
  }
}

TEST_P(Interpreters, ReadLinesAlikeHoweverTheyAreWritten) {
  read_both("G28\nG90\nM83\nG1 X10 Y20 Z1 E4 F600\nM82\n");
  Scribbler scribbler(1);
  unsigned read = 0;
  for (unsigned i = 0; i < kLines && !HasFailure(); ++i) {
    read += read_alone(scribbler.line()) ? 1 : 0;
  }
  EXPECT_GT(read, kLines / 20);
  EXPECT_LT(read, kLines);
}

INSTANTIATE_TEST_SUITE_P(Of, Interpreters,
                         ::testing::Values(Firmware::klipper, Firmware::marlin, Firmware::rrf),
                         [](const auto& tested) { return std::string(to_string(tested.param)); });

}  // namespace
}  // namespace unflex::testing
