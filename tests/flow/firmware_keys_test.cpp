// Everything that a firmware's configuration decides is a key, and each key changes the plan.
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

// A program in which every limit and setting affects the duration of something.
std::string everything() {
  std::string text =
      "G90\nM83\nG1 X100 Y100 Z0.2 F3000\n"
      "G1 X100.5 Y100 E.02 F3000\nG1 X130 E1\nG1 Y130 E2\nG1 X100 E1\nG1 Y100 E.1\n"
      "G1 E-3 F6000\nG1 X110 Y110 F12000\nG1 Z3 F6000\nG1 Z0.2\nG1 E3 F6000\nG10\nG11\n"
      "G1 F6000\nG2 X140 Y110 I15 J0 E1\nG3 X140 Y110 I.4 J.3 P1 E.2\n";
  // A circle of short lines, then a zigzag of lines too short for some firmwares.
  text +=
      "G1 X142.013 Y131.007 E1\nG1 X20 Y20 F9000\nM400\nG1 X20.6 Y20 E.03\nG1 X21.17 Y20.19 "
      "E.03\nG1 X21.65 Y20.54 E.03\n"
      "G1 X22 Y21.03 E.03\nG1 X22.19 Y21.6 E.03\nG1 X22.19 Y22.2 E.03\nG1 X22 Y22.77 E.03\n"
      "G1 X40 Y22.77 E1\nG1 X20.77 Y22.77 E1\n";
  for (int i = 0; i < 40; ++i) {
    text += i % 2 == 0 ? "G1 X20.85 Y22.8 E.004\n" : "G1 X20.77 Y22.77 E.004\n";
  }
  text += "M200 S1\nG1 X60 Y60 E4\nM200 S0\n";
  return text;
}

Inspection plan(const std::vector<std::string>& overrides) {
  const JobFolder folder(everything(), overrides);
  SilentProgress progress;
  const Result<Inspection> inspection = inspect(folder.job(), progress);
  EXPECT_TRUE(inspection) << to_string(inspection.error());
  return inspection.value_or(Inspection{});
}

struct Case {
  std::string firmware;
  std::string setting;
  std::vector<std::string> others = {};  // in force both with and without `setting`
};

void PrintTo(const Case& tested, std::ostream* out) {
  *out << tested.firmware << ' ' << tested.setting;
}

class FirmwareKey : public ::testing::TestWithParam<Case> {};

TEST_P(FirmwareKey, ChangesThePlan) {
  const Case& tested = GetParam();
  std::vector<std::string> overrides = tested.others;
  overrides.push_back("printer.firmware=" + tested.firmware);
  const Inspection before = plan(overrides);
  overrides.push_back(tested.setting);
  const Inspection after = plan(overrides);
  EXPECT_TRUE(before.reference_time_s != after.reference_time_s ||
              before.counts.moves != after.counts.moves ||
              before.filament_mm != after.filament_mm || before.max_mm != after.max_mm);
}

INSTANTIATE_TEST_SUITE_P(
    Klipper, FirmwareKey,
    ::testing::Values(
        Case{"klipper", "limits.max_velocity_mm_s=90"},
        Case{"klipper", "limits.max_accel_mm_s2=2000"},
        Case{"klipper", "limits.square_corner_velocity_mm_s=8"},
        Case{"klipper", "limits.minimum_cruise_ratio=0"},
        Case{"klipper", "limits.max_z_velocity_mm_s=5"},
        Case{"klipper", "limits.max_z_accel_mm_s2=50"},
        Case{"klipper", "extruder.instantaneous_corner_velocity_mm_s=0.1"},
        Case{"klipper", "extruder.max_extrude_only_velocity_mm_s=20"},
        Case{"klipper", "extruder.max_extrude_only_accel_mm_s2=100"},
        Case{"klipper", "extruder.nozzle_diameter_mm=0.25"},
        Case{"klipper", "extruder.filament_diameter_mm=2.85"},
        Case{"klipper", "printer.arc_resolution_mm=0.3"},
        Case{"klipper", "printer.retract_length_mm=2"},
        Case{"klipper", "printer.retract_speed_mm_s=33", {"printer.retract_length_mm=2"}},
        Case{"klipper", "printer.unretract_speed_mm_s=33", {"printer.retract_length_mm=2"}},
        Case{"klipper", "printer.unretract_extra_length_mm=1"},
        Case{"klipper", "printer.firmware_retraction=false", {"printer.retract_length_mm=2"}}));

