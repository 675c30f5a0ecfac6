// Variants of firmware: each is recognised, and either supported or refused with advice.

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "reading.hpp"

namespace unflex::machine {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kPrinterCfg =
    "[printer]\nkinematics: corexy\nmax_velocity: 300\nmax_accel: 3000\n"
    "[input_shaper]\nshaper_freq_x: 45\nshaper_freq_y: 38\n";

Settings read(const std::string& text, const std::vector<std::string>& overrides = {}) {
  Result<Settings> settings = parse(text, "printer", overrides);
  EXPECT_TRUE(settings) << to_string(settings.error());
  return settings.value_or(Settings{});
}

Settings sliced(const std::string& head, const std::vector<std::string>& overrides = {}) {
  const PrintText print{.name = "print.gcode", .head = head, .tail = "", .tail_line = 1};
  Result<Settings> settings = load({.print = &print, .printer_file = {}, .overrides = overrides});
  EXPECT_TRUE(settings) << to_string(settings.error());
  return settings.value_or(Settings{});
}

std::string refusal(const Settings& settings) {
  return settings.refusal ? to_string(*settings.refusal) : "";
}

std::string notes(const Settings& settings) {
  std::string text;
  for (const Diagnostic& note : settings.notes) {
    text += to_string(note) + "\n";
  }
  return text;
}

class KlipperVersion : public ::testing::TestWithParam<std::pair<const char*, bool>> {};

TEST_P(KlipperVersion, IgnoresTheShapersOffForElevenCommits) {
  const auto& [version, is_broken] = GetParam();
  for (const Settings& s :
       {read(kPrinterCfg, {std::string("printer.version=\"") + version + "\""}),
        read(std::string("# Git version: '") + version + "'\n" + kPrinterCfg)}) {
    EXPECT_EQ(s.printer.version, version);
    EXPECT_EQ(s.refusal.has_value(), is_broken) << refusal(s);
    if (is_broken) {
      EXPECT_THAT(refusal(s), HasSubstr("update it to v0.13.0-642 or later"));
      EXPECT_THAT(notes(s), HasSubstr("compensate refuses: Klipper v0.13.0"));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Field, KlipperVersion,
                         ::testing::Values(std::pair{"v0.13.0-630-g0123abcd", false},
                                           std::pair{"v0.13.0-631-gdb10e92e9", true},
                                           std::pair{"v0.13.0-641-g0123abcd-dirty", true},
                                           std::pair{"v0.13.0-642-g77d5d942e", false},
                                           std::pair{"v0.12.0-635", false},
                                           std::pair{"v0.14.0-635", false},
                                           std::pair{"v0.13.0", false}));

TEST(Klipper, HasNoVersionThatIsNone) {
  EXPECT_EQ(read(std::string("# Git version: 'a \"word\"'\n") + kPrinterCfg).printer.version, "");
}

TEST(Klipper, WithoutAShaperOrAsKalicoMayHaveAnyVersion) {
  const std::string version = "printer.version=\"v0.13.0-635\"";
  EXPECT_EQ(refusal(read(kPrinterCfg, {version, "printer.input_shaper_freq_x_hz=0",
                                       "printer.input_shaper_freq_y_hz=0"})),
            "");
  EXPECT_EQ(refusal(read(kPrinterCfg, {version, "printer.variant=\"kalico\""})), "");
}

TEST(Kalico, IsToldByItsSections) {
  const Settings s = read(std::string(kPrinterCfg) + "[danger_options]\nlog_statistics: False\n");
  EXPECT_EQ(told(s, "printer.variant"), "\"kalico\" printer:8");
  EXPECT_EQ(refusal(s), "");
  EXPECT_EQ(read(kPrinterCfg).printer.variant, "auto");
}

TEST(Kalico, IsRefusedWithLimitedKinematics) {
  std::string config = kPrinterCfg;
  config.replace(config.find("corexy"), 6, "limited_corexy");
  const Settings s = read(config);
  EXPECT_EQ(told(s, "printer.variant"), "\"kalico_limited\" printer:2");
  EXPECT_THAT(refusal(s), HasSubstr("printer:2: warning: Kalico's limited_* kinematics"));
  EXPECT_THAT(refusal(s), HasSubstr("set kinematics in printer.cfg without limited_"));
  EXPECT_THAT(notes(s), Not(HasSubstr("does not know kinematics")));
  // The settings stay the same when written and read again.
  const Settings again = read(to_toml(s));
  EXPECT_THAT(refusal(again), HasSubstr("Kalico's limited_* kinematics"));
}

TEST(Kalico, IsRefusedWithSmoothShapers) {
  const Settings s = read(std::string(kPrinterCfg) + "shaper_type_y: smooth_mzv\n");
  EXPECT_EQ(told(s, "printer.variant"), "\"kalico_smooth\" printer:8");
  EXPECT_THAT(refusal(s), HasSubstr("set shaper_type in [input_shaper] to one without smooth_"));
}

class BuddyModel : public ::testing::TestWithParam<const char*> {};

TEST_P(BuddyModel, IsRefusedUnlessTheFirmwareIsKnownToBeAnother) {
  const std::string model = GetParam();
  for (const std::string& head : {"; gcode_flavor = marlin2\n; printer_model = " + model + "\n",
                                  "M862.3 P \"" + model + "\" ; printer model check\n"}) {
    const Settings s = sliced(head);
    EXPECT_THAT(refusal(s), HasSubstr("print.gcode:"));
    EXPECT_THAT(refusal(s), HasSubstr("printer.firmware = \"klipper\""));
    EXPECT_THAT(refusal(sliced(head, {"printer.firmware=\"marlin\""})), HasSubstr("caps"));
    for (const std::string other : {"printer.firmware=\"klipper\"", "printer.firmware=\"rrf\"",
                                    "printer.variant=\"mainline\""}) {
      EXPECT_EQ(refusal(sliced(head, {other})), "") << other;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Field, BuddyModel,
                         ::testing::Values("MK4", "MK4S", "MK4IS", "MK4SMMU3", "MK3.5", "MK3.9S",
                                           "MINI", "MINIIS", "XL", "XL5IS", "COREONE",
                                           "Prusa CORE One", "Original Prusa MK4"));

class OtherModel : public ::testing::TestWithParam<const char*> {};

TEST_P(OtherModel, IsTakenForNoBuddy) {
  const std::string model = GetParam();
  EXPECT_EQ(refusal(sliced("; printer_model = " + model + "\nM862.3 P \"" + model + "\"\n")), "");
}

INSTANTIATE_TEST_SUITE_P(Field, OtherModel,
                         ::testing::Values("MK3S", "MK3SMMU2S", "MK3S X99", "MK2.5S",
                                           "Voron_v2_350_afterburner", "XL-400", "MINIMAL",
                                           "VC3_300"));

TEST(Buddy, IsToldByM115AndByItsKey) {
  const std::string dump = "echo:  M92 X100 Y100\necho:  M201 X7000 Y7000\n";
  const Settings s = read(
      "FIRMWARE_NAME:Prusa-Firmware-Buddy 6.2.2+8853 (Github) "
      "MACHINE_TYPE:Prusa-MK4 EXTRUDER_COUNT:1\n" +
      dump);
  EXPECT_EQ(told(s, "printer.variant"), "\"prusa_buddy\" printer:1");
  EXPECT_THAT(refusal(s), HasSubstr("printer:1: "));
  EXPECT_EQ(refusal(read("FIRMWARE_NAME:Prusa-Firmware 3.13.2 based on Marlin\n" + dump)), "");
  EXPECT_THAT(refusal(read("[printer]\nvariant = \"prusa_buddy\"\n")), HasSubstr("printer:2: "));
}

constexpr const char* kDump =
    "FIRMWARE_NAME:Marlin 2.1.3 (Jul 1 2026) SOURCE_CODE_URL:x MACHINE_TYPE:Own\n"
    "echo:  M92 X80 Y80\necho:  M201 X3000 Y3000 E10000\necho:  M204 P3000 T3000\n"
    "echo:  M205 J0.013\n";

TEST(FixedTimeMotion, IsRefusedUntilItIsOff) {
  EXPECT_EQ(read(kDump).printer.version, "2.1.3");
  EXPECT_EQ(refusal(read(std::string(kDump) + "echo:  M493 S0\n")), "");
  const Settings s = read(std::string(kDump) + "echo:  M493 S1 D0 H1\n");
  EXPECT_EQ(told(s, "printer.ft_motion"), "true printer:6");
  EXPECT_THAT(refusal(s), HasSubstr("write M493 S0 into the start code"));
}

// The print's start code wins over what the printer has stored.
TEST(FixedTimeMotion, GoesByTheStartCode) {
  const std::vector<std::string> is_on = {"printer.firmware=\"marlin\"", "printer.ft_motion=true"};
  const std::vector<std::string> is_off = {"printer.firmware=\"marlin\""};
  EXPECT_THAT(refusal(sliced("G28\n", is_on)), HasSubstr("M493 S0"));
  EXPECT_EQ(refusal(sliced("G28\nM493 S0\n", is_on)), "");
  EXPECT_THAT(refusal(sliced("G28\nM493 S1\n", is_off)), HasSubstr("print.gcode:2: "));
  EXPECT_EQ(refusal(sliced("G28\nM493 S1\n", {"printer.firmware=\"klipper\""})), "");
}

// jerk / (K e) with e = 0.4 · 0.2 / (π 1.75² / 4) = 0.03326 and, with junction deviation,
// jerk = √(0.7071 · 0.013 · 10000 / 0.2929) = 17.72 mm/s.
TEST(LinearAdvance, IsSaidWhereItLimitsPrints) {
  const auto with_k = [](const char* k) {
    return notes(read(std::string(kDump) + "echo:  M900 K" + k + "\n"));
  };
  EXPECT_THAT(with_k("0.2"), HasSubstr("by some 2663 mm/s² at most"));
  EXPECT_THAT(with_k("0.2"), HasSubstr("set limits.print_accel_mm_s2 = 2600 and M204 P"));
  EXPECT_THAT(with_k("0.05"), Not(HasSubstr("LIN_ADVANCE"))) << "10654 mm/s²";
  EXPECT_THAT(with_k("0"), Not(HasSubstr("LIN_ADVANCE")));
  EXPECT_THAT(notes(sliced("M900 K0.2\n",
                           {"printer.firmware=\"marlin\"", "limits.max_e_accel_mm_s2=10000"})),
              HasSubstr("print.gcode:1: warning: with LIN_ADVANCE and K 0.2"));
}

TEST(SnapmakerJ1, IsNeverToldToSwitchItsShaperOff) {
  const std::string head = "; printer_model = Snapmaker J1\n";
  const std::vector<std::string> marlin = {"printer.firmware=\"marlin\""};
  EXPECT_EQ(refusal(sliced(head, marlin)), "");
  EXPECT_THAT(notes(sliced(head, marlin)), HasSubstr("M593 F0 stops X and Y"));
  EXPECT_THAT(refusal(sliced(head + "M593 F40\n", marlin)),
              HasSubstr("take this line out of the start code"));
  EXPECT_THAT(refusal(read("[printer]\nfirmware = \"marlin\"\nvariant = \"snapmaker_j1\"\n"
                           "input_shaper_freq_x_hz = 40\n")),
              HasSubstr("set printer.input_shaper_freq_x_hz = 0"));
  EXPECT_EQ(read("FIRMWARE_NAME:Snapmaker J1 V2.2.13\necho:  M92 X80 Y80\necho: M201 X1 Y1\n")
                .printer.variant,
            "snapmaker_j1");
}

constexpr const char* kConfigG =
    "M584 X0 Y1\nM550 P\"Duet\"\nM566 X900.00 Y900.00 Z60 E300 P1\nM205 X8 Y20\n";

TEST(RepRapFirmware, HasAJerkOfPrintsFrom3_6On) {
  const Settings before = read(kConfigG);
  EXPECT_FALSE(before.has_print_jerk());
  EXPECT_THAT(before.print_jerk_mm_s(), ::testing::ElementsAre(8.0, 20.0, 1.0, 5.0));
  const Settings s = read(std::string("; FIRMWARE_NAME: RepRapFirmware for Duet 3 MB6HC "
                                      "FIRMWARE_VERSION: 3.6.0 ELECTRONICS: x\n") +
                          kConfigG);
  EXPECT_EQ(told(s, "printer.version"), "\"3.6.0\" printer:1");
  EXPECT_TRUE(s.has_print_jerk());
  EXPECT_THAT(s.jerk_mm_s(), ::testing::ElementsAre(15.0, 15.0, 1.0, 5.0));
  EXPECT_THAT(s.print_jerk_mm_s(), ::testing::ElementsAre(8.0, 15.0, 1.0, 5.0)) << "at most M566's";
  EXPECT_TRUE(read(kConfigG, {"printer.version=\"3.10.1\""}).has_print_jerk());
  EXPECT_FALSE(read(kConfigG, {"printer.version=\"3.5.4\""}).has_print_jerk());
}

TEST(RepRapFirmware, HasOneJerkAgainBehindM566) {
  const Settings s = read(std::string(kConfigG) + "M566 X600\n", {"printer.version=\"3.6\""});
  EXPECT_DOUBLE_EQ(s.print_jerk_mm_s()[0], 10.0);
  EXPECT_DOUBLE_EQ(s.print_jerk_mm_s()[1], 15.0) << "Y was not named";
}

TEST(LineRate, GoesByFirmwareAndTransport) {
  const auto rate = [](const std::string& firmware, const std::string& transport) {
    return read("[printer]\nfirmware = \"" + firmware + "\"\ntransport = \"" + transport + "\"\n")
        .max_lines_per_s();
  };
  for (const std::string transport : {"auto", "card"}) {
    EXPECT_EQ(rate("klipper", transport), 1000.0);
    EXPECT_EQ(rate("marlin", transport), 200.0);
    EXPECT_EQ(rate("rrf", transport), 500.0);
  }
  for (const std::string firmware : {"klipper", "marlin", "rrf"}) {
    EXPECT_EQ(rate(firmware, "serial"), 100.0);
  }
  EXPECT_EQ(rate("rrf", "sbc"), 250.0);
  EXPECT_EQ(
      read("[printer]\ntransport = \"serial\"\n[emit]\nmax_lines_per_s = 300\n").max_lines_per_s(),
      300.0);
}

}  // namespace
}  // namespace unflex::machine
