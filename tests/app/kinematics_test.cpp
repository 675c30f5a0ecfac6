// unflex kinematics: what a print asks of joints, and rows from measured places.
#include "kinematics.hpp"

#include <gmock/gmock.h>

#include <string>

#include "program.hpp"

namespace unflex::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kTripteron =
    "[limits]\nmax_velocity_mm_s = 300\nmax_accel_mm_s2 = 3000\nmax_z_velocity_mm_s = 300\n"
    "[kinematics]\ntype = \"tripteron\"\n"
    "bars_mm = [150, 150]\nrail_y_mm = [80, -80, 0]\nrail_z_mm = [0, 0, 0]\n"
    "tool_joint_a_mm = [-20, 25, 10]\ntool_joint_b_mm = [-20, -25, 10]\n"
    "tool_joint_c_mm = [20, 0, 10]\n";
// 100 mm along X, then 40 mm along Y, at a height of 100 mm.
const std::string kPrint =
    "G28\nM83\nG90\nG1 Z100 F18000\nG1 X0 Y0 F6000\nG1 X100 E5\nG1 Y40 F3000 E2\n";

class Joints : public ProgramTest {
 protected:
  Joints() {
    write_file(path("p.toml"), kTripteron);
    write_file(path("in.gcode"), kPrint);
  }
  Outcome look(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = {"kinematics", "in.gcode", "--printer", "p.toml"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_as_typed(arguments);
  }
};

TEST_F(Joints, AreFollowedThroughAPrint) {
  const Outcome outcome = look({"--set", "kinematics.range_a_mm=[-200, 0]"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, StartsWith("in.gcode\nmachine       tripteron, condition of J 1.414\n"));
  // C does X + Z + 30, and Y does not move it.
  EXPECT_THAT(outcome.out, HasSubstr(" to -45.000 of -200 to 0 mm\n"));
  EXPECT_THAT(outcome.out, HasSubstr("joint C       130.000 to 230.000 mm\n"));
  EXPECT_THAT(outcome.out, HasSubstr("0 of them go where the machine cannot be"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("reach         not known")));
}

TEST_F(Joints, TellTheirLargestSpeedAndAcceleration) {
  write_file(path("in.gcode"), "G28\nM83\nG1 X0 Y0 Z0 F6000\nG1 X50 Y50 E5\nG1 X100 E2\n");
  const Outcome outcome =
      run_as_typed({"kinematics", "in.gcode", "--set", "kinematics.type=corexy"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  // At 45° the motor A does √2 times what the tool does, and B nothing.
  EXPECT_THAT(outcome.out,
              HasSubstr("joint A       0.000 to 150.000 mm\n              141.4 mm/s (line 4)"));
  EXPECT_THAT(outcome.out,
              HasSubstr("joint B       0.000 to 50.000 mm\n              100.0 mm/s (line 5)"));
  EXPECT_THAT(outcome.out, HasSubstr("reach         not known; kinematics.range_a_mm"));
}

TEST_F(Joints, RefuseAPrintBeyondTheirRange) {
  const Outcome outcome = look({"--set", "kinematics.range_c_mm=[0, 200]"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(
      outcome.err,
      "in.gcode:6: the tool cannot be at X75 Y0 Z100: joint C would have to be at 205 mm, and "
      "its range is 0 to 200\n"
      "in.gcode:7: the tool cannot be at X100 Y0 Z100: joint C would have to be at 230 mm, and "
      "its range is 0 to 200\n"
      "in.gcode:6: 2 moves go, from this line on, where this machine cannot be; place the "
      "print elsewhere, or correct the keys of kinematics if they are wrong\n");
  EXPECT_THAT(outcome.out, HasSubstr("2 of them go where the machine cannot be"));
}

TEST_F(Joints, RefuseAPrintBeyondTheReachOfALeg) {
  write_file(path("in.gcode"), kPrint + "G1 Z170\nG1 X50 E1\n");
  const Outcome outcome = look({"-q"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("in.gcode:8: the tool cannot be at X100 Y40"),
                                 HasSubstr("mm long, and it is straight at 300 mm\n")));
}

TEST_F(Joints, LookAtAPrintOrAtPlaces) {
  EXPECT_THAT(run_as_typed({"kinematics"}).err,
              HasSubstr("what to look at? give a print, or --fit"));
  EXPECT_EQ(run_as_typed({"kinematics"}).exit_code, 1);
  EXPECT_THAT(run_as_typed({"kinematics", "in.gcode", "--fit", "p.csv"}).err,
              HasSubstr("--fit reads places alone"));
  EXPECT_THAT(run_as_typed({"kinematics", "--fit", "p.csv", "--printer", "p.toml"}).err,
              HasSubstr("--printer and --set are of a print"));
  EXPECT_EQ(run_as_typed({"kinematics", "missing.gcode"}).exit_code, 2);
  EXPECT_EQ(run_as_typed({"kinematics", "-", "--printer", "missing.toml"}).exit_code, 1);
}

// q = J p + c of the default tripteron, with offsets of 10, 20 and 30 mm.
const std::string kPlaces =
    "10,20,30,0,0,0\n210,220,230,200,0,0\n210,-180,30,0,200,0\n-190,-180,230,0,0,200\n"
    "210,-180,430,200,200,200\n";

class FitOfRows : public ProgramTest {
 protected:
  Outcome fit(const std::string& text, const std::vector<std::string>& more = {}) const {
    write_file(path("p.csv"), text);
    std::vector<std::string> arguments = {"kinematics", "--fit", "p.csv"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_as_typed(arguments);
  }
};

TEST_F(FitOfRows, GivesLinesForAPrinterFile) {
  const Outcome outcome = fit("qa,qb,qc,x,y,z\n" + kPlaces, {"-q"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out,
            "kinematics.type = \"linear\"  # or \"tripteron\"\n"
            "kinematics.joint_a = [1.000000, 1.000000, -1.000000]\n"
            "kinematics.joint_b = [1.000000, -1.000000, -1.000000]\n"
            "kinematics.joint_c = [1.000000, 0.000000, 1.000000]\n"
            "kinematics.offset_mm = [10.0000, 20.0000, 30.0000]\n");
  // As they are, they are a printer file.
  write_file(path("rows.toml"), outcome.out);
  write_file(path("in.gcode"), kPrint);
  const Outcome looked = run_as_typed({"kinematics", "in.gcode", "--printer", "rows.toml"});
  EXPECT_EQ(looked.exit_code, 0) << looked.err;
  EXPECT_THAT(looked.out, HasSubstr("machine       linear, condition of J 1.414\n"));
  EXPECT_THAT(looked.out, HasSubstr("joint C       130.000 to 230.000 mm\n"));
}

TEST_F(FitOfRows, NamesTheRailThatIsOff) {
  const Outcome good = fit(kPlaces);
  EXPECT_THAT(good.out, HasSubstr("# no rail is off\n"));
  const Outcome bad = fit(kPlaces + "# with a slip\n110,121.5,130,100,0,0\n");
  EXPECT_EQ(bad.exit_code, 0) << bad.err;
  EXPECT_THAT(bad.out, HasSubstr("# residual of A: 0.0000 mm RMS, 0.0000 mm at most"));
  EXPECT_THAT(bad.out, HasSubstr("# rail B is off most; measure line 7 again"));
  const std::size_t fifth = kPlaces.find("210,-180,430");
  EXPECT_THAT(fit(kPlaces.substr(0, fifth)).out, HasSubstr("# four places are met by any rails"));
}

TEST_F(FitOfRows, TakesColumnsInAnyOrder) {
  const Outcome outcome =
      fit("x,y,z,qa,qb,qc\n0,0,0,10,20,30\n200,0,0,210,220,230\n0,200,0,210,-180,30\n"
          "0,0,200,-190,-180,230\n");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("kinematics.offset_mm = [10.0000, 20.0000, 30.0000]\n"));
}

TEST_F(FitOfRows, TellsWhereTheTableIsWrong) {
  const auto refusal = [&](const std::string& text) {
    const Outcome outcome = fit(text);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(outcome.out, "");
    return outcome.err;
  };
  EXPECT_EQ(
      refusal("10,20,30,0,0,0\n210,220,230,2oo,0,0\n"),
      "p.csv:2: has no number for x; write six numbers in mm, qa,qb,qc,x,y,z, with points for "
      "decimals\n");
  EXPECT_THAT(refusal("1,2,3,4,5\n"), StartsWith("p.csv:1: has no number for z;"));
  EXPECT_THAT(refusal("a,b,c,x,y,z\n" + kPlaces),
              StartsWith("p.csv:1: its header has no column qa;"));
  EXPECT_EQ(refusal("10,20,30,0,0,0\n"),
            "p.csv: at least 4 places that are not in one plane are needed, and it has 1; measure "
            "more\n");
  EXPECT_EQ(refusal("0,0,0,0,0,0\n1,1,1,1,0,0\n1,-1,0,0,1,0\n2,0,1,1,1,0\n"),
            "p.csv: all its places of the tool lie in a plane, or nearly so; measure some that are "
            "far from it\n");
  EXPECT_EQ(run_as_typed({"kinematics", "--fit", "none.csv"}).exit_code, 2);
}

}  // namespace
}  // namespace unflex::app
