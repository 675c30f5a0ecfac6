// Filament as each firmware counts it, in the text alone: an emitted print lays what the sliced one
// lays, and leaves the reading of E that the lines after a run are meant from.
//
// Klipper (gcode_move.py, cmd_G1) and Marlin (gcode.cpp, get_destination_from_command) count a
// relative E into the reading, Marlin in single precision; RepRapFirmware (GCodes.cpp,
// LoadExtrusionAndFeedrateFromGCode) does not.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>

#include "app/program.hpp"

namespace unflex::app {
namespace {

struct Laid {
  double total_mm = 0.0;
  double most_back_mm = 0.0;  // the longest retraction
  double reading_mm = 0.0;    // at the end
};

Laid laid(const std::string& gcode, const std::string& firmware) {
  const bool is_marlin = firmware == "marlin";
  const bool counts_relative = firmware != "rrf";
  const auto kept = [&](double value) {
    return is_marlin ? static_cast<double>(static_cast<float>(value)) : value;
  };
  Laid result;
  bool absolute = true;
  std::istringstream lines(gcode);
  for (std::string line; std::getline(lines, line);) {
    line.resize(std::min(line.find(';'), line.size()));
    absolute = line.starts_with("M82") || (is_marlin && line.starts_with("G90")) ||
               (absolute && !line.starts_with("M83") && !(is_marlin && line.starts_with("G91")));
    const std::size_t at = line.find('E');
    if (at == std::string::npos || !line.starts_with('G')) {
      continue;
    }
    const double word = std::stod(line.substr(at + 1));
    double& reading = result.reading_mm;
    if (line.starts_with("G92")) {
      reading = kept(word);
      continue;
    }
    const double before = reading;
    const double after = kept(absolute ? word : before + word);
    const double moved = absolute || counts_relative ? after - before : word;
    reading = absolute || counts_relative ? after : before;
    result.total_mm += moved;
    result.most_back_mm = std::min(result.most_back_mm, moved);
  }
  return result;
}

std::string print_from(double reading_mm) {
  std::string text =
      fmt::format("G21\nG90\nM82\nT0\nG28\nG92 E{}\nG1 X40 Y40 Z0.3 F6000\n", reading_mm);
  double e = reading_mm;
  for (int layer = 0; layer < 2; ++layer) {
    for (int turn = 0; turn < 9; ++turn) {
      for (const char* const corner : {"X80 Y40", "X80 Y80", "X40 Y80", "X40 Y40"}) {
        text += fmt::format("G1 {} E{:.5f} F4800\n", corner, e += 1.33);
      }
    }
    text += fmt::format("G1 E{:.5f} F2400\nG1 Z{} F600\nG1 X45 Y45 F9000\nG1 X40 Y40\n", e - 0.8,
                        0.6 + layer);
    text += fmt::format("G1 E{:.5f} F2400\n", e);
  }
  return text + fmt::format("G1 E{:.5f}\nM84\n", e - 3.0);
}

class Filament : public ProgramTest {};

TEST_F(Filament, IsLaidAsTheFirmwareCountsIt) {
  for (const std::string firmware : {"klipper", "marlin", "rrf"}) {
    for (const double reading_mm : {0.0, 9000.0}) {
      SCOPED_TRACE(fmt::format("{} from E{}", firmware, reading_mm));
      const std::string sliced = print_from(reading_mm);
      write_file(path("in.gcode"), sliced);
      const Outcome outcome = run({"compensate", "in.gcode", "-o", "out.gcode", "--engine",
                                   "banded", "--quiet", "--set", "printer.firmware=" + firmware});
      ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
      const std::string text = read_file(path("out.gcode"));
      ASSERT_GT(text.size(), 10 * sliced.size());
      const Laid before = laid(sliced, firmware);
      const Laid after = laid(text, firmware);
      EXPECT_NEAR(before.total_mm, 72 * 1.33 - 3.0, 2e-3);
      EXPECT_NEAR(after.total_mm, before.total_mm, 5e-3);
      EXPECT_NEAR(after.most_back_mm, before.most_back_mm, 2e-3);
      EXPECT_NEAR(after.reading_mm, before.reading_mm, 2e-3);
    }
  }
}

}  // namespace
}  // namespace unflex::app
