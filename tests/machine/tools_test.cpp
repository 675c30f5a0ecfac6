// The tools of a tool changer in a printer file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "reading.hpp"
#include "unflex/machine/as_printer.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::machine {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const std::string kPrinter =
    "[dynamics.x]\nfreq_hz = 45\n[dynamics.y]\nfreq_hz = 40\ndamping_ratio = 0.08\n";
const std::string kTwoTools =
    kPrinter +
    "[tool.0]\n[tool.1]\ndynamics.x.freq_hz = 36\ndynamics.y.damping_ratio = 0.1\n"
    "offset_mm = [17.5, -2]\n";

Result<Settings> parsed(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return parse(text, "printer.toml", overrides);
}

std::string complaint(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const Result<Settings> settings = parsed(text, overrides);
  return settings ? "none" : to_string(settings.error());
}

TEST(ATool, HasItsOwnValuesAndTheRestOfThePrinter) {
  const Result<Settings> settings = parsed(kTwoTools);
  ASSERT_TRUE(settings) << to_string(settings.error());
  ASSERT_EQ(settings->tools.size(), 2U);
  const Settings first = with_tool(*settings, 0);
  EXPECT_EQ(first.dynamics.x.freq_hz, 45.0);
  EXPECT_EQ(first.dynamics.y.damping_ratio, 0.08);
  const Settings second = with_tool(*settings, 1);
  EXPECT_EQ(second.dynamics.x.freq_hz, 36.0);
  EXPECT_EQ(second.dynamics.x.damping_ratio, 0.06);
  EXPECT_EQ(second.dynamics.y.freq_hz, 40.0);
  EXPECT_EQ(second.dynamics.y.damping_ratio, 0.1);
  EXPECT_EQ(with_tool(*settings, 2).dynamics.x.freq_hz, 45.0);
  EXPECT_EQ(told(*settings, "tool.1.dynamics.x.freq_hz"), "36 printer.toml:8");
  EXPECT_EQ(told(*settings, "tool.1.offset_mm"), "[17.5, -2] printer.toml:10");
}

TEST(ATool, MayBeSetOnTheCommandLine) {
  const Result<Settings> settings =
      parsed(kTwoTools, {"tool.1.dynamics.x.freq_hz=40", "tool.15.dynamics.y.freq_hz=30"});
  ASSERT_TRUE(settings) << to_string(settings.error());
  EXPECT_EQ(with_tool(*settings, 1).dynamics.x.freq_hz, 40.0);
  EXPECT_EQ(with_tool(*settings, 15).dynamics.y.freq_hz, 30.0);
  EXPECT_EQ(told(*settings, "tool.1.dynamics.x.freq_hz"), "40 --set");
}

TEST(ATool, WithAFrequencySwingsInOneMode) {
  const std::string modes =
      "[dynamics.x]\nmode = [{freq_hz = 45, damping_ratio = 0.06, gain = 0.8}, {freq_hz = 90, "
      "damping_ratio = 0.06, gain = 0.2}]\n[dynamics.y]\nfreq_hz = 40\n"
      "[tool.0]\n[tool.1]\ndynamics.x.freq_hz = 36\n";
  const Result<Settings> settings = parsed(modes);
  ASSERT_TRUE(settings) << to_string(settings.error());
  EXPECT_EQ(with_tool(*settings, 0).dynamics.x.modes.size(), 2U);
  EXPECT_THAT(with_tool(*settings, 1).dynamics.x.modes, IsEmpty());
  EXPECT_EQ(nozzle_axes(with_tool(*settings, 1)).x.mode_count(), 1U);
}

// A map tells shares of freq_hz, and places of the carriage.
TEST(ATool, HasThePrintersMapAtItsOwnFrequencyAndPlace) {
  const Result<Settings> settings =
      parsed(kTwoTools, {"dynamics.x.map=[{along = \"x\", at_mm = [0, 100], freq_hz = [45, 90]}]"});
  ASSERT_TRUE(settings) << to_string(settings.error());
  const AxisDynamics x = with_tool(*settings, 1).dynamics.x;
  EXPECT_DOUBLE_EQ(x.freq_hz * x.share_at({17.5, 0.0}), 36.0);
  EXPECT_DOUBLE_EQ(x.freq_hz * x.share_at({67.5, 0.0}), 54.0);
}

TEST(ATool, IsWrittenAsItWasRead) {
  const Result<Settings> settings = parsed(kTwoTools);
  ASSERT_TRUE(settings);
  const Result<Settings> again = parsed(to_toml(*settings));
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(rows(*again).size(), rows(*settings).size());
  ASSERT_EQ(again->tools.size(), 2U);
  EXPECT_EQ(again->tools[1].freq_hz.x, 36.0);
  EXPECT_EQ(again->tools[1].offset_mm.x, 17.5);
}

