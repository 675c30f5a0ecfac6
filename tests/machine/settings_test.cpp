// The settings have what the printer file says, and the rest follows from that.

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <regex>

#include "paths.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/machine/recommend.hpp"

namespace unflex::machine {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Settings read(std::string_view text, const std::vector<std::string>& overrides = {}) {
  Result<Settings> settings = parse(text, "printer.toml", overrides);
  EXPECT_TRUE(settings) << to_string(settings.error());
  return settings.value_or(Settings{});
}

// Fuzzing found this: −0 was written as -0 and read again as 0.
TEST(Settings, HoldNoZeroWithASign) {
  const Result<Settings> settings =
      parse("[printer]\nunretract_extra_length_mm = -0.0\n", "printer.toml", {});
  ASSERT_TRUE(settings.has_value());
  EXPECT_FALSE(std::signbit(settings->printer.unretract_extra_length_mm));
}

TEST(Settings, ThatWereReadAreValid) {
  const std::string examples = test_paths::kExamples;
  for (const std::string& name :
       {examples + "/printer.toml", std::string(test_paths::kData) + "/modes.toml"}) {
    const Result<Settings> settings = load(name, {});
    ASSERT_TRUE(settings) << to_string(settings.error());
    const Status valid = settings->validate();
    EXPECT_TRUE(valid) << name << ": " << to_string(valid.error());
  }
  EXPECT_TRUE(Settings{}.validate());
}

// In code nothing hinders any value.
TEST(Settings, ThatWereSetInCodeAreChecked) {
  const auto complaint = [](const auto& change) {
    Settings settings;
    change(settings);
    const Status valid = settings.validate();
    return valid ? std::string("none") : valid.error().message;
  };
  EXPECT_EQ(complaint([](Settings& s) { s.limits.max_accel_mm_s2 = -1.0; }),
            "limits.max_accel_mm_s2 is -1, but must be > 0");
  EXPECT_THAT(complaint([](Settings& s) { s.dynamics.y.freq_hz = std::nan(""); }),
              HasSubstr("dynamics.y.freq_hz must be a finite number"));
  EXPECT_THAT(complaint([](Settings& s) { s.printer.transport = "pigeon"; }),
              HasSubstr("printer.transport must be one of"));
  EXPECT_THAT(complaint([](Settings& s) {
                s.printer.travel_mm.x = Range{200.0, 0.0};
              }),
              HasSubstr("printer.travel_x_mm"));
  EXPECT_THAT(complaint([](Settings& s) { s.solve.overlap_s = 2.0 * s.solve.window_s; }),
              HasSubstr("solve.overlap_s must not exceed solve.window_s"));
}

std::string origin(const Settings& settings, std::string_view key) {
  for (const auto& [name, from] : settings.origins) {
    if (name == key) {
      return from;
    }
  }
  return "no such key";
}

TEST(Settings, WithoutAFileAreTheDefaults) {
  const Result<Settings> settings = load(std::nullopt, {});
  ASSERT_TRUE(settings);
  EXPECT_EQ(settings->printer.firmware, Firmware::klipper);
  EXPECT_FALSE(settings->printer.travel_mm.x);
  EXPECT_DOUBLE_EQ(settings->limits.max_velocity_mm_s, 300.0);
  EXPECT_DOUBLE_EQ(settings->dynamics.y.freq_hz, 45.0);
  EXPECT_EQ(origin(*settings, "limits.max_velocity_mm_s"), "default");
}

TEST(Settings, OfEverySectionAreRead) {
  const Settings s = read(R"(
schema_version = 1
[printer]
firmware = "klipper"
travel_x_mm = [-5, 250.5]
travel_y_mm = [0.0, 210]
firmware_retraction = false
[limits]
max_accel_mm_s2 = 3000
[extruder]
nozzle_diameter_mm = 0.6
[dynamics.x]
freq_hz = 52.5
damping_ratio = 0.1
[dynamics]
y.freq_hz = 40
[base]
max_jerk_mm_s3 = 1e8
[solve]
tail_ms = 5
[emit]
period_ms = 0.5
[verify]
step_ms = 0.05
)");
  ASSERT_TRUE(s.printer.travel_mm.x && s.printer.travel_mm.y);
  EXPECT_DOUBLE_EQ(s.printer.travel_mm.x->min, -5.0);
  EXPECT_DOUBLE_EQ(s.printer.travel_mm.x->max, 250.5);
  EXPECT_DOUBLE_EQ(s.printer.travel_mm.y->max, 210.0);
  EXPECT_FALSE(s.printer.firmware_retraction);
  EXPECT_DOUBLE_EQ(s.limits.max_accel_mm_s2, 3000.0);
  EXPECT_DOUBLE_EQ(s.extruder.nozzle_diameter_mm, 0.6);
  EXPECT_DOUBLE_EQ(s.dynamics.x.freq_hz, 52.5);
  EXPECT_DOUBLE_EQ(s.dynamics.x.damping_ratio, 0.1);
  EXPECT_DOUBLE_EQ(s.dynamics.y.freq_hz, 40.0);
  EXPECT_DOUBLE_EQ(s.dynamics.y.damping_ratio, 0.06);
  EXPECT_DOUBLE_EQ(s.base.max_jerk_mm_s3, 1e8);
  EXPECT_DOUBLE_EQ(s.tail_s(), 0.005);
  EXPECT_DOUBLE_EQ(s.period_ms(), 0.5);
  EXPECT_DOUBLE_EQ(s.verify.step_ms, 0.05);
}

TEST(Settings, RememberWhereTheyCameFrom) {
  const Settings s = read("[limits]\n\nmax_accel_mm_s2 = 3000\nmax_velocity_mm_s = 200\n",
                          {"limits.max_velocity_mm_s=250"});
  EXPECT_EQ(origin(s, "limits.max_accel_mm_s2"), "printer.toml:3");
  EXPECT_EQ(origin(s, "limits.max_velocity_mm_s"), "--set");
  EXPECT_EQ(origin(s, "emit.period_ms"), "default");
}

TEST(Overrides, WinOverTheFileAndOverEarlierOnes) {
  const Settings s =
      read("[emit]\nperiod_ms = 1\n", {"emit.period_ms=0.25", "emit.period_ms = .5"});
  EXPECT_DOUBLE_EQ(s.period_ms(), 0.5);
}

TEST(Overrides, TakeEveryTypeOfValue) {
  const Settings s = read("", {"printer.travel_x_mm=[0,250]", "printer.firmware=klipper",
                               "printer.firmware_retraction=false", "emit.accel_mm_s2=2e6",
                               "limits.max_velocity_mm_s=+200"});
  ASSERT_TRUE(s.printer.travel_mm.x);
  EXPECT_DOUBLE_EQ(s.printer.travel_mm.x->max, 250.0);
  EXPECT_FALSE(s.printer.firmware_retraction);
  EXPECT_DOUBLE_EQ(s.emit_accel_mm_s2(), 2e6);
  EXPECT_DOUBLE_EQ(s.limits.max_velocity_mm_s, 200.0);
  EXPECT_EQ(read("", {"printer.firmware=\"klipper\""}).printer.firmware, Firmware::klipper);
}

// The source thesis' axis: ω = 100 rad/s, ζ = 0.5 from 1 kg, 10 N/mm and 0.1 N·s/mm.
TEST(Dynamics, FollowFromMassStiffnessAndDamping) {
  const Settings s =
      read("[dynamics.x]\nmass_g = 1000\nstiffness_n_mm = 10\ndamping_n_s_mm = 0.1\n");
  EXPECT_NEAR(s.dynamics.x.freq_hz, 100.0 / (2.0 * std::numbers::pi), 1e-12);
  EXPECT_NEAR(s.dynamics.x.damping_ratio, 0.5, 1e-12);
  EXPECT_DOUBLE_EQ(s.dynamics.y.freq_hz, 45.0);
  EXPECT_EQ(origin(s, "dynamics.x.freq_hz"), "printer.toml:2");
}

// --set gives the axis in another form than the file.
TEST(Overrides, OfOneFormOfTheDynamicsReplaceTheOther) {
  const std::string modal = "[dynamics.x]\nfreq_hz = 30\ndamping_ratio = 0.2\n";
  const std::vector<std::string> by_mass = {
      "dynamics.x.mass_g=1000", "dynamics.x.stiffness_n_mm=10", "dynamics.x.damping_n_s_mm=0.1"};
  const Settings mass = read(modal, by_mass);
  EXPECT_NEAR(mass.dynamics.x.freq_hz, 100.0 / (2.0 * std::numbers::pi), 1e-12);
  EXPECT_NEAR(mass.dynamics.x.damping_ratio, 0.5, 1e-12);
  EXPECT_EQ(origin(mass, "dynamics.x.freq_hz"), "--set");
  const Settings freq =
      read("[dynamics.x]\nmass_g = 1000\nstiffness_n_mm = 10\ndamping_n_s_mm = 0.1\n",
           {"dynamics.x.freq_hz=30"});
  EXPECT_DOUBLE_EQ(freq.dynamics.x.freq_hz, 30.0);
  EXPECT_NEAR(freq.dynamics.x.damping_ratio, 0.5, 1e-12);
  std::vector<std::string> both = by_mass;
  both.emplace_back("dynamics.x.freq_hz=30");
  EXPECT_FALSE(parse(modal, "printer.toml", both));
}

TEST(Overrides, MayNameTheSchema) {
  EXPECT_TRUE(parse("", "printer.toml", {"schema_version=1"}));
  EXPECT_FALSE(parse("", "printer.toml", {"schema_version=2"}));
}

// A user who types the bound that a message names must not be refused again.
TEST(Bounds, ThatMessagesNameAreAccepted) {
  for (double freq_hz = 20.0; freq_hz < 300.0; freq_hz *= 1.003) {
    const std::string dynamics =
        fmt::format("[dynamics.x]\nfreq_hz = {0}\n[dynamics.y]\nfreq_hz = {0}\n", freq_hz);
    const Result<Settings> refused = parse(dynamics, "printer.toml", {"emit.period_ms=50"});
    ASSERT_FALSE(refused);
    std::smatch bounds;
    ASSERT_TRUE(std::regex_search(refused.error().message, bounds,
                                  std::regex("at most ([0-9.]+), better ([0-9.]+)$")))
        << refused.error().message;
    EXPECT_TRUE(parse(dynamics, "printer.toml", {"emit.period_ms=" + bounds[1].str()})) << freq_hz;
    EXPECT_THAT(recommendations(read(dynamics, {"emit.period_ms=" + bounds[2].str()})), IsEmpty())
        << freq_hz;
  }
  EXPECT_TRUE(
      parse("[printer]\nfirmware = \"rrf\"\ninput_shaper_freq_x_hz = 5.73\n", "printer.toml", {}));
}

TEST(UnsetKeys, FollowKlippersFormulas) {
  const Settings s = read("");
  EXPECT_DOUBLE_EQ(s.axis_max_velocity_mm_s()[2], 300.0);
  EXPECT_DOUBLE_EQ(s.axis_max_accel_mm_s2()[2], 5000.0);
  EXPECT_DOUBLE_EQ(s.max_extrude_cross_section_mm2(), 4.0 * 0.4 * 0.4);
  const double ratio = 0.64 / (std::numbers::pi * 0.875 * 0.875);
  EXPECT_NEAR(s.max_extrude_only_velocity_mm_s(), 300.0 * ratio, 1e-9);
  EXPECT_NEAR(s.max_extrude_only_accel_mm_s2(), 5000.0 * ratio, 1e-9);
}

TEST(UnsetKeys, FollowMarlinsDefaults) {
  const Settings s = read(
      "[printer]\nfirmware = \"marlin\"\n[limits]\nmax_accel_mm_s2 = 2000\n"
      "max_y_accel_mm_s2 = 1500\nmax_x_velocity_mm_s = 180\n");
  EXPECT_EQ(s.axis_max_velocity_mm_s(), (std::array{180.0, 300.0, 5.0, 25.0}));
  EXPECT_EQ(s.axis_max_accel_mm_s2(), (std::array{2000.0, 1500.0, 100.0, 10000.0}));
  EXPECT_EQ(s.jerk_mm_s(), (std::array{10.0, 10.0, 0.3, 5.0}));
  EXPECT_EQ(s.steps_per_mm(), (std::array{80.0, 80.0, 400.0, 500.0}));
  EXPECT_EQ(s.print_accel_mm_s2(), 2000.0);
  EXPECT_EQ(s.queue_length(), 16.0);
  EXPECT_EQ(s.max_lines_per_s(), 200.0);
}

TEST(UnsetKeys, FollowRepRapFirmwaresDefaults) {
  const Settings s = read("[printer]\nfirmware = \"rrf\"\n");
  EXPECT_EQ(s.axis_max_velocity_mm_s(), (std::array{300.0, 300.0, 20.0, 100.0}));
  EXPECT_EQ(s.axis_max_accel_mm_s2(), (std::array{5000.0, 5000.0, 200.0, 500.0}));
  EXPECT_EQ(s.jerk_mm_s(), (std::array{15.0, 15.0, 10.0, 5.0}));
  EXPECT_EQ(s.steps_per_mm(), (std::array{80.0, 80.0, 800.0, 420.0}));
  EXPECT_EQ(s.print_accel_mm_s2(), 50000.0);
  EXPECT_EQ(s.queue_length(), 60.0);
  EXPECT_EQ(s.max_lines_per_s(), 500.0);
}

TEST(UnsetKeys, IgnoreAConfiguredCrossSectionForTheExtrudeOnlyLimitsAsKlipperDoes) {
  const Settings s = read("[extruder]\nmax_extrude_cross_section_mm2 = 5\n");
  EXPECT_DOUBLE_EQ(s.max_extrude_cross_section_mm2(), 5.0);
  EXPECT_NEAR(s.max_extrude_only_velocity_mm_s(), read("").max_extrude_only_velocity_mm_s(), 1e-12);
}

TEST(UnsetKeys, FollowTheKeysTheyDependOn) {
  const Settings s = read(
      "[limits]\nmax_velocity_mm_s = 100\nmax_accel_mm_s2 = 2000\n"
      "[dynamics.x]\nfreq_hz = 30\n");
  EXPECT_DOUBLE_EQ(s.base_max_velocity_mm_s(), 200.0);
  EXPECT_DOUBLE_EQ(s.base_max_accel_mm_s2(), 4000.0);
}

StepLimits limits_of(const std::string& keys) { return read("[printer]\n" + keys).step_limits(); }

TEST(StepLimits, AreThoseOfBoardsAndDrivers) {
  EXPECT_FALSE(limits_of("").is_any());
  EXPECT_DOUBLE_EQ(limits_of("driver = \"a4988\"\n").max_hz, 500e3);
  EXPECT_NEAR(limits_of("driver = \"drv8825\"\n").max_hz, 263158.0, 0.5);
  EXPECT_NEAR(limits_of("driver = \"tmc2209\"\n").max_hz, 5e6, 1e-3);
  struct Board {
    std::string name;
    double one_hz;
    double three_hz;
  };
  for (const Board& board : {Board{"avr_16mhz", 156.9e3, 98.8e3},
                             Board{"lpc1768", 1.923e6, 1.351e6}, Board{"stm32f103", 1.180e6, 818e3},
                             Board{"stm32f4", 3.652e6, 2.459e6}, Board{"sam3x", 1.273e6, 981e3}}) {
    const StepLimits limits = limits_of("mcu = \"" + board.name + "\"\n");
    EXPECT_DOUBLE_EQ(limits.max_hz, board.one_hz) << board.name;
    EXPECT_DOUBLE_EQ(limits.max_shared_hz, board.three_hz) << board.name;
    EXPECT_TRUE(std::isinf(limits.max_total_hz)) << board.name;
  }
}

TEST(StepLimits, CountWhereTheyAreSmallest) {
  const std::string all = "driver = \"drv8825\"\nmcu = \"stm32f4\"\n";
  EXPECT_NEAR(limits_of(all).max_hz, 263158.0, 0.5);
  EXPECT_DOUBLE_EQ(limits_of(all + "max_step_rate_hz = 40000\n").max_hz, 40e3);
  EXPECT_DOUBLE_EQ(limits_of(all + "max_total_step_rate_hz = 90000\n").max_total_hz, 90e3);
  EXPECT_DOUBLE_EQ(limits_of(all + "max_total_step_rate_hz = 90000\n").max_shared_hz, 90e3);
}

TEST(StepLimits, BoundTheSpeedOfTheBase) {
  const auto speed = [](const std::string& keys) {
    return read("[limits]\nmax_velocity_mm_s = 200\n[printer]\n" + keys).base_max_velocity_mm_s();
  };
  const std::string steps = "x_steps_per_mm = 100\ny_steps_per_mm = 160\n";
  EXPECT_DOUBLE_EQ(speed(steps), 400.0);
  EXPECT_DOUBLE_EQ(speed("max_step_rate_hz = 48000\n"), 400.0);
  EXPECT_DOUBLE_EQ(speed(steps + "max_step_rate_hz = 48000\n"), 300.0);
  // The plan itself may ask for that much.
  EXPECT_DOUBLE_EQ(speed(steps + "max_step_rate_hz = 16000\n"), 200.0);
}

// A motor that moves X and Y is asked √2 times as much where the tool moves askew.
TEST(MotorLimits, AreThoseOfThePrinter) {
  const Settings cartesian = read("[limits]\nmax_accel_mm_s2 = 7000\n");
  EXPECT_DOUBLE_EQ(cartesian.motor_max_accel_mm_s2(), 7000.0);
  EXPECT_DOUBLE_EQ(cartesian.base_max_accel_mm_s2(), 14000.0);
  EXPECT_EQ(cartesian.motor_max_accel_key(), "limits.max_accel_mm_s2");
  const Settings corexy =
      read("[limits]\nmax_accel_mm_s2 = 7000\n[kinematics]\ntype = \"corexy\"\n");
  EXPECT_NEAR(corexy.motor_max_accel_mm_s2(), 7000.0 * std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(corexy.base_max_accel_mm_s2(), 2.0 * corexy.motor_max_accel_mm_s2(), 1e-9);
  EXPECT_NEAR(corexy.motor_max_velocity_mm_s(), 300.0 * std::sqrt(2.0), 1e-9);
  // Marlin limits motors.
  const Settings marlin = read(
      "[printer]\nfirmware = \"marlin\"\n[limits]\nmax_accel_mm_s2 = 3000\n"
      "max_y_accel_mm_s2 = 2500\n[kinematics]\ntype = \"corexy\"\n");
  EXPECT_DOUBLE_EQ(marlin.motor_max_accel_mm_s2(), 2500.0);
  EXPECT_EQ(marlin.motor_max_accel_key(), "limits.max_y_accel_mm_s2");
  EXPECT_DOUBLE_EQ(marlin.base_max_accel_mm_s2(), 6000.0);
}

TEST(BaseAccel, FollowsWhatThePrintAsksForWhileItsKeyIsUnset) {
  const Settings klipper = read("");
  EXPECT_DOUBLE_EQ(klipper.base_max_accel_mm_s2(3000.0), 10000.0);
  EXPECT_DOUBLE_EQ(klipper.base_max_accel_mm_s2(12000.0), 24000.0);
  EXPECT_DOUBLE_EQ(klipper.base_max_accel_mm_s2(2e5), 2e5) << "a fifth of emit.accel_mm_s2";
  EXPECT_DOUBLE_EQ(read("", {"emit.accel_mm_s2=150000"}).base_max_accel_mm_s2(24000.0), 30000.0);
  const Settings rrf = read("", {"printer.firmware=rrf"});
  EXPECT_DOUBLE_EQ(rrf.base_max_accel_mm_s2(1e5), 2e5);
  EXPECT_DOUBLE_EQ(rrf.emit_accel_mm_s2(1e5), 1e6);
  const Settings given = read("[base]\nmax_accel_mm_s2 = 20000\n");
  EXPECT_DOUBLE_EQ(given.base_max_accel_mm_s2(12000.0), 20000.0);
  EXPECT_DOUBLE_EQ(given.base_accel_times_asked(), 0.0);
}

TEST(Tail, LastsForTheSlowerAxis) {
  const Settings s = read("[dynamics.y]\nfreq_hz = 15.915494309189533\ndamping_ratio = 0.5\n");
  EXPECT_NEAR(s.tail_s(), 0.04, 1e-12);
}

TEST(Tail, LastsTwoMillisecondsAtLeast) {
  const Settings s = read("", {"dynamics.x.damping_ratio=0.01", "dynamics.y.damping_ratio=0"});
  EXPECT_DOUBLE_EQ(s.tail_s(), 0.002);
}

TEST(ShaperFrequency, IsOneForBothAxesOfRepRapFirmware) {
  const std::vector<std::string> rrf = {"printer.firmware=rrf"};
  EXPECT_DOUBLE_EQ(read("", rrf).shaper_freq_hz().y, 0.0);
  const Settings s = read("[printer]\ninput_shaper_freq_x_hz = 41\n", rrf);
  EXPECT_DOUBLE_EQ(s.shaper_freq_hz().y, 41.0);
}

// The default is the firmware's own type, which it uses if a command names none.
TEST(ShaperType, IsTheFirmwaresDefaultUnlessNamed) {
  EXPECT_EQ(read("").shaper_type().x, "mzv");
  EXPECT_EQ(read("", {"printer.firmware=marlin"}).shaper_type().x, "zv");
  EXPECT_EQ(read("", {"printer.firmware=rrf"}).shaper_type().y, "zvd");
  const Settings named = read("[printer]\ninput_shaper_type = \"ei\"\n");
  EXPECT_EQ(named.shaper_type().x, "ei");
  EXPECT_EQ(named.shaper_type().y, "ei");
  EXPECT_EQ(read("[printer]\ninput_shaper_type = \"mzv(n=4,t=0.9)\"\n").shaper_type().y,
            "mzv(n=4,t=0.9)");
  const Settings two = read("[printer]\ninput_shaper_type_y = \"zv\"\n");
  EXPECT_EQ(two.shaper_type().x, "mzv");
  EXPECT_EQ(two.shaper_type().y, "zv");
}

TEST(ShaperDampingRatio, IsTheFirmwaresDefaultUnlessGiven) {
  EXPECT_DOUBLE_EQ(read("").shaper_damping_ratio().x, 0.1);
  EXPECT_DOUBLE_EQ(read("", {"printer.firmware=marlin"}).shaper_damping_ratio().y, 0.15);
  EXPECT_DOUBLE_EQ(read("", {"printer.firmware=rrf"}).shaper_damping_ratio().y, 0.1);
  const Settings given = read("[printer]\ninput_shaper_damping_ratio_x = 0.05\n");
  EXPECT_DOUBLE_EQ(given.shaper_damping_ratio().x, 0.05);
  EXPECT_DOUBLE_EQ(given.shaper_damping_ratio().y, 0.1);
}

TEST(ShaperType, IsAWordInAFileAndInAnOverride) {
  EXPECT_EQ(read("[printer]\ninput_shaper_type = \"mzv\"\n").printer.input_shaper.type.x, "mzv");
  EXPECT_EQ(read("", {"printer.input_shaper_type=ei2"}).printer.input_shaper.type.x, "ei2");
}

TEST(ShaperFrequency, OfZeroStaysZero) {
  EXPECT_DOUBLE_EQ(read("", {"printer.input_shaper_freq_x_hz=0"}).shaper_freq_hz().x, 0.0);
}

TEST(ToToml, ReadsBackAsTheSameSettings) {
  const Settings first =
      read("", {"printer.travel_y_mm=[-1.25,200]", "limits.max_accel_mm_s2=3333.3",
                "printer.firmware_retraction=false", "solve.jerk_weight=1e-9"});
  const std::string text = to_toml(first);
  const Settings second = read(text);
  const std::vector<SettingRow> before = rows(first);
  const std::vector<SettingRow> after = rows(second);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(after[i].value, before[i].value) << before[i].key;
    EXPECT_EQ(after[i].origin == "default", before[i].origin == "default") << before[i].key;
  }
  EXPECT_THAT(text, HasSubstr("\nmax_accel_mm_s2 = 3333.3  # --set\n"));
  EXPECT_DOUBLE_EQ(second.limits.max_accel_mm_s2, 3333.3);
  EXPECT_EQ(second.solve.jerk_weight, 1e-9);
  EXPECT_DOUBLE_EQ(second.printer.travel_mm.y->min, -1.25);
  EXPECT_FALSE(second.printer.travel_mm.x);
  EXPECT_FALSE(second.base.max_accel_mm_s2);
}

TEST(ToToml, ShowsWhatHoldsForUnsetKeys) {
  EXPECT_THAT(to_toml(read("")), HasSubstr("# max_accel_mm_s2 = 10000  (unset: 2 × the larger of "
                                           "limits.max_accel_mm_s2 and what a run's plan "
                                           "accelerates; 2√2 × for a Klipper on which a motor "
                                           "moves X and Y)"));
}

TEST(Rows, HoldOneRowPerOriginInTheSameOrder) {
  const Settings s = read("[limits]\nmax_accel_mm_s2 = 3000\n");
  const std::vector<SettingRow> table = rows(s);
  ASSERT_EQ(table.size(), s.origins.size());
  for (std::size_t i = 0; i < table.size(); ++i) {
    EXPECT_EQ(table[i].key, s.origins[i].first);
    EXPECT_EQ(table[i].origin, s.origins[i].second);
  }
  EXPECT_EQ(table.front().key, "printer.firmware");
  EXPECT_EQ(table.front().value, "\"klipper\"");
}

TEST(Rows, HoldTheValueInForce) {
  const Settings s = read("[limits]\nmax_accel_mm_s2 = 3000\n[printer]\ntravel_x_mm = [0, 9.5]\n");
  std::map<std::string, std::string> values;
  for (const SettingRow& row : rows(s)) {
    values[row.key] = row.value;
  }
  EXPECT_EQ(values["limits.max_accel_mm_s2"], "3000");
  EXPECT_EQ(values["base.max_accel_mm_s2"], "6000");
  EXPECT_EQ(values["printer.travel_x_mm"], "[0, 9.5]");
  EXPECT_EQ(values["printer.travel_y_mm"], "");
}

TEST(UnsetKeys, ShortenThePeriodAboveFiftyHertz) {
  EXPECT_DOUBLE_EQ(read("", {"dynamics.y.freq_hz=50"}).period_ms(), 1.0);
  EXPECT_DOUBLE_EQ(read("", {"dynamics.y.freq_hz=100"}).period_ms(), 0.5);
  EXPECT_THAT(recommendations(read("", {"dynamics.y.freq_hz=100"})), IsEmpty());
}

TEST(Recommendations, AskForAShorterPeriodAboveFiftyHertz) {
  EXPECT_THAT(recommendations(read("", {"emit.period_ms=1"})), IsEmpty());
  EXPECT_THAT(recommendations(read("", {"emit.period_ms=1", "dynamics.y.freq_hz=60"})),
              ElementsAre(HasSubstr("0.833 or less")));
}

TEST(Load, ReadsAFile) {
  const std::filesystem::path file =
      std::filesystem::path(::testing::TempDir()) / "unflex_machine_load.toml";
  std::ofstream(file) << "[limits]\r\nmax_accel_mm_s2 = 1234\r\n";
  const Result<Settings> settings = load(file, {});
  std::filesystem::remove(file);
  ASSERT_TRUE(settings) << to_string(settings.error());
  EXPECT_DOUBLE_EQ(settings->limits.max_accel_mm_s2, 1234.0);
  EXPECT_EQ(origin(*settings, "limits.max_accel_mm_s2"), file.string() + ":2");
}

const std::string kTwoModes =
    "[[dynamics.x.mode]]\nfreq_hz = 45\ndamping_ratio = 0.06\ngain = 0.8\n"
    "[[dynamics.x.mode]]\nfreq_hz = 110\ndamping_ratio = 0.1\ngain = 0.2\n";

TEST(Modes, AreReadAndWrittenBack) {
  const Result<Settings> read = parse(kTwoModes, "printer.toml", {});
  ASSERT_TRUE(read) << to_string(read.error());
  const AxisDynamics& x = read->dynamics.x;
  ASSERT_EQ(x.modes.size(), 2U);
  EXPECT_EQ(x.modes[1].freq_hz, 110.0);
  EXPECT_EQ(x.modes[1].damping_ratio, 0.1);
  EXPECT_DOUBLE_EQ(x.modes[1].gain, 0.2);
  EXPECT_EQ(x.freq_hz, 45.0);
  EXPECT_EQ(x.fastest_hz(), 110.0);
  // The second mode has a gain of 0.2, for which eleven nodes in its period do.
  EXPECT_DOUBLE_EQ(x.good_period_ms(), 1e3 / (11.0 * 110.0));
  EXPECT_EQ(x.description(), "45 Hz, ζ 0.06, gain 0.8 + 110 Hz, ζ 0.1, gain 0.2");
  const Result<Settings> again = parse(to_toml(*read), "again.toml", {});
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(again->dynamics.x.description(), x.description());
  EXPECT_TRUE(again->dynamics.y.modes.empty());
}

TEST(Modes, AreOverriddenByOneModeAndTheOtherWayRound) {
  const Result<Settings> one = parse(kTwoModes, "", {"dynamics.x.freq_hz=50"});
  ASSERT_TRUE(one) << to_string(one.error());
  EXPECT_TRUE(one->dynamics.x.modes.empty());
  EXPECT_EQ(one->dynamics.x.freq_hz, 50.0);
  const std::string modes =
      "dynamics.y.mode=[{freq_hz=40, damping_ratio=0.1, gain=-0.1}, "
      "{freq_hz=60, damping_ratio=0.05, gain=1.1}]";
  const Result<Settings> several = parse("[dynamics.y]\nfreq_hz = 30\n", "", {modes});
  ASSERT_TRUE(several) << to_string(several.error());
  EXPECT_EQ(several->dynamics.y.freq_hz, 60.0);
  EXPECT_EQ(several->dynamics.y.slowest_hz(), 40.0);
}

TEST(Modes, AreKnownResonances) {
  const Result<Settings> x = parse(kTwoModes, "", {"dynamics.y.freq_hz=40"});
  ASSERT_TRUE(x);
  EXPECT_TRUE(x->guesses.empty());
}

TEST(Modes, AreRefusedWhereTheyCannotBeMeant) {
  const auto refusal = [](const std::string& text) {
    const Result<Settings> read = parse(text, "p.toml", {});
    return read ? std::string() : to_string(read.error());
  };
  EXPECT_THAT(refusal(kTwoModes + "[dynamics.x]\nfreq_hz = 45\n"), HasSubstr("p.toml"));
  const auto mode = [](const std::string& first, const std::string& second) {
    return "[dynamics]\nx.mode = [{" + first + "}, {" + second + "}]\n";
  };
  const std::string good = "freq_hz = 45, damping_ratio = 0.1, gain = 0.7";
  EXPECT_THAT(
      refusal(mode(good, "freq_hz = 90, damping_ratio = 0.1, gain = 0.2")),
      HasSubstr("p.toml:2: the gains of dynamics.x.mode add up to 0.9, but must add up to 1"));
  EXPECT_THAT(refusal(mode(good, "freq_hz = 0, damping_ratio = 0.1, gain = 0.3")),
              HasSubstr("dynamics.x.mode, number 2: freq_hz is 0, but must be"));
  EXPECT_THAT(refusal(mode(good, "freq_hz = 90, gain = 0.3")),
              HasSubstr("dynamics.x.mode, number 2: damping_ratio is missing"));
  EXPECT_THAT(refusal(mode(good, "freq_hz = 90, damping_ratio = 0.1, gain = 0.3, mass = 1")),
              HasSubstr("number 2: unknown value 'mass'"));
  EXPECT_THAT(refusal("[dynamics]\nx.mode = [{" + good + "}]\n"), HasSubstr("2 to 3 tables"));
  EXPECT_THAT(refusal("[dynamics]\nx.mode = 3\n"), HasSubstr("2 to 3 tables"));
}

constexpr std::string_view kPlants =
    "[dynamics.x]\nfreq_hz = 45\n"
    "[[dynamics.x.plant]]\nshare = 0.25\n"
    "mode = [{freq_hz = 46, damping_ratio = 0.06, gain = 1}]\n"
    "[[dynamics.x.plant]]\nshare = 0.125\n"
    "mode = [{freq_hz = 44, damping_ratio = 0.06, gain = 0.9},\n"
    "        {freq_hz = 90, damping_ratio = 0.1, gain = 0.1}]\n";

TEST(Plants, AreReadAndWrittenAgain) {
  const Result<Settings> settings = parse(kPlants, "p.toml", {});
  ASSERT_TRUE(settings) << to_string(settings.error());
  const std::vector<PlantSettings>& plants = settings->dynamics.x.plants;
  ASSERT_EQ(plants.size(), 2U);
  EXPECT_EQ(plants[0].share, 0.25);
  ASSERT_EQ(plants[1].modes.size(), 2U);
  EXPECT_EQ(plants[1].modes[1].freq_hz, 90.0);
  const Result<Settings> again = parse(to_toml(*settings), "again.toml", {});
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(again->dynamics.x.plants.size(), 2U);
  EXPECT_EQ(again->dynamics.x.plants[1].modes[0].gain, 0.9);
}

TEST(Plants, StayBehindIfTheModelIsOverridden) {
  const Result<Settings> other = parse(kPlants, "p.toml", {"dynamics.x.freq_hz=50"});
  ASSERT_TRUE(other);
  EXPECT_TRUE(other->dynamics.x.plants.empty());
  const Result<Settings> kept = parse(kPlants, "p.toml", {"dynamics.y.freq_hz=50"});
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->dynamics.x.plants.size(), 2U);
}

