#include "text_machine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace unflex::testing {
namespace {

constexpr Firmware kFirmwares[] = {Firmware::klipper, Firmware::marlin, Firmware::rrf};

TextMachine after(Firmware firmware, std::initializer_list<std::string_view> lines) {
  TextMachine machine(firmware, {.length_mm = 0.8, .extra_mm = 0.1});
  machine.read("G28");
  for (const std::string_view line : lines) {
    machine.read(line);
  }
  return machine;
}

// All firmwares agree on this print; the tests below are about their differences.
TEST(TextMachine, FollowsAPlainPrint) {
  for (const Firmware firmware : kFirmwares) {
    const TextMachine machine =
        after(firmware, {"G21", "G90 ; absolute", "M83", "T0", "G92 E0", "", "  ; only a comment",
                         "G1 X10 Y20 Z0.2 F6000", "G1 X15 E0.5", "G0 Y25", "G4 P30", "M106 S77.5",
                         "G91", "G1 X-1 Y-1 Z0.4 E-0.25", "M117 layer 1 of 2"});
    const Reading& reading = machine.reading();
    EXPECT_NEAR(reading.position_mm[0], 14.0, 1e-6);
    EXPECT_NEAR(reading.position_mm[1], 24.0, 1e-6);
    EXPECT_NEAR(reading.position_mm[2], 0.6, 1e-6);
    EXPECT_NEAR(reading.filament_mm, 0.25, 1e-6);
    EXPECT_DOUBLE_EQ(reading.feed_mm_s, 100.0);
    EXPECT_TRUE(reading.known[0] && reading.known[1] && reading.known[2]);
    EXPECT_FALSE(reading.absolute_xyz || reading.absolute_e);
    EXPECT_TRUE(machine.not_followed().empty());
    EXPECT_EQ(machine.refused(), 0U);
    EXPECT_TRUE(machine.path().empty());
  }
}

TEST(TextMachine, TellsTheEndOfALine) {
  for (const Firmware firmware : kFirmwares) {
    TextMachine machine = after(firmware, {"M83", "G1 X10 Y20 Z0.5 F6000"});
    ASSERT_EQ(machine.path().size(), 1U);
    EXPECT_EQ(machine.path()[0], (std::array{10.0, 20.0, 0.5}));
    for (const std::string_view line : {"G1 X10 Y20 E1", "G1 F1200", "G92 X0", "G28"}) {
      machine.read(line);
      EXPECT_TRUE(machine.path().empty()) << line;
    }
  }
}

TEST(TextMachine, NamesWhatItDoesNotFollow) {
  EXPECT_TRUE(
      after(Firmware::klipper, {"PRINT_START BED=60"}).not_followed().contains("PRINT_START"));
  EXPECT_TRUE(after(Firmware::klipper, {"M201 X500"}).not_followed().contains("M201"));
  EXPECT_TRUE(after(Firmware::marlin, {"M566 X500"}).not_followed().contains("M566"));
  EXPECT_TRUE(after(Firmware::marlin, {"M486 S1", "M486 P1"}).not_followed().contains("M486"));
  EXPECT_TRUE(after(Firmware::rrf, {"M201.1 X500"}).not_followed().contains("M201.1"));
  EXPECT_TRUE(after(Firmware::rrf, {"G10 P0 X3"}).not_followed().contains("G10"));
}

// Klipper: gcode.py, _process_commands. Marlin: parser.cpp, parse(). RepRapFirmware:
// StringParser.cpp, DecodeCommand(), FindParameters() and Seen().
TEST(TextMachine, SplitsALineAsTheFirmwareDoes) {
  const auto x_after = [](Firmware firmware, std::string_view line) {
    return after(firmware, {line}).reading().position_mm[0];
  };
  for (const Firmware firmware : kFirmwares) {
    EXPECT_EQ(x_after(firmware, "N12 G1 X5*34"), 5.0);
    EXPECT_EQ(x_after(firmware, "G1X 5Y 2"), 5.0);
    EXPECT_EQ(x_after(firmware, "  G1  X+5 ;X9"), 5.0);
  }
  EXPECT_EQ(x_after(Firmware::klipper, "g1 x5"), 5.0);
  EXPECT_EQ(x_after(Firmware::marlin, "g1 x5"), 0.0);
  EXPECT_EQ(x_after(Firmware::rrf, "g1 x5"), 5.0);
  EXPECT_EQ(x_after(Firmware::klipper, "G01 X5"), 0.0);
  EXPECT_EQ(x_after(Firmware::marlin, "G01 X5"), 5.0);
  EXPECT_EQ(x_after(Firmware::rrf, "G01 X5"), 5.0);
  EXPECT_EQ(x_after(Firmware::klipper, "G 1 X5"), 0.0);
  EXPECT_EQ(x_after(Firmware::marlin, "G 1 X5"), 5.0);
  EXPECT_EQ(x_after(Firmware::rrf, "G 1 X5"), 0.0);
  EXPECT_EQ(x_after(Firmware::klipper, "G1 X5 X6"), 6.0);
  EXPECT_EQ(x_after(Firmware::marlin, "G1 X5 X6"), 6.0);
  EXPECT_EQ(x_after(Firmware::rrf, "G1 X5 X6"), 5.0);
  // RepRapFirmware reads an E that follows a digit as an exponent.
  EXPECT_EQ(after(Firmware::marlin, {"G1 X5E1"}).reading().filament_mm, 1.0);
  EXPECT_EQ(x_after(Firmware::rrf, "G1 X5E1"), 50.0);
  EXPECT_EQ(after(Firmware::rrf, {"G1 X5 E1"}).reading().filament_mm, 1.0);
}

// gcode_move.py, cmd_G20; parser.h, value_axis_units() and value_feedrate(); GCodeBuffer.cpp,
// ConvertDistance() and ConvertSpeed().
TEST(TextMachine, InchesAreOfXyzEAndF) {
  for (const Firmware firmware : {Firmware::marlin, Firmware::rrf}) {
    const TextMachine machine =
        after(firmware, {"M83", "G20", "G1 X1 E0.1 F60", "G92 Y2", "G1 Y2.5"});
    EXPECT_TRUE(machine.reading().inches);
    EXPECT_NEAR(machine.reading().position_mm[0], 25.4, 1e-5);
    EXPECT_NEAR(machine.reading().position_mm[1], 12.7, 1e-5);
    EXPECT_NEAR(machine.reading().filament_mm, 2.54, 1e-6);
    EXPECT_NEAR(machine.reading().feed_mm_s, 25.4, 1e-6);
  }
  const TextMachine klipper = after(Firmware::klipper, {"G20", "G1 X1"});
  EXPECT_EQ(klipper.refused(), 1U);
  EXPECT_FALSE(klipper.reading().inches);
  EXPECT_EQ(klipper.reading().position_mm[0], 1.0);
}

// M200-M205.cpp: value_axis_units(), value_linear_units(), value_ulong(); planner.h:
// max_acceleration_mm_per_s2 is an integer.
TEST(TextMachine, MarlinScalesLimitsByTheUnit) {
  const auto limits =
      after(Firmware::marlin, {"M201 X500.9", "G20", "M201 Y100", "M203 X10", "M204 P100 T200",
                               "M205 X0.5 J0.001 B20000", "M593 X F40 D0.1"})
          .reading()
          .limits;
  EXPECT_EQ(limits.at("M201 X"), 500.0);
  EXPECT_EQ(limits.at("M201 Y"), 2540.0);
  EXPECT_NEAR(limits.at("M203 X"), 254.0, 1e-4);
  EXPECT_NEAR(limits.at("M204 P"), 2540.0, 1e-3);
  EXPECT_NEAR(limits.at("M204 T"), 5080.0, 1e-3);
  EXPECT_NEAR(limits.at("M205 X"), 12.7, 1e-5);
  EXPECT_NEAR(limits.at("M205 J"), 0.0254, 1e-6);
  EXPECT_NEAR(limits.at("M205 B"), 0.02, 1e-9);
  EXPECT_EQ(limits.at("shaper X freq"), 40.0);
  EXPECT_FALSE(limits.contains("shaper Y freq"));
  // A junction deviation of 0.5 inch is out of range and changes nothing.
  EXPECT_FALSE(after(Firmware::marlin, {"G20", "M205 J0.5"}).reading().limits.contains("M205 J"));
}

// GCodes2.cpp, HandleMcode(), cases 201, 203, 205 and 566; GCodes5.cpp, ConfigureAccelerations();
// GCodeBuffer.cpp, GetSpeedFromMm() and GetAcceleration().
TEST(TextMachine, RepRapFirmwareTakesLimitsInMillimetres) {
  const auto limits =
      after(Firmware::rrf, {"G20", "M201 X500", "M203 X6000 Y3000", "M203 S1 Z10", "M204 P800 T900",
                            "M566 X600", "M205 Y8", "M593 P\"ei2\" F42.5 S0.1"})
          .reading()
          .limits;
  EXPECT_EQ(limits.at("M201 X"), 500.0);
  EXPECT_EQ(limits.at("M203 X"), 100.0);
  EXPECT_EQ(limits.at("M203 Y"), 50.0);
  EXPECT_EQ(limits.at("M203 Z"), 10.0);
  EXPECT_EQ(limits.at("M204 P"), 800.0);
  EXPECT_EQ(limits.at("M204 T"), 900.0);
  EXPECT_EQ(limits.at("M566 X"), 10.0);
  EXPECT_EQ(limits.at("M566 Y"), 8.0);
  EXPECT_EQ(after(Firmware::rrf, {"M566 X3"}).reading().limits.at("M566 X"), 0.1);
  EXPECT_EQ(limits.at("shaper freq"), 42.5);
  EXPECT_NE(limits.at("shaper type"), 0.0);
  EXPECT_EQ(after(Firmware::rrf, {"M593 P\"none\""}).reading().limits.at("shaper type"), 0.0);
  EXPECT_EQ(after(Firmware::rrf, {"M593 F0"}).refused(), 1U);  // AxisShaper.cpp, Configure()
}

// toolhead.py, cmd_M204 and cmd_SET_VELOCITY_LIMIT; input_shaper.py, InputShaperParams.update.
TEST(TextMachine, KlipperSetsLimits) {
  const auto limits = after(Firmware::klipper,
                            {"SET_VELOCITY_LIMIT ACCEL=3000 VELOCITY=250",
                             "set_velocity_limit square_corner_velocity=7.5 Minimum_Cruise_Ratio=0",
                             "M204 P900 T800", "M204 P100", "SET_INPUT_SHAPER SHAPER_FREQ_X=0"})
                          .reading()
                          .limits;
  EXPECT_EQ(limits.at("velocity"), 250.0);
  EXPECT_EQ(limits.at("accel"), 800.0);
  EXPECT_EQ(limits.at("square corner velocity"), 7.5);
  EXPECT_EQ(limits.at("minimum cruise ratio"), 0.0);
  EXPECT_EQ(limits.at("shaper X freq"), 0.0);
}

// gcode.h, set_relative_mode(); gcode_move.py, cmd_G90 and cmd_G1; GCodes2.cpp, cases 82 to 91.
TEST(TextMachine, RelativeEAndRelativeAxes) {
  const auto absolute_e = [](Firmware firmware, std::initializer_list<std::string_view> lines) {
    return after(firmware, lines).reading().absolute_e;
  };
  EXPECT_TRUE(absolute_e(Firmware::marlin, {"M83", "G90"}));
  EXPECT_FALSE(absolute_e(Firmware::klipper, {"M83", "G90"}));
  EXPECT_FALSE(absolute_e(Firmware::rrf, {"M83", "G90"}));
  EXPECT_FALSE(absolute_e(Firmware::marlin, {"M82", "G91"}));
  EXPECT_FALSE(absolute_e(Firmware::klipper, {"M82", "G91"}));
  EXPECT_TRUE(absolute_e(Firmware::rrf, {"M82", "G91"}));
  EXPECT_TRUE(absolute_e(Firmware::marlin, {"G91", "M82"}));
  EXPECT_FALSE(absolute_e(Firmware::klipper, {"G91", "M82"}));
  EXPECT_TRUE(absolute_e(Firmware::klipper, {"G91", "M82", "G90"}));
}

// GCodes.cpp, LoadExtrusionAndFeedrateFromGCode(): latestVirtualExtruderPosition is of absolute E
// alone. gcode_move.py, cmd_G1, and gcode.cpp, get_destination_from_command(), count all.
TEST(TextMachine, RelativeEInTheReading) {
  for (const Firmware firmware : kFirmwares) {
    const Reading reading =
        after(firmware, {"M82", "G1 E5", "M83", "G1 E2", "M82", "G1 E6"}).reading();
    EXPECT_DOUBLE_EQ(reading.e_reading_mm, 6.0);
    EXPECT_DOUBLE_EQ(reading.filament_mm, firmware == Firmware::rrf ? 8.0 : 6.0);
  }
}

// types.h: xyze_pos_t consists of floats. At 100 m the smallest step is 0.0078 mm.
TEST(TextMachine, MarlinCountsEInSinglePrecision) {
  const auto pushed = [](Firmware firmware) {
    TextMachine machine = after(firmware, {"G92 E100000", "M83"});
    for (int i = 0; i < 100; ++i) {
      machine.read("G1 E0.003");
    }
    return machine.reading().filament_mm;
  };
  EXPECT_EQ(pushed(Firmware::marlin), 0.0);
  EXPECT_NEAR(pushed(Firmware::klipper), 0.3, 1e-9);
  EXPECT_NEAR(pushed(Firmware::rrf), 0.3, 1e-6);
}

// gcode_move.py, cmd_G92; G92.cpp; GCodes3.cpp, SetPositions().
TEST(TextMachine, G92MovesCoordinatesAndNotTheTool) {
  for (const Firmware firmware : kFirmwares) {
    TextMachine machine = after(firmware, {"G1 X100 Y50", "G92 X20"});
    EXPECT_DOUBLE_EQ(machine.reading().position_mm[0], 100.0);
    EXPECT_DOUBLE_EQ(machine.reading().offset_mm[0], 80.0);
    machine.read("G1 X25");
    EXPECT_DOUBLE_EQ(machine.reading().position_mm[0], 105.0);
    EXPECT_EQ(machine.path().at(0), (std::array{105.0, 50.0, 0.0}));
    machine.read("G28 X");
    machine.read("G1 X25");
    EXPECT_DOUBLE_EQ(machine.reading().position_mm[0], 25.0);
    EXPECT_DOUBLE_EQ(machine.reading().position_mm[1], 50.0);
  }
  // G92 without words resets all axes in Klipper, none in the others.
  EXPECT_EQ(after(Firmware::klipper, {"G1 X9 E3", "G92"}).reading().offset_mm[0], 9.0);
  EXPECT_EQ(after(Firmware::klipper, {"G1 X9 E3", "G92"}).reading().e_reading_mm, 0.0);
  EXPECT_EQ(after(Firmware::marlin, {"G1 X9 E3", "G92"}).reading().offset_mm[0], 0.0);
  EXPECT_EQ(after(Firmware::rrf, {"G1 X9 E3", "G92"}).reading().e_reading_mm, 3.0);
}

// stepper_enable.py, cmd_M18; M17_M18_M84.cpp; GCodes2.cpp, case 84; GCodes3.cpp, SetPositions().
TEST(TextMachine, MotorsOffLosesThePlace) {
  const auto known_x = [](Firmware firmware, std::initializer_list<std::string_view> lines) {
    return after(firmware, lines).reading().known[0];
  };
  for (const Firmware firmware : kFirmwares) {
    EXPECT_FALSE(TextMachine(firmware, {}).reading().known[0]);
    EXPECT_FALSE(known_x(firmware, {"M84"}));
    EXPECT_TRUE(known_x(firmware, {"M84", "G28"}));
    EXPECT_EQ(known_x(firmware, {"M84 S60"}), firmware != Firmware::klipper);
    EXPECT_EQ(known_x(firmware, {"M84 Y E"}), firmware != Firmware::klipper);
    EXPECT_EQ(known_x(firmware, {"M84", "G92 X0"}), firmware == Firmware::rrf);
  }
}

// gcode_move.py, cmd_M221; planner.cpp, _populate_block(); GCodes.cpp,
// LoadExtrusionAndFeedrateFromGCode(), applyM220M221.
TEST(TextMachine, FlowFactor) {
  for (const Firmware firmware : kFirmwares) {
    TextMachine machine = after(firmware, {"G1 X10 E10 F600", "M221 S50"});
    EXPECT_DOUBLE_EQ(machine.reading().e_reading_mm, 10.0);
    machine.read("G1 X20 E12");
    EXPECT_NEAR(machine.reading().filament_mm, 11.0, 1e-6);
    EXPECT_DOUBLE_EQ(machine.reading().e_reading_mm, 12.0);
    machine.read("G92 E3");
    EXPECT_DOUBLE_EQ(machine.reading().e_reading_mm, 3.0);
    machine.read("G1 E4");  // RepRapFirmware applies no factor if no axis is named
    EXPECT_NEAR(machine.reading().filament_mm, firmware == Firmware::rrf ? 12.0 : 11.5, 1e-6);
    machine.read("G1 X20 E5");  // naming an axis is enough
    EXPECT_NEAR(machine.reading().filament_mm, firmware == Firmware::rrf ? 12.5 : 12.0, 1e-6);
  }
  EXPECT_DOUBLE_EQ(after(Firmware::klipper, {"M221 S95.5", "M221"}).reading().flow_factor, 1.0);
  EXPECT_NEAR(after(Firmware::marlin, {"M221 S95.5", "M221"}).reading().flow_factor, 0.95, 1e-6);
  EXPECT_NEAR(after(Firmware::rrf, {"M221 S95.5", "M221"}).reading().flow_factor, 0.955, 1e-6);
}

// gcode_move.py, cmd_M220: changes the speed too, so that the feed of later lines stays.
TEST(TextMachine, SpeedFactorLeavesTheFeed) {
  for (const Firmware firmware : kFirmwares) {
    const Reading reading = after(firmware, {"G1 F1200", "M220 S150", "G1 X1"}).reading();
    EXPECT_DOUBLE_EQ(reading.feed_mm_s, 20.0);
    EXPECT_DOUBLE_EQ(reading.speed_factor, 1.5);
  }
  EXPECT_EQ(after(Firmware::klipper, {"G1 X5 F0"}).reading().position_mm[0], 0.0);  // cmd_G1
  const Reading marlin = after(Firmware::marlin, {"G1 F1200", "G1 X5 F0"}).reading();
  EXPECT_EQ(marlin.position_mm[0], 5.0);
  EXPECT_DOUBLE_EQ(marlin.feed_mm_s, 20.0);
}

// firmware_retraction.py, cmd_G10 and cmd_G11; motion.cpp, _internal_move_to_destination();
// GCodes.cpp, RetractFilament().
TEST(TextMachine, RetractionByTheFirmware) {
  for (const Firmware firmware : kFirmwares) {
    TextMachine machine = after(firmware, {"G1 E4 F1200", "M221 S50", "G10", "G10"});
    const double factor = firmware == Firmware::klipper ? 0.5 : 1.0;
    EXPECT_TRUE(machine.reading().retracted);
    EXPECT_NEAR(machine.reading().filament_mm, 4.0 - 0.8 * factor, 1e-6);
    EXPECT_NEAR(machine.reading().e_reading_mm, 4.0, 1e-12);
    machine.read("G11");
    machine.read("G11");
    EXPECT_FALSE(machine.reading().retracted);
    EXPECT_NEAR(machine.reading().filament_mm, 4.0 + 0.1 * factor, 1e-6);
    EXPECT_NEAR(machine.reading().e_reading_mm, 4.0, 1e-12);
    EXPECT_DOUBLE_EQ(machine.reading().feed_mm_s, 20.0);
  }
}

// gcode_arcs.py, planArc; G2_G3.cpp, plan_arc(); GCodes.cpp, DoArcMove().
TEST(TextMachine, ArcsShowTheirExtent) {
  for (const Firmware firmware : kFirmwares) {
    TextMachine machine =
        after(firmware, {"G1 X10 Y10 Z1", "G92 X0", "G3 X0 Y20 Z3 I0 J5 E7 F600"});
    const auto by_x = [](const auto& a, const auto& b) { return a[0] < b[0]; };
    const auto right = *std::ranges::max_element(machine.path(), by_x);
    EXPECT_NEAR(right[0], 15.0, 1e-3);
    EXPECT_NEAR(right[2], 2.0, 0.02);
    EXPECT_NEAR((*std::ranges::min_element(machine.path(), by_x))[0], 10.0, 1e-5);
    EXPECT_EQ(machine.path().back(), (std::array{10.0, 20.0, 3.0}));
    EXPECT_DOUBLE_EQ(machine.reading().filament_mm, 7.0);
    EXPECT_DOUBLE_EQ(machine.reading().feed_mm_s, 10.0);
    machine.read("G2 I0 J5");  // a whole turn
    EXPECT_NEAR((*std::ranges::min_element(machine.path(), by_x))[0], 5.0, 1e-3);
    EXPECT_NEAR((*std::ranges::max_element(machine.path(), by_x))[0], 15.0, 1e-3);
    EXPECT_EQ(machine.path().back(), (std::array{10.0, 20.0, 3.0}));
    EXPECT_EQ(machine.refused(), 0U);
  }
}

// gcode_arcs.py, _cmd_inner: "G2/G3 does not support relative move mode", "R moves".
TEST(TextMachine, ArcsThatKlipperRefuses) {
  for (const Firmware firmware : kFirmwares) {
    const bool klipper = firmware == Firmware::klipper;
    const TextMachine relative = after(firmware, {"G91", "G2 X10 Y0 I5 J0"});
    EXPECT_EQ(relative.refused(), klipper ? 1U : 0U);
    EXPECT_EQ(relative.path().empty(), klipper);
    const TextMachine by_radius = after(firmware, {"G2 X10 Y0 R-13"});
    EXPECT_EQ(by_radius.refused(), klipper ? 1U : 0U);
    EXPECT_NEAR(by_radius.reading().position_mm[0], klipper ? 0.0 : 10.0, 1e-12);
    // A negative radius means the longer arc, here above the chord.
    const auto y_of = [](const auto& place) { return place[1]; };
    EXPECT_NEAR(klipper ? 25.0 : y_of(*std::ranges::max_element(by_radius.path(), {}, y_of)), 25.0,
                1e-2);
    EXPECT_EQ(after(firmware, {"G2 X10 Y0"}).refused(), 1U);  // no centre
  }
}

// gcode_move.py, cmd_SAVE_GCODE_STATE and cmd_RESTORE_GCODE_STATE.
TEST(TextMachine, KlipperSavesAndRestores) {
  TextMachine machine = after(
      Firmware::klipper, {"G1 X10 Y10 E5 F1200", "SAVE_GCODE_STATE NAME=here", "G92 X0 E0",
                          "M221 S50", "G91", "G1 X5 E4 F600", "RESTORE_GCODE_STATE NAME=here"});
  EXPECT_DOUBLE_EQ(machine.reading().position_mm[0], 15.0);
  EXPECT_DOUBLE_EQ(machine.reading().offset_mm[0], 0.0);
  EXPECT_DOUBLE_EQ(machine.reading().filament_mm, 7.0);
  EXPECT_DOUBLE_EQ(machine.reading().e_reading_mm, 5.0);
  EXPECT_DOUBLE_EQ(machine.reading().feed_mm_s, 20.0);
  EXPECT_DOUBLE_EQ(machine.reading().flow_factor, 1.0);
  EXPECT_TRUE(machine.reading().absolute_xyz);
  EXPECT_TRUE(machine.path().empty());
  machine.read("RESTORE_GCODE_STATE NAME=here MOVE=1");
  EXPECT_EQ(machine.path().at(0), (std::array{10.0, 10.0, 0.0}));
  machine.read("RESTORE_GCODE_STATE");
  EXPECT_EQ(machine.refused(), 1U);
}

// gcode_move.py, cmd_SET_GCODE_OFFSET and _handle_home_rails_end.
TEST(TextMachine, KlipperOffsetsOutliveHoming) {
  TextMachine machine = after(Firmware::klipper, {"G1 Z1", "SET_GCODE_OFFSET Z=0.2"});
  EXPECT_DOUBLE_EQ(machine.reading().position_mm[2], 1.0);
  machine.read("SET_GCODE_OFFSET Z_ADJUST=0.1 MOVE=1");
  EXPECT_DOUBLE_EQ(machine.reading().position_mm[2], 1.1);
  machine.read("G28");
  machine.read("G1 Z1");
  EXPECT_DOUBLE_EQ(machine.reading().position_mm[2], 1.3);
}

// GCodes.cpp, ReadMove; GCodes2.cpp, G1: it waits until the buffer is empty.
TEST(TextMachine, RrfKeepsTheLastMoveInABuffer) {
  const auto waits = [](Firmware firmware, std::initializer_list<std::string_view> lines) {
    return after(firmware, lines).move_waits();
  };
  EXPECT_TRUE(waits(Firmware::rrf, {"G1 X5"}));
  EXPECT_TRUE(waits(Firmware::rrf, {"M83", "G1 E5", "M204 P100"}));
  EXPECT_FALSE(waits(Firmware::rrf, {"G1 X5", "G1 F600"}));
  EXPECT_FALSE(waits(Firmware::rrf, {"G1 X5", "M400"}));
  EXPECT_FALSE(waits(Firmware::marlin, {"G1 X5"}));
}

}  // namespace
}  // namespace unflex::testing
