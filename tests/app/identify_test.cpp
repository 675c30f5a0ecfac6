// From records to lines for the printer file.

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "app/program.hpp"
#include "paths.hpp"
#include "report/documented_keys.hpp"

namespace unflex::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// RepRapFirmware's record of ringing along X and Y.
std::string ringing(double x_hz, double y_hz) {
  constexpr double kRate_hz = 1344.0;
  constexpr double kDampingRatio = 0.06;
  std::string text = "Sample,X,Y,Z\n";
  for (int i = 0; i < 500; ++i) {
    const double time_s = i / kRate_hz;
    const auto swing = [&](double freq_hz) {
      const double omega = 2.0 * std::numbers::pi * freq_hz;
      return std::exp(-kDampingRatio * omega * time_s) *
             std::cos(omega * std::sqrt(1.0 - kDampingRatio * kDampingRatio) * time_s);
    };
    text += std::to_string(i) + "," + std::to_string(swing(x_hz)) + "," +
            std::to_string(0.2 * swing(y_hz)) + ",1.0\n";
  }
  return text + "Rate 1344, overflows 0\n";
}

class Identify : public ProgramTest {
 protected:
  Identify() {
    write_file(path("a_x.csv"), ringing(50.0, 40.0));
    write_file(path("a_y.csv"), ringing(50.0, 40.0));
    write_file(path("b.csv"), ringing(50.0, 40.0));
  }
};