const std::vector<std::string> kFwRetract = {"printer.firmware_retraction=true"};

INSTANTIATE_TEST_SUITE_P(
    Marlin, FirmwareKey,
    ::testing::Values(
        Case{"marlin", "printer.x_steps_per_mm=100"}, Case{"marlin", "printer.y_steps_per_mm=100"},
        Case{"marlin", "printer.z_steps_per_mm=800"}, Case{"marlin", "printer.e_steps_per_mm=93"},
        Case{"marlin", "printer.min_steps_per_segment=12"},
        Case{"marlin", "printer.queue_length=8"}, Case{"marlin", "printer.classic_jerk=true"},
        Case{"marlin", "printer.jd_handle_small_segments=false"},
        Case{"marlin", "printer.minimum_planner_speed_mm_s=5"},
        Case{"marlin", "printer.min_arc_segment_mm=0.5"},
        Case{"marlin", "printer.max_arc_segment_mm=0.5"},
        Case{"marlin", "printer.arc_segments_per_s=400"},
        Case{"marlin", "printer.min_circle_segments=24", {"printer.max_arc_segment_mm=5"}},
        Case{"marlin", "printer.arc_correction_interval=1"},
        Case{"marlin", "printer.arc_p_circles=true"},
        Case{"marlin", "printer.retract_z_hop_mm=1", kFwRetract},
        Case{"marlin", "printer.retract_length_mm=1", kFwRetract},
        Case{"marlin", "printer.retract_speed_mm_s=20", kFwRetract},
        Case{"marlin", "printer.unretract_speed_mm_s=20", kFwRetract},
        Case{"marlin", "printer.unretract_extra_length_mm=1", kFwRetract},
        Case{"marlin", "printer.firmware_retraction=false"},
        Case{"marlin", "limits.max_x_velocity_mm_s=40"},
        Case{"marlin", "limits.max_z_velocity_mm_s=2"},
        Case{"marlin", "limits.max_e_velocity_mm_s=2"},
        Case{"marlin", "limits.max_x_accel_mm_s2=500"},
        Case{"marlin", "limits.max_z_accel_mm_s2=50"},
        Case{"marlin", "limits.max_e_accel_mm_s2=50"},
        Case{"marlin", "limits.print_accel_mm_s2=500"},
        Case{"marlin", "limits.travel_accel_mm_s2=500"},
        Case{"marlin", "limits.retract_accel_mm_s2=500"},
        Case{"marlin", "limits.junction_deviation_mm=0.05"},
        Case{"marlin", "limits.jerk_x_mm_s=5", {"printer.classic_jerk=true"}},
        Case{"marlin", "limits.jerk_e_mm_s=0.1", {"printer.classic_jerk=true"}},
        Case{"marlin", "limits.min_velocity_mm_s=70"},
        Case{"marlin", "limits.min_travel_velocity_mm_s=250"},
        Case{"marlin", "limits.min_segment_time_ms=0"},
        Case{"marlin", "extruder.filament_diameter_mm=2.85"}));