TEST(Plants, ThatAreNoneNameTheirPlace) {
  const auto refusal = [](const std::string& plant) {
    const Result<Settings> settings =
        parse("[dynamics]\nx.freq_hz = 45\nx.plant = [" + plant + "]\n", "p.toml", {});
    return settings ? std::string{} : to_string(settings.error());
  };
  const std::string mode = "mode = [{freq_hz = 46, damping_ratio = 0.06, gain = 1}]";
  EXPECT_EQ(refusal("{share = 0.5, " + mode + "}"), "");
  EXPECT_THAT(refusal("{share = 0.5, " + mode + "}, {share = 0.5, " + mode + "}"),
              HasSubstr("p.toml:3: the shares of dynamics.x.plant add up to 1, but must leave"));
  EXPECT_THAT(refusal("{share = 0, " + mode + "}"),
              HasSubstr("dynamics.x.plant, number 1: share must be a number above 0 and below 1"));
  EXPECT_THAT(refusal("{" + mode + "}"), HasSubstr("number 1: share is missing"));
  EXPECT_THAT(refusal("{share = 0.5, mode = 3}"), HasSubstr("mode must be a list of 1 to 3"));
  EXPECT_THAT(refusal("{share = 0.5, mode = [{freq_hz = 0, damping_ratio = 0.1, gain = 1}]}"),
              HasSubstr("number 1, mode, number 1: freq_hz is 0, but must be"));
  EXPECT_THAT(refusal("{share = 0.5, weight = 1, " + mode + "}"),
              HasSubstr("unknown value 'weight'; a plant has share and mode"));
  EXPECT_THAT(refusal("3"), HasSubstr("1 to 8 tables"));
}

