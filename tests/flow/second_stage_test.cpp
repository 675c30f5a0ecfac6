// Prints on a printer that rings behind its compensated axes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "jobs.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"

namespace unflex::flow {
namespace {

using testing::JobFolder;

// One corner with a full stop in it, as in the table of docs/study.md.
const std::string kCorner =
    "G28\nG90\nM83\nG1 X50 Y50 Z0.2 F6000\nG4 P500\nG1 X60 Y50 E0.4 F6000\nG1 X60 Y60 E0.4\n";

report::Report made_of(const std::string& print, std::vector<std::string> overrides) {
  for (const char* known :
       {"dynamics.x.freq_hz=45", "dynamics.y.freq_hz=45", "second.x_freq_hz=110",
        "second.y_freq_hz=110", "limits.max_accel_mm_s2=5000"}) {
    overrides.insert(overrides.begin(), known);
  }
  const JobFolder folder(print, overrides);
  SilentProgress progress;
  Result<report::Report> result = compensate(folder.job(), progress);
  EXPECT_TRUE(result) << to_string(result.error());
  EXPECT_EQ(result->violation_count, 0U) << testing::complaints(*result);
  EXPECT_EQ(result->runs.fallback, 0U) << testing::complaints(*result);
  return std::move(*result);
}

TEST(SecondStage, MakesUpForTheModeBehindTheFirst) {
  const std::string stop = "limits.square_corner_velocity_mm_s=0";
  const report::Report first = made_of(kCorner, {stop, "second.shaper=none"});
  const report::Report both = made_of(kCorner, {stop, "emit.tolerance_um=0.05"});
  // Simulated by other code: 57.9/16.7 as sliced, 8.95/1.77 by the first stage, 1.20/0.06 by both.
  const auto um = [](double mm) { return 1e3 * mm; };
  EXPECT_NEAR(um(testing::unshaped(first).extruding.contour_max_mm), 57.9, 0.6);
  EXPECT_NEAR(um(testing::unshaped(first).extruding.contour_rms_mm), 16.7, 0.2);
  EXPECT_NEAR(um(first.measured.compensated.extruding.contour_max_mm), 8.95, 0.9);
  EXPECT_NEAR(um(first.measured.compensated.extruding.contour_rms_mm), 1.77, 0.18);
  EXPECT_NEAR(um(both.measured.compensated.extruding.contour_max_mm), 1.2, 0.3);
  EXPECT_LT(um(both.measured.compensated.extruding.contour_rms_mm), 0.15);
}

TEST(SecondStage, HoldsOnEveryFirmwareAndOnMotorsThatAreShared) {
  std::string print = "G28\nG90\nM83\nG1 X80 Y80 Z0.2 F6000\nG4 P500\nG1 F4800\n";
  for (int i = 0; i < 2; ++i) {
    print +=
        "G1 X110 E1\nG1 Y110 E1\nG1 X97 E0.5\nG1 X95 Y106 E0.2\nG1 X93 Y110 E0.2\n"
        "G1 X80 E0.5\nG1 Y80 E1\n";
  }
  for (const std::string& printer :
       {std::string("printer.firmware=klipper"), std::string("printer.firmware=marlin"),
        std::string("printer.firmware=rrf"), std::string("kinematics.type=corexy")}) {
    SCOPED_TRACE(printer);
    const report::Report first = made_of(print, {printer, "second.shaper=none"});
    const report::Report both = made_of(print, {printer});
    EXPECT_LT(both.measured.compensated.extruding.contour_rms_mm,
              0.6 * first.measured.compensated.extruding.contour_rms_mm);
    EXPECT_LT(both.measured.compensated.time_s, first.measured.compensated.time_s + 0.1);
  }
}

}  // namespace
}  // namespace unflex::flow
