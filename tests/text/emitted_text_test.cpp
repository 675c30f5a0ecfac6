// Filament in the emitted text, read by the tests' own machine.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <string_view>

#include "jobs.hpp"
#include "own_limits.hpp"
#include "same_print.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"

namespace unflex::testing {
namespace {

using flow::testing::JobFolder;

constexpr std::array kFirmwares = {Firmware::klipper, Firmware::marlin, Firmware::rrf};

void expect_same_when_compensated(const std::string& gcode, Firmware firmware,
                                  std::size_t times_longer) {
  SCOPED_TRACE(to_string(firmware));
  const std::string sliced = numbered(gcode);
  const JobFolder folder(sliced, {fmt::format("printer.firmware={}", to_string(firmware))});
  flow::Job job = folder.job(2);
  job.engine = flow::EngineChoice::banded;
  SilentProgress progress;
  const Result<report::Report> report = flow::compensate(job, progress);
  ASSERT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_GT(report->runs.compensated, 0U);
  const std::string emitted = folder.output();
  EXPECT_GT(emitted.size(), times_longer * gcode.size());
  EXPECT_EQ(difference(sliced, emitted, printer_with(job.settings)), "");
}

double filament_mm(std::string_view gcode, Firmware firmware) {
  TextMachine machine(firmware, {});
  while (!gcode.empty()) {
    machine.read(take_line(gcode));
  }
  return machine.reading().filament_mm;
}

std::string walls_from(double reading_mm) {
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

// Far from zero, single precision matters: Marlin adds up relative filament in it.
TEST(EmittedText, LaysTheFilamentOfAnAbsoluteReadingFarFromZero) {
  for (const Firmware firmware : kFirmwares) {
    for (const double reading_mm : {0.0, 9000.0}) {
      SCOPED_TRACE(reading_mm);
      EXPECT_NEAR(filament_mm(walls_from(reading_mm), firmware), 72 * 1.33 - 3.0, 2e-3);
      expect_same_when_compensated(walls_from(reading_mm), firmware, 10);
    }
  }
}

// Errors of single runs would add up over many runs.
TEST(EmittedText, LaysTheFilamentOfManyRuns) {
  for (const char* const modes : {"G90\nM82\n", "G90\nM83\n", "G91\nM83\n"}) {
    SCOPED_TRACE(modes);
    const bool absolute = std::string_view(modes).starts_with("G90");
    const bool reading = std::string_view(modes).ends_with("M82\n");
    std::string text = "G28\nG21\nG90\nG1 X50 Y50 Z0.2 F6000\nG92 E0\n" + std::string(modes);
    double e = 0.0;
    for (int run = 0; run < 40; ++run) {
      const double to = 50.0 + 20.0 * (1 - run % 2);
      text += fmt::format("G1 X{} E{:.5f} F4200\nG1 E{:.5f} F1800\nG4 P1\nG1 E{:.5f}\n",
                          absolute ? to : (run % 2 == 0 ? 20.0 : -20.0), e + 0.7654,
                          reading ? e + 0.2654 : -0.5, reading ? e + 0.7654 : 0.5);
      e += reading ? 0.7654 : 0.0;
    }
    for (const Firmware firmware : kFirmwares) {
      expect_same_when_compensated(text, firmware, 2);
    }
  }
}

}  // namespace
}  // namespace unflex::testing
