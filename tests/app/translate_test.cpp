// unflex translate: a print for a firmware whose X, Y and Z are joints.
#include <gmock/gmock.h>

#include <filesystem>
#include <string>

#include "program.hpp"

namespace unflex::app {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class Translation : public ProgramTest {
 protected:
  Translation() {
    write_file(path("p.toml"),
               "[printer]\nfirmware = \"marlin\"\n"
               "[kinematics]\ntype = \"tripteron\"\nhome_mm = [100, 100, 0.2]\n");
    write_file(path("in.gcode"), "G28\nM83\nG1 X110 E1 F3600 ; wall\nG1 Y120\n");
  }
  Outcome translate(const std::vector<std::string>& more) const {
    std::vector<std::string> arguments = {"translate", "in.gcode", "--printer", "p.toml"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_as_typed(arguments);
  }
};

const std::string kTranslated =
    "G28\nM83\nG1 X209.8 Y9.8 Z110.2 E1 F6235.38 ; wall\nG1 X229.8 Y-10.2 Z110.2 F5091.17\n"
    "; unflex joints: 2 moves of the tool in 2 lines\n";

TEST_F(Translation, WritesJointsForAPlainFirmware) {
  const Outcome outcome = translate({"-o", "out.gcode"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(outcome.out, "joints        of a tripteron: 2 moves of the tool in 2 lines\n");
  EXPECT_EQ(read_file(path("out.gcode")), kTranslated);
}

TEST_F(Translation, GoesThroughAPipeAndInPlace) {
  const Outcome piped = run_as_typed({"translate", "-", "-o", "-", "--printer", "p.toml"});
  EXPECT_EQ(piped.exit_code, 0) << piped.err;
  EXPECT_EQ(piped.out, "; unflex joints: 0 moves of the tool in 0 lines\n");
  EXPECT_EQ(translate({"-o", "-"}).out, kTranslated);
  const Outcome replaced = translate({"--in-place", "-q"});
  EXPECT_EQ(replaced.exit_code, 0) << replaced.err;
  EXPECT_EQ(replaced.out, "");
  EXPECT_EQ(read_file(path("in.gcode")), kTranslated);
  // Once is enough.
  const Outcome again = translate({"--in-place"});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, StartsWith("in.gcode:5: this file was already translated"));
  EXPECT_EQ(read_file(path("in.gcode")), kTranslated);
}

TEST_F(Translation, LeavesNoFileWhereALineIsRefused) {
  const auto refusal = [&](const std::vector<std::string>& more) {
    const Outcome outcome = translate(more);
    EXPECT_FALSE(std::filesystem::exists(path("out.gcode")));
    return outcome;
  };
  const Outcome out_of_range =
      refusal({"-o", "out.gcode", "--set", "kinematics.range_a_mm=[0, 220]"});
  EXPECT_EQ(out_of_range.exit_code, 2);
  EXPECT_THAT(out_of_range.err, StartsWith("in.gcode:4: the tool cannot be at X110 Y111"));
  write_file(path("in.gcode"), "G28\nG29\nG1 X1 F600\n");
  const Outcome levelling = refusal({"-o", "out.gcode"});
  EXPECT_EQ(levelling.exit_code, 2);
  EXPECT_THAT(levelling.err, StartsWith("in.gcode:2: G29 is for the firmware's bed levelling"));
  write_file(path("in.gcode"), "G28\n;unflex run\n");
  EXPECT_THAT(refusal({"-o", "out.gcode"}).err,
              StartsWith("in.gcode:2: this file was already compensated by unflex"));
}

TEST_F(Translation, IsRefusedWhereItIsNotNeeded) {
  EXPECT_EQ(translate({"-o", "in.gcode"}).exit_code, 1);
  EXPECT_THAT(translate({"-o", "in.gcode"}).err, HasSubstr("is the input too"));
  EXPECT_THAT(translate({}).err, HasSubstr("where to write? give -o OUT"));
  const Outcome cartesian = run_as_typed({"translate", "in.gcode", "-o", "out.gcode"});
  EXPECT_EQ(cartesian.exit_code, 1);
  EXPECT_THAT(cartesian.err, HasSubstr("which machine? kinematics.type is \"cartesian\""));
  write_file(path("printer.cfg"),
             "[printer]\nkinematics: corexy\nmax_velocity: 300\nmax_accel: 3000\n");
  const Outcome native =
      run_as_typed({"translate", "in.gcode", "-o", "out.gcode", "--printer", "printer.cfg"});
  EXPECT_EQ(native.exit_code, 1);
  EXPECT_THAT(native.err, StartsWith("printer.cfg:2: the firmware knows itself that the machine "
                                     "is corexy"));
  EXPECT_FALSE(std::filesystem::exists(path("out.gcode")));
}

TEST_F(Translation, WarnsWhereFirmwaresKnowTheMachine) {
  const Outcome outcome = translate({"-o", "out.gcode", "--set", "kinematics.type=corexy"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("a firmware for a corexy knows itself"));
  EXPECT_EQ(translate({"-o", "no.gcode", "--set", "kinematics.type=corexy", "--strict"}).exit_code,
            2);
  EXPECT_FALSE(std::filesystem::exists(path("no.gcode")));
}

}  // namespace
}  // namespace unflex::app
