// What no source says is told as a guess, and what is odd brings a note.

#include <fmt/core.h>
#include <gmock/gmock.h>

#include "reading.hpp"
#include "unflex/machine/recommend.hpp"

namespace unflex::machine {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

Settings read(const std::string& text, const std::vector<std::string>& overrides = {}) {
  Result<Settings> settings = parse(text, "p.toml", overrides);
  EXPECT_TRUE(settings) << to_string(settings.error());
  return settings.value_or(Settings{});
}

std::string guess(const Settings& settings) {
  return settings.guesses.empty() ? "" : to_string(settings.guesses.front());
}

std::string refusal(const std::string& text) {
  const Result<Settings> settings = parse(text, "p", {});
  EXPECT_FALSE(settings) << "was read";
  return settings ? "" : to_string(settings.error());
}

TEST(Guesses, AreTheResonancesThatNobodyGives) {
  EXPECT_EQ(guess(read("[limits]\nmax_accel_mm_s2 = 4000\n")),
            "p.toml: warning: the resonance along X and Y is not given, and 45 Hz is assumed, a "
            "guess that compensate refuses; find it with unflex identify or unflex tune, take it "
            "from the "
            "printer's own configuration with unflex printer init, or give --set "
            "dynamics.x.freq_hz=... --set dynamics.y.freq_hz=...");
  const Result<Settings> nothing = load({}, {});
  ASSERT_TRUE(nothing);
  EXPECT_THAT(guess(*nothing), StartsWith("warning: the resonance along X and Y"));
}

TEST(Guesses, NameTheAxis) {
  const std::string only_x = "[dynamics.x]\nfreq_hz = 52\n";
  EXPECT_THAT(guess(read(only_x)), HasSubstr("the resonance along Y is not given"));
  EXPECT_THAT(guess(read(only_x)), EndsWith("or give --set dynamics.y.freq_hz=..."));
  EXPECT_THAT(guess(read("", {"dynamics.y.freq_hz=40"})), HasSubstr("along X is not given"));
  EXPECT_EQ(guess(read(only_x, {"dynamics.y.freq_hz=40"})), "");
}

TEST(Guesses, AreNotTheResonancesOfMassesAndSprings) {
  const std::string mass = "mass_g = 500\nstiffness_n_mm = 40\ndamping_n_s_mm = 0.017\n";
  EXPECT_EQ(guess(read("[dynamics.x]\n" + mass + "[dynamics.y]\n" + mass)), "");
  EXPECT_THAT(guess(read("[dynamics.x]\n" + mass)), HasSubstr("along Y is not given"));
}

// A damping ratio says nothing of the frequency.
TEST(Guesses, StayWhereTheDampingIsGivenAlone) {
  EXPECT_THAT(guess(read("[dynamics.x]\nfreq_hz = 50\n[dynamics.y]\ndamping_ratio = 0.05\n")),
              HasSubstr("along Y is not given"));
}

// What is read again says no more than before.
TEST(Guesses, StayInATomlThatWasMadeOfThem) {
  EXPECT_THAT(read(to_toml(read(""))).guesses, SizeIs(1));
  const std::vector<std::string> given = {"dynamics.x.freq_hz=45", "dynamics.y.freq_hz=45"};
  EXPECT_THAT(read(to_toml(read("", given))).guesses, IsEmpty());
}

TEST(Frequencies, ThatNoPrinterHasBringANote) {
  for (const auto& [freq_hz, is_odd] : {std::pair{"9.9", true}, std::pair{"10", false},
                                        std::pair{"200", false}, std::pair{"200.1", true}}) {
    const Settings s =
        read("[dynamics.x]\nfreq_hz = 50\n", {fmt::format("dynamics.y.freq_hz={}", freq_hz)});
    ASSERT_THAT(s.notes, SizeIs(is_odd ? 1 : 0)) << freq_hz;
    if (is_odd) {
      EXPECT_EQ(to_string(s.notes[0]),
                fmt::format("--set dynamics.y.freq_hz={0}: warning: dynamics.y.freq_hz is {0}, but "
                            "printers swing at 10 to 200 Hz; look whether it is in Hz and of this "
                            "axis, or measure it with unflex identify",
                            freq_hz));
    }
  }
}

TEST(ShaperFrequency, IsNeverThatOfTheDynamics) {
  const std::vector<std::string> dynamics = {"dynamics.x.freq_hz=50", "dynamics.y.freq_hz=40"};
  const Settings s = read("[printer]\ninput_shaper_freq_y_hz = 42\n", dynamics);
  EXPECT_TRUE(s.shaper_unknown().x);
  EXPECT_FALSE(s.shaper_unknown().y);
  EXPECT_EQ(told(s, "printer.input_shaper_freq_x_hz"), " default");
  EXPECT_THAT(to_toml(s), HasSubstr("# input_shaper_freq_x_hz is unset: not known\n"));
  EXPECT_DOUBLE_EQ(s.shaper_freq_hz().y, 42.0);
  EXPECT_TRUE(read("", {"printer.firmware=marlin"}).shaper_unknown().x);
  // RepRapFirmware has one shaper for both axes.
  const Settings rrf = read("", {"printer.firmware=rrf", "printer.input_shaper_freq_x_hz=0"});
  EXPECT_FALSE(rrf.shaper_unknown().x || rrf.shaper_unknown().y);
  // The command that switches it off does harm there.
  EXPECT_FALSE(
      read("", {"printer.firmware=marlin", "printer.variant=snapmaker_j1"}).shaper_unknown().x);
}

TEST(SpeedStep, IsKeptOrRefused) {
  EXPECT_THAT(refusal("[emit]\nmax_speed_step_mm_s = 5\n"),
              StartsWith("p:2: emit.max_speed_step_mm_s is 5, but must be at least 6.47, what "
                         "limits.max_accel_mm_s2"));
  EXPECT_DOUBLE_EQ(read("[emit]\nmax_speed_step_mm_s = 6.47\n").emit.max_speed_step_mm_s, 6.47);
  // The default gives way.
  EXPECT_GT(read("", {"emit.max_lines_per_s=100"}).least_speed_step_mm_s(), 30.0);
}

TEST(M115, AloneIsNotEnough) {
  const std::string answer = "FIRMWARE_NAME:Marlin 2.1.2 (Jan 1 2024) PROTOCOL_VERSION:1.0\nok\n";
  EXPECT_THAT(refusal(answer), HasSubstr("append what M503 answers"));
  EXPECT_THAT(refusal(answer), HasSubstr("dynamics.x.freq_hz and dynamics.y.freq_hz"));
  EXPECT_EQ(read(answer + "echo:  M92 X80 Y80\necho:  M203 X300 Y300\n").printer.version, "2.1.2");
}

// Files that are given for the printer by mistake.
TEST(OtherFiles, AreNamedWithTheWayOut) {
  for (const char* head : {"freq,psd_x,psd_y,psd_z,psd_xyz\n5.0,1.2e+03,1.1,1.2,1.3\n",
                           "#time,accel_x,accel_y,accel_z\n0.1,1,2,3\n"}) {
    EXPECT_THAT(refusal(head), HasSubstr("is a record of an accelerometer, not a printer file"));
  }
  EXPECT_THAT(refusal("[virtual_sdcard]\npath: ~/gcodes\n[mcu]\nserial: a\n"
                      "[gcode_macro PAUSE]\ngcode:\n  BASE_PAUSE\n"),
              HasSubstr("has no [printer]"));
}

TEST(Suggestions, FindNamesThatBeginAlike) {
  const Result<Settings> settings = parse("", "p.toml", {"dynamics.x.frequency=45"});
  ASSERT_FALSE(settings);
  EXPECT_THAT(to_string(settings.error()), HasSubstr("did you mean 'dynamics.x.freq_hz'?"));
}

TEST(RrfKinematics, InAnExpressionAreNotTaken) {
  const std::string head = "M550 P\"x\"\nM593 P\"zvd\" F40\n";
  const Settings s = read(head + "M669 K1\nM669 K{global.max_y + 1}\n");
  EXPECT_EQ(s.kinematics.type, Kinematics::corexy);
  ASSERT_THAT(s.notes, SizeIs(1));
  EXPECT_THAT(to_string(s.notes[0]), StartsWith("p.toml:4: warning: no number behind K"));
  EXPECT_THAT(read(head + "M669 K{global.kind}\n", {"kinematics.type=corexy"}).notes, IsEmpty());
  EXPECT_THAT(refusal(head + "M669 K-1\n"), HasSubstr("kinematics K-1 is a machine that"));
}

TEST(RrfKinematics, OfACorexzBlameASlowZMotor) {
  const std::string head = "M550 P\"x\"\nM593 P\"zvd\" F40\nM201 X6000 Y6000 Z100\n";
  const Settings s = read(head + "M669 K2\n");
  ASSERT_THAT(s.notes, SizeIs(1));
  EXPECT_THAT(to_string(s.notes[0]),
              StartsWith("p.toml:3: warning: limits.max_z_accel_mm_s2 (M201 Z) is 100, and on a "
                         "corexz the Z motor moves X too"));
  EXPECT_THAT(read(head + "M669 K1\n").notes, IsEmpty());
  EXPECT_THAT(read(head + "M669 K2\nM201 Z24000\n").notes, IsEmpty());
}

TEST(LineBudget, ThatIsTooLowIsNamed) {
  EXPECT_THAT(
      recommendations(read("", {"emit.max_lines_per_s=20"})),
      ElementsAre(StartsWith("emit.max_lines_per_s is 20, and lines so long cannot follow a "
                             "resonance at 45 Hz, so that runs stay as sliced; give 90")));
  EXPECT_THAT(recommendations(read("", {"emit.max_lines_per_s=90"})), IsEmpty());
}

TEST(HotendAhead, WithoutAModelIsNamed) {
  EXPECT_THAT(recommendations(read("", {"hotend.ahead=true", "hotend.gain_c=2"})),
              ElementsAre(StartsWith("hotend.ahead is true, but does nothing without a model")));
  EXPECT_THAT(recommendations(read("", {"hotend.ahead=true", "hotend.gain_c=2",
                                        "hotend.time_constant_s=300", "hotend.dead_time_s=5"})),
              IsEmpty());
}

TEST(StepLimits, OfMotorsWhoseStepsAreNotKnownAreNamed) {
  EXPECT_THAT(recommendations(read("", {"printer.driver=\"a4988\"", "printer.x_steps_per_mm=80"})),
              ElementsAre(StartsWith("a limit of step rates is given, but not the steps of both")));
  EXPECT_THAT(recommendations(read("", {"printer.driver=\"a4988\"", "printer.x_steps_per_mm=80",
                                        "printer.y_steps_per_mm=80"})),
              IsEmpty());
}

}  // namespace
}  // namespace unflex::machine
