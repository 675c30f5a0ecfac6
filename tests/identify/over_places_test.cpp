// Records of several places become maps of the frequency.

#include "unflex/identify/over_places.hpp"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <random>

#include "modes_simulation.hpp"
#include "sweep_simulation.hpp"
#include "welch.hpp"

namespace unflex::identify {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// A model with this frequency, whose 95 % interval is `spread` to either side, as a share.
AxisModel model_with(double freq_hz, double spread = 0.002) {
  const Result<RecordFit> fit = fit_tower({.spacing_mm = 1.0,
                                           .spacing_spread_mm = spread,
                                           .speed_mm_s = freq_hz,
                                           .decay = 1.5,
                                           .decay_spread = 0.02});
  return fit.value().model;
}

PlacedModel at(const Place& place_mm, double freq_hz, double spread = 0.002) {
  return {"record", place_mm, model_with(freq_hz, spread)};
}

AxisOverPlaces good(const std::vector<PlacedModel>& models) {
  const Result<AxisOverPlaces> all = combine_over_places(models);
  EXPECT_TRUE(all) << to_string(all.error());
  return all.value_or(AxisOverPlaces{});
}

// 45 Hz at the origin. It falls by 10 % over 200 mm along x, and by 5 % along y.
double machine_hz(const Place& place_mm) {
  return 45.0 * (1.0 - 0.1 * place_mm[0] / 200.0) * (1.0 - 0.05 * place_mm[1] / 200.0);
}

std::vector<Place> grid() {
  std::vector<Place> places;
  for (const double x_mm : {0.0, 100.0, 200.0}) {
    for (const double y_mm : {0.0, 100.0, 200.0}) {
      places.push_back({x_mm, y_mm, 20.0});
    }
  }
  return places;
}

TEST(OverPlaces, ALineIsOneMapThroughAllItsPlaces) {
  std::vector<PlacedModel> models;
  for (const double x_mm : {200.0, 0.0, 100.0}) {
    models.push_back(at({x_mm, 50.0, 20.0}, machine_hz({x_mm, 0.0, 20.0})));
  }
  const AxisOverPlaces all = good(models);
  ASSERT_THAT(all.maps, SizeIs(1));
  EXPECT_EQ(all.maps[0].along, 'x');
  EXPECT_THAT(all.maps[0].at_mm, ElementsAre(0.0, 100.0, 200.0));
  EXPECT_NEAR(all.maps[0].freq_hz[0], 45.0, 1e-9);
  EXPECT_NEAR(all.maps[0].freq_hz[2], 40.5, 1e-9);
  // The model is that of the middle, and its interval no narrower than that of a record.
  EXPECT_EQ(all.reference_mm, (Place{100.0, 50.0, 20.0}));
  const Estimate& freq_hz = all.model.modes.front().freq_hz;
  EXPECT_NEAR(freq_hz.value, 42.75, 1e-9);
  EXPECT_NEAR(freq_hz.high / freq_hz.value, 1.002, 1e-4);
  EXPECT_NEAR(all.worst().residual(), 0.0, 1e-9);
  EXPECT_TRUE(all.agrees);
  EXPECT_THAT(all.remark, IsEmpty());
}

TEST(OverPlaces, AGridIsAProductThatTakesNoiseOutOfItsRecords) {
  std::mt19937 random(3);
  std::normal_distribution<double> chance(0.0, 0.005);
  std::vector<PlacedModel> models;
  for (const Place& place_mm : grid()) {
    models.push_back(at(place_mm, machine_hz(place_mm) * std::exp(chance(random)), 0.01));
  }
  const AxisOverPlaces all = good(models);
  ASSERT_THAT(all.maps, SizeIs(2));
  EXPECT_EQ(all.maps[1].along, 'y');
  for (const PlaceOfAxis& one : all.places) {
    EXPECT_NEAR(one.map_hz / machine_hz(one.place_mm), 1.0, 0.01);
  }
  EXPECT_LT(std::abs(all.worst().residual()), 0.01);
  EXPECT_THAT(all.warnings, IsEmpty());
}

TEST(OverPlaces, AMapAlongZIsFoundBesideOthers) {
  std::vector<PlacedModel> models;
  for (const Place& place_mm : grid()) {
    models.push_back(at(place_mm, machine_hz(place_mm)));
  }
  models.push_back(at({100.0, 100.0, 220.0}, 0.9 * machine_hz({100.0, 100.0, 0.0})));
  const AxisOverPlaces all = good(models);
  ASSERT_THAT(all.maps, SizeIs(3));
  EXPECT_EQ(all.maps[2].along, 'z');
  EXPECT_NEAR(all.maps[2].freq_hz[1] / all.maps[2].freq_hz[0], 0.9, 1e-9);
}

TEST(OverPlaces, RecordsOfAPlaceCountByTheirNumber) {
  // A place that does not fit into the product pulls less than three records of it do.
  const auto residual_with = [](int count) {
    std::vector<PlacedModel> models = {at({0.0, 0.0, 0.0}, 40.0), at({0.0, 100.0, 0.0}, 42.0),
                                       at({100.0, 0.0, 0.0}, 44.0)};
    for (int i = 0; i < count; ++i) {
      models.push_back(at({100.0, 100.0, 0.0}, 47.0));
    }
    return std::abs(good(models).places.back().residual());
  };
  EXPECT_LT(residual_with(3), 0.6 * residual_with(1));
}

TEST(OverPlaces, WhatTheProductCannotTellIsSaidWithItsPlace) {
  std::vector<PlacedModel> models;
  for (const Place& place_mm : grid()) {
    const bool is_odd = place_mm[0] == 200.0 && place_mm[1] == 200.0;
    models.push_back(at(place_mm, machine_hz(place_mm) * (is_odd ? 1.1 : 1.0)));
  }
  const AxisOverPlaces all = good(models);
  EXPECT_EQ(all.worst().place_mm, (Place{200.0, 200.0, 20.0}));
  ASSERT_THAT(all.warnings, SizeIs(1));
  EXPECT_THAT(all.warnings[0], HasSubstr("the records at 200, 200, 20 mm are +"));
}

TEST(OverPlaces, NothingChangesNoMap) {
  const AxisOverPlaces same = good({at({0.0, 0.0, 0.0}, 45.0), at({200.0, 0.0, 0.0}, 45.1)});
  EXPECT_THAT(same.maps, IsEmpty());
  EXPECT_THAT(same.remark, HasSubstr("no map along x"));
  EXPECT_NEAR(same.places[0].map_hz, same.model.values().front().freq_hz, 1e-12);
  // A change of 1.5 % is told by good records, not by those that are 2 % wide.
  const auto maps_with = [](double spread) {
    return good({at({0.0, 0.0, 0.0}, 45.0, spread), at({200.0, 0.0, 0.0}, 45.68, spread)}).maps;
  };
  EXPECT_THAT(maps_with(0.002), SizeIs(1));
  EXPECT_THAT(maps_with(0.02), IsEmpty());
  // A grid on which only one direction counts has a map along this one.
  std::vector<PlacedModel> models;
  for (const Place& place_mm : grid()) {
    models.push_back(at(place_mm, machine_hz({place_mm[0], 0.0, 0.0})));
  }
  const AxisOverPlaces one = good(models);
  ASSERT_THAT(one.maps, SizeIs(1));
  EXPECT_THAT(one.remark, HasSubstr("no map along y:"));
}

TEST(OverPlaces, PlacesOnADiagonalLeaveTheDirectionOpen) {
  const AxisOverPlaces all = good({at({0.0, 0.0, 0.0}, 45.0), at({200.0, 200.0, 0.0}, 46.5)});
  EXPECT_THAT(all.maps, IsEmpty());
  ASSERT_THAT(all.warnings, SizeIs(1));
  EXPECT_THAT(all.warnings[0], HasSubstr("leave open along which direction"));
}

TEST(OverPlaces, RefusesOnePlaceAndRecordsThatContradictEachOther) {
  const Result<AxisOverPlaces> one = combine_over_places({at({0.0, 0.0, 0.0}, 45.0)});
  ASSERT_FALSE(one);
  EXPECT_EQ(one.error().place.file, "record");
  std::vector<PlacedModel> models = {at({0.0, 0.0, 0.0}, 45.0), at({0.0, 0.0, 0.0}, 48.0),
                                     at({200.0, 0.0, 0.0}, 40.0)};
  models[1].name = "odd.csv";
  const Result<AxisOverPlaces> two = combine_over_places(models);
  ASSERT_FALSE(two);
  EXPECT_EQ(two.error().place.file, "odd.csv");
  EXPECT_THAT(two.error().message, HasSubstr("48.0 Hz at 0, 0, 0 mm, but record tells 45.0 Hz"));
}

TEST(OverPlaces, AnAxisOfSeveralModesHasNoMap) {
  std::vector<PlacedModel> models;
  for (const double share : {1.0, 0.9}) {
    const SimulatedSpectrum of{.modes = {{45.0 * share, 0.06, 0.7}, {80.0 * share, 0.05, 0.3}},
                               .windows = 60};
    const Result<RecordFit> fit = fit_spectrum(simulate(of), {});
    ASSERT_TRUE(fit && fit->is_trusted());
    ASSERT_THAT(fit->model.modes, SizeIs(2));
    models.push_back({"spectrum", {200.0 * share, 0.0, 0.0}, fit->model});
  }
  const AxisOverPlaces all = good(models);
  EXPECT_THAT(all.maps, IsEmpty());
  EXPECT_THAT(all.model.modes, SizeIs(2));
  EXPECT_FALSE(all.agrees);
  ASSERT_THAT(all.warnings, SizeIs(1));
  EXPECT_THAT(all.warnings[0], HasSubstr("swings in several modes"));
}

TEST(OverPlaces, SweepsOfAMachineGiveItsMapBack) {
  std::vector<PlacedModel> models;
  std::uint32_t seed = 1;
  for (const Place& place_mm : {Place{0.0, 0.0, 20.0}, {200.0, 0.0, 20.0}, {0.0, 200.0, 20.0}}) {
    const SimulatedTest test{.mode_hz = machine_hz(place_mm), .rate_hz = 1600.0, .seed = ++seed};
    const Result<RecordFit> fit = fit_spectrum(welch(simulate(test), test.rate_hz, false), Sweep{});
    ASSERT_TRUE(fit && fit->is_trusted());
    models.push_back({"sweep", place_mm, fit->model});
  }
  const AxisOverPlaces all = good(models);
  EXPECT_THAT(all.maps, SizeIs(2));
  for (const PlaceOfAxis& one : all.places) {
    EXPECT_NEAR(one.map_hz / machine_hz(one.place_mm), 1.0, 0.01);
  }
}

TEST(PlaceInName, IsReadFromKlippersNamesAndFromTheUsers) {
  const Place place_mm = {100.0, 50.5, 20.0};
  for (const char* const name :
       {"/tmp/resonances_x_100.000_50.500_20.000_20230101_120000.csv",
        "raw_data_x_adxl345_hotend_2_100.000_50.500_20.000_20230101_120000.csv",
        "raw_data_axis=1.000,0.000,0.000_100.000_50.500_20.000_a.csv",
        "all.csv (raw_data_x_100.000_50.500_20.000.csv)", "raw_data_x_at_100_50.5_20.csv",
        "0.000_0.000_0.000.csv (resonances_x_100.000_50.500_20.000_1)"}) {
    EXPECT_EQ(place_in_name(name), place_mm) << name;
  }
  EXPECT_EQ(place_in_name("raw_data_y_at_-5_0_3.csv"), (Place{-5.0, 0.0, 3.0}));
  for (const char* const name :
       {"resonances_x_20230101_120000.csv", "raw_data_x_2023_01_15.csv", "calibration_data_x_1.csv",
        "10.000_20.000_30.000/resonances_x_1.csv", "raw_data_x_100.000_50.000_a.csv",
        "raw_data_x_at_100_50.csv", ""}) {
    EXPECT_EQ(place_in_name(name), std::nullopt) << name;
  }
}

}  // namespace
}  // namespace unflex::identify
