// A small print through the whole program.

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "app/program.hpp"
#include "report/documented_keys.hpp"

namespace unflex::app {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class SmallPrint : public ProgramTest {
 protected:
  SmallPrint() { write_file(path("in.gcode"), small_print()); }

  std::string compensated() {
    const Outcome outcome = run({"compensate", "in.gcode", "-o", "-"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  }
};

TEST_F(SmallPrint, IsCompensatedFromFileToFile) {
  const Outcome outcome = run({"compensate", "in.gcode", "-o", "out.gcode", "--report", "r.json"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, StartsWith("in.gcode → out.gcode\n"));
  EXPECT_THAT(names(), ElementsAre("in.gcode", "out.gcode", "r.json"));
  EXPECT_GT(read_file(path("out.gcode")).size(), small_print().size());
  const auto json = nlohmann::json::parse(read_file(path("r.json")));
  EXPECT_EQ(json["command"], "compensate");
  EXPECT_EQ(json["input"], "in.gcode");
  EXPECT_EQ(json["output"], "out.gcode");
  EXPECT_EQ(json["violation_count"], 0);
  EXPECT_GT(json["runs"]["compensated"], 0);
  EXPECT_EQ(json["printer"]["limits.max_accel_mm_s2"]["value"], 5000);
  EXPECT_LT(json["deviation"]["compensated"]["extruding"]["contour_rms_mm"].get<double>(),
            json["deviation"]["uncompensated"]["extruding"]["contour_rms_mm"].get<double>() / 15);
}

// A base for a band of frequencies is quicker than the sliced moves.
const std::vector<std::string> kBand = {"--set", "dynamics.freq_error=0.1"};
const std::vector<std::string> kSteps = {"--set", "printer.x_steps_per_mm=80", "--set",
                                         "printer.y_steps_per_mm=80"};

std::vector<std::string> with_steps(std::vector<std::string> arguments, double max_hz) {
  arguments.insert(arguments.end(), kSteps.begin(), kSteps.end());
  arguments.insert(arguments.end(), kBand.begin(), kBand.end());
  arguments.insert(arguments.end(), {"--set", fmt::format("printer.max_step_rate_hz={}", max_hz)});
  return arguments;
}

TEST_F(SmallPrint, TellsTheStepRatesOfMotors) {
  const std::vector<std::string> inspect = {"inspect", "in.gcode", "--report", "i.json"};
  EXPECT_THAT(run(with_steps(inspect, 0.0)).out, HasSubstr("\nstep rates    X "));
  const auto inspected = nlohmann::json::parse(read_file(path("i.json")))["step_rates"];
  EXPECT_EQ(inspected["motors"][0]["motor"], "X");
  EXPECT_TRUE(inspected["max_hz"].is_null());
  const double sliced_hz = inspected["motors"][0]["sliced_hz"];
  EXPECT_GT(sliced_hz, 0.0);
  EXPECT_THAT(run({"inspect", "in.gcode"}).out, Not(HasSubstr("step rates")));

  const Outcome free =
      run(with_steps({"compensate", "in.gcode", "-o", "out.gcode", "--report", "r.json"}, 0.0));
  EXPECT_EQ(free.exit_code, 0) << free.err;
  EXPECT_THAT(free.out, HasSubstr("\nstep rates    X "));
  const auto rates = nlohmann::json::parse(read_file(path("r.json")))["step_rates"];
  EXPECT_EQ(rates["motors"][0]["sliced_hz"], sliced_hz);
  std::vector<std::string> without_steps = {"compensate", "in.gcode", "-o", "-"};
  without_steps.insert(without_steps.end(), kBand.begin(), kBand.end());
  EXPECT_EQ(read_file(path("out.gcode")), run(without_steps).out);

  // What was sliced keeps this limit, and the output does not.
  const double emitted_hz = rates["motors"][0]["emitted_hz"];
  ASSERT_GT(emitted_hz, 1.02 * sliced_hz);
  const double between_hz = 0.5 * (sliced_hz + emitted_hz);
  const Outcome broken =
      run(with_steps({"verify", "out.gcode", "--against", "in.gcode"}, between_hz));
  EXPECT_EQ(broken.exit_code, 3);
  EXPECT_THAT(broken.err, ::testing::ContainsRegex("out.gcode:[0-9]+: motor X makes [0-9]+ steps"));
  EXPECT_THAT(broken.err, Not(HasSubstr("warning")));
  const Outcome kept = run(
      with_steps({"compensate", "in.gcode", "-o", "kept.gcode", "--report", "k.json"}, between_hz));
  EXPECT_EQ(kept.exit_code, 0) << kept.err;
  const auto limited = nlohmann::json::parse(read_file(path("k.json")));
  EXPECT_EQ(limited["violation_count"], 0);
  EXPECT_LE(limited["step_rates"]["motors"][0]["emitted_hz"], between_hz * 1.002);
}

TEST_F(SmallPrint, IsWarnedOfWhereItWasSlicedForTooManySteps) {
  const Outcome outcome = run(with_steps({"compensate", "in.gcode", "-o", "out.gcode"}, 100.0));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err,
              ::testing::ContainsRegex("in.gcode:[0-9]+: warning: as sliced, motor X"));
  const Outcome inspected = run(with_steps({"inspect", "in.gcode"}, 100.0));
  EXPECT_EQ(inspected.exit_code, 0);
  EXPECT_THAT(inspected.err, HasSubstr("warning: as sliced, motor X"));
}

TEST_F(SmallPrint, GivesTheSameBytesFromFileAndPipeAndForAnyNumberOfWorkers) {
  const std::string first = compensated();
  ASSERT_FALSE(first.empty());
  const Outcome piped = run({"compensate", "-", "-o", "-", "-j", "1"}, small_print());
  EXPECT_EQ(piped.exit_code, 0);
  EXPECT_EQ(piped.err, "");
  EXPECT_EQ(piped.out, first);
  const Outcome crowd = run({"compensate", "in.gcode", "-o", "out.gcode", "-q", "-j", "4"});
  EXPECT_EQ(crowd.exit_code, 0);
  EXPECT_EQ(crowd.out, "");
  EXPECT_EQ(read_file(path("out.gcode")), first);
  EXPECT_EQ(run({"compensate", "in.gcode", "--in-place"}).exit_code, 0);
  EXPECT_EQ(read_file(path("in.gcode")), first);
}

TEST_F(SmallPrint, IsShownOnAPageThatIsTheSameForAnyNumberOfWorkers) {
  const auto page = [&](const std::string& jobs) {
    const Outcome outcome =
        run({"compensate", "in.gcode", "-o", "out.gcode", "-q", "-j", jobs, "--report", "r.html"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return read_file(path("r.html"));
  };
  const std::string first = page("1");
  EXPECT_THAT(first, StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(first, HasSubstr("<title>in.gcode</title>"));
  EXPECT_EQ(page("4"), first);
  // Writing a report does not change the output.
  EXPECT_EQ(read_file(path("out.gcode")), compensated());
}

TEST_F(SmallPrint, IsShownOnAPageWhenItIsVerified) {
  write_file(path("out.gcode"), compensated());
  const Outcome outcome =
      run({"verify", "out.gcode", "--against", "in.gcode", "--report", "r.html", "-q"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(read_file(path("r.html")),
              HasSubstr("<b class=\"after\">yes</b>, every rule is kept"));
}

TEST_F(SmallPrint, KeepsThePermissionsOfWhatItReplaces) {
  std::filesystem::permissions(path("in.gcode"), std::filesystem::perms(0640));
  ASSERT_EQ(run({"compensate", "in.gcode", "--in-place"}).exit_code, 0);
  EXPECT_EQ(std::filesystem::status(path("in.gcode")).permissions(), std::filesystem::perms(0640));
}

TEST_F(SmallPrint, LeavesALinkALink) {
  std::filesystem::create_symlink("in.gcode", path("link.gcode"));
  ASSERT_EQ(run({"compensate", "link.gcode", "--in-place"}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(path("link.gcode")));
  EXPECT_NE(read_file(path("in.gcode")), small_print());
}

TEST_F(SmallPrint, CanGoToTheNullDeviceWithoutReplacingIt) {
  EXPECT_EQ(run({"compensate", "in.gcode", "-o", "/dev/null", "-q"}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

TEST_F(SmallPrint, IsNotCompensatedTwice) {
  write_file(path("out.gcode"), compensated());
  const Outcome again = run({"compensate", "out.gcode", "-o", "twice.gcode"});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, StartsWith("out.gcode"));
  EXPECT_THAT(names(), ElementsAre("in.gcode", "out.gcode"));
}

TEST_F(SmallPrint, AboveTheAllowedDeviationIsNotWritten) {
  const Outcome outcome = run(
      {"compensate", "in.gcode", "--in-place", "--max-deviation", "1e-9", "--report", "r.json"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, StartsWith("in.gcode: extruding moves stray up to "));
  EXPECT_THAT(outcome.err, HasSubstr("more than --max-deviation 1e-09; no output was written\n"));
  EXPECT_EQ(read_file(path("in.gcode")), small_print());
  EXPECT_EQ(nlohmann::json::parse(read_file(path("r.json")))["command"], "compensate");
}

TEST_F(SmallPrint, WithinTheAllowedDeviationIsWritten) {
  EXPECT_EQ(run({"compensate", "in.gcode", "-o", "out.gcode", "--max-deviation", "0.5"}).exit_code,
            0);
  EXPECT_THAT(names(), ElementsAre("in.gcode", "out.gcode"));
}

TEST_F(SmallPrint, IsVerifiedWithTheFiguresOfItsCompensation) {
  ASSERT_EQ(run({"compensate", "in.gcode", "-o", "out.gcode", "--report", "c.json"}).exit_code, 0);
  const Outcome outcome =
      run({"verify", "out.gcode", "--against", "in.gcode", "--report", "v.json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const auto c = nlohmann::json::parse(read_file(path("c.json")));
  const auto v = nlohmann::json::parse(read_file(path("v.json")));
  EXPECT_EQ(v["command"], "verify");
  EXPECT_EQ(c["deviation"], v["deviation"]);
  EXPECT_EQ(c["print_time_s"], v["print_time_s"]);
}

// Behind a macro unflex would write an approach. A file that is not unflex's has none.
TEST_F(SmallPrint, HasTheSameFiguresBeforeAndAfterIfItIsVerifiedAgainstItself) {
  write_file(path("in.gcode"),
             "START\nG92 E0\nG90\nM83\nG1 X5 Y5 Z0.3 F9000\nG1 X60 E5 F3000\n" + small_print());
  for (const std::string shaper : {"0", "45"}) {
    const Outcome outcome =
        run({"verify", "in.gcode", "--against", "in.gcode", "--report", "-", "--set",
             "printer.firmware=klipper", "--set", "printer.input_shaper_freq_x_hz=" + shaper,
             "--set", "printer.input_shaper_freq_y_hz=" + shaper});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const auto json = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(json["violation_count"], 0);
    EXPECT_GT(json["deviation"]["uncompensated"]["extruding"]["contour_rms_mm"], 0.0);
    EXPECT_EQ(json["deviation"]["uncompensated"], json["deviation"]["compensated"]);
    EXPECT_EQ(json["corners"]["uncompensated"], json["corners"]["compensated"]);
    for (const auto& one : json["sensitivity"]) {
      EXPECT_EQ(one["uncompensated"], one["compensated"]);
    }
    EXPECT_EQ(json["print_time_s"]["reference"], json["print_time_s"]["emitted"]);
  }
}

TEST_F(SmallPrint, IsVerifiedFromStdin) {
  const std::string output = compensated();
  EXPECT_EQ(run({"verify", "-", "--against", "in.gcode"}, output).exit_code, 0);
}

TEST_F(SmallPrint, FailsVerificationWhenALineIsLost) {
  std::string output = compensated();
  const std::size_t at = output.find("M106 S128\n");
  ASSERT_NE(at, std::string::npos);
  output.erase(at, 10);
  const Outcome outcome = run({"verify", "-", "--against", "in.gcode"}, output);
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.err, "");
}

TEST_F(SmallPrint, FailsVerificationAboveTheAllowedDeviation) {
  write_file(path("out.gcode"), compensated());
  const Outcome outcome =
      run({"verify", "out.gcode", "--against", "in.gcode", "--max-deviation", "1e-9"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, StartsWith("out.gcode: extruding moves stray up to "));
}

TEST_F(SmallPrint, IsInspected) {
  const Outcome outcome = run({"inspect", "in.gcode"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, StartsWith("in.gcode\n"));
  EXPECT_THAT(outcome.out, HasSubstr("8 extruding"));
}

TEST_F(SmallPrint, IsInspectedWithTheReportOnStdoutAlone) {
  const Outcome outcome = run({"inspect", "-", "--report", "-"}, small_print());
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["input"], "-");
  EXPECT_EQ(json["moves"]["extruding"], 8);
  EXPECT_EQ(json["commands"]["M106"], 2);
  EXPECT_GT(json["print_time_s"]["reference"].get<double>(), 1.0);
}

TEST_F(SmallPrint, BringsAWarningAboutALongPeriodOnly) {
  const Outcome outcome =
      run({"inspect", "in.gcode", "--set", "dynamics.x.freq_hz=60", "--set", "emit.period_ms=1"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err,
            "unflex: warning: emit.period_ms is 1; at 60 Hz 0.833 or less follows the path "
            "better\n");
}

TEST_F(ProgramTest, PrintsItsVersionAndHelpOnStdout) {
  const Outcome version = run({"--version"});
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_THAT(version.out, ::testing::MatchesRegex("unflex [0-9]+\\.[0-9]+\\.[0-9]+\n"));
  EXPECT_EQ(version.err, "");
  const Outcome help = run({"compensate", "--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("--max-deviation"));
  EXPECT_EQ(help.err, "");
}

}  // namespace
}  // namespace unflex::app