INSTANTIATE_TEST_SUITE_P(
    RepRapFirmware, FirmwareKey,
    ::testing::Values(
        Case{"rrf", "printer.x_steps_per_mm=100"}, Case{"rrf", "printer.y_steps_per_mm=100"},
        Case{"rrf", "printer.queue_length=4"}, Case{"rrf", "printer.step_clock_hz=937500"},
        Case{"rrf", "printer.retract_z_hop_mm=1"}, Case{"rrf", "printer.retract_length_mm=1"},
        Case{"rrf", "printer.retract_speed_mm_s=5"}, Case{"rrf", "printer.unretract_speed_mm_s=5"},
        Case{"rrf", "printer.unretract_extra_length_mm=1"},
        Case{"rrf", "limits.max_x_velocity_mm_s=40"}, Case{"rrf", "limits.max_z_velocity_mm_s=2"},
        Case{"rrf", "limits.max_e_velocity_mm_s=2"}, Case{"rrf", "limits.max_x_accel_mm_s2=500"},
        Case{"rrf", "limits.max_z_accel_mm_s2=50"}, Case{"rrf", "limits.max_e_accel_mm_s2=50"},
        Case{"rrf", "limits.print_accel_mm_s2=500"}, Case{"rrf", "limits.travel_accel_mm_s2=500"},
        Case{"rrf", "limits.jerk_x_mm_s=5"}, Case{"rrf", "limits.jerk_e_mm_s=0.1"},
        Case{"rrf", "limits.jerk_policy=1"}, Case{"rrf", "limits.min_movement_velocity_mm_s=60"},
        Case{"rrf", "extruder.filament_diameter_mm=2.85"}));

constexpr const char* kCorner =
    "G90\nM83\nG1 X100 Y100 Z0.2 F6000\nG4 P500\nG1 X104 Y100 E.1\nG1 X104 Y104 E.1\n";

struct Printed {
  report::Report report;
  std::string text;
};

Printed compensated(const std::vector<std::string>& overrides) {
  const JobFolder folder(kCorner, overrides);
  SilentProgress progress;
  const Result<report::Report> report = compensate(folder.job(), progress);
  EXPECT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->violation_count, 0U) << testing::complaints(*report);
  return {*report, folder.output()};
}

TEST(FirmwareKeys, NameTheShaperThatRepRapFirmwareIsSetBackTo) {
  const std::string shaped = "printer.input_shaper_freq_x_hz=41";
  const Printed zvd = compensated({"printer.firmware=rrf", shaped});
  EXPECT_THAT(zvd.text, ::testing::EndsWith("\nM593 P\"zvd\" F41\n"));
  const Printed mzv =
      compensated({"printer.firmware=rrf", shaped, "printer.input_shaper_type=mzv"});
  EXPECT_THAT(mzv.text, ::testing::EndsWith("\nM593 P\"mzv\" F41\n"));
}

TEST(FirmwareKeys, BelowWhatRepRapFirmwareTakesAreWhatItMakesOfThem) {
  const Printed printed =
      compensated({"printer.firmware=rrf", "limits.jerk_e_mm_s=0",
                   "limits.min_movement_velocity_mm_s=0.001", "limits.max_z_accel_mm_s2=0.01"});
  EXPECT_EQ(printed.report.runs.compensated, 1U);
  EXPECT_THAT(printed.text, ::testing::HasSubstr("M566 X900 Y900 E6 P0\n"));
}

// Klipper refuses such a line. The plan does not know this limit, so verify checks it.
TEST(FirmwareKeys, NameTheCrossSectionThatKlipperRefuses) {
  const std::string start = "G90\nM83\nG1 X100 Y100 Z0.2 F600\nG4 P500\n";
  const std::string bead = "G1 X101 Y100 E";
  const auto violations = [&](const std::string& setting) {
    const JobFolder folder(start + bead + ".1", {setting});
    folder.set_output(start + ";unflex run\n" + bead + ".3\n;unflex end\n");
    SilentProgress progress;
    const Result<report::Report> report = verify(folder.job(), progress);
    EXPECT_TRUE(report) << to_string(report.error());
    return testing::complaints(*report);
  };
  EXPECT_THAT(violations("extruder.max_extrude_cross_section_mm2=0.64"),
              ::testing::HasSubstr("too much for so short a way"));
  EXPECT_THAT(violations("extruder.max_extrude_cross_section_mm2=5"),
              ::testing::Not(::testing::HasSubstr("too much for so short a way")));
}

}  // namespace
}  // namespace unflex::flow
