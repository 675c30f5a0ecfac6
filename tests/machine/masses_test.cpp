// Machines that are masses on the drives of their motors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "unflex/machine/mode_frame.hpp"

namespace unflex::machine {
namespace {

using ::testing::HasSubstr;

constexpr std::string_view kCoreXY =
    "[limits]\nmax_accel_mm_s2 = 5000\n[kinematics]\ntype = \"corexy\"\n"
    "[dynamics]\nof = \"masses\"\ntool_mass_g = 300\n"
    "[dynamics.y]\ngantry_mass_g = 300\n"
    "[dynamics.a]\nstiffness_n_mm = 40\ndamping_n_s_mm = 0.02\n"
    "[dynamics.b]\nstiffness_n_mm = 36\ndamping_n_s_mm = 0.018\n";

Result<Settings> parsed(std::string text, const std::vector<std::string>& overrides = {}) {
  return parse(text, "printer.toml", overrides);
}

std::string refusal(std::string_view from, std::string_view to) {
  std::string text(kCoreXY);
  text.replace(text.find(from), from.size(), to);
  const Result<Settings> settings = parsed(text);
  return settings ? std::string("none") : to_string(settings.error());
}

// The numbers of a CoreXY whose belts are a tenth apart: 56.4874 and 80.2165 Hz.
TEST(MassesOnDrives, ShowEachAxisItsShareOfTheModes) {
  const Result<Settings> settings = parsed(std::string(kCoreXY));
  ASSERT_TRUE(settings) << to_string(settings.error());
  const Axes<AxisDynamics>& dynamics = settings->dynamics;
  EXPECT_NEAR(dynamics.x.freq_hz, 80.2165, 5e-5);
  EXPECT_NEAR(dynamics.y.freq_hz, 56.4874, 5e-5);
  for (const AxisDynamics& axis : {dynamics.x, dynamics.y}) {
    ASSERT_EQ(axis.modes.size(), 2U);
    EXPECT_NEAR(axis.modes[0].gain + axis.modes[1].gain, 1.0, 1e-12);
    EXPECT_NEAR(std::max(axis.modes[0].gain, axis.modes[1].gain), 0.99455, 1e-4);
  }
  EXPECT_TRUE(settings->validate());
  ASSERT_TRUE(mode_frame(*settings).has_value());
  EXPECT_FALSE(mode_frame(*settings)->mode(2)) << "nothing says that Z swings";
  EXPECT_FALSE(mode_frame(Settings{}).has_value());
}

TEST(MassesOnDrives, AreAxesWhereTheBeltsAreEqual) {
  const Result<Settings> settings = parsed(
      std::string(kCoreXY), {"dynamics.b.stiffness_n_mm=40", "dynamics.b.damping_n_s_mm=0.02"});
  ASSERT_TRUE(settings) << to_string(settings.error());
  EXPECT_TRUE(settings->dynamics.x.modes.empty());
  EXPECT_NEAR(settings->dynamics.x.freq_hz, 82.1873, 5e-5);
  EXPECT_NEAR(settings->dynamics.y.freq_hz, 58.1152, 5e-5);
  // c/(2√(km)) of two belts.
  EXPECT_NEAR(settings->dynamics.y.damping_ratio, 0.04e3 / (2.0 * std::sqrt(80e3 * 0.6)), 1e-9);
}

TEST(MassesOnDrives, AreRefusedWithTheirPlaceWhereTheyAreWrong) {
  EXPECT_THAT(refusal("tool_mass_g = 300\n", ""),
              HasSubstr("printer.toml:6: dynamics.of is \"masses\", so dynamics.tool_mass_g must"));
  EXPECT_THAT(refusal("stiffness_n_mm = 36\n", ""),
              HasSubstr("the motor B moves X or Y, so dynamics.b.stiffness_n_mm must be given"));
  EXPECT_THAT(refusal("gantry_mass_g = 300", "gantry_mass_g = 300\nfreq_hz = 40"),
              HasSubstr("printer.toml:10: dynamics.y.freq_hz is given, but dynamics.of is "
                        "\"masses\"; remove dynamics.y.freq_hz or set dynamics.of to \"axes\""));
  EXPECT_THAT(refusal("of = \"masses\"\n", ""),
              HasSubstr("is given, but dynamics.of is \"axes\"; remove"));
  EXPECT_THAT(refusal("stiffness_n_mm = 36", "stiffness_n_mm = 360000"),
              HasSubstr("which is out of range; check their units"));
  EXPECT_THAT(refusal("damping_n_s_mm = 0.018", "damping_n_s_mm = 1"),
              HasSubstr("a mode is damped so much that it does not swing"));
  EXPECT_THAT(refusal("[limits]\n", "[timing]\ntolerance_um = 20\n[limits]\n"),
              HasSubstr("timing.tolerance_um"));
  EXPECT_THAT(refusal("[limits]\n", "[second]\nx_freq_hz = 120\n[limits]\n"),
              HasSubstr("second.x_freq_hz"));
}

TEST(MassesOnDrives, TellThatDampingCouplesTheModes) {
  std::string text(kCoreXY);
  const std::string_view from = "damping_n_s_mm = 0.018";
  text.replace(text.find(from), from.size(), "damping_n_s_mm = 0.001");
  const Result<Settings> settings = parsed(text);
  ASSERT_TRUE(settings) << to_string(settings.error());
  ASSERT_FALSE(settings->notes.empty());
  EXPECT_THAT(to_string(settings->notes.front()),
              HasSubstr("% of the damping couples the modes, which unflex leaves out"));
}

}  // namespace
}  // namespace unflex::machine
