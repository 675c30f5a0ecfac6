// unflex as a slicer's post-processing script: the path comes last, the slicer passes settings in
// its environment and shows little of a script's messages.

#include "hook.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "app/program.hpp"

namespace unflex::app {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

// An environment variable that is set for the lifetime of the object.
class Variable {
 public:
  Variable(std::string name, const std::string& value) : name_(std::move(name)) {
    ::setenv(name_.c_str(), value.c_str(), 1);
  }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;
  ~Variable() { ::unsetenv(name_.c_str()); }

 private:
  std::string name_;
};

class Hook : public ProgramTest {
 protected:
  Hook() { write_file(path("in.gcode"), small_print()); }

  Outcome hook(std::vector<std::string> options = {}) {
    options.insert(options.begin(), {"compensate", "--in-place"});
    options.push_back("in.gcode");
    return run(options);
  }
};

constexpr const char* kBlock =
    "; gcode_flavor = marlin2\n; machine_max_feedrate_x = 180\n; nozzle_diameter = 0.6\n";

nlohmann::json setting(const nlohmann::json& report, const std::string& key) {
  return report["printer"][key];
}

TEST_F(Hook, TakesThePathBehindTheOptions) {
  const Outcome outcome = hook({"--set", "limits.max_accel_mm_s2=3000", "--quiet"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out + outcome.err, "");
  EXPECT_THAT(read_file(path("in.gcode")), HasSubstr(";unflex run"));
  EXPECT_THAT(names(), ElementsAre("in.gcode"));
}

TEST_F(Hook, RunTwiceRefusesAndLeavesTheFile) {
  ASSERT_EQ(hook().exit_code, 0);
  const std::string once = read_file(path("in.gcode"));
  const Outcome again = hook();
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, MatchesRegex("in.gcode:[0-9]+: this file was already compensated by "
                                      "unflex; give .* let a slicer run unflex once\n"));
  EXPECT_EQ(read_file(path("in.gcode")), once);
  EXPECT_THAT(names(), ElementsAre("in.gcode"));
}

TEST_F(Hook, TakesSettingsFromTheSlicersEnvironment) {
  const Variable flavor("SLIC3R_GCODE_FLAVOR", "marlin2");
  const Variable speed("SLIC3R_MACHINE_MAX_FEEDRATE_X", "170,90");
  const Variable nozzle("SLIC3R_NOZZLE_DIAMETER", "0.5");
  const Outcome outcome = hook({"--report", "r.json", "--set", "printer.firmware=\"marlin\""});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto report = nlohmann::json::parse(read_file(path("r.json")));
  EXPECT_EQ(setting(report, "limits.max_x_velocity_mm_s")["value"], 170);
  EXPECT_EQ(setting(report, "limits.max_x_velocity_mm_s")["origin"],
            "SLIC3R_MACHINE_MAX_FEEDRATE_X");
  EXPECT_EQ(setting(report, "extruder.nozzle_diameter_mm")["origin"], "SLIC3R_NOZZLE_DIAMETER");
}

TEST_F(Hook, TrustsTheFilesOwnBlockMoreThanTheEnvironment) {
  write_file(path("in.gcode"), small_print() + kBlock);
  const Variable flavor("SLIC3R_GCODE_FLAVOR", "klipper");
  const Variable speed("SLIC3R_MACHINE_MAX_FEEDRATE_X", "170");
  const Variable accel("SLIC3R_MACHINE_MAX_ACCELERATION_X", "1234");
  const Outcome outcome = hook({"--report", "r.json", "--set", "printer.firmware=\"marlin\""});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto report = nlohmann::json::parse(read_file(path("r.json")));
  EXPECT_EQ(setting(report, "limits.max_x_velocity_mm_s")["value"], 180);
  EXPECT_THAT(setting(report, "limits.max_x_velocity_mm_s")["origin"].get<std::string>(),
              StartsWith("in.gcode:"));
  EXPECT_EQ(setting(report, "limits.max_x_accel_mm_s2")["value"], 1234);
}

TEST_F(Hook, GivesTheSameBytesWhetherBlockOrEnvironmentTells) {
  const std::vector<std::string> options = {
      "--set", "printer.firmware=\"marlin\"",      "--set", "printer.input_shaper_freq_x_hz=0",
      "--set", "printer.input_shaper_freq_y_hz=0", "-q"};
  write_file(path("in.gcode"), small_print() + kBlock);
  ASSERT_EQ(hook(options).exit_code, 0);
  const std::string by_block = read_file(path("in.gcode"));
  write_file(path("in.gcode"), small_print());
  {
    const Variable flavor("SLIC3R_GCODE_FLAVOR", "marlin2");
    const Variable speed("SLIC3R_MACHINE_MAX_FEEDRATE_X", "180");
    const Variable nozzle("SLIC3R_NOZZLE_DIAMETER", "0.6");
    ASSERT_EQ(hook(options).exit_code, 0);
  }
  EXPECT_EQ(read_file(path("in.gcode")) + kBlock, by_block);
}

TEST_F(Hook, AloneLooksAtTheEnvironment) {
  const Variable nozzle("SLIC3R_NOZZLE_DIAMETER", "0.5");
  ASSERT_EQ(run({"compensate", "in.gcode", "-o", "out.gcode", "--report", "r.json"}).exit_code, 0);
  const auto report = nlohmann::json::parse(read_file(path("r.json")));
  EXPECT_EQ(setting(report, "extruder.nozzle_diameter_mm")["origin"], "default");
}

TEST_F(Hook, CallsThePrintByItsFinalName) {
  const Variable host("SLIC3R_PP_HOST", "File");
  const Variable name("SLIC3R_PP_OUTPUT_NAME", "/media/card/lid.gcode");
  const Outcome good = hook();
  EXPECT_EQ(good.exit_code, 0);
  EXPECT_THAT(good.out, StartsWith("/media/card/lid.gcode → /media/card/lid.gcode\n"));
  const Outcome again = hook();
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, StartsWith("/media/card/lid.gcode:"));
}

