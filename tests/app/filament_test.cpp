// unflex filament, and prints that are fitted before they are compensated.
#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "paths.hpp"
#include "program.hpp"

namespace unflex::app {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kHollow = "extruder.filament_area_mm2=2.177";

class Filament : public ProgramTest {
 protected:
  Filament() {
    write_file(path("in.gcode"),
               "M83\nG28\nG1 X10 Y10 F6000\nG1 X40 E.33260\nG1 E-0.8\nG1 Y40 E1\n");
  }
};

TEST_F(Filament, IsFittedToItsSection) {
  const Outcome outcome = run({"filament", "in.gcode", "-o", "out.gcode", "--set", kHollow});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, StartsWith("filament      E × 1.10486 in 2 lines\n"));
  EXPECT_EQ(read_file(path("out.gcode")),
            "M83\nG28\nG1 X10 Y10 F6000\nG1 X40 E0.36748\nG1 E-0.8\nG1 Y40 E1.10486\n"
            "; unflex filament: 1.3326 mm of moves that print became 1.47234 mm\n");
  // Once is enough.
  const Outcome again = run({"filament", "out.gcode", "-o", "twice.gcode", "--set", kHollow});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, StartsWith("out.gcode:7: says that the print was fitted"));
  EXPECT_FALSE(std::filesystem::exists(path("twice.gcode")));
  // In place the file has its name as well.
  EXPECT_THAT(run({"filament", "out.gcode", "--in-place", "--set", kHollow}).err,
              StartsWith("out.gcode:7: says that the print was fitted"));
}

TEST_F(Filament, GoesThroughAPipe) {
  const Outcome outcome = run({"filament", "-", "-o", "-", "--set", kHollow}, "M83\nG1 X5 E1");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, StartsWith("M83\nG1 X5 E1.10486\n; unflex filament:"));
}

TEST_F(Filament, FollowsTheProfileBesideThePrinterFile) {
  std::filesystem::create_directory(path("printers"));
  write_file(path("printers/p.toml"), "[extruder]\nfilament_profile = \"spool.csv\"\n");
  write_file(path("printers/spool.csv"), "mm,area_mm2\n0,2.1\n1000,4.1\n");
  const Outcome outcome = run({"filament", "in.gcode", "--in-place", "--printer", "printers/p.toml",
                               "--filament-start-mm", "500"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  // 2.405282 / 3.1, and a little less farther on.
  EXPECT_THAT(outcome.out, HasSubstr("E × 0.775"));
  EXPECT_THAT(read_file(path("in.gcode")), HasSubstr("G1 X40 E0.258"));
  write_file(path("printers/spool.csv"), "mm,area_mm2\n0,2.1\n0,4.1\n");
  const Outcome wrong =
      run({"filament", "in.gcode", "-o", "out.gcode", "--printer", "printers/p.toml"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_EQ(wrong.err,
            "printers/spool.csv:3: is not behind the place before; sort the places "
            "along the filament\n");
  std::filesystem::remove(path("printers/spool.csv"));
  const Outcome missing =
      run({"filament", "in.gcode", "-o", "out.gcode", "--printer", "printers/p.toml"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.err, StartsWith("printers/spool.csv: cannot be read;"));
}

TEST_F(Filament, SaysWhatIsMissing) {
  const Outcome none = run({"filament", "in.gcode", "-o", "out.gcode"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_EQ(none.err,
            "unflex: which filament? set extruder.filament_area_mm2 or "
            "extruder.filament_profile\n");
  const Outcome both = run({"filament", "in.gcode", "-o", "out.gcode", "--set", kHollow, "--set",
                            "extruder.filament_profile=spool.csv"});
  EXPECT_EQ(both.exit_code, 1);
  EXPECT_THAT(both.err, HasSubstr("both say what the filament holds"));
  EXPECT_EQ(run({"filament", "in.gcode", "--set", kHollow}).exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(path("out.gcode")));
}

// Relative E without M83 would be read as places.
TEST_F(Filament, IsNotFittedWhereEIsNotWhatTheTextSays) {
  std::string text = "G28\n";
  for (int i = 0; i < 60; ++i) {
    text += "G1 X" + std::to_string(10 + i % 2) + " E0.0" + std::to_string(1 + i % 3) + "\n";
  }
  write_file(path("relative.gcode"), text);
  const Outcome outcome = run({"filament", "relative.gcode", "-o", "out.gcode", "--set", kHollow});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("M83"));
  EXPECT_FALSE(std::filesystem::exists(path("out.gcode")));
}

TEST_F(Filament, IsFittedBeforeAPrintIsCompensated) {
  const std::string print = std::string(test_paths::kData) + "/pipeline_star.gcode";
  const auto filament = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"compensate", print,    "-o",       "out.gcode",
                                          "--engine",   "banded", "--report", "r.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(read_file(path("r.json")));
  };
  const nlohmann::json sliced = filament({});
  EXPECT_TRUE(sliced["fitted_filament"].is_null());
  const nlohmann::json fitted = filament({"--set", kHollow});
  const nlohmann::json& row = fitted["fitted_filament"];
  EXPECT_NEAR(row["fitted_mm"].get<double>() / row["sliced_mm"].get<double>(), 1.104861, 1e-5);
  EXPECT_NEAR(fitted["extrusion"]["output_mm"].get<double>(),
              fitted["extrusion"]["input_mm"].get<double>(), 0.01);
  EXPECT_NEAR(fitted["extrusion"]["output_mm"].get<double>() -
                  sliced["extrusion"]["output_mm"].get<double>(),
              row["fitted_mm"].get<double>() - row["sliced_mm"].get<double>(), 0.01);
  // The file verifies against the sliced one with the same filament, and not without.
  EXPECT_EQ(run({"verify", "out.gcode", "--against", print, "--set", kHollow}).exit_code, 0);
  EXPECT_EQ(run({"verify", "out.gcode", "--against", print}).exit_code, 3);
}

}  // namespace
}  // namespace unflex::app