TEST(ATool, WithWrongKeysIsRefusedAtItsPlace) {
  EXPECT_EQ(complaint(kPrinter + "[tool.0]\ndynamics.x.freq_hz = 0.5\n"),
            "printer.toml:7: tool.0.dynamics.x.freq_hz is 0.5, but must be ≥ 1, ≤ 1000");
  EXPECT_EQ(complaint(kPrinter + "[tool.0]\ndynamics.x.freq_hz = \"fast\"\n"),
            "printer.toml:7: tool.0.dynamics.x.freq_hz must be a number, not the text \"fast\"");
  EXPECT_THAT(complaint(kPrinter + "[tool.0]\ndynamics.x.freq_herz = 40\n"),
              HasSubstr("printer.toml:7: unknown key 'tool.0.dynamics.x.freq_herz'"));
  EXPECT_THAT(complaint(kPrinter + "[tool.3]\nlimits.max_accel_mm_s2 = 4\n"),
              HasSubstr("printer.toml:7: unknown key 'tool.3.limits"));
  EXPECT_EQ(complaint(kPrinter + "[tool.16]\n"),
            "printer.toml:6: unknown tool 'tool.16'; tools are [tool.0] to [tool.15]");
  EXPECT_THAT(complaint(kPrinter + "[tool.01]\n"), HasSubstr("printer.toml:6: unknown tool"));
  EXPECT_THAT(complaint(kPrinter + "[tools.1]\n"), HasSubstr("unknown section 'tools'"));
  EXPECT_EQ(complaint(kPrinter + "tool = 3\n"), "printer.toml:6: unknown key 'dynamics.y.tool'");
  EXPECT_EQ(complaint("tool = 3\n" + kPrinter), "printer.toml:1: 'tool' is a section, not a key");
  EXPECT_THAT(complaint(kPrinter + "[tool.0]\noffset_mm = 3\n"),
              HasSubstr("printer.toml:7: tool.0.offset_mm must be two numbers"));
  EXPECT_THAT(complaint(kPrinter, {"tool.1.freq_hz=40"}),
              HasSubstr("unknown key 'tool.1.freq_hz', did you mean"));
}

// 1 ms is too long for 400 Hz.
TEST(ATool, FitsTheOtherSettings) {
  EXPECT_THAT(complaint(kPrinter + "[emit]\nperiod_ms = 1\n[tool.2]\n"
                                   "dynamics.x.freq_hz = 400\n"),
              HasSubstr("with tool 2: emit.period_ms is 1"));
  Settings settings;
  settings.tools = {{.number = 1, .freq_hz = {0.1, std::nullopt}}};
  const Status valid = settings.validate();
  ASSERT_FALSE(valid);
  EXPECT_EQ(valid.error().message, "tool.1.dynamics.x.freq_hz is 0.1, but must be ≥ 1, ≤ 1000");
}

// A printer.cfg with several heads brings a note until they have frequencies of their own.
TEST(ATool, AnswersTheNoteAboutSeveralHeads) {
  const std::string klipper =
      "[printer]\nkinematics: corexy\nmax_velocity: 300\nmax_accel: 3000\n[input_shaper]\n"
      "shaper_freq_x: 45\nshaper_freq_y: 40\n[toolchanger]\n";
  const auto notes = [&](const std::vector<std::string>& overrides) {
    std::string text;
    const Result<Settings> settings = parse(klipper, "printer.cfg", overrides);
    for (const Diagnostic& note : settings->notes) {
      text += note.message + "\n";
    }
    return text;
  };
  EXPECT_THAT(notes({}), HasSubstr("[toolchanger]: this printer has more than one head"));
  EXPECT_THAT(notes({"tool.1.dynamics.x.freq_hz=36"}), Not(HasSubstr("[toolchanger]")));
}

// No print begins with the printer's own frequencies if all tools have theirs.
TEST(ATool, LeavesNoGuessIfAllHaveFrequencies) {
  const std::string own = "dynamics.x.freq_hz = 40\ndynamics.y.freq_hz = 41\n";
  EXPECT_THAT(parsed("[tool.0]\n" + own + "[tool.1]\n" + own)->guesses, IsEmpty());
  EXPECT_EQ(parsed("[tool.0]\n[tool.1]\n" + own)->guesses.size(), 1U);
  EXPECT_EQ(parsed("[tool.1]\n" + own)->guesses.size(), 1U);
}

}  // namespace
}  // namespace unflex::machine
