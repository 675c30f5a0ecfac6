// The test of compensated stops.
#include "unflex/machine/ring_test.hpp"

#include <gmock/gmock.h>

#include "reading.hpp"

namespace unflex::machine {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Result<std::string> text_for(const std::string& printer, char axis) {
  const Result<Settings> settings = parse(printer, "printer", {});
  EXPECT_TRUE(settings) << to_string(settings.error());
  return ring_test(settings.value_or(Settings{}), axis);
}

constexpr const char* kBed = "travel_x_mm = [0, 200]\ntravel_y_mm = [0, 300]\n";

TEST(RingTest, StopsInTheMiddleOfTheBed) {
  const auto x = text_for(std::string("[printer]\n") + kBed, 'x');
  ASSERT_TRUE(x);
  EXPECT_THAT(*x, HasSubstr("G1 X70.000 Y150.000 F3000\n"));
  for (const char* speed : {"20", "50", "100"}) {
    const std::string name = std::string("ACCELEROMETER_MEASURE NAME=unflex_x_") + speed + "\n";
    const std::string feed = std::to_string(60 * std::stoi(speed));
    EXPECT_THAT(*x, HasSubstr(name + "G1 X130.000 F" + feed + "\nM400\nG4 P1000\n" + name));
  }
  const auto y = text_for(std::string("[printer]\n") + kBed, 'y');
  ASSERT_TRUE(y);
  EXPECT_THAT(*y, HasSubstr("G1 X100.000 Y120.000 F3000\n"));
  EXPECT_THAT(*y, HasSubstr("G1 Y180.000 F6000\n"));
}

TEST(RingTest, RecordsAsTheFirmwareCan) {
  const auto rrf = text_for(std::string("[printer]\nfirmware = \"rrf\"\n") + kBed, 'y');
  ASSERT_TRUE(rrf);
  EXPECT_THAT(*rrf, HasSubstr("M956 P0 S2560 A1 F\"unflex_y_100.csv\"\nG1 Y180.000 F6000\n"));
  EXPECT_THAT(*rrf, Not(HasSubstr("ACCELEROMETER")));
  EXPECT_FALSE(text_for(std::string("[printer]\nfirmware = \"marlin\"\n") + kBed, 'y'));
}

TEST(RingTest, NeedsRoom) {
  const auto none = text_for("[printer]\ntravel_x_mm = [0, 50]\n", 'x');
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("printer.travel_x_mm leaves no 60 mm"));
}

TEST(SecondSettings, NeedAModeOfTheirOwn) {
  const auto told = [](const std::string& text) {
    const Result<Settings> settings = parse(text, "p.toml", {});
    return settings ? std::string() : to_string(settings.error());
  };
  EXPECT_EQ(told("[dynamics.x]\nfreq_hz = 45\n[second]\nx_freq_hz = 110\n"), "");
  EXPECT_THAT(told("[dynamics.x]\nfreq_hz = 45\n[second]\nx_freq_hz = 46\n"),
              HasSubstr("p.toml:4: second.x_freq_hz is 46, the same as the axis' own 45 Hz"));
  EXPECT_THAT(told("[[dynamics.x.mode]]\nfreq_hz = 40\ngain = 0.5\ndamping_ratio = 0.1\n"
                   "[[dynamics.x.mode]]\nfreq_hz = 60\ngain = 0.3\ndamping_ratio = 0.1\n"
                   "[[dynamics.x.mode]]\nfreq_hz = 80\ngain = 0.2\ndamping_ratio = 0.1\n"
                   "[second]\nx_freq_hz = 110\n"),
              HasSubstr("the axis has 3 modes already"));
  EXPECT_THAT(told("[second]\nshaper = \"2hump_ei\"\n"), HasSubstr("second.shaper"));
}

}  // namespace
}  // namespace unflex::machine
