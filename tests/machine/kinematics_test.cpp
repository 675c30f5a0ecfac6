// Keys of kinematics, and the machine that they make.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "unflex/machine/kinematic_machine.hpp"

namespace unflex::machine {
namespace {

using testing::HasSubstr;

const std::string kType = "[kinematics]\ntype = \"tripteron\"\n";
const std::string kLegs =
    "bars_mm = [150, 150]\nrail_y_mm = [80, -80, 0]\nrail_z_mm = [0, 0, 0]\n"
    "tool_joint_a_mm = [-20, 25, 10]\ntool_joint_b_mm = [-20, -25, 10]\n"
    "tool_joint_c_mm = [20, 0, 10]\n";

Settings good(const std::string& text) {
  const Result<Settings> settings = parse(text, "p.toml", {});
  EXPECT_TRUE(settings) << to_string(settings.error());
  return settings.value_or(Settings{});
}

std::string refusal(const std::string& text) {
  const Result<Settings> settings = parse(text, "p.toml", {});
  EXPECT_FALSE(settings);
  return settings ? std::string{} : to_string(settings.error());
}

TEST(KinematicMachine, HasTheLegsOfATripteron) {
  const kinematics::Machine machine = kinematic_machine(good(kType + kLegs));
  const auto q = to_joints(machine, {100, 40, 100});
  ASSERT_TRUE(q);
  EXPECT_THAT(*q, testing::ElementsAre(-45.0, -125.0, 230.0));
  EXPECT_FALSE(fault(machine, {100, 0, 169}));
  EXPECT_TRUE(fault(machine, {100, 0, 170}));
  const kinematics::Machine bent =
      kinematic_machine(good(kType + kLegs + "elbow_deg = [20, 180]\n"));
  EXPECT_TRUE(fault(bent, {100, 0, 169}));
}

TEST(KinematicMachine, HasRangesAndAnOffset) {
  const kinematics::Machine machine = kinematic_machine(
      good("[kinematics]\ntype = \"corexy\"\noffset_mm = [1, 2, 3]\nrange_b_mm = [-40, 60]\n"));
  EXPECT_THAT(*to_joints(machine, {10, 20, 5}), testing::ElementsAre(31.0, -8.0, 8.0));
  EXPECT_THAT(fault(machine, {0, 50, 0}).value_or(""),
              HasSubstr("joint B would have to be at -48"));
  EXPECT_FALSE(fault(machine, {500, 500, 0}));
  const kinematics::Machine zeroed =
      kinematic_machine(good(kType + kLegs + "offset_mm = [0, 0, 0]\n"));
  EXPECT_THAT(*to_joints(zeroed, {250, 75, 100}), testing::ElementsAre(225.0, 75.0, 350.0));
}

TEST(KinematicKeys, AreReadAgainAsTheyAreTold) {
  const Settings settings = good(kType + kLegs + "elbow_deg = [5, 175]\nrange_c_mm = [0, 400]\n");
  const Settings again = good(to_toml(settings));
  EXPECT_EQ(again.kinematics.bars_mm, settings.kinematics.bars_mm);
  EXPECT_EQ(again.kinematics.tool_joint_mm, settings.kinematics.tool_joint_mm);
  EXPECT_EQ(again.kinematics.elbow_deg->max, 175.0);
  EXPECT_EQ(again.kinematics.range_mm[2]->max, 400.0);
}

TEST(KinematicKeys, TellTheLegsAsAWhole) {
  EXPECT_EQ(refusal(kType + "bars_mm = [150, 150]\n"),
            "p.toml:3: kinematics.bars_mm is given, but kinematics.rail_y_mm is not; the reach of "
            "the legs takes both");
  EXPECT_THAT(refusal(kType + "rail_z_mm = [0, 0, 0]\n"),
              HasSubstr("p.toml:3: kinematics.rail_z_mm is given, but kinematics.bars_mm is not"));
  EXPECT_THAT(refusal(kType + "elbow_deg = [5, 175]\n"),
              HasSubstr("p.toml:3: kinematics.elbow_deg is of the legs' bars"));
  EXPECT_THAT(
      refusal("[kinematics]\ntype = \"corexy\"\n" + kLegs),
      HasSubstr("p.toml:3: kinematics.bars_mm is given, but kinematics.type is \"corexy\""));
}

TEST(KinematicKeys, AreHeldToWhatTheyMean) {
  EXPECT_THAT(refusal(kType + "bars_mm = [150]\n"),
              HasSubstr("p.toml:3: kinematics.bars_mm must be two numbers > 0, as in [150, 150]"));
  EXPECT_THAT(refusal(kType + "bars_mm = [150, 0]\n"), HasSubstr("must be two numbers > 0"));
  EXPECT_THAT(refusal(kType + "range_a_mm = [5, 5]\n"),
              HasSubstr("p.toml:3: kinematics.range_a_mm is [5, 5], but the first"));
  EXPECT_THAT(refusal(kType + kLegs + "elbow_deg = [-5, 175]\n"),
              HasSubstr("p.toml:9: kinematics.elbow_deg is [-5, 175], and must be within 0"));
  EXPECT_THAT(refusal(kType + kLegs + "joint_a = [0, 1, -1]\n"),
              HasSubstr("p.toml:9: kinematics.joint_a does not move its slider along X"));
}

}  // namespace
}  // namespace unflex::machine
