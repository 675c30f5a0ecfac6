// Settings from Marlin's M503, RepRapFirmware's config.g and slicers, and which of them wins.

#include <fmt/core.h>
#include <gmock/gmock.h>

#include <cmath>

#include "reading.hpp"

namespace unflex::machine {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class Sources : public PrinterFiles {};

Settings read(const std::string& text, const std::string& name = "print.gcode") {
  Result<Settings> settings = parse(text, name, {});
  EXPECT_TRUE(settings) << to_string(settings.error());
  return settings.value_or(Settings{});
}

PrintText print_of(const std::string& head, const std::string& tail) {
  return {.name = "print.gcode", .head = head, .tail = tail, .tail_line = 101};
}

Settings sliced(const PrintText& print, const std::vector<std::string>& overrides = {}) {
  Result<Settings> settings = load(
      {.print = &print, .printer_file = {}, .overrides = overrides, .firmware_as_sliced = true});
  EXPECT_TRUE(settings) << to_string(settings.error());
  return settings.value_or(Settings{});
}

constexpr const char* kMarlinBlock =
    "; gcode_flavor = marlin2\n; machine_max_feedrate_x = 180,90\n; machine_max_feedrate_y = 200\n"
    "; machine_max_feedrate_z = 12\n; machine_max_acceleration_x = 3000\n"
    "; machine_max_acceleration_y = 2500\n; machine_max_acceleration_extruding = 1250\n"
    "; machine_max_acceleration_travel = 0\n; machine_max_jerk_x = 8\n; nozzle_diameter = 0.6,0.4\n"
    "; filament_diameter = 2.85\n; bed_shape = 0x0,200x0,200x200,0x200\n";

TEST(SlicerVariables, SayWhatTheTextDoesNot) {
  PrintText print = print_of("", "; gcode_flavor = marlin2\n; machine_max_feedrate_x = 180\n");
  print.variables = {{"SLIC3R_GCODE_FLAVOR", "klipper"},
                     {"SLIC3R_MACHINE_MAX_FEEDRATE_X", "90"},
                     {"SLIC3R_MACHINE_MAX_FEEDRATE_Y", " 170,80 "},
                     {"SLIC3R_NOTES", "any text"}};
  const Settings s = sliced(print);
  EXPECT_EQ(told(s, "printer.firmware"), "\"marlin\" print.gcode:101");
  EXPECT_EQ(told(s, "limits.max_x_velocity_mm_s"), "180 print.gcode:102");
  EXPECT_EQ(told(s, "limits.max_y_velocity_mm_s"), "170 SLIC3R_MACHINE_MAX_FEEDRATE_Y");
}

TEST(SlicerVariables, MayTellTheLimitsToBeIgnored) {
  PrintText print = print_of("", "; gcode_flavor = marlin2\n; machine_max_feedrate_x = 180\n");
  print.variables = {{"SLIC3R_MACHINE_LIMITS_USAGE", "ignore"}};
  EXPECT_THAT(told(sliced(print), "limits.max_x_velocity_mm_s"), HasSubstr("default"));
}

TEST(MarlinDump, IsRead) {
  const Result<Settings> loaded = load(fixture("m503.txt"), {});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  const Settings& s = *loaded;
  EXPECT_EQ(told(s, "printer.firmware"), "\"marlin\" m503.txt");
  EXPECT_EQ(told(s, "printer.y_steps_per_mm"), "80.5 m503.txt:7");
  EXPECT_EQ(told(s, "limits.max_y_velocity_mm_s"), "400 m503.txt:9");
  EXPECT_EQ(told(s, "limits.max_velocity_mm_s"), "500 m503.txt:9");
  EXPECT_EQ(told(s, "limits.max_x_accel_mm_s2"), "900 m503.txt:11");
  EXPECT_EQ(told(s, "limits.max_accel_mm_s2"), "700 m503.txt:11");
  EXPECT_EQ(told(s, "limits.print_accel_mm_s2"), "600 m503.txt:13");
  EXPECT_EQ(told(s, "limits.travel_accel_mm_s2"), "650 m503.txt:13");
  EXPECT_EQ(told(s, "limits.retract_accel_mm_s2"), "500 m503.txt:13");
  EXPECT_EQ(told(s, "limits.min_segment_time_ms"), "15 m503.txt:15");
  EXPECT_EQ(told(s, "limits.junction_deviation_mm"), "0.02 m503.txt:15");
  EXPECT_EQ(told(s, "printer.classic_jerk"), "false m503.txt:15");
  EXPECT_EQ(told(s, "printer.retract_length_mm"), "3.2 m503.txt:19");
  EXPECT_EQ(told(s, "printer.unretract_extra_length_mm"), "0.1 m503.txt:19");
  EXPECT_EQ(told(s, "printer.unretract_speed_mm_s"), "8 m503.txt:19");
  EXPECT_EQ(told(s, "dynamics.x.freq_hz"), "40 m503.txt:21");
  EXPECT_EQ(told(s, "dynamics.y.damping_ratio"), "0.12 m503.txt:22");
  EXPECT_EQ(told(s, "printer.input_shaper_freq_y_hz"), "35 m503.txt:22");
  EXPECT_EQ(told(s, "extruder.filament_diameter_mm"), "2.85 m503.txt:5");
  ASSERT_THAT(s.notes, SizeIs(1));
  EXPECT_THAT(s.notes[0].message, ::testing::HasSubstr("set kinematics.type to that"));
  EXPECT_THAT(load(fixture("m503.txt"), {"kinematics.type=corexy"})->notes, IsEmpty());
}

// M503 S0 writes no echo. M906 and M569 exist in both firmwares.
TEST(MarlinDump, WithoutEchoesIsKnownByItsWords) {
  const Settings s = read(
      "M149 C\nM92 X80 Y80 Z400 E93\nM203 X500 Y500 Z12 E120\nM201 X1000 Y900\n"
      "M205 B20000 S0 T0 J0.02\nM906 X800 Y800\nM569 S1 X Y\nM593 X F41 D0.1\nM593 Y F33\n");
  EXPECT_EQ(told(s, "printer.firmware"), "\"marlin\" print.gcode");
  EXPECT_EQ(told(s, "limits.max_velocity_mm_s"), "500 print.gcode:3");
  EXPECT_EQ(told(s, "dynamics.y.freq_hz"), "33 print.gcode:9");
}

TEST(MarlinDump, OfClassicJerkIsRead) {
  const Settings s = read("echo:  M92 X80 Y80\necho:  M205 B20000 S0 T0 X8.00 Y9.00 Z0.40 E5.00\n");
  EXPECT_TRUE(s.printer.junctions.classic_jerk);
  EXPECT_EQ(s.jerk_mm_s(), (std::array{8.0, 9.0, 0.4, 5.0}));
  EXPECT_FALSE(s.printer.firmware_retraction);
}

TEST(MarlinDump, ThatRoundsTheJunctionDeviationBringsANote) {
  const Settings s =
      read("echo:  M92 X80 Y80\necho:  M205 J0.01\necho:  M593 F40 D0.1\n", "dump.txt");
  ASSERT_THAT(s.notes, SizeIs(2));
  EXPECT_EQ(s.notes[0].place.line, 2);
  EXPECT_DOUBLE_EQ(s.dynamics.y.freq_hz, 40.0);
}

TEST(MarlinDump, ThatRoundsTheJunctionDeviationBringsNoNoteToWhoKnows) {
  const std::string dump = "echo:  M92 X80 Y80\necho:  M205 J0.01\necho:  M593 F40 D0.1\n";
  for (const char* deviation : {"0.013", "0.01"}) {
    const Result<Settings> s = parse(
        dump, "dump.txt",
        {fmt::format("limits.junction_deviation_mm={}", deviation), "kinematics.type=cartesian"});
    ASSERT_TRUE(s);
    EXPECT_THAT(s->notes, IsEmpty());
  }
}

// M503 does not tell it, and neither does a slicer.
TEST(Kinematics, OfAMarlinAreAskedForWhereverItsSettingsComeFrom) {
  const std::string dump = "echo:  M92 X80 Y80\necho:  M593 F40 D0.1\n";
  const std::string toml = "[printer]\nfirmware = \"marlin\"\n";
  for (const std::string& text : {dump, toml}) {
    const Result<Settings> silent = parse(text, "printer", {});
    ASSERT_TRUE(silent);
    ASSERT_FALSE(silent->notes.empty()) << text;
    EXPECT_THAT(to_string(silent->notes.front()), HasSubstr("set kinematics.type"));
    const Result<Settings> told = parse(text, "printer", {"kinematics.type=corexy"});
    ASSERT_TRUE(told);
    EXPECT_THAT(told->notes, IsEmpty()) << text;
  }
  EXPECT_THAT(read("[printer]\nfirmware = \"klipper\"\n").notes, IsEmpty());
}

TEST(MarlinDump, InInchesIsConverted) {
  // No note about the junction deviation, only that about kinematics.
  EXPECT_THAT(read("echo:  G20\necho:  M92 X80\necho:  M205 J0.01\necho:  M593 F40 D0.1\n").notes,
              SizeIs(1));
  EXPECT_NEAR(*read("echo:  G20\necho:  M201 X10 Y10\n").limits.axis_max_accel_mm_s2[0], 254.0,
              1e-9);
}

TEST(RrfConfig, IsRead) {
  const Result<Settings> loaded = load(fixture("config.g"), {});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  const Settings& s = *loaded;
  EXPECT_EQ(told(s, "printer.firmware"), "\"rrf\" config.g");
  EXPECT_EQ(told(s, "printer.travel_x_mm"), "[-5, 230] config.g:5");
  EXPECT_EQ(told(s, "printer.e_steps_per_mm"), "420 config.g:7");
  EXPECT_EQ(told(s, "limits.jerk_x_mm_s"), "15 config.g:8");
  EXPECT_EQ(told(s, "limits.jerk_policy"), "1 config.g:8");
  EXPECT_EQ(told(s, "limits.max_x_velocity_mm_s"), "300 config.g:9");
  EXPECT_EQ(told(s, "limits.min_movement_velocity_mm_s"), "0.5 config.g:9");
  EXPECT_EQ(told(s, "limits.max_accel_mm_s2"), "3000 config.g:10");
  EXPECT_EQ(told(s, "limits.print_accel_mm_s2"), "2500 config.g:11");
  EXPECT_EQ(told(s, "dynamics.y.freq_hz"), "42.5 config.g:12");
  EXPECT_EQ(told(s, "dynamics.x.damping_ratio"), "0.08 config.g:12");
  EXPECT_EQ(told(s, "printer.input_shaper_type"), "\"mzv\" config.g:12");
  EXPECT_EQ(told(s, "printer.retract_speed_mm_s"), "30 config.g:13");
  EXPECT_EQ(told(s, "printer.unretract_speed_mm_s"), "20 config.g:13");
  EXPECT_EQ(told(s, "printer.retract_z_hop_mm"), "0.2 config.g:13");
  EXPECT_THAT(s.notes, IsEmpty());
}

// The heater of the first tool, and 210 °C as the temperature at which losses are taken.
TEST(RrfConfig, HasTheModelOfTheHotend) {
  const std::string start = "M550 P\"x\"\nM593 P\"zvd\" F40\n";
  const std::string bed = "M307 H0 R0.4 K0.25 D3 E1.35 S1.00\n";
  const std::string hotend = "M307 H1 R1.693 K0.268:0.1 D6.39 E1.35 S1.00 V24\n";
  const Settings now = read(start + bed + hotend, "config.g");
  ASSERT_TRUE(now.hotend.has_model());
  // K u_max = R τ, τ = ΔT / (K (ΔT/100)^E)
  const double time_constant_s = 185.0 / (0.268 * std::pow(1.85, 1.35));
  EXPECT_NEAR(*now.hotend.time_constant_s, time_constant_s, 1e-9);
  EXPECT_NEAR(*now.hotend.gain_c, 1.693 * time_constant_s / 255.0, 1e-9);
  EXPECT_NEAR(*now.hotend.dead_time_s, 6.39, 1e-9);
  EXPECT_EQ(now.hotend.sensor_lag_s, 0.0);
  const Settings before_3_4 = read(start + "M307 H1 A340 C140 D5.5\n", "config.g");
  EXPECT_NEAR(*before_3_4.hotend.gain_c, 340.0 / 255.0, 1e-9);
  EXPECT_NEAR(*before_3_4.hotend.time_constant_s, 140.0, 1e-9);
  const Settings other =
      read(start + "M307 H2 A340 C140 D5.5\n" + hotend + "M563 P0 D0 H2 F0\n", "config.g");
  EXPECT_NEAR(*other.hotend.time_constant_s, 140.0, 1e-9);
  for (const std::string_view none : {"M307 H0 A340 C140 D5.5\n", "M307 H1 A340\n", "M307 H1\n",
                                      "M307 H1 R2 K0.3\n", "M307 H1 D5.5\n"}) {
    EXPECT_FALSE(read(start + std::string(none), "config.g").hotend.has_model()) << none;
  }
}

// RepRapFirmware's speeds are in mm/min, so the numbers are sixty times those of Marlin.
TEST(RrfConfig, OfSpeedsAloneIsKnownByItsWords) {
  for (const std::string text :
       {"M566 X900 Y900\nM203 X12000 Y12000\nM201 X1000 Y1000\n",
        "M92 X80 Y80\nM203 X12000 Y12000\nM201 X1000 Y1000\n",
        "M208 X0:200 Y0:200\nM350 X16 Y16 I1\nM92 X80\nM203 X12000\nM593 P\"zvd\" F40\n"}) {
    const Settings s = read(text);
    EXPECT_THAT(told(s, "printer.firmware"), HasSubstr("rrf")) << text;
    EXPECT_THAT(told(s, "limits.max_velocity_mm_s"), HasSubstr("200 ")) << text;
  }
}

// Expressions cannot be evaluated, so the user has to give the values.
TEST(RrfConfig, WithExpressionsAsksForTheirKeys) {
  const std::string text =
      "M550 P\"x\"\nM566 X{global.jerk} Y900\nM201 X3000 Y3000\nM593 P\"zvd\" F40\n";
  const Settings s = read(text, "config.g");
  EXPECT_EQ(told(s, "limits.max_x_accel_mm_s2"), "3000 config.g:3");
  EXPECT_THAT(told(s, "limits.jerk_y_mm_s"), HasSubstr("default"));
  ASSERT_THAT(s.notes, SizeIs(1));
  EXPECT_EQ(to_string(s.notes[0]),
            "config.g:2: warning: an expression, which unflex does not evaluate: nothing of this "
            "line is taken; give limits.jerk_x_mm_s and limits.jerk_y_mm_s with --set");
  std::vector<std::string> given = {"limits.jerk_x_mm_s=10"};
  EXPECT_THAT(parse(text, "config.g", given)->notes, SizeIs(1));
  given.emplace_back("limits.jerk_y_mm_s=15");
  EXPECT_THAT(parse(text, "config.g", given)->notes, IsEmpty());
}

// Versions 3.2 and 3.3 give a rate and a time constant, with the fan off and on.
TEST(RrfConfig, HasTheHotendsModelByItsRateAndTimeConstant) {
  const HotendSettings hotend =
      read("M550 P\"x\"\nM307 H1 B0 R2.346 C171.7:114.3 D6.53 S1.00 V24.0\nM593 P\"zvd\" F40\n")
          .hotend;
  EXPECT_NEAR(hotend.gain_c.value_or(0.0), 2.346 * 171.7 / 255.0, 1e-4);
  EXPECT_NEAR(hotend.time_constant_s.value_or(0.0), 171.7, 1e-9);
  EXPECT_NEAR(hotend.dead_time_s.value_or(0.0), 6.53, 1e-9);
}

TEST(RrfConfig, TellsInWhichModeOfFilamentAPrintBegins) {
  const std::string text = "M550 P\"x\"\nM593 P\"zvd\" F40\n";
  EXPECT_FALSE(read(text, "config.g").printer.relative_extrusion);
  EXPECT_EQ(told(read(text + "G90\nM83\n", "config.g"), "printer.relative_extrusion"),
            "true config.g:4");
  EXPECT_FALSE(read(text + "M83\nM82\n", "config.g").printer.relative_extrusion);
}

TEST(RrfConfig, WithAWordTwiceSaysThatTheLineIsNotTaken) {
  const Settings s = read("M550 P\"x\"\nM204 P2000 P3000\nM593 P\"zvd\" F40\n", "config.g");
  ASSERT_THAT(s.notes, SizeIs(1));
  EXPECT_EQ(to_string(s.notes[0]),
            "config.g:2: warning: two commands, or a word given twice: nothing of this line is "
            "taken; give limits.print_accel_mm_s2 with --set");
}

TEST(RrfConfig, MayPushLessThanItPulled) {
  const Settings s = read("M550 P\"x\"\nM207 S2 R-0.5 F1800\nM593 P\"zvd\" F40\n", "config.g");
  EXPECT_EQ(told(s, "printer.unretract_extra_length_mm"), "-0.5 config.g:2");
}

TEST(RrfConfig, TellsThePressureAdvanceOfTheFirstExtruder) {
  const auto advance = [](const std::string& line) {
    return told(read("M550 P\"x\"\n" + line + "\n", "config.g"), "extruder.pressure_advance_s");
  };
  EXPECT_EQ(advance("M572 D0 S0.045"), "0.045 config.g:2");
  EXPECT_EQ(advance("M572 D0:1 S0.05:0.06"), "0.05 config.g:2");
  EXPECT_EQ(advance("M572 D1 S0.045"), "0 default");
}

TEST(RrfConfig, GivesTravelAsPairsToo) {
  const Settings s = read("M550 P\"x\"\nM208 X-2:210 Y0:200.5 Z0:200\nM593 P\"none\"\n");
  EXPECT_EQ(by_key(s)["printer.travel_x_mm"].value, "[-2, 210]");
  EXPECT_EQ(by_key(s)["printer.travel_y_mm"].value, "[0, 200.5]");
  EXPECT_DOUBLE_EQ(s.shaper_freq_hz().x, 0.0);
}

TEST(RrfConfig, GivesTravelWhateverStandsAroundItsNumbers) {
  const std::string first = "M550 P\"x\"\nM593 P\"none\"\n";
  for (const char* line :
       {"M208 X220 Y210 S0\nM208 Z200 S0 ; X and Y above", "M208 X220 Y210;max", "M208 x220 y210",
        "M208 Y210X220", "M208 X 220 Y\t210", "M208 Z{\"X1Y\"} X220 Y210",
        "M208 X0:220 Y0:210 ; X:Y", "M208 X9 Y210 X220"}) {
    const Settings s = read(first + line + "\n", "config.g");
    EXPECT_EQ(by_key(s)["printer.travel_x_mm"].value, "[0, 220]") << line;
    EXPECT_EQ(by_key(s)["printer.travel_y_mm"].value, "[0, 210]") << line;
  }
}

TEST(RrfConfig, WithTravelInExpressionsKeepsWhatItKnowsAndAsksForTheRest) {
  const std::string first = "M550 P\"x\"\nM593 P\"zvd\" F40\n";
  const std::string later = first + "M208 X-5 S1\nM208 X220 S0\nM208 X{global.a + 2} Y200 S0\n";
  const Settings s = read(later, "config.g");
  EXPECT_EQ(told(s, "printer.travel_x_mm"), "[-5, 220] config.g:4");
  EXPECT_EQ(told(s, "printer.travel_y_mm"), "[0, 200] config.g:5");
  ASSERT_THAT(s.notes, SizeIs(1));
  EXPECT_EQ(to_string(s.notes[0]),
            "config.g:5: warning: an expression, which unflex does not evaluate: X is not taken; "
            "give printer.travel_x_mm with --set");
  EXPECT_THAT(parse(later, "config.g", {"printer.travel_x_mm=[0, 9]"})->notes, IsEmpty());
  EXPECT_THAT(read(later + "M208 X230\n", "config.g").notes, IsEmpty());

  const Settings half = read(first + "M208 X0:{b ? 1 : 2} Y{a}:200\n", "config.g");
  EXPECT_THAT(told(half, "printer.travel_x_mm"), HasSubstr("default"));
  EXPECT_THAT(told(half, "printer.travel_y_mm"), HasSubstr("default"));
  EXPECT_THAT(half.notes, SizeIs(2));
  EXPECT_EQ(to_string(read(first + "M208 X Y200\n", "config.g").notes.at(0)),
            "config.g:3: warning: no number: X is not taken; give printer.travel_x_mm with --set");
}

TEST(RrfConfig, SaysWhereAnExpressionOutdatesAnEarlierLine) {
  const std::string text = "M550 P\"x\"\nM201 X3000\nM201 X{global.a}\nM593 P\"zvd\" F40\n";
  const Settings s = read(text, "config.g");
  EXPECT_EQ(told(s, "limits.max_x_accel_mm_s2"), "3000 config.g:2");
  EXPECT_THAT(s.notes, SizeIs(1));
  EXPECT_THAT(read(text + "M201 X2000\n", "config.g").notes, IsEmpty());
}

TEST(RrfConfig, GivesTheSameLimitsInWhateverOrder) {
  const std::string first = "M550 P\"x\"\nM593 P\"zvd\" F40\n";
  const std::string x = "M201 X3000\nM203 X6000\n";
  const std::string y = "M201 Y1000\nM203 Y30000\n";
  for (const std::string& lines : {x + y, y + x, "M201 X500 Y500\nM203 X60000\n" + x + y}) {
    const Settings s = read(first + lines);
    EXPECT_DOUBLE_EQ(s.limits.max_accel_mm_s2, 1000.0) << lines;
    EXPECT_DOUBLE_EQ(s.limits.max_velocity_mm_s, 500.0) << lines;
  }
}

TEST(RrfConfig, TellsTheKinematics) {
  for (const auto& [line, kinematics] :
       {std::pair{"M669 K0", Kinematics::cartesian}, std::pair{"M669 K1", Kinematics::corexy},
        std::pair{"M669 K2 S100 T0.5", Kinematics::corexz},
        std::pair{"M669 K11", Kinematics::hybrid_corexy}}) {
    const Result<Settings> settings =
        parse(std::string("M550 P\"x\"\n") + line + "\n", "config.g", {});
    ASSERT_TRUE(settings) << to_string(settings.error());
    EXPECT_EQ(settings->kinematics.type, kinematics) << line;
  }
}

// CoreKinematics.cpp, Configure: behind each axis the factors of the motors, 0 for those not named.
TEST(RrfConfig, TellsAMatrixOfMotors) {
  const auto machine = [](const std::string& lines) {
    return read("M550 P\"x\"\n" + lines, "config.g");
  };
  const Settings tripteron = machine("M669 X1:1:1 Y1:-1:0 Z-1:-1:1\n");
  EXPECT_EQ(tripteron.kinematics.type, Kinematics::tripteron);
  const Settings core = machine("M669 K0\nM669 X1:1:0 Y1:-1:0\n");
  EXPECT_EQ(core.kinematics.type, Kinematics::corexy);
  const Settings geared = machine("M669 K1 Y2:-2\n");
  EXPECT_EQ(geared.kinematics.type, Kinematics::linear);
  EXPECT_EQ(geared.motors().rows(),
            (Motors::Rows{{{1.0, 2.0, 0.0}, {1.0, -2.0, 0.0}, {0.0, 0.0, 1.0}}}));
  EXPECT_EQ(told(geared, "kinematics.joint_b"), "[1, -2, 0] config.g:2");
  const Settings reset = machine("M669 X1:1:0 Y2:-2:0\nM669 K1\n");
  EXPECT_EQ(reset.kinematics.type, Kinematics::corexy);
  EXPECT_FALSE(reset.kinematics.joints[0]);
}

TEST(RrfConfig, OfOtherMachinesIsRefused) {
  for (const auto& [line, reason] :
       {std::pair{"M669 K4", "kinematics K4 is a machine that unflex does not support yet"},
        std::pair{"M669 K3", "kinematics K3"}, std::pair{"M669 K12", "kinematics K12"},
        std::pair{"M665 L200 R100", "M665 makes this machine a delta"},
        std::pair{"M669 X1:y", "M669 X gives motor 1 the factor '', which is no number"},
        std::pair{"M669 X1:1:0:0.5", "M669 X gives motor 3 the factor '0.5', which is more motors"},
        std::pair{"M669 X1:1 Y2:2", "no machine can have these motors"}}) {
    const Result<Settings> settings =
        parse(std::string("M550 P\"x\"\n") + line + "\n", "config.g", {});
    ASSERT_FALSE(settings) << line;
    EXPECT_THAT(to_string(settings.error()),
                ::testing::StartsWith(std::string("config.g:2: ") + reason));
  }
}

TEST(MarlinDump, OfADeltaIsRefused) {
  const Result<Settings> settings =
      parse("echo:  M92 X80 Y80\necho:  M205 J0.01\necho:  M665 L250.00 R100.00\n", "m503.txt", {});
  ASSERT_FALSE(settings);
  EXPECT_THAT(to_string(settings.error()), ::testing::StartsWith("m503.txt:3: M665 is of a delta"));
}

TEST(Kinematics, ThatTheFirmwareHasNotAreRefused) {
  const auto refused = [](const std::string& type, const std::string& firmware) {
    return !load(std::nullopt, {"kinematics.type=" + type, "printer.firmware=" + firmware});
  };
  EXPECT_TRUE(refused("delta", "klipper"));
  EXPECT_TRUE(refused("hybrid_corexy", "marlin"));
  EXPECT_TRUE(refused("hybrid_corexz", "marlin"));
  EXPECT_TRUE(refused("hybrid_corexz", "rrf"));
  EXPECT_FALSE(refused("hybrid_corexz", "klipper"));
  EXPECT_FALSE(refused("hybrid_corexy", "rrf"));
  EXPECT_FALSE(refused("corexy", "marlin"));
}

TEST(Kinematics, MakeMotorsFasterThanTheToolWhereTheFirmwareLimitsTheTool) {
  const auto refused = [](const std::string& type, const std::string& firmware, double times) {
    return !load(std::nullopt, {"kinematics.type=" + type, "printer.firmware=" + firmware,
                                "base.max_accel_mm_s2=" + std::to_string(times * 5000.0)});
  };
  EXPECT_TRUE(refused("corexy", "klipper", 1.41));
  EXPECT_FALSE(refused("corexy", "klipper", 1.42));
  EXPECT_FALSE(refused("corexz", "klipper", 1.0));
  EXPECT_FALSE(refused("corexy", "marlin", 1.0));
}

TEST(Slicers, TellAMarlinsLimits) {
  const Settings s = sliced(print_of("; generated by PrusaSlicer 2.5.0\n", kMarlinBlock));
  EXPECT_EQ(told(s, "printer.firmware"), "\"marlin\" print.gcode:101");
  EXPECT_EQ(told(s, "limits.max_x_velocity_mm_s"), "180 print.gcode:102");
  EXPECT_EQ(told(s, "limits.max_velocity_mm_s"), "200 print.gcode:103");
  EXPECT_EQ(told(s, "limits.max_accel_mm_s2"), "2500 print.gcode:106");
  EXPECT_EQ(told(s, "limits.print_accel_mm_s2"), "1250 print.gcode:107");
  EXPECT_EQ(by_key(s)["limits.travel_accel_mm_s2"].origin, "default");
  EXPECT_EQ(told(s, "extruder.nozzle_diameter_mm"), "0.6 print.gcode:110");
  EXPECT_EQ(by_key(s)["printer.travel_x_mm"].origin, "default") << "a bed is not the travel";
  EXPECT_FALSE(s.printer.junctions.classic_jerk);
}

TEST(Slicers, TellAKlippersLimitsAtTheHead) {
  const Settings s = sliced(print_of(
      "; CONFIG_BLOCK_START\n; gcode_flavor = klipper\n; machine_max_speed_x = 500,200\n"
      "; machine_max_speed_y = 400,200\n; machine_max_acceleration_x = 20000\n"
      "; machine_max_acceleration_extruding = 12000\n; machine_max_acceleration_z = 20000\n"
      "; CONFIG_BLOCK_END\n",
      ""));
  EXPECT_EQ(told(s, "printer.firmware"), "\"klipper\" print.gcode:2");
  EXPECT_DOUBLE_EQ(s.limits.max_velocity_mm_s, 400.0);
  EXPECT_DOUBLE_EQ(s.limits.max_accel_mm_s2, 12000.0);
  EXPECT_DOUBLE_EQ(s.axis_max_accel_mm_s2()[2], 12000.0);
}

// If the tool is slower than the slicer believes, Z is slower as well.
TEST(Slicers, TellAZThatIsNotFasterThanTheTool) {
  const PrintText print =
      print_of("",
               "; gcode_flavor = klipper\n; machine_max_acceleration_x = 20000\n"
               "; machine_max_acceleration_z = 10000\n; machine_max_feedrate_x = 300\n"
               "; machine_max_feedrate_z = 200\n");
  const Settings s = sliced(print, {"limits.max_accel_mm_s2=5000", "limits.max_velocity_mm_s=100"});
  EXPECT_EQ(told(s, "limits.max_z_accel_mm_s2"), "5000 print.gcode:103");
  EXPECT_EQ(told(s, "limits.max_z_velocity_mm_s"), "100 print.gcode:105");
  EXPECT_EQ(told(sliced(print), "limits.max_z_accel_mm_s2"), "10000 print.gcode:103");
}

TEST(Slicers, AreNotListenedToWhereTheUserSaysOtherwise) {
  const PrintText print =
      print_of("", "; gcode_flavor = marlin2\n; machine_max_junction_deviation = 0.5\n");
  EXPECT_FALSE(
      load({.print = &print, .printer_file = {}, .overrides = {}, .firmware_as_sliced = true}));
  EXPECT_DOUBLE_EQ(sliced(print, {"limits.junction_deviation_mm=0.1"}).limits.junction_deviation_mm,
                   0.1);
}

TEST(Slicers, ThatSayMarlinMeanKlipperWhereThePrintHasItsMacros) {
  const Settings s = sliced(print_of("M104 S200\nSTART_PRINT BED=60\n", kMarlinBlock));
  EXPECT_EQ(told(s, "printer.firmware"), "\"klipper\" print.gcode:2");
  EXPECT_DOUBLE_EQ(s.limits.max_accel_mm_s2, 1250.0);
}

TEST(Slicers, DoNotChooseTheFirmwareOfACompensation) {
  const PrintText print = print_of("", kMarlinBlock);
  const Result<Settings> settings = load({.print = &print, .printer_file = {}, .overrides = {}});
  ASSERT_TRUE(settings);
  EXPECT_EQ(told(*settings, "printer.firmware"), "\"klipper\" default");
  EXPECT_EQ(by_key(*settings)["limits.max_accel_mm_s2"].origin, "default") << "a Marlin's";
  EXPECT_EQ(told(*settings, "extruder.nozzle_diameter_mm"), "0.6 print.gcode:110");
  ASSERT_THAT(settings->guesses, SizeIs(2));
  EXPECT_THAT(to_string(settings->guesses[0]),
              HasSubstr("print.gcode:101: warning: sliced for marlin, but taken to be run by "
                        "klipper, the default"));
  for (const char* firmware : {"klipper", "marlin"}) {
    const Result<Settings> chosen =
        load({.print = &print,
              .printer_file = {},
              .overrides = {fmt::format("printer.firmware={}", firmware)}});
    ASSERT_TRUE(chosen);
    EXPECT_THAT(chosen->guesses, SizeIs(1)) << "that of the resonances";
    EXPECT_EQ(chosen->limits.max_accel_mm_s2 == 2500.0, std::string(firmware) == "marlin");
  }
}

TEST(Slicers, AreNotBelievedWhatTheyWereToldToIgnore) {
  const Settings s =
      sliced(print_of("", std::string(kMarlinBlock) + "; machine_limits_usage = ignore\n"));
  EXPECT_DOUBLE_EQ(s.limits.max_accel_mm_s2, 5000.0);
  EXPECT_EQ(s.printer.firmware, Firmware::marlin);
}

TEST(Slicers, NameTheFlavorAloneInCura) {
  EXPECT_EQ(sliced(print_of(";FLAVOR:Marlin\n;TIME:12\n", "")).printer.firmware, Firmware::marlin);
  EXPECT_EQ(sliced(print_of(";FLAVOR:RepRap (RepRap)\n", "")).printer.firmware, Firmware::rrf);
  const PrintText print = print_of(";FLAVOR:Makerbot\n", "");
  const Settings odd = sliced(print);
  EXPECT_EQ(odd.printer.firmware, Firmware::klipper);
  ASSERT_THAT(odd.guesses, SizeIs(2));
  EXPECT_EQ(
      to_string(odd.guesses[0]),
      "print.gcode:1: warning: unflex does not know G-code of the flavor 'Makerbot', and that "
      "klipper runs it is a guess that compensate refuses; say what runs it with --set "
      "printer.firmware=...");
  // A user who follows the advice does not get it again.
  const std::vector<std::string> said = {"printer.firmware=marlin"};
  EXPECT_THAT(sliced(print, said).guesses, SizeIs(1));
  const Result<Settings> to_run = load({.print = &print, .printer_file = {}, .overrides = said});
  ASSERT_TRUE(to_run);
  EXPECT_THAT(to_run->guesses, SizeIs(1));
}

TEST(Slicers, ThatWriteAtTheEndAreMissedInAPipe) {
  PrintText print = print_of("; generated by PrusaSlicer 2.7\n", "");
  print.is_stream = true;
  EXPECT_THAT(sliced(print).notes, SizeIs(1));
  print.head += "; gcode_flavor = klipper\n";
  EXPECT_THAT(sliced(print).notes, IsEmpty());
}

TEST_F(Sources, WinInTheirOrder) {
  const std::string file =
      write("p.toml", "[limits]\nmax_accel_mm_s2 = 2000\nmax_velocity_mm_s = 150\n");
  const PrintText print = print_of("", kMarlinBlock);
  const Result<Settings> s =
      load({.print = &print,
            .printer_file = file,
            .overrides = {"limits.max_velocity_mm_s=120", "printer.firmware=marlin"}});
  ASSERT_TRUE(s) << to_string(s.error());
  EXPECT_EQ(told(*s, "limits.max_velocity_mm_s"), "120 --set");
  EXPECT_EQ(told(*s, "limits.max_accel_mm_s2"), "2000 p.toml:2");
  EXPECT_EQ(told(*s, "limits.print_accel_mm_s2"), "1250 print.gcode:107");
  EXPECT_EQ(told(*s, "emit.period_ms"), "1 default");
}

TEST_F(Sources, OfAPrintAreItsHeadAndItsTailWithTheirLines) {
  std::string text = "; head\nM104 S200\nG1 X1 F600\n";
  for (int i = 0; i < 80000; ++i) {
    text += "G1 X1.234 Y5.678 E9.0\n";
  }
  text += kMarlinBlock;
  const Result<PrintText> print = read_print_text(*memory_store(text), "p.gcode");
  ASSERT_TRUE(print);
  EXPECT_EQ(print->head, "; head\nM104 S200\nG1 X1 F600\n");
  EXPECT_TRUE(print->tail.ends_with(kMarlinBlock));
  EXPECT_TRUE(print->tail.starts_with("G1 X1.234 Y5.678 E9.0\n"));
  EXPECT_EQ(told(sliced(*print), "printer.firmware"), "\"marlin\" p.gcode:80004");
  EXPECT_FALSE(describes_printer(*print));
}

TEST_F(Sources, OfAPrintWithALongHeadEndWithTheLastLineWithinTheLimit) {
  std::string text;
  while (text.size() < kMaxHeadBytes + 100'000) {
    text += "; comment without end\n";
  }
  const std::string head = text.substr(0, text.rfind('\n', kMaxHeadBytes - 1) + 1);
  text += "G1 X1 F600\n";
  const Result<PrintText> print = read_print_text(*memory_store(text), "p.gcode");
  ASSERT_TRUE(print);
  EXPECT_EQ(print->head.size(), head.size());
  EXPECT_EQ(head_end(text.substr(0, kMaxHeadBytes - 1)), std::string::npos);
  for (const std::size_t come : {kMaxHeadBytes, kMaxHeadBytes + 60'000, text.size()}) {
    EXPECT_EQ(head_end(text.substr(0, come)), head.size()) << come;
  }
  EXPECT_EQ(head_end(std::string(kMaxHeadBytes + 1, ';')), 0U);
}

TEST_F(Sources, OfAShortFileAreAllOfIt) {
  const Result<PrintText> print = read_print_text(*memory_store("[printer]\na: 1\n"), "p.cfg");
  ASSERT_TRUE(print);
  EXPECT_EQ(print->tail, "[printer]\na: 1\n");
  EXPECT_EQ(print->tail_line, 1);
  EXPECT_TRUE(describes_printer(*print));
}

TEST(ToToml, OfEverySourceReadsBackAsTheSameSettings) {
  for (const std::string name : {"printer.cfg", "m503.txt", "config.g"}) {
    const Result<Settings> first = load(fixture(name), {});
    ASSERT_TRUE(first) << name;
    const Settings second = read(to_toml(*first), "printer.toml");
    const std::map<std::string, SettingRow> before = by_key(*first);
    for (const auto& [key, row] : by_key(second)) {
      EXPECT_EQ(row.value, before.at(key).value) << name << " " << key;
    }
    EXPECT_THAT(to_toml(*first), HasSubstr("  # " + fixture(name) + ":")) << name;
  }
}

TEST(ToToml, ReadsBackWhateverTheFileIsCalled) {
  const std::string text = "[limits]\nmax_accel_mm_s2 = 1234\n";
  // Invalid UTF-8: a stray byte, cut off, overlong, a surrogate, too large.
  for (const auto& [name, shown] :
       {std::pair{"a\xff.toml", "a?.toml"}, std::pair{"a\xc3", "a?"}, std::pair{"\xe2\x82", "??"},
        std::pair{"\xc0\xaf.toml", "??.toml"}, std::pair{"\xe0\x80\x80", "???"},
        std::pair{"\xed\xa0\x80", "???"}, std::pair{"\xf4\x90\x80\x80", "????"},
        std::pair{"a\nb\x7f", "a?b?"}, std::pair{"Gerät → 𝄞.toml", "Gerät → 𝄞.toml"}}) {
    const std::string toml = to_toml(read(text, name));
    EXPECT_THAT(toml, HasSubstr(fmt::format("max_accel_mm_s2 = 1234  # {}:2\n", shown)));
    EXPECT_DOUBLE_EQ(read(toml, "printer.toml").limits.max_accel_mm_s2, 1234.0) << shown;
  }
}

}  // namespace
}  // namespace unflex::machine
