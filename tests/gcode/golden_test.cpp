// Compares with the firmware's own moves for a program of moves and arcs in all modes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "interpreting.hpp"
#include "paths.hpp"

namespace unflex::gcode {
namespace {

const std::string kData = test_paths::kData;

// The program draws G0 to G3 in all planes, G10 G11, G90 to G92, M82 M83, M220 M221, offsets and
// saved states. The table is what Klipper's gcode_move.py, gcode_arcs.py and firmware_retraction.py
// handed to the tool head for it: one row per straight piece.
TEST(Interpreter, MovesAsKlipperDoes) {
  const auto expected = csv_rows(kData + "/gcode_klipper_program.moves.csv");
  ASSERT_EQ(expected.size(), 3089U);
  std::istringstream program(file_text(kData + "/gcode_klipper_program.gcode"));
  Interpreter interpreter;
  std::size_t row = 0;
  Line line;
  while (std::getline(program, line.text)) {
    ++line.number;
    const Event event = interpreter.interpret(line);
    // Random arcs end anywhere.
    EXPECT_THAT(event.warnings, ::testing::Each(::testing::HasSubstr("off its circle")))
        << line.number << ": " << line.text;
    EXPECT_FALSE(event.position_lost) << line.number << ": " << line.text;
    for (const Segment& segment : event.segments) {
      ASSERT_LT(row, expected.size());
      const std::vector<double>& want = expected[row++];
      ASSERT_EQ(segment.line, static_cast<std::size_t>(want[0])) << "row " << row;
      for (const Axis axis : {X, Y, Z, E}) {
        ASSERT_NEAR(segment.end_mm[axis], want[1 + axis], 1e-6) << line.text << ", row " << row;
      }
      ASSERT_NEAR(segment.feed_mm_s, want[5], 1e-5 * want[5]) << line.text << ", row " << row;
    }
  }
  EXPECT_EQ(row, expected.size());
}

// The head of a real print with arcs, and where Klipper started each of its moves.
TEST(Interpreter, CutsTheArcsOfARealPrintAsKlipperDoes) {
  const auto expected = csv_rows(kData + "/gcode_arcs_cut.starts.csv");
  ASSERT_EQ(expected.size(), 401U);
  std::istringstream print(file_text(kData + "/gcode_arcs_cut.gcode"));
  Interpreter interpreter;
  std::size_t row = 0;
  Line line;
  while (std::getline(print, line.text)) {
    const Event event = interpreter.interpret(line);
    for (const Segment& segment : event.segments) {
      if (segment.length_mm() > 0.0) {
        ASSERT_LT(row, expected.size());
        for (const Axis axis : {X, Y, Z}) {
          ASSERT_NEAR(segment.start_mm[axis], expected[row][axis], 1e-6) << line.text;
        }
        ++row;
      }
    }
  }
  EXPECT_EQ(row, expected.size());
}

TEST(Interpreter, ReadsEveryMannerOfWriting) {
  std::istringstream stream(file_text(kData + "/gcode_forms.gcode"));
  LineReader reader(stream, "forms");
  // Klipper knows no G01, Marlin no lower case.
  Interpreter interpreter(default_options(Firmware::rrf));
  std::vector<Position> ends;
  Line line;
  std::string text;
  while (*reader.next(line)) {
    text += line.text;
    const Event event = interpreter.interpret(line);
    EXPECT_TRUE(event.warnings.empty()) << line.text;
    EXPECT_TRUE(event.kind != EventKind::barrier || line.text.starts_with("M862")) << line.text;
    EXPECT_EQ(event.line.text, line.text);
    for (const Segment& segment : event.segments) {
      ends.push_back(segment.end_mm);
      EXPECT_DOUBLE_EQ(segment.feed_mm_s, 20.0);
    }
  }
  const std::vector<Position> expected = {
      {10, 10, 0, 0.5}, {20, 10, 0, 1}, {20, 20, 0, 1.5}, {10, 20, 0, 2}, {1.5, 2, 0, 3}};
  EXPECT_EQ(ends, expected);
  EXPECT_EQ(text, file_text(kData + "/gcode_forms.gcode"));
}

}  // namespace
}  // namespace unflex::gcode
