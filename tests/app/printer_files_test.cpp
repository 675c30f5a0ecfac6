// The output does not depend on how the printer is described.

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "app/program.hpp"
#include "paths.hpp"

namespace unflex::app {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kConfig = std::string(test_paths::kData) + "/printer/printer.cfg";

class PrinterFile : public ProgramTest {
 protected:
  PrinterFile() { write_file(path("in.gcode"), small_print()); }

  std::string compensated(std::vector<std::string> options) {
    std::vector<std::string> arguments = {"compensate", "in.gcode", "-o", "-", "-q"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  }
};

TEST_F(PrinterFile, GivesTheSameBytesAsPrinterCfgAsTomlAndByOverrides) {
  const std::string from_cfg = compensated({"--printer", kConfig});
  ASSERT_NE(from_cfg, "");
  EXPECT_NE(from_cfg, compensated({})) << "the settings would not matter";
  ASSERT_EQ(run({"printer", "init", "--from", kConfig, "-o", "printer.toml"}).exit_code, 0);
  EXPECT_EQ(compensated({"--printer", "printer.toml"}), from_cfg);

  ASSERT_EQ(
      run({"inspect", "in.gcode", "--printer", kConfig, "-q", "--report", "r.json"}).exit_code, 0);
  std::vector<std::string> overrides;
  const auto report = nlohmann::json::parse(read_file(path("r.json")));
  for (const auto& [key, setting] : report["printer"].items()) {
    if (setting["origin"] != "default") {
      overrides.insert(overrides.end(), {"--set", key + "=" + setting["value"].dump()});
    }
  }
  ASSERT_GT(overrides.size(), 20U);
  overrides.insert(overrides.end(), {"--set", "dynamics.freq_error=0.1"});  // as in the file
  EXPECT_EQ(compensated(overrides), from_cfg);
}

// People copy printer.cfg alone from the printer.
TEST_F(PrinterFile, MayBeAPrinterCfgWithoutWhatItIncludes) {
  const std::string text =
      "[printer]\nkinematics: corexy\nmax_velocity: 250\nmax_accel: 1500\n"
      "[input_shaper]\nshaper_freq_x: 40\nshaper_freq_y: 50\n"
      "[stepper_x]\nposition_max: 235\n[stepper_y]\nposition_max: 235\n";
  write_file(path("whole.cfg"), text);
  write_file(path("printer.cfg"), "[include mainsail.cfg]\n[include macros/*.cfg]\n" + text);
  const std::string warning =
      "printer.cfg:1: warning: the included file mainsail.cfg is missing, and unflex does without "
      "what it says; copy it from the printer to that place if it says more than macros, or take "
      "the line out\n";

  const Outcome made = run({"printer", "init", "--from", "printer.cfg", "-o", "printer.toml"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.err, HasSubstr(warning));
  EXPECT_THAT(made.err, ::testing::Not(HasSubstr("macros/")));
  const Outcome from_cfg =
      run({"compensate", "in.gcode", "-o", "out.gcode", "-q", "--printer", "printer.cfg"});
  EXPECT_EQ(from_cfg.exit_code, 0) << from_cfg.err;
  EXPECT_THAT(from_cfg.err, HasSubstr(warning));
  EXPECT_EQ(read_file(path("out.gcode")), compensated({"--printer", "printer.toml"}));
  EXPECT_EQ(read_file(path("out.gcode")), compensated({"--printer", "whole.cfg"}));
  EXPECT_EQ(
      run({"compensate", "in.gcode", "-o", "strict.gcode", "--strict", "--printer", "printer.cfg"})
          .exit_code,
      2);
  EXPECT_FALSE(std::filesystem::exists(path("strict.gcode")));
}

TEST_F(PrinterFile, ThatLacksALimitNamesTheIncludeThatMayHaveIt) {
  write_file(path("printer.cfg"),
             "[printer]\nkinematics: corexy\nmax_velocity: 250\n[include limits.cfg]\n");
  const std::string error =
      "printer.cfg: max_accel in [printer] is missing; it may be in limits.cfg (printer.cfg:4), "
      "which is included but not there: copy it from the printer to that place\n";
  const Outcome made = run({"printer", "init", "--from", "printer.cfg", "-o", "printer.toml"});
  EXPECT_EQ(made.exit_code, 1);
  EXPECT_EQ(made.err, error);
  const Outcome compensated =
      run({"compensate", "in.gcode", "-o", "out.gcode", "--printer", "printer.cfg"});
  EXPECT_EQ(compensated.exit_code, 1);
  EXPECT_EQ(compensated.err, error);
  EXPECT_FALSE(std::filesystem::exists(path("out.gcode")));
}

TEST_F(PrinterFile, WithoutResonancesNamesTheIncludeThatMayHaveThem) {
  write_file(path("printer.cfg"),
             "[printer]\nkinematics: corexy\nmax_velocity: 250\nmax_accel: 1500\n"
             "[include shaper.cfg]\n");
  const Outcome outcome =
      run({"compensate", "in.gcode", "-o", "out.gcode", "--printer", "printer.cfg"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, StartsWith("printer.cfg: the resonance along X and Y is not given"));
  EXPECT_THAT(outcome.err, HasSubstr("; it may be in shaper.cfg (printer.cfg:5), which is included "
                                     "but not there"));
}

TEST_F(PrinterFile, MayComeFromAPipe) {
  const std::string config =
      "[limits]\nmax_accel_mm_s2 = 1500\n[dynamics]\nx.freq_hz = 45\ny.freq_hz = 45\n";
  write_file(path("p.toml"), config);
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  std::thread writer([&] { write_file(path("pipe"), config); });
  const std::string piped = compensated({"--printer", "pipe"});
  writer.join();
  EXPECT_NE(piped, compensated({}));
  EXPECT_EQ(piped, compensated({"--printer", "p.toml"}));
}

TEST_F(PrinterFile, IsMadeFromAPrintToo) {
  write_file(path("sliced.gcode"),
             small_print() + "; gcode_flavor = marlin\n; machine_max_acceleration_x = 1500\n");
  const Outcome outcome = run({"printer", "init", "--from", "sliced.gcode", "-o", "-"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("firmware = \"marlin\"  # sliced.gcode:"));
  EXPECT_THAT(outcome.out, HasSubstr("max_accel_mm_s2 = 1500  # sliced.gcode:"));
}

TEST_F(PrinterFile, IsNotMadeFromWhatSaysNothingOfAPrinter) {
  write_file(path("in.gcode"), small_print());
  const Outcome outcome = run({"printer", "init", "--from", "in.gcode", "-o", "p.toml"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err,
            "in.gcode: says nothing of a printer; give its configuration, or a print that holds "
            "its slicer's settings\n");
  EXPECT_FALSE(std::filesystem::exists(path("p.toml")));
}

TEST_F(PrinterFile, HasHelpOfItsOwn) {
  EXPECT_THAT(run({"printer", "init", "-o", "p.toml"}).err,
              ::testing::EndsWith("; run 'unflex printer init --help'\n"));
}

TEST_F(PrinterFile, IsNotWrittenOverWhatItIsMadeFrom) {
  write_file(path("p.toml"), "[limits]\nmax_accel_mm_s2 = 1\n");
  const Outcome outcome = run({"printer", "init", "--from", "p.toml", "-o", "p.toml"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, StartsWith("p.toml: is what it is made from too"));
}

TEST_F(PrinterFile, IsAskedForWhereTheSlicerHadAnotherFirmwareInMind) {
  write_file(path("in.gcode"), "; gcode_flavor = reprapfirmware\n" + small_print());
  const Outcome file = run({"compensate", "in.gcode", "-o", "-", "-q"});
  EXPECT_EQ(file.exit_code, 1);
  EXPECT_EQ(file.out, "");
  EXPECT_THAT(file.err,
              StartsWith("in.gcode:1: sliced for rrf, but taken to be run by klipper, the "
                         "default, a guess that compensate refuses; say which it is with "
                         "--set printer.firmware=rrf or klipper"));
  const Outcome piped = run({"compensate", "-", "-o", "-", "-q"}, read_file(path("in.gcode")));
  EXPECT_EQ(piped.exit_code, 1);
  const Outcome inspected = run({"inspect", "in.gcode", "-q"});
  EXPECT_EQ(inspected.exit_code, 0);
  EXPECT_THAT(inspected.err,
              StartsWith("in.gcode:1: warning: sliced for rrf, but taken to be run "));
  const Outcome klipper =
      run({"compensate", "in.gcode", "-o", "-", "-q", "--set", "printer.firmware=klipper"});
  EXPECT_THAT(klipper.out, HasSubstr("SET_VELOCITY_LIMIT"));
  const Outcome told =
      run({"compensate", "in.gcode", "-o", "-", "-q", "--set", "printer.firmware=rrf"});
  EXPECT_THAT(told.out, HasSubstr("M566"));
  EXPECT_EQ(told.err, "");
}

}  // namespace
}  // namespace unflex::app
