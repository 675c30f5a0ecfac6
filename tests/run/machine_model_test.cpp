#include "unflex/run/machine_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "jobs.hpp"
#include "unflex/machine/as_printer.hpp"
#include "unflex/run/emit_options.hpp"
#include "unflex/run/setup.hpp"
#include "unflex/run/verify_rules.hpp"

namespace unflex::run {
namespace {

RunRules rules_for(const machine::Settings& settings) {
  return {settings, compensate_setup(settings), compensate_setup(settings),
          emit_options(settings, "test"), verify_rules(settings)};
}

double y_hz(const RunRules& rules) { return rules.settings.dynamics.y.freq_hz; }

// 250 g on a bed of 500 g: 38 Hz · √(500 / 750) = 31.03 Hz.
TEST(AMovingBed, SwingsSlowerByTheRootOfItsMass) {
  machine::Settings settings = flow::testing::settings();
  settings.dynamics.y.freq_hz = 38.0;
  settings.dynamics.y.moving_mass_g = 500.0;
  MachineModel machine(settings, rules_for);
  const machine::MachineState printed{.printed_g = 250.0};
  EXPECT_NEAR(y_hz(*machine.at(printed)), 31.0269, 0.0005 * 31.0);
  EXPECT_NEAR(machine.at(printed)->verify.nozzle.y.slowest_rad_s(),
              2.0 * std::numbers::pi * 31.0269, 0.0005 * 2.0 * std::numbers::pi * 31.0);
  EXPECT_EQ(machine.at(printed)->settings.dynamics.x.freq_hz, settings.dynamics.x.freq_hz);
  EXPECT_EQ(y_hz(machine.as_given()), 38.0);
  EXPECT_EQ(y_hz(*machine.at({})), 38.0);
}

// The frequencies are linear between two heights and constant beyond them.
TEST(AMapOfHeights, GivesTheFrequencyOfTheHeight) {
  machine::Settings settings = flow::testing::settings();
  settings.dynamics.x.freq_hz = 45.0;
  settings.dynamics.x.map = {{'z', {0.0, 100.0, 200.0}, {45.0, 42.5, 30.0}}};
  MachineModel machine(settings, rules_for);
  for (const auto& [height_mm, hz] :
       {std::pair{-5.0, 45.0}, std::pair{0.0, 45.0}, std::pair{50.0, 43.75}, std::pair{100.0, 42.5},
        std::pair{150.0, 36.25}, std::pair{200.0, 30.0}, std::pair{300.0, 30.0}}) {
    const auto rules = machine.at({.height_mm = height_mm});
    EXPECT_NEAR(rules->settings.dynamics.x.freq_hz, hz, 5.1e-4 * hz) << height_mm;
  }
}

// The rules have the frequency near the run, and windows those of the places.
TEST(AMapOverTheBed, GivesTheFrequencyOfThePlace) {
  machine::Settings settings = flow::testing::settings();
  settings.dynamics.x.freq_hz = 45.0;
  settings.dynamics.x.map = {{'x', {0.0, 200.0}, {45.0, 40.0}},
                             {'y', {0.0, 200.0}, {45.0, 54.0}},
                             {'z', {0.0, 100.0}, {45.0, 22.5}}};
  MachineModel machine(settings, rules_for);
  const auto rules = machine.at({.height_mm = 50.0, .place_mm = {100.0, 150.0}});
  const double by_height = 0.75;
  const double here_hz = 45.0 * by_height * (42.5 / 45.0) * (51.75 / 45.0);
  EXPECT_NEAR(rules->settings.dynamics.x.freq_hz, here_hz, 1.1e-3 * here_hz);
  for (const XY place_mm : {XY{0.0, 0.0}, XY{30.0, 170.0}, XY{200.0, 200.0}}) {
    const double there_hz =
        45.0 * by_height * (1.0 - place_mm.x / 1800.0) * (1.0 + place_mm.y / 1000.0);
    const double by_field = rules->settings.dynamics.x.freq_hz * rules->setup.x.field.at(place_mm);
    const double judged =
        rules->settings.dynamics.x.freq_hz *
        rules->verify.change.frequency_shares({place_mm.x, place_mm.y, 50.0, 0.0}).x;
    EXPECT_NEAR(by_field, there_hz, 6e-4 * there_hz);
    EXPECT_NEAR(judged, by_field, 1e-9);
    // The verdict is about the machine as given.
    EXPECT_NEAR(45.0 * machine.as_given()
                           .verify.change.frequency_shares({place_mm.x, place_mm.y, 50.0, 0.0})
                           .x,
                there_hz, 1e-9);
  }
}

TEST(AMachineThatChanges, KeepsWithinATwentiethOfAPercent) {
  machine::Settings settings = flow::testing::settings();
  settings.dynamics.x.moving_mass_g = 800.0;
  settings.dynamics.x.map = {{'z', {0.0, 250.0}, {settings.dynamics.x.freq_hz, 60.0}}};
  settings.dynamics.y.moving_mass_g = 300.0;
  MachineModel machine(settings, rules_for);
  for (double printed_g = 0.0; printed_g < 1200.0; printed_g += 23.7) {
    const machine::MachineState state{printed_g, 0.31 * printed_g};
    const auto rules = machine.at(state);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double exact_hz =
          settings.dynamics[axis].freq_hz * settings.dynamics[axis].frequency_share(state);
      EXPECT_NEAR(rules->settings.dynamics[axis].freq_hz / exact_hz, 1.0, 5.1e-4) << printed_g;
    }
  }
}

// A tool's own frequency, then the share that the bed's mass makes of it: 36 Hz · √(500 / 750).
TEST(AToolChanger, HasTheRulesOfTheToolInUse) {
  machine::Settings settings = flow::testing::settings();
  settings.dynamics.y.freq_hz = 38.0;
  settings.dynamics.y.moving_mass_g = 500.0;
  settings.tools = {{.number = 0}, {.number = 1, .freq_hz = {30.0, 36.0}}};
  int made = 0;
  MachineModel machine(settings, [&](const machine::Settings& of) {
    ++made;
    return rules_for(of);
  });
  const auto rules = machine.at({.printed_g = 250.0, .tool = 1});
  EXPECT_NEAR(y_hz(*rules), 29.3939, 0.0005 * 30.0);
  EXPECT_EQ(rules->settings.dynamics.x.freq_hz, 30.0);
  EXPECT_NEAR(rules->verify.nozzle.y.slowest_rad_s(), 2.0 * std::numbers::pi * 29.3939,
              0.0005 * 2.0 * std::numbers::pi * 30.0);
  EXPECT_NEAR(y_hz(*machine.at({.printed_g = 250.0, .tool = 0})), 31.0269, 0.0005 * 31.0);
  // The verdict knows all tools.
  ASSERT_EQ(machine.as_given().verify.tools.size(), 2U);
  EXPECT_NEAR(machine.as_given().verify.tools[1].nozzle.y.slowest_rad_s(),
              2.0 * std::numbers::pi * 36.0, 1e-9);
  const int made_before = made;
  for (int i = 0; i < 60; ++i) {
    static_cast<void>(machine.at({.printed_g = 250.0, .tool = i % 2}));
  }
  EXPECT_EQ(made, made_before);
}

TEST(AMachineThatStays, HasOneSetOfRules) {
  MachineModel machine(flow::testing::settings(), rules_for);
  EXPECT_EQ(machine.at({}), machine.at({1e6, 1e3}));
  EXPECT_EQ(machine.at({}).get(), &machine.as_given());
}

}  // namespace
}  // namespace unflex::run
