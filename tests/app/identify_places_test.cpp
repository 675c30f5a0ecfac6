// Records that Klipper took at several places become maps in the printer file.

#include <fmt/core.h>
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "app/program.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

using Place = std::array<double, 3>;

constexpr double kDampingRatio = 0.06;

// 45 Hz at the origin. It falls by 10 % over 200 mm along x, and by 5 % along y.
double along_x(const Place& place_mm) { return 45.0 * (1.0 - 0.1 * place_mm[0] / 200.0); }
double over_bed(const Place& place_mm) {
  return along_x(place_mm) * (1.0 - 0.05 * place_mm[1] / 200.0);
}

// Klipper's recording of a stop behind which this frequency rings.
std::string ringing(double freq_hz, double noise = 0.0, std::uint32_t seed = 1) {
  constexpr double kRate_hz = 1600.0;
  constexpr int kSamples = 300;
  std::mt19937 random(seed);
  std::normal_distribution<double> chance(0.0, 1.0);
  std::string text = "#time,accel_x,accel_y,accel_z\n";
  for (int i = 0; i < kSamples; ++i) {
    const double time_s = i / kRate_hz;
    const double omega = 2.0 * std::numbers::pi * freq_hz;
    const double swing = std::exp(-kDampingRatio * omega * time_s) *
                         std::cos(omega * std::sqrt(1.0 - kDampingRatio * kDampingRatio) * time_s);
    text += fmt::format("{:.6f},{:.3f},{:.3f},9800.0\n", time_s,
                        1e3 * (swing + noise * chance(random)), 1e3 * noise * chance(random));
  }
  return text;
}

std::string name_of(const Place& place_mm, const std::string& behind_axis = "") {
  return fmt::format("raw_data_x{}_{:.3f}_{:.3f}_{:.3f}_20230101_120000.csv", behind_axis,
                     place_mm[0], place_mm[1], place_mm[2]);
}

std::vector<Place> grid() {
  std::vector<Place> places;
  for (const double x_mm : {10.0, 105.0, 200.0}) {
    for (const double y_mm : {10.0, 105.0, 200.0}) {
      places.push_back({x_mm, y_mm, 20.0});
    }
  }
  return places;
}

class IdentifyPlaces : public ProgramTest {
 protected:
  // Identifies files by the names given, and quietly.
  Outcome identify(const std::vector<std::string>& files,
                   const std::vector<std::string>& options = {"-q"}) {
    std::vector<std::string> arguments = {"identify"};
    arguments.insert(arguments.end(), files.begin(), files.end());
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run(arguments);
  }

  std::string record(const std::string& name, double freq_hz, double noise = 0.0,
                     std::uint32_t seed = 1) {
    write_file(path(name), ringing(freq_hz, noise, seed));
    return name;
  }
};

// The frequency that a printer file's text gives for the axis X at a place.
double hz_at(const std::string& text, const Place& place_mm) {
  const auto settings = machine::parse(text, "p.toml", {});
  EXPECT_TRUE(settings) << to_string(settings.error());
  if (!settings) {
    return 0.0;
  }
  const machine::AxisDynamics& x = settings->dynamics.x;
  return x.freq_hz *
         x.frequency_share({.height_mm = place_mm[2], .place_mm = {place_mm[0], place_mm[1]}});
}

TEST_F(IdentifyPlaces, ALineOfPlacesIsAMapThatThePrinterFileTakes) {
  std::vector<std::string> files;
  std::vector<Place> places;
  for (const double x_mm : {10.0, 60.0, 110.0, 160.0, 210.0}) {
    places.push_back({x_mm, 50.0, 20.0});
    files.push_back(record(name_of(places.back()), along_x(places.back())));
  }
  const Outcome outcome = identify(files);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, AllOf(StartsWith("[dynamics.x]\nfreq_hz = 42.5"),
                                 HasSubstr("\n[[dynamics.x.map]]\nalong = \"x\"\n"
                                           "at_mm = [10, 60, 110, 160, 210]\nfreq_hz = [44.7"),
                                 Not(HasSubstr("\"y\""))));
  for (const Place& place_mm : places) {
    EXPECT_NEAR(hz_at(outcome.out, place_mm) / along_x(place_mm), 1.0, 0.01);
  }
}

