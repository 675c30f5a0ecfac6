// Whole prints as Marlin and RepRapFirmware read them: nothing lost, nothing remarked upon.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>

#include "container/packed.hpp"
#include "interpreting.hpp"
#include "unflex/gcode/compensable.hpp"
#include "whole_prints.hpp"

namespace unflex::gcode {
namespace {

struct Print {
  const char* name;
  Firmware firmware;
  std::size_t moves;        // lines that move something
  std::size_t compensable;  // moves that may be rewritten
  std::size_t limits;       // lines that change limits
  double filament_mm;
};

void PrintTo(const Print& print, std::ostream* out) { *out << print.name; }

void expect_read(const std::string& bytes, const Print& print) {
  std::istringstream stream(bytes);
  LineReader reader(stream, print.name);
  Interpreter interpreter(default_options(print.firmware));
  std::size_t moves = 0;
  std::size_t rewritable = 0;
  std::size_t limits = 0;
  double filament_mm = 0.0;
  Position last{};
  Line line;
  while (*reader.next(line)) {
    const Event event = interpreter.interpret(line);
    EXPECT_THAT(event.warnings, ::testing::IsEmpty()) << line.text;
    moves += event.kind == EventKind::move ? 1 : 0;
    limits += event.kind == EventKind::limits ? 1 : 0;
    rewritable += compensable(event, print.firmware) ? 1 : 0;
    for (const Segment& segment : event.segments) {
      ASSERT_EQ(segment.start_mm, last) << line.number;
      last = segment.end_mm;
      filament_mm += segment.delta(E);
    }
  }
  EXPECT_EQ(moves, print.moves);
  EXPECT_EQ(rewritable, print.compensable);
  EXPECT_EQ(limits, print.limits);
  EXPECT_NEAR(filament_mm, print.filament_mm, 0.01);
}

class CutDialectPrint : public ::testing::TestWithParam<Print> {};

TEST_P(CutDialectPrint, IsReadWithoutRemarks) {
  expect_read(container::ten_layers(GetParam().name), GetParam());
}

INSTANTIATE_TEST_SUITE_P(
    Samples, CutDialectPrint,
    ::testing::Values(Print{"bracket", Firmware::marlin, 16149, 15542, 259, 1112.692},
                      Print{"cube", Firmware::marlin, 1618, 1525, 1, 228.7026},
                      Print{"textplate", Firmware::marlin, 21363, 20782, 12014, 1941.849},
                      Print{"wallring", Firmware::marlin, 3602, 3173, 173, 1581.619}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

class DialectPrint : public ::testing::TestWithParam<Print> {};

TEST_P(DialectPrint, IsReadWithoutRemarks) {
  const std::filesystem::path path = unflex::testing::whole_print(GetParam().name);
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "UNFLEX_SAMPLES names no folder with it: " << path;
  }
  expect_read(file_text(path), GetParam());
}

INSTANTIATE_TEST_SUITE_P(
    Samples, DialectPrint,
    ::testing::Values(Print{"bracket_mk3s_whole", Firmware::marlin, 100215, 94010, 1709, 5233.06},
                      Print{"cube20_ender3_absE", Firmware::marlin, 17952, 16729, 9, 1519.48},
                      Print{"dome_snap_dense", Firmware::marlin, 27648, 27226, 0, 422.968},
                      Print{"pins_slic3r_zhop", Firmware::marlin, 18756, 17953, 2825, 240.988},
                      Print{"textplate_cura", Firmware::marlin, 44062, 43025, 17614, 2149.54},
                      Print{"wallring_mini_marlin2", Firmware::marlin, 31692, 25559, 2489, 4053.19},
                      Print{"vase_rrf_spiral", Firmware::rrf, 33207, 33173, 438, 900.979}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

}  // namespace
}  // namespace unflex::gcode
