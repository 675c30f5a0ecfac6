#include "unflex/gcode/hotend_command.hpp"

#include <gtest/gtest.h>

#include <string>

namespace unflex::gcode {
namespace {

// "210", "210 tool 1 waits", "waits both ways" …
std::string meaning(std::string_view line, Firmware firmware) {
  const auto command = hotend_command(parse(line), firmware);
  if (!command) {
    return "nothing";
  }
  std::string text;
  if (command->target_c) {
    text += std::to_string(static_cast<int>(*command->target_c));
  }
  if (command->tool) {
    text += " tool " + std::to_string(*command->tool);
  }
  if (command->waits) {
    text += command->waits_cooling ? " waits both ways" : " waits";
  }
  return text;
}

TEST(HotendCommand, IsWhatKlipperDoes) {
  const auto of = [](std::string_view line) { return meaning(line, Firmware::klipper); };
  EXPECT_EQ(of("M104 S210"), "210");
  EXPECT_EQ(of("M104 S210 ; warm"), "210");
  EXPECT_EQ(of("m104s210"), "210");
  EXPECT_EQ(of("M104 T1 S210"), "210 tool 1");
  EXPECT_EQ(of("M104"), "0");
  EXPECT_EQ(of("M109 S210"), "210 waits both ways");
  EXPECT_EQ(of("M109 S0"), "0");
  EXPECT_EQ(of("SET_HEATER_TEMPERATURE HEATER=extruder TARGET=210"), "210 tool 0");
  EXPECT_EQ(of("SET_HEATER_TEMPERATURE HEATER=extruder2 TARGET=210"), "210 tool 2");
  EXPECT_EQ(of("SET_HEATER_TEMPERATURE HEATER=extruder99999999999 TARGET=210"),
            "210 tool 2147483647");
  EXPECT_EQ(of("SET_HEATER_TEMPERATURE HEATER=extruder"), "0 tool 0");
  EXPECT_EQ(of("SET_HEATER_TEMPERATURE HEATER=heater_bed TARGET=60"), "nothing");
  EXPECT_EQ(of("TEMPERATURE_WAIT SENSOR=extruder MINIMUM=205"), " tool 0 waits");
  EXPECT_EQ(of("TEMPERATURE_WAIT SENSOR=extruder MINIMUM=205 MAXIMUM=215"),
            " tool 0 waits both ways");
  EXPECT_EQ(of("TEMPERATURE_WAIT SENSOR=heater_bed MINIMUM=60"), "nothing");
  EXPECT_EQ(of("TURN_OFF_HEATERS"), "0");
  EXPECT_EQ(of("M140 S60"), "nothing");
  EXPECT_EQ(of("G10 P0 S210"), "nothing");
  EXPECT_EQ(of("START_PRINT EXTRUDER=210"), "nothing");
  EXPECT_EQ(of("; M104 S210"), "nothing");
}

TEST(HotendCommand, IsWhatMarlinDoes) {
  const auto of = [](std::string_view line) { return meaning(line, Firmware::marlin); };
  EXPECT_EQ(of("M104 S210"), "210");
  EXPECT_EQ(of("M104 T1 S210"), "210 tool 1");
  EXPECT_EQ(of("M104"), "nothing");
  EXPECT_EQ(of("M109 S210"), "210 waits");
  EXPECT_EQ(of("M109 R210"), "210 waits both ways");
  EXPECT_EQ(of("M109 R200 S210"), "210 waits");
  EXPECT_EQ(of("M109 S0"), "0 waits");
  EXPECT_EQ(of("M109"), "nothing");
  EXPECT_EQ(of("M104 I1"), "");
  EXPECT_EQ(of("M109 I1"), " waits both ways");
  EXPECT_EQ(of("M568 P0 S210"), "nothing");
}

TEST(HotendCommand, IsWhatRepRapFirmwareDoes) {
  const auto of = [](std::string_view line) { return meaning(line, Firmware::rrf); };
  EXPECT_EQ(of("M104 S210"), "210");
  EXPECT_EQ(of("M109 S210"), "210 waits");
  EXPECT_EQ(of("M109 R210"), "210 waits both ways");
  EXPECT_EQ(of("M116"), " waits both ways");
  EXPECT_EQ(of("M116 P1"), " tool 1 waits both ways");
  EXPECT_EQ(of("M568 P0 S210 R150"), "210 tool 0");
  EXPECT_EQ(of("M568 P0 A2"), "nothing");
  EXPECT_EQ(of("G10 P0 S210 R150"), "210 tool 0");
  EXPECT_EQ(of("G10 S210"), "210");
  EXPECT_EQ(of("G10"), "nothing");
  EXPECT_EQ(of("G10 P1 X0.2 Y0.1"), "nothing");
}

TEST(HotendCommand, KnowsToolsAndPauses) {
  EXPECT_EQ(selected_tool(parse("T1"), Firmware::marlin), 1);
  EXPECT_EQ(selected_tool(parse("T-1"), Firmware::rrf), -1);
  EXPECT_EQ(selected_tool(parse("ACTIVATE_EXTRUDER EXTRUDER=extruder1"), Firmware::klipper), 1);
  EXPECT_FALSE(selected_tool(parse("G1 X1"), Firmware::klipper).has_value());
  for (const std::string_view line : {"M0", "M1 hello", "M25", "M226", "M600", "M601", "PAUSE"}) {
    EXPECT_TRUE(pauses_print(parse(line))) << line;
  }
  for (const std::string_view line : {"G1 X1", "M106 S255", "G4 P100", "M400", "M73 P1"}) {
    EXPECT_FALSE(pauses_print(parse(line))) << line;
  }
}

TEST(HotendCommand, IsReadBackAsWritten) {
  for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
    EXPECT_EQ(meaning(set_hotend_line(215.0, std::nullopt), firmware), "215");
    EXPECT_EQ(meaning(set_hotend_line(215.0, 1), firmware), "215 tool 1");
  }
  EXPECT_EQ(set_hotend_line(215.5, std::nullopt), "M104 S215.5");
  EXPECT_EQ(set_hotend_line(215.0, 0), "M104 T0 S215");
}

}  // namespace
}  // namespace unflex::gcode
