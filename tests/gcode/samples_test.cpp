// Cuts of five prints of three slicers against counts of another program, and ten whole prints
// against those that Klipper reports.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>

#include "container/packed.hpp"
#include "interpreting.hpp"
#include "whole_prints.hpp"

namespace unflex::gcode {
namespace {

struct Sample {
  const char* name;
  std::size_t lines;
  std::size_t moves_xyz;  // segments that move X, Y or Z
  std::size_t moves_e;    // segments that move filament
  std::size_t arcs;
};

void PrintTo(const Sample& sample, std::ostream* out) { *out << sample.name; }

void expect_read(const std::string& bytes, const Sample& sample) {
  std::istringstream stream(bytes);
  LineReader reader(stream, sample.name);
  // Klipper without a [firmware_retraction] section, as where the counts were taken.
  Interpreter interpreter(InterpreterOptions{.firmware_retraction = false});
  std::string joined;
  std::size_t lines = 0;
  std::size_t moves_xyz = 0;
  std::size_t moves_e = 0;
  std::size_t arcs = 0;
  Position last{};
  Line line;
  while (*reader.next(line)) {
    ++lines;
    const Event event = interpreter.interpret(line);
    joined += event.line.text;
    EXPECT_EQ(event.line.number, lines);
    // Some prints have G10 and G11, which retract nothing without that section.
    EXPECT_THAT(event.warnings, ::testing::Each(::testing::HasSubstr("[firmware_retraction]")))
        << line.text;
    const Command command = parse(line.content());
    arcs += command.is('G', 2) || command.is('G', 3) ? 1 : 0;
    for (const Segment& segment : event.segments) {
      ASSERT_EQ(segment.start_mm, last) << line.number;
      last = segment.end_mm;
      moves_xyz += segment.length_mm() > 0.0 ? 1 : 0;
      moves_e += segment.delta(E) != 0.0 ? 1 : 0;
    }
  }
  EXPECT_EQ(lines, sample.lines);
  EXPECT_TRUE(joined == bytes) << "bytes were lost or changed";
  EXPECT_EQ(reader.bytes_read(), bytes.size());
  EXPECT_EQ(moves_xyz, sample.moves_xyz);
  EXPECT_EQ(moves_e, sample.moves_e);
  EXPECT_EQ(arcs, sample.arcs);
}

class CutPrint : public ::testing::TestWithParam<Sample> {};

TEST_P(CutPrint, IsReadAsKlipperReadsIt) {
  expect_read(container::ten_layers(GetParam().name), GetParam());
}

// Counted by another program.
INSTANTIATE_TEST_SUITE_P(Samples, CutPrint,
                         ::testing::Values(Sample{"bracket", 17502, 15847, 15569, 0},
                                           Sample{"cube", 1920, 1538, 1541, 0},
                                           Sample{"star", 7129, 4994, 4688, 0},
                                           Sample{"textplate", 33595, 20796, 15370, 0},
                                           Sample{"wallring", 4879, 3357, 3322, 0}),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

class WholePrint : public ::testing::TestWithParam<Sample> {};

TEST_P(WholePrint, IsReadAsKlipperReadsIt) {
  const Sample& sample = GetParam();
  const std::filesystem::path path = unflex::testing::whole_print(sample.name);
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "UNFLEX_SAMPLES names no folder with it: " << path;
  }
  expect_read(file_text(path), sample);
}

INSTANTIATE_TEST_SUITE_P(Samples, WholePrint,
                         ::testing::Values(Sample{"bracket_mk3s_whole", 114223, 97114, 94625, 0},
                                           Sample{"cube20_ender3_absE", 21912, 16835, 17058, 0},
                                           Sample{"star_voron_klipper_fwretract", 44624, 24483,
                                                  21852, 0},
                                           Sample{"vase_rrf_spiral", 36421, 33189, 33184, 0},
                                           Sample{"wallring_mini_marlin2", 49892, 28156, 27636, 0},
                                           Sample{"pins_slic3r_zhop", 23605, 18375, 17387, 0},
                                           Sample{"textplate_cura", 62194, 43044, 32568, 0},
                                           Sample{"dome_snap_dense", 29310, 27325, 27090, 0},
                                           Sample{"washer_ratrig_lines", 34055, 29122, 29135, 0},
                                           Sample{"washer_ratrig_arcs", 13882, 14923, 14936, 3050}),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

}  // namespace
}  // namespace unflex::gcode
