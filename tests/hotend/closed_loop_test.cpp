#include "unflex/hotend/closed_loop.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "hotend/reference.hpp"

namespace unflex::hotend {
namespace {

// The reference from 25 °C, by the gains of each rule. A controller samples every 0.5 s.
struct Row {
  std::string name;
  Gains gains;
  double wound_up_c = 0.0;  // peak of 150 °C without conditional integration
  double peak_c = 0.0;
  double settled_s = 0.0;
  double peak_of_220_c = 0.0;
  double settled_of_220_s = 0.0;
};

Gains by(Rule rule) { return *gains(rule, kReference); }

// K_i = 2/P_u and K_d = P_u/8 belong to the ideal form, but are put into the parallel one here.
Gains misread() {
  const double period_s = ultimate(kReference)->period_s;
  return {.p = by(Rule::zn_pid).p, .i = 2.0 / period_s, .d = period_s / 8.0};
}

TEST(StepResponse, IsThatOfTheTable) {
  constexpr double kBand_c = 0.3;
  constexpr double kBand_s = 3.0;
  const Row rows[] = {
      {"zn", by(Rule::zn_pid), 252.3, 153.77, 116.0, 222.75, 171.0},
      {"misread", misread(), 169.7, 151.91, 298.0, 219.57, 374.0},
      {"cc", by(Rule::cohen_coon), 252.5, 153.24, 104.0, 221.68, 150.0},
      {"tl", by(Rule::tyreus_luyben), 212.8, 150.00, 105.0, 220.00, 173.0},
      {"simc-pi", by(Rule::simc_pi), 223.7, 150.00, 95.0, 220.00, 190.0},
      {"simc", by(Rule::simc_pid), 229.3, 150.00, 94.0, 220.00, 160.0},
  };
  for (const Row& row : rows) {
    SCOPED_TRACE(row.name);
    Control control{.gains = row.gains};
    const Response to_150 = step_response(kReference, control, 25.0, 150.0);
    const Response to_220 = step_response(kReference, control, 25.0, 220.0);
    control.conditional_integration = false;
    const Response wound_up = step_response(kReference, control, 25.0, 150.0);
    EXPECT_NEAR(wound_up.peak_c, row.wound_up_c, kBand_c);
    EXPECT_NEAR(to_150.peak_c, row.peak_c, kBand_c);
    EXPECT_NEAR(to_150.settled_s.value_or(0.0), row.settled_s, kBand_s);
    EXPECT_NEAR(to_220.peak_c, row.peak_of_220_c, kBand_c);
    EXPECT_NEAR(to_220.settled_s.value_or(0.0), row.settled_of_220_s, kBand_s);
  }
}

TEST(StepResponse, OscillatesSteadilyAtTheUltimateGain) {
  // Wide bounds of the power, so that it never saturates.
  Plant plant = kReference;
  plant.full_power = 1e9;
  plant.ambient_c = -1e6;
  const Control control{.gains = {.p = ultimate(kReference)->gain}};
  const Response response = step_response(plant, control, 0.0, 1.0, {.duration_s = 600.0});
  const auto swing_c = [&](double from_s) {
    const auto first = response.temperature_c.begin() + std::lround(from_s / 0.05);
    const auto [low, high] = std::minmax_element(first, first + 600);
    return *high - *low;
  };
  EXPECT_NEAR(swing_c(560.0) / swing_c(260.0), 1.0, 0.02);
}

TEST(StepResponse, GoesDownAsWell) {
  const Response response = step_response(kReference, {.gains = by(Rule::simc_pid)}, 220.0, 200.0);
  EXPECT_NEAR(response.temperature_c.back(), 200.0, 0.05);
  EXPECT_EQ(response.peak_c, 220.0);
  EXPECT_LT(response.worst_c, 3.0);
  ASSERT_TRUE(response.settled_s);
}

TEST(StepResponse, SaysIfItNeverArrives) {
  const Control weak{.gains = {.p = 1.0}};
  const Response response = step_response(kReference, weak, 25.0, 150.0);
  EXPECT_FALSE(response.settled_s);
  EXPECT_EQ(response.worst_c, 0.0);
  // A proportional controller stops where its error is the power that holds: K K_p e = T − T_amb.
  EXPECT_NEAR(response.temperature_c.back(), 25.0 + 125.0 * 2.0 / 3.0, 0.1);
}

TEST(LoadResponse, DropsAndComesBack) {
  const double load = load_in_counts(kReference, melting_power_w(15.0, 195.0), 40.0);
  const Response simc = load_response(kReference, {.gains = by(Rule::simc_pid)}, 220.0, load);
  const Response pi = load_response(kReference, {.gains = by(Rule::simc_pi)}, 220.0, load);
  EXPECT_NEAR(simc.temperature_c.back(), 220.0, 0.05);
  EXPECT_LT(simc.worst_c, pi.worst_c);
  EXPECT_GT(simc.worst_c, 1.0);
  // Until the heater answers, the block cools at K u_load / τ₁. It cannot do better.
  EXPECT_GT(simc.worst_c, 0.5 * load * 2.0 / 300.0 * 5.0);
  EXPECT_LT(simc.worst_c, 5.0);
}

TEST(LoadResponse, StaysWhereItIsWithoutOne) {
  const Response response =
      load_response(kReference, {.gains = by(Rule::simc_pid)}, 220.0, 0.0, {.duration_s = 60.0});
  EXPECT_LT(response.worst_c, 1e-9);
  EXPECT_EQ(response.settled_s, 0.0);
}

}  // namespace
}  // namespace unflex::hotend