TEST_F(Hook, SaysWhichVariableIsWrong) {
  const Variable nozzle("SLIC3R_NOZZLE_DIAMETER", "4000");
  const Outcome outcome = hook();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, StartsWith("SLIC3R_NOZZLE_DIAMETER: "));
  EXPECT_EQ(read_file(path("in.gcode")), small_print());
}

TEST_F(Hook, AddsToItsLog) {
  const Variable name("SLIC3R_PP_OUTPUT_NAME", "lid.gcode");
  EXPECT_EQ(hook({"--log", "unflex.log", "--quiet"}).out, "");
  const std::string first = read_file(path("unflex.log"));
  EXPECT_THAT(first, MatchesRegex("20[0-9-]+T[0-9:]+Z unflex [0-9.]+ lid.gcode\n"
                                  "  lid.gcode → lid.gcode\n(  .*\n)*  exit code 0\n"));
  EXPECT_EQ(hook({"--log", "unflex.log"}).exit_code, 2);
  const std::string both = read_file(path("unflex.log"));
  EXPECT_THAT(both, StartsWith(first));
  EXPECT_THAT(both.substr(first.size()),
              MatchesRegex("20[0-9-]+T[0-9:]+Z unflex [0-9.]+ lid.gcode\n  lid.gcode:[0-9]+: this "
                           "file was already compensated.*\n  exit code 2\n"));
}

TEST_F(Hook, RefusesALogThatCannotBe) {
  EXPECT_THAT(hook({"--log", "missing/unflex.log"}).err,
              StartsWith("missing/unflex.log: cannot write the log: No such file"));
  EXPECT_THAT(hook({"--log", "in.gcode"}).err, StartsWith("in.gcode: is read or written already"));
  EXPECT_EQ(hook({"--log", "missing/unflex.log"}).exit_code, 1);
  EXPECT_EQ(read_file(path("in.gcode")), small_print());
}

TEST_F(Hook, PutsAReportOfItsSuffixAloneBesideTheFinalFile) {
  const Variable host("SLIC3R_PP_HOST", "File");
  std::filesystem::create_directory(path("card"));
  const Variable name("SLIC3R_PP_OUTPUT_NAME", path("card/lid.gcode"));
  EXPECT_EQ(hook({"--report", ".html"}).exit_code, 0);
  EXPECT_THAT(read_file(path("card/lid.html")), StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(names(), ElementsAre("card", "in.gcode"));
}

TEST_F(Hook, HasNoPlaceForAReportBesideAnUpload) {
  const Variable host("SLIC3R_PP_HOST", "OctoPrint");
  const Variable name("SLIC3R_PP_OUTPUT_NAME", "lid.gcode");
  const Outcome outcome = hook({"--report", ".json"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, AllOf(StartsWith("unflex: --report .json: "), HasSubstr("OctoPrint")));
  EXPECT_THAT(names(), ElementsAre("in.gcode"));
}

TEST(Slicer, IsReadFromTheEnvironment) {
  EXPECT_THAT(read_slicer().settings, IsEmpty());
  const Variable host("SLIC3R_PP_HOST", "PrusaLink");
  const Variable name("SLIC3R_PP_OUTPUT_NAME", "");
  const Variable later("SLIC3R_PP_LATER", "1");
  const Variable jerk("SLIC3R_MACHINE_MAX_JERK_X", "8=8");
  const Slicer slicer = read_slicer();
  EXPECT_EQ(slicer.host, "PrusaLink");
  EXPECT_FALSE(slicer.output_name);
  EXPECT_THAT(slicer.settings,
              ElementsAre(std::pair<std::string, std::string>("SLIC3R_MACHINE_MAX_JERK_X", "8=8")));
}

}  // namespace
}  // namespace unflex::app
