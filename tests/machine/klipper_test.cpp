// A printer.cfg, read as Klipper reads it, gives all that is needed.

#include <fmt/core.h>
#include <gmock/gmock.h>

#include "reading.hpp"

namespace unflex::machine {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char* kWhole =
    "[printer]\nkinematics: cartesian\nmax_velocity: 200\nmax_accel: 1000\n"
    "[input_shaper]\nshaper_freq_x: 40\nshaper_freq_y: 50\n";

class KlipperFiles : public PrinterFiles {
 protected:
  static std::string failure(const std::string& file) {
    const Result<Settings> settings = load(file, {});
    EXPECT_FALSE(settings) << "was read";
    EXPECT_TRUE(settings || settings.error().kind == ErrorKind::usage);
    return settings ? "" : to_string(settings.error());
  }
  static Settings good(const std::string& file) {
    Result<Settings> settings = load(file, {});
    EXPECT_TRUE(settings) << to_string(settings.error());
    return settings.value_or(Settings{});
  }
};

TEST_F(KlipperFiles, TellTheStepsOfMotors) {
  const Settings s = good(write(
      "printer.cfg",
      std::string(kWhole) +
          "[stepper_x]\nrotation_distance: 40\nmicrosteps: 16\n"
          "[stepper_y]\nrotation_distance: 40\nmicrosteps: 32\nfull_steps_per_rotation: 400\n"
          "[stepper_z]\nrotation_distance: 8\n"
          "[extruder]\nrotation_distance: 22.6789511\nmicrosteps: 16\ngear_ratio: 50:10, 2 : 1\n"));
  EXPECT_DOUBLE_EQ(s.printer.steps_per_mm[0].value_or(0.0), 80.0);
  EXPECT_DOUBLE_EQ(s.printer.steps_per_mm[1].value_or(0.0), 320.0);
  EXPECT_FALSE(s.printer.steps_per_mm[2]);
  EXPECT_NEAR(s.printer.steps_per_mm[3].value_or(0.0), 1411.0, 0.1);
}

TEST_F(KlipperFiles, AreReadWithTheirIncludesAndWhatWasSaved) {
  const Settings s = good(fixture("printer.cfg"));
  EXPECT_EQ(told(s, "printer.firmware"), "\"klipper\" printer.cfg:8");
  EXPECT_EQ(told(s, "limits.max_velocity_mm_s"), "280 printer.cfg:10");
  EXPECT_EQ(told(s, "limits.max_accel_mm_s2"), "4200 printer.cfg:11");
  EXPECT_EQ(told(s, "limits.minimum_cruise_ratio"), "0.5 printer.cfg:12");
  EXPECT_EQ(told(s, "limits.square_corner_velocity_mm_s"), "6.5 printer.cfg:13");
  EXPECT_EQ(told(s, "limits.max_z_velocity_mm_s"), "14 printer.cfg:14");
  EXPECT_EQ(told(s, "limits.max_z_accel_mm_s2"), "120 printer.cfg:15");
  EXPECT_EQ(told(s, "printer.travel_x_mm"), "[-4.5, 235] printer.cfg:21");
  EXPECT_EQ(told(s, "printer.travel_y_mm"), "[0, 228] printer.cfg:27");
  EXPECT_EQ(told(s, "extruder.nozzle_diameter_mm"), "0.6 extruder.cfg:2");
  EXPECT_EQ(told(s, "extruder.filament_diameter_mm"), "1.75 extruder.cfg:3");
  EXPECT_EQ(told(s, "extruder.max_extrude_cross_section_mm2"), "5 extruder.cfg:4");
  EXPECT_EQ(told(s, "extruder.instantaneous_corner_velocity_mm_s"), "2 extruder.cfg:5");
  EXPECT_EQ(told(s, "printer.firmware_retraction"), "true shaper.cfg:4");
  EXPECT_EQ(told(s, "printer.retract_length_mm"), "0.8 shaper.cfg:5");
  EXPECT_EQ(told(s, "printer.unretract_speed_mm_s"), "10 default");
  EXPECT_EQ(told(s, "printer.arc_resolution_mm"), "0.25 macros.cfg:9");
}

TEST_F(KlipperFiles, GiveTheResonanceForWhichKlipperChoosesTheShaper) {
  const Settings s = good(fixture("printer.cfg"));
  EXPECT_EQ(told(s, "dynamics.x.freq_hz"), "50.4 shaper.cfg:2");
  EXPECT_EQ(told(s, "dynamics.x.damping_ratio"), "0.1 shaper.cfg:2");
  EXPECT_EQ(told(s, "dynamics.y.freq_hz"), "37.8 printer.cfg:41");
  EXPECT_EQ(told(s, "dynamics.y.damping_ratio"), "0.07 printer.cfg:42");
  EXPECT_EQ(told(s, "dynamics.freq_error"), "0.1 default");
  EXPECT_EQ(told(s, "printer.input_shaper_freq_x_hz"), "51.2 shaper.cfg:2");
  ASSERT_THAT(s.notes, SizeIs(2));
  EXPECT_THAT(to_string(s.notes[0]),
              HasSubstr("shaper.cfg:2: warning: Klipper chooses mzv at some 1.015 times the "
                        "resonance, so shaper_freq_x of 51.2 Hz is taken for 50.4 Hz ± 5 %; unflex "
                        "identify"));
  EXPECT_THAT(s.guesses, IsEmpty());
}

// Measured: where the mode was at 61.1 Hz, Klipper advised mzv at 63.4 Hz.
TEST_F(KlipperFiles, GiveAResonanceNearAMeasuredOne) {
  const auto file = [&](std::string_view type, double freq_hz) {
    return write("a.cfg", fmt::format("[printer]\nkinematics: corexy\nmax_velocity: 200\n"
                                      "max_accel: 1000\n[input_shaper]\nshaper_type: {}\n"
                                      "shaper_freq_x: {}\nshaper_freq_y: {}\n",
                                      type, freq_hz, freq_hz));
  };
  const Settings measured = good(file("mzv", 63.4));
  EXPECT_NEAR(measured.dynamics.x.freq_hz, 61.1, 0.05 * 61.1);
  EXPECT_DOUBLE_EQ(measured.shaper_freq_hz().x, 63.4) << "set back as it was";
  EXPECT_DOUBLE_EQ(good(file("zv", 50.5)).dynamics.y.freq_hz, 50.0);
  EXPECT_DOUBLE_EQ(good(file("ei", 62.0)).dynamics.y.freq_hz, 50.0);
  EXPECT_DOUBLE_EQ(good(file("2hump_ei", 80.0)).dynamics.x.freq_hz, 50.0);
  EXPECT_DOUBLE_EQ(good(file("3hump_ei", 100.5)).dynamics.x.freq_hz, 50.0);
  const Settings unknown = good(file("mzv(n=4)", 50.0));
  EXPECT_THAT(unknown.guesses, SizeIs(1)) << "nothing to derive from";
  EXPECT_EQ(unknown.shaper_type().x, "mzv(n=4)");
  EXPECT_EQ(good(file("mzv(n=2)", 50.0)).shaper_type().x, "mzv") << "Klipper refuses it";
}

TEST_F(KlipperFiles, TellNothingOfTheirShapersOnceBothResonancesAreGiven) {
  const std::vector<std::string> x = {"dynamics.x.freq_hz=50"};
  std::vector<std::string> both = x;
  both.emplace_back("dynamics.y.freq_hz=40");
  const Result<Settings> half = load(fixture("printer.cfg"), x);
  ASSERT_TRUE(half);
  EXPECT_THAT(half->notes, SizeIs(1));
  const Result<Settings> whole = load(fixture("printer.cfg"), both);
  ASSERT_TRUE(whole);
  EXPECT_THAT(whole->notes, IsEmpty());
}

TEST_F(KlipperFiles, WithoutAShaperHaveNoneToSetBackAndAnUnknownResonance) {
  const Settings s =
      good(write("printer.cfg",
                 "[printer]\nkinematics: cartesian\nmax_velocity: 200\nmax_accel: 1000\n[mcu]\n"));
  EXPECT_EQ(told(s, "printer.input_shaper_freq_x_hz"), "0 printer.cfg");
  EXPECT_FALSE(s.shaper_unknown().x);
  EXPECT_EQ(told(s, "printer.firmware_retraction"), "false printer.cfg");
  EXPECT_EQ(told(s, "dynamics.x.freq_hz"), "45 default");
  ASSERT_THAT(s.guesses, SizeIs(1));
  EXPECT_THAT(to_string(s.guesses[0]),
              HasSubstr("printer.cfg: warning: the resonance along X and Y"));
}

TEST_F(KlipperFiles, TakeTheLastOfAnOptionInTheOrderOfTheIncludes) {
  write("later.cfg", "[printer]\nmax_accel: 2\n");
  EXPECT_EQ(told(good(write("a.cfg", std::string(kWhole) + "[include later.cfg]\n")),
                 "limits.max_accel_mm_s2"),
            "2 later.cfg:2");
  EXPECT_EQ(told(good(write("b.cfg", std::string("[include later.cfg]\n") + kWhole)),
                 "limits.max_accel_mm_s2"),
            "1000 b.cfg:5");
}

TEST_F(KlipperFiles, FindIncludesBesideTheFileThatNamesThem) {
  write("sub/inner.cfg", "[printer]\nsquare_corner_velocity: 9\n");
  write("sub/outer.cfg", "[include inner.cfg]\n[include nothing*.cfg]\n");
  EXPECT_EQ(told(good(write("p.cfg", std::string("[include sub/outer.cfg]\n") + kWhole)),
                 "limits.square_corner_velocity_mm_s"),
            "9 inner.cfg:2");
}

TEST_F(KlipperFiles, ThatIncludeThemselvesAreRefused) {
  const std::string file = write("a.cfg", std::string(kWhole) + "[include b.cfg]\n");
  write("b.cfg", "[include a.cfg]\n");
  EXPECT_THAT(failure(file), EndsWith("a.cfg includes itself"));
  EXPECT_THAT(failure(file), HasSubstr("b.cfg:1: "));
}

TEST_F(KlipperFiles, DoWithoutIncludesThatAreMissing) {
  const Settings s = good(write("a.cfg", std::string(kWhole) + "[include no.cfg]\n"));
  EXPECT_EQ(told(s, "limits.max_accel_mm_s2"), "1000 a.cfg:4");
  EXPECT_EQ(told(s, "dynamics.x.damping_ratio"), "0.1 a.cfg:6");
  ASSERT_THAT(s.notes, SizeIs(3));
  EXPECT_THAT(to_string(s.notes[2]),
              ::testing::ContainsRegex("a.cfg:8: warning: the included file .*/no.cfg is missing, "
                                       "and unflex does without what it says; copy it from the "
                                       "printer to that place"));
}

// Klipper takes such a pattern for an empty set.
TEST_F(KlipperFiles, MayHavePatternsThatMatchNothing) {
  for (const std::string pattern : {"macros/*.cfg", "no?.cfg", "no[ab].cfg"}) {
    const Settings s =
        good(write("a.cfg", std::string(kWhole) + "[include " + pattern + "]\n[extruder]\n"));
    EXPECT_THAT(s.notes, SizeIs(2)) << pattern;
    EXPECT_EQ(told(s, "printer.firmware_retraction"), "false a.cfg") << pattern;
  }
}

TEST_F(KlipperFiles, DoWithoutLinksThatLeadNowhere) {
  const std::string file =
      write("a.cfg", std::string(kWhole) + "[include mainsail.cfg]\n[include main*.cfg]\n");
  std::filesystem::create_symlink("/nowhere/mainsail.cfg",
                                  std::filesystem::path(file).parent_path() / "mainsail.cfg");
  const Settings s = good(file);
  ASSERT_THAT(s.notes, SizeIs(4));
  EXPECT_THAT(to_string(s.notes[2]), HasSubstr("a.cfg:8: warning: the included file "));
  EXPECT_THAT(to_string(s.notes[3]), HasSubstr("a.cfg:9: warning: the included file "));
}

TEST_F(KlipperFiles, SayWhereWhatTheyNeedMayBe) {
  const std::string one =
      failure(write("a.cfg", "[include speeds.cfg]\n[printer]\nkinematics: corexy\n"));
  EXPECT_THAT(one,
              ::testing::ContainsRegex(
                  "a.cfg: max_velocity in \\[printer\\] is missing; it may be in .*/speeds.cfg "
                  "\\(.*/a.cfg:1\\), which is included but not there: copy it from"));
  const std::string two =
      failure(write("b.cfg", "[include p.cfg]\n[mcu]\nserial: x\n[include m/*.cfg]\n"));
  EXPECT_THAT(two, ::testing::ContainsRegex("b.cfg: kinematics in \\[printer\\] is missing; it may "
                                            "be in .*/p.cfg \\(.*/b.cfg:1\\) or .*/m/\\*.cfg "
                                            "\\(.*/b.cfg:4\\), which are included but not there"));
}

TEST_F(KlipperFiles, SayWhereTheSteppersOfCarriagesMayBe) {
  std::string text = kWhole;
  text.replace(text.find("cartesian"), 9, "generic_cartesian");
  text += "[include steppers.cfg]\n";
  EXPECT_THAT(failure(write("a.cfg", text)),
              ::testing::ContainsRegex("a.cfg:2: the steppers of this generic_cartesian and their "
                                       "carriages are missing; it may be in .*/steppers.cfg"));
  good(write("b.cfg", text + "[stepper a]\ncarriages: x\n"));
}

// Without what is missing nobody knows whether there is a shaper, or where it is.
TEST_F(KlipperFiles, LeaveOpenWhatAMissingIncludeMaySay) {
  const std::string text = "[printer]\nkinematics: corexy\nmax_velocity: 200\nmax_accel: 1000\n";
  const Settings s = good(write("a.cfg", text + "[include shaper.cfg]\n"));
  EXPECT_FALSE(s.printer.input_shaper.freq_hz.x);
  EXPECT_FALSE(s.printer.input_shaper.freq_hz.y);
  EXPECT_THAT(told(s, "printer.firmware_retraction"), EndsWith("default"));
  ASSERT_THAT(s.guesses, SizeIs(1));
  EXPECT_THAT(s.guesses[0].message, ::testing::ContainsRegex("; it may be in .*/shaper.cfg \\("));
  const Settings whole = good(write("b.cfg", text));
  EXPECT_EQ(whole.printer.input_shaper.freq_hz.x, 0.0);
  ASSERT_THAT(whole.guesses, SizeIs(1));
  EXPECT_THAT(whole.guesses[0].message, ::testing::Not(HasSubstr("it may be in")));
}

TEST_F(KlipperFiles, IgnoreWhatWasSavedOnceSomeoneHasWrittenBelow) {
  const Settings s = good(write(
      "a.cfg", std::string(kWhole) +
                   "#*# <---------------------- SAVE_CONFIG ---------------------->\n"
                   "#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.\n#*#\n"
                   "#*# [input_shaper]\n#*# damping_ratio_x = 0.3\n[extruder]\n"));
  EXPECT_EQ(told(s, "dynamics.x.damping_ratio"), "0.1 a.cfg:6");
  ASSERT_THAT(s.notes, SizeIs(3));
  EXPECT_EQ(s.notes[2].place.line, 13);
}

TEST_F(KlipperFiles, NameTheLineOfWhatIsWrong) {
  EXPECT_THAT(failure(write("a.cfg", std::string(kWhole) + "[extruder]\nnozzle_diameter: wide\n")),
              EndsWith("a.cfg:9: nozzle_diameter in [extruder] must be a number, not 'wide'"));
  EXPECT_THAT(failure(write("over_lines.cfg",
                            std::string(kWhole) + "[extruder]\nnozzle_diameter: 0.4\n  wide\n")),
              EndsWith("cfg:9: nozzle_diameter in [extruder] must be a number, not '0.4 wide'"));
  EXPECT_THAT(failure(write("b.cfg", std::string(kWhole) + "[extruder]\nnozzle_diameter: 0\n")),
              EndsWith("b.cfg:9: extruder.nozzle_diameter_mm is 0, but must be > 0"));
  EXPECT_THAT(failure(write("c.cfg", std::string(kWhole) + "[mcu]\nnonsense\n")),
              EndsWith("c.cfg:9: is neither [section] nor 'option: value'; Klipper would refuse it "
                       "too"));
  EXPECT_THAT(failure(write("d.cfg", "[mcu]\nserial: x\n[printer]\nkinematics: corexy\n")),
              HasSubstr("d.cfg: max_velocity in [printer] is missing"));
}

TEST_F(KlipperFiles, TellTheKinematics) {
  const auto told = [&](std::string_view name) {
    std::string text = kWhole;
    text.replace(text.find("cartesian"), 9, name);
    return good(write("a.cfg", text)).kinematics.type;
  };
  EXPECT_EQ(told("cartesian"), Kinematics::cartesian);
  EXPECT_EQ(told("generic_cartesian"), Kinematics::cartesian);
  EXPECT_EQ(told("corexy"), Kinematics::corexy);
  EXPECT_EQ(told("limited_corexy"), Kinematics::corexy);
  EXPECT_EQ(told("corexz"), Kinematics::corexz);
  EXPECT_EQ(told("hybrid_corexy"), Kinematics::hybrid_corexy);
  EXPECT_EQ(told("hybrid_corexz"), Kinematics::hybrid_corexz);
}

// kinematic_stepper.py: each stepper moves a sum of carriages.
TEST_F(KlipperFiles, TellTheMotorsOfCarriages) {
  std::string head = kWhole;
  head.replace(head.find("cartesian"), 9, "generic_cartesian");
  head += "[carriage x]\nposition_max: 200\n[carriage along_y]\naxis: y\n[carriage z]\n";
  const auto machine = [&](const std::string& steppers) {
    return good(write("a.cfg", head + steppers));
  };
  const Settings own = machine(
      "[stepper a]\ncarriages: x\n[stepper b]\ncarriages: along_y\n"
      "[stepper c]\ncarriages: along_y\n[stepper d]\ncarriages: -z\n");
  EXPECT_EQ(own.kinematics.type, Kinematics::cartesian);
  EXPECT_EQ(own.printer.travel_mm.x->max, 200.0);
  const Settings core = machine(
      "[stepper a]\ncarriages: x+along_y\n[stepper b]\ncarriages: x-along_y\n"
      "[stepper b1]\ncarriages: -1*x+1*along_y\n[stepper c]\ncarriages: z\n");
  EXPECT_EQ(core.kinematics.type, Kinematics::corexy);
  const Settings tripteron = machine(
      "[stepper a]\ncarriages: x+along_y-z\nrotation_distance: 40\nmicrosteps: 16\n"
      "[stepper b]\ncarriages: x-along_y-z\n[stepper c]\ncarriages: x+0.5*z\n");
  EXPECT_EQ(tripteron.kinematics.type, Kinematics::linear);
  EXPECT_EQ(tripteron.motors().rows(),
            (Motors::Rows{{{1.0, 1.0, -1.0}, {1.0, -1.0, -1.0}, {1.0, 0.0, 0.5}}}));
  EXPECT_EQ(tripteron.printer.steps_per_mm[0], 80.0);
}

TEST_F(KlipperFiles, NameTheLineOfCarriagesThatMakeNoMachine) {
  std::string head = kWhole;
  head.replace(head.find("cartesian"), 9, "generic_cartesian");
  const auto error = [&](const std::string& steppers) {
    return failure(write("a.cfg", head + steppers));
  };
  EXPECT_THAT(
      error("[stepper a]\ncarriages: x+left\n"),
      HasSubstr("a.cfg:9: [stepper a] moves the carriage 'left', and no section tells its"));
  EXPECT_THAT(error("[stepper a]\ncarriages: x-x\n"), HasSubstr("names two carriages of X"));
  EXPECT_THAT(error("[stepper a]\ncarriages: two*x\n"),
              HasSubstr("'two*x' is no number times a carriage"));
  EXPECT_THAT(error("[stepper a]\ncarriages: x+y\n[stepper b]\ncarriages: z\n"),
              HasSubstr("2 different sums of carriages, and unflex knows machines with three"));
  EXPECT_THAT(error("[stepper a]\ncarriages: x+y\n[stepper b]\ncarriages: 2*x+2*y\n"
                    "[stepper c]\ncarriages: z\n"),
              HasSubstr("no machine can have these motors: its motors do not move X, Y and Z"));
}

TEST_F(KlipperFiles, OfOtherMachinesAreRefused) {
  for (const std::string name :
       {"delta", "rotary_delta", "deltesian", "polar", "winch", "none", "cartesianer"}) {
    std::string text = kWhole;
    text.replace(text.find("cartesian"), 9, name);
    EXPECT_THAT(failure(write("a.cfg", text)),
                HasSubstr("a.cfg:2: unflex does not support kinematics '" + name + "' yet, only"));
  }
}

TEST_F(KlipperFiles, AreToldByTheirContentAndNotByTheirName) {
  EXPECT_EQ(good(write("a.toml", kWhole)).limits.max_accel_mm_s2, 1000.0);
  EXPECT_EQ(good(write("b.cfg", "[limits]\nmax_accel_mm_s2 = 77\n")).limits.max_accel_mm_s2, 77.0);
  EXPECT_THAT(failure(write("c.toml", "[limits]\nmax_accel = 7\nmax_velocity = 7\n")),
              HasSubstr("did you mean 'limits.max_accel_mm_s2'?"));
}

}  // namespace
}  // namespace unflex::machine