TEST(AFrequencyMap, IsReadFromATableOfPoints) {
  const Settings s =
      read("[[dynamics.y.map]]\nalong = \"z\"\nat_mm = [0, 100, 200]\nfreq_hz = [45, 42.5, 40]\n");
  ASSERT_EQ(s.dynamics.y.map.size(), 1U);
  EXPECT_EQ(s.dynamics.y.map[0].at_mm, (std::vector<double>{0.0, 100.0, 200.0}));
  EXPECT_EQ(s.dynamics.y.map[0].freq_hz, (std::vector<double>{45.0, 42.5, 40.0}));
  EXPECT_TRUE(s.changes());
  EXPECT_FALSE(Settings{}.changes());
}

TEST(AFrequencyMap, MayBeAlongEachDirection) {
  const Settings s = read(
      "[[dynamics.x.map]]\nalong = \"x\"\nat_mm = [0, 100]\nfreq_hz = [45, 36]\n"
      "[[dynamics.x.map]]\nalong = \"y\"\nat_mm = [0, 100]\nfreq_hz = [45, 54]\n"
      "[[dynamics.x.map]]\nalong = \"z\"\nat_mm = [0, 100]\nfreq_hz = [45, 22.5]\n");
  ASSERT_EQ(s.dynamics.x.map.size(), 3U);
  EXPECT_NEAR(s.dynamics.x.frequency_share({.height_mm = 100.0, .place_mm = {50.0, 25.0}}),
              0.9 * 1.05 * 0.5, 1e-12);
  EXPECT_NEAR(s.dynamics.x.share_at({50.0, 25.0}), 0.9 * 1.05, 1e-12);
}

