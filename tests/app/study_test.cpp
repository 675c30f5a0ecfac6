// unflex study through the whole program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "app/program.hpp"
#include "paths.hpp"

namespace unflex::app {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Study : public ProgramTest {};

std::map<std::string, nlohmann::json> by_name(const nlohmann::json& methods) {
  std::map<std::string, nlohmann::json> named;
  for (const nlohmann::json& method : methods) {
    named[method["method"]] = method;
  }
  return named;
}

TEST_F(Study, OfOneCaseIsATableOnStdout) {
  const Outcome outcome = run({"study", "--case", "3A"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, StartsWith("(0,0) → (10,0) → (10,10) mm"));
  EXPECT_THAT(outcome.out, HasSubstr("  uncompensated                  100\n"));
  EXPECT_THAT(outcome.out, HasSubstr("  3A   ipopt"));
  EXPECT_THAT(outcome.out, HasSubstr("  3A   banded"));
}

TEST_F(Study, OfThePrintUsesThePrintersSettings) {
  write_file(path("in.gcode"), small_print());
  const Outcome outcome =
      run({"study", "in.gcode", "--set", "dynamics.x.freq_hz=50", "--set", "emit.period_ms=0.9",
           "--set", "dynamics.freq_error=0", "--report", "r.json", "-q"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  const auto json = nlohmann::json::parse(read_file(path("r.json")));
  EXPECT_EQ(json["command"], "study");
  EXPECT_EQ(json["input"], "in.gcode");
  EXPECT_EQ(json["printer"]["dynamics.x.freq_hz"]["value"], 50);
  const auto methods = by_name(json["cases"][0]["methods"]);
  const auto rms = [&](const std::string& method) {
    return methods.at(method)["deviation"][0]["contour_rms_mm"].get<double>();
  };
  EXPECT_LT(rms("unflex 4×"), rms("ZV") / 3.0);
  EXPECT_LT(rms("ZV"), rms("uncompensated") / 3.0);
}

// The last row is made for a band, whatever the settings say of it; the others are made for the
// settings.
TEST_F(Study, OfThePrintHasARowForABandOfFrequencies) {
  write_file(path("in.gcode"), small_print());
  const auto methods = [&](const std::string& error) {
    const Outcome outcome = run(
        {"study", "in.gcode", "-j", "2", "--set", "dynamics.freq_error=" + error, "--report", "-"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return by_name(nlohmann::json::parse(outcome.out)["cases"][0]["methods"]);
  };
  const auto exact = methods("0");
  const auto band = methods("0.1");
  const std::string row = "unflex 4×, ±10 %";
  EXPECT_EQ(exact.at(row)["deviation"], band.at(row)["deviation"]);
  EXPECT_EQ(band.at("unflex 4×")["deviation"], band.at(row)["deviation"]);
  EXPECT_NE(exact.at("unflex 4×")["deviation"], exact.at(row)["deviation"]);
  const auto rms = [&](const std::string& method, std::size_t error) {
    return exact.at(method)["deviation"][error]["contour_rms_mm"].get<double>();
  };
  EXPECT_LT(rms("unflex 4×", 0), rms(row, 0));
  EXPECT_GT(rms("unflex 4×", 1), rms(row, 1));
  EXPECT_GT(rms("unflex 4×", 4), rms(row, 4));
}

TEST_F(Study, OfThePrintFromStdinIsThatOfTheFile) {
  write_file(path("in.gcode"), small_print());
  const Outcome file = run({"study", "in.gcode", "-j", "1", "--report", "-"});
  const Outcome piped = run({"study", "-", "-j", "3", "--report", "-"}, small_print());
  auto first = nlohmann::json::parse(file.out);
  auto second = nlohmann::json::parse(piped.out);
  first.erase("performance");
  second.erase("performance");
  second["input"] = "in.gcode";
  EXPECT_EQ(first, second);
}

TEST_F(Study, IsAPageIfTheReportsNameEndsSo) {
  const Outcome outcome = run({"study", "--case", "ref", "--report", "r.html", "-q"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(names(), ElementsAre("r.html"));
  EXPECT_THAT(read_file(path("r.html")), StartsWith("<!DOCTYPE html>"));
}

TEST_F(Study, OfAFileWithoutMotionSaysSo) {
  write_file(path("in.gcode"), "M104 S200\nG28\n");
  const Outcome outcome = run({"study", "in.gcode"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err,
            "in.gcode: has no stretch that could be compensated; unflex inspect tells why\n");
}

TEST_F(Study, JudgesOnTheMachinesOfAFolder) {
  const std::string spectra = std::string(test_paths::kData) + "/spectra/";
  std::filesystem::create_directories(path("machines/ender"));
  for (const std::string name :
       {"ender3_resonances_x_20210821_152037.csv", "ender3_resonances_y_20210630_223910.csv"}) {
    write_file(path("machines/ender/" + name), read_file(spectra + name));
  }
  write_file(path("machines/notes.txt"), "passed by");
  write_file(path("in.gcode"), small_print());
  const Outcome outcome =
      run({"study", "in.gcode", "--machines", "machines", "--report", "r.json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("Klipper's choice"));
  const auto json = nlohmann::json::parse(read_file(path("r.json")));
  ASSERT_EQ(json["machines"].size(), 1U);
  EXPECT_EQ(json["machines"][0]["machine"], "ender/ender3");
  const auto& contenders = json["machines"][0]["contenders"];
  const auto rms = [&](std::size_t number) {
    return contenders[number]["contour_rms_mm"].get<double>();
  };
  ASSERT_EQ(contenders[5]["name"], "unflex");
  EXPECT_LT(rms(5), 0.5 * rms(0));
  EXPECT_LT(rms(5), rms(1));
  EXPECT_GT(json["machines"][0]["corners"], 0);
  const auto from_corners = [&](std::size_t number) {
    return contenders[number]["corner_rms_mm"].get<double>();
  };
  // MZV cuts corners.
  EXPECT_LT(from_corners(5), 0.5 * from_corners(2));
  EXPECT_EQ(contenders[5]["shifted"][1]["corner_rms_mm"], from_corners(5));
  EXPECT_GT(contenders[5]["corner_max_mm"], from_corners(5));
}

TEST_F(Study, FindsTheLeastTimeWithinTolerances) {
  // The slicer's own accelerations and corners have no part in it, its speeds have.
  write_file(path("in.gcode"), small_print());
  write_file(path("limited.gcode"),
             "M204 S700\nSET_VELOCITY_LIMIT ACCEL=800 "
             "SQUARE_CORNER_VELOCITY=1\n" +
                 small_print());
  write_file(path("slow.gcode"), "SET_VELOCITY_LIMIT VELOCITY=20\n" + small_print());
  const auto study = [&](const std::string& input) {
    const Outcome outcome = run({"study", input, "--faster=100,20", "-j", "2", "--set",
                                 "printer.firmware=klipper", "--report", "-"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  const auto free = study("in.gcode");
  const auto limited = study("limited.gcode");
  const auto slow = study("slow.gcode");
  // Where a line sets limits the machine does not stop, but a run of unflex ends.
  const auto rivals = [](nlohmann::json json) {
    for (auto& tolerance : json["tolerances"]) {
      tolerance["contenders"].erase(4);
      tolerance.erase("unflex_saves");
    }
    return json["tolerances"];
  };
  EXPECT_EQ(rivals(free), rivals(limited));
  EXPECT_EQ(free["advised"], limited["advised"]);
  EXPECT_LT(free["as_sliced"]["time_s"], limited["as_sliced"]["time_s"]);
  ASSERT_EQ(free["tolerances"].size(), 2U);
  const auto zv = [](const nlohmann::json& json, std::size_t number) {
    return json["tolerances"][number]["contenders"][1];
  };
  EXPECT_EQ(zv(free, 1)["name"], "ZV");
  EXPECT_EQ(free["tolerances"][1]["tolerance_mm"], 0.02);
  EXPECT_LE(zv(free, 1)["contour_max_mm"], 0.022);
  EXPECT_LT(zv(free, 0)["time_s"], zv(free, 1)["time_s"]);
  EXPECT_LT(zv(free, 1)["time_s"], zv(slow, 1)["time_s"]);
  const auto unflex = [](const nlohmann::json& json, std::size_t number) {
    return json["tolerances"][number]["contenders"][4];
  };
  EXPECT_EQ(unflex(free, 1)["name"], "unflex");
  EXPECT_LE(unflex(free, 1)["contour_max_mm"], 0.022);
  EXPECT_LT(unflex(free, 1)["time_s"], free["tolerances"][1]["contenders"][0]["time_s"]);
  EXPECT_GT(unflex(free, 1)["time_s"], free["always_at_f"]["time_s"]);
  const Outcome text = run({"study", "in.gcode", "--faster=20", "--at-all-times"});
  EXPECT_THAT(text.out, HasSubstr("within the tolerance at all times"));
  EXPECT_THAT(text.out, HasSubstr("\n  20 µm           no shaper"));
}

// The frequencies are exact for all contenders, unless the user says otherwise.
TEST_F(Study, MakesUnflexForExactFrequencies) {
  write_file(path("in.gcode"), small_print());
  const auto study = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"study", "in.gcode", "--faster=50", "--report", "-"});
    const Outcome outcome = run(options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  const auto exact = study({});
  EXPECT_EQ(exact["freq_error"], 0.0);
  EXPECT_EQ(exact["printer"]["dynamics.freq_error"]["origin"], "study --faster");
  const auto robust = study({"--set", "dynamics.freq_error=0.1"});
  EXPECT_EQ(robust["freq_error"], 0.1);
  EXPECT_EQ(robust["printer"]["dynamics.freq_error"]["origin"], "--set");
  EXPECT_LT(exact["tolerances"][0]["contenders"][4]["time_s"],
            robust["tolerances"][0]["contenders"][4]["time_s"]);
}

// Both ways to time a print, that of the grid and that of the replay, agree on the print as sliced.
TEST_F(Study, TimesAPrintAsTheVerificationDoes) {
  write_file(path("in.gcode"),
             read_file(std::string(test_paths::kData) + "/study_fasttower.gcode"));
  const auto study =
      nlohmann::json::parse(run({"study", "in.gcode", "--faster=100", "--report", "-"}).out);
  ASSERT_EQ(run({"compensate", "in.gcode", "-o", "out.gcode", "--report", "r.json"}).exit_code, 0);
  const auto report = nlohmann::json::parse(read_file(path("r.json")));
  const double verified_s = report["print_time_s"]["reference"];
  EXPECT_NEAR(study["as_sliced"]["time_s"].get<double>(), verified_s, 1e-3 * verified_s);
  EXPECT_LT(study["always_at_f"]["time_s"], verified_s);
}

TEST_F(Study, DrawsTheLeastTimes) {
  write_file(path("in.gcode"), small_print());
  for (const std::string name : {"r.html", "r.svg"}) {
    EXPECT_EQ(run({"study", "in.gcode", "--faster=50", "--report", name, "-q"}).exit_code, 0);
  }
  EXPECT_THAT(read_file(path("r.html")), StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(read_file(path("r.svg")), StartsWith("<svg xmlns="));
}

TEST_F(Study, FindsNoTimeOfAPrintWithoutFilament) {
  write_file(path("in.gcode"), "G28\nG1 X20 Y20 F6000\nG1 X40\n");
  const Outcome outcome = run({"study", "in.gcode", "--faster"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err, "in.gcode: lays no filament; give a sliced print\n");
}

TEST_F(Study, CompensatesThePrintAtSeveralAccelerations) {
  write_file(path("in.gcode"), "M204 S2500\n" + small_print());
  const auto study = [&](std::vector<std::string> options) {
    std::vector<std::string> arguments = {"study",    "in.gcode",
                                          "--accel",  "2500,10000",
                                          "-j",       "2",
                                          "--set",    "printer.firmware=klipper",
                                          "--set",    "dynamics.freq_error=0",
                                          "--report", "-"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  // The print's own M204 holds unless it is scaled: 2500 of 5000 becomes 1250 and 5000.
  const auto kept = study({});
  const auto scaled = study({"--scale-m204", "--keep-rms", "100"});
  ASSERT_EQ(kept["accels"].size(), 2U);
  EXPECT_EQ(kept["accels"][0]["max_accel_mm_s2"], 2500);
  const auto sliced_s = [](const nlohmann::json& json, std::size_t number) {
    return json["accels"][number]["sliced_time_s"].get<double>();
  };
  // Moves in Z and of filament alone gain something in either.
  EXPECT_GT(sliced_s(scaled, 0) - sliced_s(scaled, 1),
            2.0 * (sliced_s(kept, 0) - sliced_s(kept, 1)));
  EXPECT_GT(sliced_s(scaled, 0), sliced_s(kept, 0));
  EXPECT_LT(sliced_s(scaled, 1), sliced_s(kept, 1));
  EXPECT_LT(scaled["accels"][1]["time_s"], scaled["accels"][0]["time_s"]);
  EXPECT_EQ(scaled["kept_max_accel_mm_s2"], 10000);
  for (const auto& at : scaled["accels"]) {
    EXPECT_LT(at["compensated"]["contour_rms_mm"].get<double>(),
              0.2 * at["sliced"]["contour_rms_mm"].get<double>());
  }
  EXPECT_THAT(run({"study", "in.gcode", "--accel", "5000"}).out, HasSubstr("compensated, µm"));
}

TEST_F(Study, SaysWhatIsWrongWithTheMachines) {
  EXPECT_THAT(run({"study", "--machines", "machines"}).err, HasSubstr("needs a print"));
  write_file(path("in.gcode"), small_print());
  EXPECT_THAT(run({"study", "in.gcode", "--machines", "none"}).err,
              HasSubstr("none: cannot read the folder"));
  std::filesystem::create_directories(path("empty"));
  EXPECT_THAT(run({"study", "in.gcode", "--machines", "empty"}).err,
              HasSubstr("holds no machine with records of both axes"));
  write_file(path("empty/resonances_x_1.csv"), "freq,what\n");
  const Outcome broken = run({"study", "in.gcode", "--machines", "empty"});
  EXPECT_EQ(broken.exit_code, 2);
  EXPECT_THAT(broken.err, StartsWith("empty/resonances_x_1.csv"));
}

}  // namespace
}  // namespace unflex::app