TEST_F(Identify, GivesLinesThatAPrinterFileTakes) {
  const Outcome outcome = run({"identify", "a_x.csv", "a_y.csv", "-q"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, StartsWith("[dynamics.x]\nfreq_hz = 50"));
  write_file(path("p.toml"), outcome.out);
  write_file(path("in.gcode"), small_print());
  const Outcome inspected =
      run({"inspect", "in.gcode", "--printer", "p.toml", "-q", "--report", "-"});
  EXPECT_EQ(inspected.exit_code, 0) << inspected.err;
  const auto printer = nlohmann::json::parse(inspected.out)["printer"];
  EXPECT_NEAR(printer["dynamics.x.freq_hz"]["value"].get<double>(), 50.0, 0.05);
  EXPECT_NEAR(printer["dynamics.y.freq_hz"]["value"].get<double>(), 40.0, 0.05);
  EXPECT_NEAR(printer["dynamics.y.damping_ratio"]["value"].get<double>(), 0.06, 0.001);
}

TEST_F(Identify, DrawsWhatItFitted) {
  const Outcome outcome = run({"identify", "a_x.csv"});
  EXPECT_THAT(outcome.out, StartsWith("a_x.csv: along x, the sensor's x, ringing\n"));
  EXPECT_THAT(outcome.out, ::testing::ContainsRegex("\n  measured  .*█"));
  EXPECT_THAT(outcome.out, ::testing::ContainsRegex("\n  fitted    .*█"));
}

TEST_F(Identify, TakesTheAxisThatMovedMostAndSaysSo) {
  const Outcome outcome = run({"identify", "b.csv", "-q"});
  EXPECT_THAT(outcome.out, StartsWith("[dynamics.x]"));
  EXPECT_THAT(outcome.err, StartsWith("b.csv: warning: its name does not tell the axis"));
  const Outcome told = run({"identify", "b.csv", "-q", "--axis", "Y"});
  EXPECT_EQ(told.err, "");
  EXPECT_THAT(told.out, StartsWith("[dynamics.y]\nfreq_hz = 40"));
}

TEST_F(Identify, WritesAReportWhoseKeysAreDocumented) {
  write_file(path("b_y_at_0_100_20.csv"), ringing(50.0, 40.0));
  write_file(path("b_y_at_100_100_20.csv"), ringing(50.0, 42.0));
  ASSERT_EQ(run({"identify", "a_x.csv", "b_y_at_0_100_20.csv", "b_y_at_100_100_20.csv", "--report",
                 "r.json"})
                .exit_code,
            0);
  const auto json = nlohmann::json::parse(read_file(path("r.json")));
  const nlohmann::json& freq_hz = json["dynamics"]["x"]["modes"][0]["freq_hz"];
  EXPECT_NEAR(freq_hz["value"].get<double>(), 50.0, 0.05);
  EXPECT_LE(freq_hz["low"], freq_hz["high"]);
  std::set<std::string> keys;
  report::collect_keys(json, "", keys);
  keys.insert("records[].curve.freq_hz");  // spectra have it instead of time_s
  EXPECT_EQ(report::documented_keys(std::string(test_paths::kDocs) + "/identify.md", "Report"),
            keys);
}

TEST_F(Identify, WritesAPageOfItsOwn) {
  write_file(path("<b>&_x.csv"), ringing(50.0, 40.0));
  ASSERT_EQ(run({"identify", "<b>&_x.csv", "--report", "r.html"}).exit_code, 0);
  const std::string page = read_file(path("r.html"));
  EXPECT_THAT(page, HasSubstr("&lt;b&gt;&amp;_x.csv"));
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_EQ(page.find("<b>&_x"), std::string::npos);
  EXPECT_EQ(page.find("http://"), std::string::npos);
}

TEST_F(Identify, SaysWhereRecordsDisagree) {
  write_file(path("b_x.csv"), ringing(45.0, 40.0));
  const Outcome outcome = run({"identify", "a_x.csv", "b_x.csv", "-q"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("the records along x disagree by more than 5 %"));
  EXPECT_THAT(outcome.out, HasSubstr("[[dynamics.x.plant]]"));
}

TEST_F(Identify, TakesARingingTower) {
  const Outcome outcome = run({"identify", "--wave-spacing-mm", "2", "--speed-mm-s", "100",
                               "--decay", "1.5", "--axis", "y", "-q"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, StartsWith("[dynamics.y]\nfreq_hz = 50"));
  // --axis applies to the tower. A record's name gives its own axis.
  const Outcome both = run({"identify", "a_x.csv", "--wave-spacing-mm", "2", "--speed-mm-s", "100",
                            "--decay", "1.5", "--axis", "y", "-q"});
  EXPECT_THAT(both.out, AllOf(HasSubstr("[dynamics.x]"), HasSubstr("[dynamics.y]")));
}

TEST_F(Identify, SaysWhatItCannotUse) {
  const std::string diagonal = "raw_data_axis=1.000,1.000,0.000_a.csv";
  write_file(path(diagonal), ringing(50.0, 40.0));
  Outcome outcome = run({"identify", diagonal});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err, diagonal +
                             ": is a test along a diagonal, of a belt; unflex needs one "
                             "along X or Y, or --axis\n");
  outcome = run({"identify", "a_x.csv"}, "", fill_stdout);
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_EQ(outcome.err, "stdout: cannot write: No space left on device; make room there\n");
}

// A tool that moves as its base does, with noise: Klipper's spectrum of it has no peak.
std::string stiff_machine() {
  std::string text = "freq,psd_x,psd_y,psd_z,psd_xyz\n";
  std::mt19937 random(7);
  std::normal_distribution<double> chance(0.0, 0.15);
  for (int i = 0; i < 128; ++i) {
    const double freq_hz = 1.5625 * i;
    const double density = freq_hz < 134.0 ? freq_hz * freq_hz * std::exp(chance(random)) : 1.0;
    text += std::to_string(freq_hz) + "," + std::to_string(density) + ",1.0,1.0," +
            std::to_string(density + 2.0) + "\n";
  }
  return text;
}

// Records of a real printer's resonance test (bassco/klipper-configs, CC0).
std::string real_record(const std::string& name) {
  return std::string(test_paths::kData) + "/spectra/" + name + ".csv";
}

const std::string kTwoPeaks = real_record("ender3_resonances_x_20210821_152037");
const std::string kTurnedSensor = real_record("ender3_resonances_y_20210630_223910");

TEST_F(Identify, FindsTheModesOfARealRecordAndWhatTheyLeaveOpen) {
  const Outcome outcome = run({"identify", kTwoPeaks, kTurnedSensor, "-q"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  write_file(path("p.toml"), outcome.out);
  write_file(path("in.gcode"), small_print());
  const Outcome inspected =
      run({"inspect", "in.gcode", "--printer", "p.toml", "-q", "--report", "-"});
  ASSERT_EQ(inspected.exit_code, 0) << inspected.err;
  const auto printer = nlohmann::json::parse(inspected.out)["printer"];
  const auto& modes = printer["dynamics.x.mode"]["value"];
  EXPECT_THAT(modes.get<std::string>(), HasSubstr("freq_hz = 58."));
  EXPECT_THAT(printer["dynamics.x.plant"]["value"].get<std::string>(), HasSubstr("share = "));
  // Both peaks are within 5 % of what the printer's owner sees.
  const Outcome shown = run({"identify", kTwoPeaks, "--report", "r.json"});
  EXPECT_THAT(shown.out, AllOf(HasSubstr("\n  58.1 Hz "), HasSubstr("\n  noise "),
                               HasSubstr("\n  unexplained ")));
  const auto found = nlohmann::json::parse(read_file(path("r.json")))["dynamics"]["x"]["modes"];
  EXPECT_NEAR(found[0]["freq_hz"]["value"].get<double>(), 45.0, 2.2);
  EXPECT_NEAR(found[1]["freq_hz"]["value"].get<double>(), 58.5, 2.9);
}

TEST_F(Identify, ReadsARecordOfATurnedSensor) {
  const Outcome outcome = run({"identify", kTurnedSensor});
  EXPECT_THAT(outcome.out, HasSubstr("along y, the sensor's"));
  EXPECT_THAT(outcome.out, HasSubstr("[[dynamics.y.mode]]\nfreq_hz = 45."));
}

TEST_F(Identify, GivesNoLinesForARecordWithoutAModel) {
  write_file(path("stiff_x.csv"), stiff_machine());
  Outcome outcome = run({"identify", "stiff_x.csv"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("no model of it is to be trusted"),
                                 HasSubstr("\n  measured "), HasSubstr("\n  closest fit ")));
  EXPECT_EQ(outcome.out.find("freq_hz"), std::string::npos);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("stiff_x.csv: it shows no resonance"),
                                 HasSubstr("; check that the sensor sits tight")));
  outcome = run({"identify", "stiff_x.csv", "-q"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.out, "");
  // The other axis has its lines all the same, and a better record of this one makes up for it.
  outcome = run({"identify", "stiff_x.csv", kTurnedSensor, "-q"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.out, StartsWith("[[dynamics.y.mode]]"));
  outcome = run({"identify", "stiff_x.csv", kTwoPeaks, "-q"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.out, StartsWith("[[dynamics.x.mode]]"));
  EXPECT_THAT(outcome.err, HasSubstr("warning: is left out: it shows no resonance"));
}

TEST_F(Identify, DrawsModesAndWhatIsLeftOnItsPage) {
  write_file(path("stiff_x.csv"), stiff_machine());
  ASSERT_EQ(run({"identify", kTwoPeaks, "stiff_x.csv", "--report", "r.html"}).exit_code, 0);
  const std::string page = read_file(path("r.html"));
  for (const std::string_view part :
       {"The nozzle swings: x at 45.4, 58.1 and 33.4 Hz", "Klipper would set up ",
        "<details><summary>Lines for the printer file</summary>", ">Copy</button>", "58.1 Hz",
        "unexplained", "noise", "closest fit", "<strong>Not used:</strong>", "<th>gain"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
}

TEST_F(Identify, WritesThePrinterFileItself) {
  write_file(path("printer.cfg"),
             "[printer]\nkinematics: corexy\nmax_velocity: 300\nmax_accel: 4000\n");
  Outcome outcome = run({"printer", "init", "--from", "printer.cfg", "--record", kTwoPeaks,
                         "--record", kTurnedSensor, "-o", "p.toml"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string file = read_file(path("p.toml"));
  EXPECT_THAT(file, AllOf(HasSubstr("freq_hz = 58.09"), HasSubstr("{share = "),
                          HasSubstr("ender3_resonances_x_20210821_152037.csv")));
  write_file(path("stiff_x.csv"), stiff_machine());
  outcome =
      run({"printer", "init", "--from", "printer.cfg", "--record", "stiff_x.csv", "-o", "q.toml"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("it shows no resonance"));
  EXPECT_FALSE(std::filesystem::exists(path("q.toml")));
}

TEST_F(Identify, SaysWhatIsMissing) {
  EXPECT_EQ(run({"identify"}).exit_code, 1);
  EXPECT_EQ(run({"identify", "no.csv"}).exit_code, 2);
  EXPECT_THAT(run({"identify", "--wave-spacing-mm", "2", "--axis", "x"}).err,
              HasSubstr("needs both"));
  write_file(path("in.gcode"), small_print());
  const Outcome outcome = run({"identify", "in.gcode"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("is no record that unflex knows"));
}

TEST_F(Identify, MakesATestAndFindsWhatRingsBehindItsStops) {
  write_file(path("p.toml"),
             "[printer]\nfirmware = \"rrf\"\n[dynamics.x]\nfreq_hz = 45\n[dynamics.y]\n"
             "freq_hz = 45\n[second]\nx_freq_hz = 90\n");
  const Outcome test =
      run({"identify", "--make-test", "x", "--printer", "p.toml", "-o", "t.gcode"});
  EXPECT_EQ(test.exit_code, 0) << test.err;
  EXPECT_THAT(test.out, StartsWith("t.gcode: stops along x"));
  EXPECT_THAT(
      read_file(path("t.gcode")),
      AllOf(HasSubstr(";unflex run"), HasSubstr("M956 P0 S2560 A1"), Not(HasSubstr("LEAD_IN"))));
  write_file(path("stop_x.csv"), ringing(110.0, 40.0));
  const Outcome found = run({"identify", "--second", "stop_x.csv", "--printer", "p.toml", "-q"});
  EXPECT_EQ(found.exit_code, 0) << found.err;
  EXPECT_THAT(found.out, StartsWith("[second]\nx_freq_hz = 110"));
  EXPECT_THAT(found.out, HasSubstr("x_damping_ratio = 0.06"));
  // What rings is the known mode.
  write_file(path("known_x.csv"), ringing(45.0, 40.0));
  const Outcome none = run({"identify", "--second", "known_x.csv", "--printer", "p.toml", "-q"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_EQ(none.out, "");
  EXPECT_THAT(none.err, HasSubstr("nothing for a second stage"));
}

}  // namespace
}  // namespace unflex::app