TEST_F(IdentifyPlaces, AGridWithNoiseIsAProductOfMaps) {
  std::vector<std::string> files;
  std::uint32_t seed = 1;
  for (const Place& place_mm : grid()) {
    ++seed;
    files.push_back(record(name_of(place_mm, "_adxl345_hotend_1"), over_bed(place_mm), 0.02, seed));
  }
  const Outcome outcome = identify(files, {"--report", "r.json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("along x, place by place:\n"), HasSubstr("\n  105, 105, 20 mm"),
                    HasSubstr("\n  largest difference from the maps: ")));
  const auto json = nlohmann::json::parse(read_file(path("r.json")));
  const std::string snippet = json["snippet"].get<std::string>();
  for (const Place& place_mm : grid()) {
    EXPECT_NEAR(hz_at(snippet, place_mm) / over_bed(place_mm), 1.0, 0.01);
  }
  const nlohmann::json& x = json["dynamics"]["x"];
  EXPECT_EQ(x["maps"].size(), 2);
  EXPECT_EQ(x["places"].size(), 9);
  EXPECT_LT(x["largest_residual"].get<double>(), 0.01);
  EXPECT_EQ(x["reference_mm"], nlohmann::json({105.0, 105.0, 20.0}));
  EXPECT_EQ(json["records"][1]["place_mm"], nlohmann::json({10.0, 105.0, 20.0}));
}

TEST_F(IdentifyPlaces, NothingChangesSoThereIsNoMap) {
  const std::vector<std::string> files = {record(name_of({0.0, 50.0, 20.0}), 45.0),
                                          record(name_of({200.0, 50.0, 20.0}), 45.1)};
  const Outcome outcome = identify(files, {});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("no map along x: the frequency changes"),
                    HasSubstr("[dynamics.x]\nfreq_hz = 45."), Not(HasSubstr(".map]]"))));
}

TEST_F(IdentifyPlaces, ThePageAndThePrinterFileHaveTheMaps) {
  const std::vector<std::string> files = {
      record("raw_data_x_at_0_50_20.csv", 45.0), record("raw_data_x_at_200_50_20.csv", 40.5),
      record("resonances_x_100.000_50.000_20.000_a.csv", 42.75)};
  EXPECT_EQ(identify(files, {"-q", "--report", "r.html"}).exit_code, 0);
  EXPECT_THAT(read_file(path("r.html")),
              AllOf(HasSubstr("<th>place, along x</th>"), HasSubstr("<td>200, 50, 20 mm</td>"),
                    HasSubstr("[[dynamics.x.map]]")));
  write_file(path("printer.cfg"),
             "[printer]\nkinematics: corexy\nmax_velocity: 300\nmax_accel: 4000\n");
  const Outcome made = run({"printer", "init", "--from", "printer.cfg", "--record", files[0],
                            "--record", files[1], "--record", files[2], "-o", "p.toml"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  const std::string text = read_file(path("p.toml"));
  EXPECT_NEAR(hz_at(text, {0.0, 50.0, 20.0}), 45.0, 0.1);
  EXPECT_NEAR(hz_at(text, {200.0, 50.0, 20.0}), 40.5, 0.1);
}

TEST_F(IdentifyPlaces, ARecordOfTheOnlyPlaceNeedsNoOthers) {
  const Outcome outcome = identify(
      {record(name_of({0.0, 50.0, 20.0}), 45.0), record("raw_data_x_20230101_120000.csv", 45.2)});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(StartsWith("[dynamics.x]\n"), Not(HasSubstr("map"))));
}

TEST_F(IdentifyPlaces, RefusesRecordsThatDoNotFitTogether) {
  std::vector<std::string> files = {record(name_of({0.0, 50.0, 20.0}), 45.0),
                                    record(name_of({200.0, 50.0, 20.0}), 42.0)};
  files.push_back(record("raw_data_x_20230101_120000.csv", 45.0));
  Outcome outcome = identify(files);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err,
              AllOf(StartsWith("raw_data_x_20230101_120000.csv: its name tells no place, but that"),
                    HasSubstr("raw_data_x_at_100_50_20.csv")));
  files.back() = record("raw_data_x_lis2dw_0.000_50.000_20.000_b.csv", 48.0);
  outcome = identify(files);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, StartsWith("raw_data_x_lis2dw_0.000_50.000_20.000_b.csv: tells 48.0 Hz "
                                      "at 0, 50, 20 mm, but raw_data_x_0.000_"));
}

}  // namespace
}  // namespace unflex::app
