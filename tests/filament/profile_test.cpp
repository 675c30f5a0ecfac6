#include "unflex/filament/profile.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <sstream>
#include <string>

namespace unflex::filament {
namespace {

Result<Profile> read(const std::string& text) {
  std::istringstream table(text);
  return Profile::read(table, "spool.csv");
}

TEST(FilamentProfile, KnowsTheSectionOfADiameter) {
  EXPECT_NEAR(area_of_diameter_mm2(1.75), 2.405282, 5e-7);
  // The diameter of a full section of 2.177 mm².
  EXPECT_NEAR(area_of_diameter_mm2(1.664885), 2.177, 1e-5);
}

// Filament that is 0.025 mm thinner or thicker, and one that is hollow.
TEST(FilamentProfile, KnowsHowMuchASectionDiffersFromTheSlicers) {
  const double sliced_mm2 = area_of_diameter_mm2(1.75);
  EXPECT_NEAR(100.0 * (area_of_diameter_mm2(1.725) / sliced_mm2 - 1.0), -2.84, 5e-3);
  EXPECT_NEAR(100.0 * (area_of_diameter_mm2(1.775) / sliced_mm2 - 1.0), 2.88, 5e-3);
  EXPECT_NEAR(100.0 * Profile(2.177).volume_mm3(0.0, 1.0) / sliced_mm2, 90.51, 5e-3);
  EXPECT_NEAR(Profile(2.177).length_mm(0.0, sliced_mm2), 1.104861, 5e-7);
}

TEST(FilamentProfile, IsTheSameEverywhereWithOneSection) {
  const Profile even(2.0);
  EXPECT_EQ(even.area_mm2(-5.0), 2.0);
  EXPECT_EQ(even.area_mm2(1e6), 2.0);
  EXPECT_NEAR(even.length_mm(-3.0, 10.0), 5.0, 1e-12);
  EXPECT_NEAR(even.volume_mm3(7.0, 4.0), -6.0, 1e-12);
}

// A = 2.1 + 0.002 s: 10 mm³ are 2.1 x + 0.001 x².
TEST(FilamentProfile, FindsTheLengthThatHoldsAVolume) {
  const auto profile = read("mm,area_mm2\n0,2.1\n1000,4.1\n");
  ASSERT_TRUE(profile) << to_string(profile.error());
  EXPECT_NEAR(profile->length_mm(0.0, 10.0), 4.751155, 5e-7);
  EXPECT_NEAR(profile->area_mm2(500.0), 3.1, 1e-12);
  EXPECT_NEAR(profile->volume_mm3(0.0, 1000.0), 3100.0, 1e-9);
  // Beyond the ends it is as there.
  EXPECT_EQ(profile->area_mm2(-1.0), 2.1);
  EXPECT_EQ(profile->area_mm2(2000.0), 4.1);
  EXPECT_NEAR(profile->length_mm(1000.0, 8.2), 2.0, 1e-12);
  EXPECT_NEAR(profile->length_mm(-10.0, 21.0), 10.0, 1e-12);
  EXPECT_NEAR(profile->length_mm(-10.0, 31.0), 14.751155, 1e-6);
}

TEST(FilamentProfile, GoesBackAndForthWithoutLoss) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> area(1.5, 2.6);
  std::uniform_real_distribution<double> step(0.5, 80.0);
  std::string text = "# measured\nmm;area_mm2\n";
  double at_mm = -20.0;
  for (int i = 0; i < 60; ++i, at_mm += step(random)) {
    text += std::to_string(at_mm) + ";" + std::to_string(area(random)) + "\n";
  }
  const auto profile = read(text);
  ASSERT_TRUE(profile) << to_string(profile.error());
  double from_mm = -50.0;
  while (from_mm < at_mm + 50.0) {
    const double volume_mm3 = 2.0 * step(random);
    const double length_mm = profile->length_mm(from_mm, volume_mm3);
    EXPECT_NEAR(profile->volume_mm3(from_mm, from_mm + length_mm), volume_mm3, 1e-9);
    from_mm += length_mm;
  }
}

TEST(FilamentProfile, TakesDiametersAndAnyOrderOfColumns) {
  const auto profile = read("diameter_mm\tmm\r\n1.75\t0\r\n1.70\t100\r\n");
  ASSERT_TRUE(profile) << to_string(profile.error());
  EXPECT_NEAR(profile->area_mm2(0.0), 2.405282, 5e-7);
  EXPECT_NEAR(profile->area_mm2(100.0), area_of_diameter_mm2(1.70), 1e-12);
}

TEST(FilamentProfile, SaysWhatIsWrongWithATable) {
  const auto error = [](const std::string& text) {
    const auto profile = read(text);
    return profile ? std::string("fine") : to_string(profile.error());
  };
  EXPECT_EQ(error("0,2.1\n"),
            "spool.csv:1: is not a profile's first line; name its columns mm and "
            "area_mm2 or diameter_mm");
  EXPECT_EQ(error("mm,area_mm2\n0,2\n0,3\n"),
            "spool.csv:3: is not behind the place before; sort the places along the filament");
  EXPECT_EQ(error("mm,area_mm2\n0\n"),
            "spool.csv:2: has 1 columns, not 2 as the first line; give each place a line");
  EXPECT_EQ(error("mm,area_mm2\n0,two\n"),
            "spool.csv:2: has no number where one is needed; write numbers as 12.5");
  EXPECT_EQ(error("mm,area_mm2\n0,0\n"),
            "spool.csv:2: has a section of nothing; leave out what could not be measured");
  EXPECT_EQ(error("mm,area_mm2\n"),
            "spool.csv: has no place; give columns mm and area_mm2, and a "
            "line for each place");
}

}  // namespace
}  // namespace unflex::filament
