#include "unflex/run/machine_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

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
  const double mm = 250.0 / settings.filament_g_per_mm();
  EXPECT_NEAR(y_hz(*machine.at(mm)), 31.0269, 0.0005 * 31.0);
  EXPECT_NEAR(machine.at(mm)->verify.nozzle.y.slowest_rad_s(), 2.0 * std::numbers::pi * 31.0269,
              0.0005 * 2.0 * std::numbers::pi * 31.0);
  EXPECT_EQ(machine.at(mm)->settings.dynamics.x.freq_hz, settings.dynamics.x.freq_hz);
  EXPECT_EQ(y_hz(machine.empty()), 38.0);
  EXPECT_EQ(y_hz(*machine.at(0.0)), 38.0);
}

TEST(AMovingBed, KeepsWithinATwentiethOfAPercent) {
  machine::Settings settings = flow::testing::settings();
  settings.dynamics.x.moving_mass_g = 800.0;
  settings.dynamics.y.moving_mass_g = 300.0;
  MachineModel machine(settings, rules_for);
  for (double mm = 0.0; mm < 400e3; mm += 7919.0) {
    const double printed_g = mm * settings.filament_g_per_mm();
    const auto rules = machine.at(mm);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double exact_hz =
          settings.dynamics[axis].freq_hz * settings.dynamics[axis].frequency_share(printed_g);
      EXPECT_NEAR(rules->settings.dynamics[axis].freq_hz / exact_hz, 1.0, 5.1e-4) << mm;
    }
  }
}

TEST(AMachineWhoseBedStands, HasOneSetOfRules) {
  MachineModel machine(flow::testing::settings(), rules_for);
  EXPECT_EQ(machine.at(0.0), machine.at(1e6));
  EXPECT_EQ(machine.at(0.0).get(), &machine.empty());
}

}  // namespace
}  // namespace unflex::run
