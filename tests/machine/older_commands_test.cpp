// Settings in the words of older firmwares, and in lines that may or may not be carried out.

#include <fmt/core.h>
#include <gmock/gmock.h>

#include "reading.hpp"

namespace unflex::machine {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr const char* kRrf = "M550 P\"x\"\nM593 P\"zvd\" F40\n";

Settings read(const std::string& text, const std::string& name = "config.g",
              const std::vector<std::string>& overrides = {}) {
  Result<Settings> settings = parse(text, name, overrides);
  EXPECT_TRUE(settings) << to_string(settings.error());
  return settings.value_or(Settings{});
}

std::vector<std::string> notes(const Settings& settings) {
  std::vector<std::string> texts;
  for (const Diagnostic& note : settings.notes) {
    texts.push_back(to_string(note));
  }
  return texts;
}

TEST(RrfOlderCommands, TellTheKinematics) {
  for (const auto& [line, kinematics] :
       {std::pair{"M667 S0", Kinematics::cartesian}, std::pair{"M667 S1", Kinematics::corexy},
        std::pair{"M667 S2", Kinematics::corexz}}) {
    const Settings s = read(fmt::format("{}{}\n", kRrf, line));
    EXPECT_EQ(s.kinematics.type, kinematics) << line;
    EXPECT_EQ(told(s, "kinematics.type"), fmt::format("\"{}\" config.g:3", to_string(kinematics)));
  }
}

TEST(RrfOlderCommands, OfOtherMachinesAreRefused) {
  for (const auto& [line, reason] :
       {std::pair{"M667 S3", "kinematics S3 is a machine"}, std::pair{"M667 S11", "kinematics S11"},
        std::pair{"M667 S1 X2 Y1", "M667 gives a matrix"}}) {
    const Result<Settings> settings = parse(fmt::format("{}{}\n", kRrf, line), "config.g", {});
    ASSERT_FALSE(settings) << line;
    EXPECT_THAT(to_string(settings.error()), HasSubstr(reason));
  }
}

TEST(RrfOlderCommands, WithoutANumberAskForTheKinematics) {
  const Settings s = read(std::string(kRrf) + "M667 S{global.core}\n");
  EXPECT_THAT(notes(s), Contains(HasSubstr("no number behind S")));
  EXPECT_THAT(read(std::string(kRrf) + "M667 S{global.core}\nM669 K1\n").notes, IsEmpty());
}

// GCodes.cpp, ChangeMicrostepping; Platform.cpp, SetDriveStepsPerUnit.
TEST(RrfMicrosteps, RescaleStepsThatWereSetBefore) {
  const Settings s = read(std::string(kRrf) + "M92 X80 Y80 Z400 E420\nM350 X8 Y32 Z16 E16 I1\n");
  EXPECT_EQ(told(s, "printer.x_steps_per_mm"), "40 config.g:4");
  EXPECT_EQ(told(s, "printer.y_steps_per_mm"), "160 config.g:4");
  EXPECT_EQ(told(s, "printer.z_steps_per_mm"), "400 config.g:3");
  EXPECT_EQ(told(s, "printer.e_steps_per_mm"), "420 config.g:3");
}

TEST(RrfMicrosteps, BeforeStepsChangeNothing) {
  const Settings s = read(std::string(kRrf) + "M350 X64 Y64 Z16 E16:16 I1\nM92 X320 Y320 E420\n");
  EXPECT_EQ(told(s, "printer.x_steps_per_mm"), "320 config.g:4");
  EXPECT_EQ(told(s, "printer.e_steps_per_mm"), "420 config.g:4");
}

TEST(RrfMicrosteps, AreThoseThatStepsAreGivenFor) {
  const Settings s = read(std::string(kRrf) + "M350 X64 Y64 E16\nM92 X80 Y80 E420 S16\n");
  EXPECT_EQ(told(s, "printer.x_steps_per_mm"), "320 config.g:4");
  EXPECT_EQ(told(s, "printer.e_steps_per_mm"), "420 config.g:4");
}

TEST(RrfMicrosteps, RescaleTheStepsByDefaultToo) {
  EXPECT_EQ(told(read(std::string(kRrf) + "M350 X32\n"), "printer.x_steps_per_mm"),
            "160 config.g:3");
}

TEST(RrfMicrosteps, ByAnExpressionAskForTheSteps) {
  const Settings s = read(std::string(kRrf) + "M92 X80\nM350 X{var.micro}\n");
  EXPECT_EQ(told(s, "printer.x_steps_per_mm"), "80 config.g:3");
  EXPECT_THAT(notes(s), Contains(HasSubstr("config.g:4: warning: no number of microsteps behind X, "
                                           "and M350 changes steps per mm; give "
                                           "printer.x_steps_per_mm with --set")));
}

constexpr const char* kConditional =
    "M550 P\"x\"\nM669 K1\nM201 X4000 Y4000\nif {exists(global.heavyHead)}\n"
    "  M201 X3000 Y3000\n  M593 P\"mzv\" F38\nelse\n  M201 X9000 Y9000\n  M593 P\"mzv\" F61\n";

TEST(RrfConditions, LeaveNothingButTheKeysThatTheyWouldSet) {
  const Settings s = read(kConditional);
  EXPECT_EQ(told(s, "limits.max_x_accel_mm_s2"), "4000 config.g:3");
  EXPECT_EQ(told(s, "limits.max_accel_mm_s2"), "4000 config.g:3");
  EXPECT_THAT(told(s, "dynamics.x.freq_hz"), HasSubstr("default"));
  EXPECT_THAT(told(s, "printer.input_shaper_freq_x_hz"), HasSubstr("default"));
  EXPECT_THAT(s.guesses, SizeIs(1));
  const std::vector<std::string> told_notes = notes(s);
  ASSERT_THAT(told_notes, SizeIs(1));
  EXPECT_THAT(told_notes[0],
              HasSubstr("config.g:4: warning: unflex does not evaluate conditions and "
                        "takes nothing from the branches that begin here; give "));
  for (const char* key : {"limits.max_x_accel_mm_s2", "limits.max_y_accel_mm_s2",
                          "limits.max_accel_mm_s2", "dynamics.x.freq_hz", "dynamics.y.freq_hz",
                          "printer.input_shaper_type", "printer.input_shaper_freq_x_hz"}) {
    EXPECT_THAT(told_notes[0], HasSubstr(key));
  }
  EXPECT_THAT(told_notes[0], Not(HasSubstr("velocity")));
}

TEST(RrfConditions, AreNotToldOfWhereTheirKeysAreGiven) {
  const std::string text = std::string(kRrf) + "if {var.fast}\n  M203 X30000\nM203 X18000\n";
  EXPECT_THAT(read(text).notes, IsEmpty());
  EXPECT_EQ(told(read(text), "limits.max_x_velocity_mm_s"), "300 config.g:5");
}

TEST(RrfConditions, EndWithTheirIndentation) {
  const std::string text = std::string(kRrf) +
                           "if {var.a}\n\tif {var.b}\n\t\tM201 X1\n\tM201 Y1\n; a comment\n"
                           "\tM203 X60\nM566 X900\nwhile {iterations < 2}\n  M669 K3\nM204 P2500\n";
  const Settings s = read(text);
  EXPECT_EQ(told(s, "limits.jerk_x_mm_s"), "15 config.g:9");
  EXPECT_EQ(told(s, "limits.print_accel_mm_s2"), "2500 config.g:12");
  EXPECT_THAT(told(s, "limits.max_x_accel_mm_s2"), HasSubstr("default"));
  EXPECT_THAT(notes(s), Contains(HasSubstr("config.g:3: warning")));
  EXPECT_THAT(notes(s), Contains(HasSubstr("config.g:10: warning")));
  EXPECT_THAT(notes(s), Contains(HasSubstr("give kinematics.type with --set")));
}

TEST(RrfConditions, TellOfTravelToo) {
  const Settings s = read(std::string(kRrf) + "M208 X0:200 Y0:200\nif {var.wide}\n  M208 X0:300\n");
  EXPECT_EQ(told(s, "printer.travel_x_mm"), "[0, 200] config.g:3");
  EXPECT_THAT(notes(s), Contains(HasSubstr("give printer.travel_x_mm with --set")));
}

// Marlin 1.0, ConfigurationStore.cpp, Config_PrintSettings.
constexpr const char* kOldDump =
    "echo:Steps per unit:\necho:  M92 X80.00 Y80.00 Z400.00 E95.00\n"
    "echo:Acceleration: S=acceleration, T=retract acceleration\necho:  M204 S800.00 T3000.00\n"
    "echo:Advanced variables:\necho:  M205 S0.00 T0.00 B20000 X20.00 Z0.40 E5.00\n";

TEST(MarlinOldDump, HasOneJerkOfXAndYAndTOfRetraction) {
  const Settings s = read(kOldDump, "m503.txt");
  EXPECT_EQ(told(s, "limits.print_accel_mm_s2"), "800 m503.txt:4");
  EXPECT_EQ(told(s, "limits.travel_accel_mm_s2"), "800 m503.txt:4");
  EXPECT_EQ(told(s, "limits.retract_accel_mm_s2"), "3000 m503.txt:4");
  EXPECT_EQ(told(s, "limits.jerk_x_mm_s"), "20 m503.txt:6");
  EXPECT_EQ(told(s, "limits.jerk_y_mm_s"), "20 m503.txt:6");
  EXPECT_EQ(told(s, "limits.jerk_z_mm_s"), "0.4 m503.txt:6");
  EXPECT_EQ(told(s, "printer.classic_jerk"), "true m503.txt:6");
}

// That firmware does not know M204 P, which a run needs.
TEST(MarlinOldDump, IsOfAMarlinThatCannotPrintRuns) {
  const Settings s = read(kOldDump, "m503.txt");
  ASSERT_TRUE(s.refusal);
  EXPECT_THAT(to_string(*s.refusal), HasSubstr("m503.txt:4"));
  EXPECT_THAT(to_string(*s.refusal), HasSubstr("Marlin 1.0"));
  EXPECT_FALSE(read(kOldDump, "m503.txt", {"printer.variant=mainline"}).refusal);
}

TEST(MarlinDump, OfTodayKeepsItsWords) {
  const Settings s = read(
      "echo:  M92 X80 Y80\necho:  M204 P500 R1000 T1500\necho:  M205 X8 Y9 Z0.4 E5\n", "m503.txt");
  EXPECT_EQ(told(s, "limits.retract_accel_mm_s2"), "1000 m503.txt:2");
  EXPECT_EQ(told(s, "limits.travel_accel_mm_s2"), "1500 m503.txt:2");
  EXPECT_EQ(told(s, "limits.jerk_y_mm_s"), "9 m503.txt:3");
  EXPECT_FALSE(s.refusal);
}

TEST(RrfMaxVelocity, InMmPerSecondBringsANote) {
  const std::vector<std::string> told_notes = notes(read(std::string(kRrf) + "M203 X180 Y180\n"));
  EXPECT_THAT(told_notes,
              Contains(HasSubstr("M203 is in mm/min on RepRapFirmware, and this limits X "
                                 "to 3 mm/s; was 180 mm/s meant?")));
  EXPECT_THAT(read(std::string(kRrf) + "M203 X10800 Y10800\n").notes, IsEmpty());
}

// 84660 mm/min are 1411 mm/s, whose division leaves noise.
TEST(RrfMaxVelocity, HasTheDigitsThatWereWritten) {
  EXPECT_EQ(told(read(std::string(kRrf) + "M203 X84660 Y1000\n"), "limits.max_x_velocity_mm_s"),
            "1411 config.g:3");
  EXPECT_EQ(told(read(std::string(kRrf) + "M203 X84660 Y1000\n"), "limits.max_y_velocity_mm_s"),
            "16.6666667 config.g:3");
}

constexpr const char* kKlipper =
    "[printer]\nkinematics: corexy\nmax_velocity: 300\nmax_accel: 5000\n[input_shaper]\n"
    "shaper_type_x: mzv\nshaper_freq_x: 35\nshaper_type_y: mzv\nshaper_freq_y: 35\n";

TEST(Damping, ThatNoPrinterHasIsNotTakenForTheAxis) {
  for (const double ratio : {0.001, 0.7}) {
    const Settings s =
        read(fmt::format("{}damping_ratio_x: {}\ndamping_ratio_y: 0.08\n", kKlipper, ratio),
             "printer.cfg");
    EXPECT_THAT(told(s, "dynamics.x.damping_ratio"), HasSubstr("default")) << ratio;
    EXPECT_EQ(told(s, "dynamics.y.damping_ratio"), "0.08 printer.cfg:11");
    EXPECT_EQ(s.shaper_damping_ratio().x, ratio);  // the shaper is made for it all the same
    EXPECT_THAT(notes(s), Contains(HasSubstr("printer.cfg:10: warning: a damping ratio of")));
    EXPECT_THAT(read(fmt::format("{}damping_ratio_x: {}\n", kKlipper, ratio), "printer.cfg",
                     {"dynamics.x.damping_ratio=0.05"})
                    .notes,
                Not(Contains(::testing::Field(&Diagnostic::message, HasSubstr("no printer has")))));
  }
  const Settings rrf = read("M550 P\"x\"\nM593 P\"mzv\" F40 S0.002\n");
  EXPECT_THAT(told(rrf, "dynamics.x.damping_ratio"), HasSubstr("default"));
  const Settings marlin = read("echo:  M92 X80 Y80\necho:  M593 X F40 D0.001\n", "m503.txt");
  EXPECT_THAT(told(marlin, "dynamics.x.damping_ratio"), HasSubstr("default"));
}

TEST(Damping, OfTheUsersOwnCountsAndBringsANote) {
  const Settings s = read(kKlipper, "printer.cfg", {"dynamics.x.damping_ratio=0.6"});
  EXPECT_DOUBLE_EQ(s.dynamics.x.damping_ratio, 0.6);
  EXPECT_THAT(notes(s), Contains(HasSubstr("dynamics.x.damping_ratio is 0.6, but printers have")));
}

TEST(HybridCorexy, MayBeInverted) {
  for (const std::string name : {"hybrid_corexy", "ratos_hybrid_corexy"}) {
    const std::string text = fmt::format(
        "[printer]\nkinematics: {0}\nmax_velocity: 300\nmax_accel: 5000\n[{0}]\ninverted: ", name);
    EXPECT_EQ(read(text + "True\n", "printer.cfg").kinematics.type,
              Kinematics::hybrid_corexy_inverted);
    EXPECT_EQ(read(text + "false\n", "printer.cfg").kinematics.type, Kinematics::hybrid_corexy);
  }
}

// One resonance for both heads would be wrong for one of them.
TEST(KlipperHeads, AreToldOfWhereThereIsMoreThanOne) {
  const std::string printer(kKlipper);
  const auto notes = [&](const std::string& more) {
    std::string text;
    for (const Diagnostic& note : read(printer + more, "printer.cfg").notes) {
      text += to_string(note) + "\n";
    }
    return text;
  };
  const std::string alone = notes("");
  EXPECT_THAT(notes("[dual_carriage]\naxis: x\n"),
              HasSubstr("[dual_carriage]: this printer has more than one head"));
  EXPECT_THAT(notes("[toolchanger]\nname: a\n"), HasSubstr("[toolchanger]: this printer"));
  const std::string macro = "[gcode_macro T1]\ngcode:\n  ACTIVATE_EXTRUDER EXTRUDER=extruder1\n  ";
  EXPECT_THAT(notes(macro + "SET_INPUT_SHAPER SHAPER_FREQ_X=52 SHAPER_FREQ_Y=37\n"),
              HasSubstr("[gcode_macro T1] sets an input shaper"));
  EXPECT_EQ(notes(macro + "SET_INPUT_SHAPER SHAPER_FREQ_X=0 SHAPER_FREQ_Y=0\n"), alone);
  EXPECT_EQ(notes(macro + "SET_INPUT_SHAPER SHAPER_FREQ_X={params.X}\n"), alone);
}

// docs.kalico.gg, Config_Reference: constants.
TEST(KalicoReferences, AreFollowed) {
  const Settings s = read(
      "[constants]\naccel: 7000\nfreq: ${constants.base}\nbase: 42\n[printer]\nkinematics: corexy\n"
      "max_velocity: ${constants.speed}\nmax_accel: ${constants.accel}\n[input_shaper]\n"
      "shaper_freq_x: ${constants.freq}\nshaper_freq_y: ${input_shaper.shaper_freq_x}.5\n"
      "[constants]\nspeed: 350\n",
      "printer.cfg");
  EXPECT_EQ(told(s, "limits.max_accel_mm_s2"), "7000 printer.cfg:8");
  EXPECT_EQ(told(s, "limits.max_velocity_mm_s"), "350 printer.cfg:7");
  EXPECT_DOUBLE_EQ(s.shaper_freq_hz().x, 42.0);
  EXPECT_DOUBLE_EQ(s.shaper_freq_hz().y, 42.5);
}

TEST(KalicoReferences, ThatLeadNowhereAreNamed) {
  const Result<Settings> s =
      parse("[printer]\nkinematics: corexy\nmax_velocity: 300\nmax_accel: ${constants.accel}\n",
            "printer.cfg", {});
  ASSERT_FALSE(s);
  EXPECT_THAT(to_string(s.error()), HasSubstr("printer.cfg:4"));
}

TEST(KlipperRetraction, WithoutALengthHasNone) {
  const Settings s =
      read(std::string(kKlipper) + "[firmware_retraction]\nretract_speed: 30\n", "printer.cfg");
  ASSERT_TRUE(s.printer.retract_length_mm);
  EXPECT_DOUBLE_EQ(*s.printer.retract_length_mm, 0.0);
}

}  // namespace
}  // namespace unflex::machine
