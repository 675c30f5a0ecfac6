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

TEST(Gains, OfTheOtherFormIntegrateTooLittle) {
  EXPECT_NEAR(misread().p, 21.36, 5e-3);
  EXPECT_NEAR(misread().i, 0.0669, 5e-5);
  EXPECT_NEAR(misread().d, 3.74, 5e-3);
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

// The plant that answers to a published test of a bottle filament's hotend as that hotend did: its
// gains of the ideal form were put into a parallel controller whose integral winds up.
class BottleFilament : public ::testing::Test {
 protected:
  static constexpr Plant kPlant{
      .gain_c = 2.28, .time_constant_s = 189.0, .sensor_lag_s = 8.65, .dead_time_s = 2.25};

  static Response to_150(const Gains& gains) {
    return step_response(kPlant, {.gains = gains, .conditional_integration = false},
                         kPlant.ambient_c, 150.0, {.duration_s = 3000.0});
  }

  static double at(const Response& response, double time_s) {
    return response.temperature_c[static_cast<std::size_t>(std::lround(time_s / 0.05))];
  }
};

TEST_F(BottleFilament, OvershootsAndStaysOffWithGainsOfTheOtherForm) {
  const Response pi = to_150({.p = 15.75, .i = 0.04});
  const Response pid = to_150({.p = 21.0, .i = 0.0667, .d = 3.75});
  EXPECT_NEAR(pi.peak_c, 169.0, 0.1);
  EXPECT_NEAR(pid.peak_c, 172.9, 0.1);
  // The integral takes (K_p + 1/K)/K_i, 400 s and 320, to forget what it has wound up.
  for (const Response* response : {&pi, &pid}) {
    EXPECT_NEAR(at(*response, 670.0), 151.3, 0.05);
    EXPECT_GT(at(*response, 540.0), 151.5);
    EXPECT_NEAR(response->temperature_c.back(), 150.0, 0.01);
  }
  EXPECT_NEAR((at(pi, 1500.0) - 150.0) / (at(pi, 1100.0) - 150.0), std::exp(-400.0 / 404.7), 0.01);
}

TEST_F(BottleFilament, HasNoOffsetWithGainsOfTheRightForm) {
  const Ultimate test{.gain = 35.0, .period_s = 30.0};
  for (const Rule rule : {Rule::zn_pi, Rule::zn_pid}) {
    const Response response = to_150(*gains(rule, test));
    EXPECT_NEAR(response.peak_c, 250.0, 10.0);
    EXPECT_NEAR(response.temperature_c.back(), 150.0, 0.01);
  }
  // A proportional controller of 9 reaches the target at its peak alone, as that hotend did at 150.
  EXPECT_NEAR(to_150({.p = 9.0}).peak_c, 154.0, 0.5);
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