TEST(AFrequencyMap, ThatIsWrongIsRefusedWithItsPlace) {
  const auto error = [](const std::string& text) {
    const Result<Settings> settings = parse("[limits]\n[[dynamics.x.map]]\n" + text, "p.toml", {});
    return settings ? std::string("none") : to_string(settings.error());
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(error("along = \"w\"\nat_mm = [0, 1]\nfreq_hz = [40, 41]\n"),
              HasSubstr("along must be \"x\", \"y\" or \"z\""));
  EXPECT_THAT(error("along = \"x\"\nat_mm = [0, 1]\nfreq_hz = [40, 41]\n[[dynamics.x.map]]\n"
                    "along = \"x\"\nat_mm = [0, 1]\nfreq_hz = [40, 41]\n"),
              HasSubstr("two tables are along \"x\""));
  EXPECT_THAT(error("along = \"z\"\nat_mm = [0, 1]\nfreq_hz = [40]\n"),
              HasSubstr("must be lists of 2 to 100 numbers, as many of each"));
  EXPECT_THAT(error("along = \"z\"\nat_mm = [1, 1]\nfreq_hz = [40, 41]\n"),
              HasSubstr("at_mm must increase"));
  EXPECT_THAT(error("along = \"z\"\nat_mm = [0, 1]\nfreq_hz = [40, 0.5]\n"),
              HasSubstr("freq_hz has 0.5, but must be 1 to 1000"));
  EXPECT_THAT(error("along = \"z\"\nat_mm = [0, 1]\nfreq_hz = [40, 41]\nhz = 3\n"),
              HasSubstr("unknown value 'hz'"));
  EXPECT_THAT(error("along = \"z\"\nat_mm = [0, 1]\nfreq_hz = [40, 41]\n"
                    "[[dynamics.x.mode]]\nfreq_hz = 40\ndamping_ratio = 0.1\ngain = 0.5\n"
                    "[[dynamics.x.mode]]\nfreq_hz = 60\ndamping_ratio = 0.1\ngain = 0.5\n"),
              HasSubstr("tells one frequency at each place"));
}

}  // namespace
}  // namespace unflex::machine
