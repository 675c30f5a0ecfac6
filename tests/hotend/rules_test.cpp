#include "unflex/hotend/rules.hpp"

#include <gtest/gtest.h>

#include "hotend/reference.hpp"

namespace unflex::hotend {
namespace {

void expect_gains(const Result<Gains>& found, double p, double i, double d) {
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->p, p, 5.001e-3);
  EXPECT_NEAR(found->i, i, 5.001e-5);
  EXPECT_NEAR(found->d, d, 5.001e-3);
}

TEST(Rules, GiveTheReferenceItsGains) {
  expect_gains(gains(Rule::zn_pid, kReference), 21.36, 1.4286, 79.85);
  expect_gains(gains(Rule::cohen_coon, kReference), 32.26, 2.1153, 73.04);
  expect_gains(gains(Rule::tyreus_luyben, kReference), 16.18, 0.2460, 76.82);
  expect_gains(gains(Rule::simc_pi, kReference), 12.05, 0.2410, 0.0);
  expect_gains(gains(Rule::simc_pid, kReference), 15.94, 0.3750, 37.50);
}

TEST(Rules, NeedOnlyTheUltimateCycleIfTheyAreMadeForIt) {
  const Ultimate test{.gain = 35.0, .period_s = 30.0};
  expect_gains(gains(Rule::zn_pi, test), 15.75, 0.63, 0.0);
  expect_gains(gains(Rule::zn_pid, test), 21.0, 1.4, 78.75);
  EXPECT_EQ(gains(Rule::tyreus_luyben, test)->p, 35.0 / 2.2);
  const Result<Gains> refused = gains(Rule::simc_pid, test);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::usage);
  EXPECT_FALSE(gains(Rule::cohen_coon, test));
  EXPECT_FALSE(gains(Rule::zn_pid, Ultimate{.gain = 0.0, .period_s = 30.0}));
  EXPECT_FALSE(gains(Rule::zn_pid, Ultimate{.gain = 35.0, .period_s = -1.0}));
}

TEST(Rules, NeedADeadTime) {
  Plant plant = kReference;
  plant.dead_time_s = 0.0;
  for (const Rule rule : {Rule::simc_pid, Rule::simc_pi, Rule::zn_pid, Rule::cohen_coon}) {
    EXPECT_FALSE(gains(rule, plant));
  }
  EXPECT_FALSE(gains(Rule::simc_pid, Plant{}));
}

TEST(Rules, ScaleWithTheUnitOfPower) {
  Plant plant = kReference;
  plant.gain_c *= 255.0;
  plant.full_power = 1.0;
  for (const Rule rule : {Rule::simc_pid, Rule::zn_pid, Rule::cohen_coon}) {
    EXPECT_NEAR(gains(rule, plant)->p * 255.0, gains(rule, kReference)->p, 1e-9);
  }
}

TEST(Rules, HaveTheWordsOfTheCommandLine) {
  EXPECT_EQ(to_string(Rule::simc_pid), "simc");
  EXPECT_EQ(to_string(Rule::simc_pi), "simc-pi");
  EXPECT_EQ(to_string(Rule::zn_pid), "zn");
  EXPECT_EQ(to_string(Rule::zn_pi), "zn-pi");
  EXPECT_EQ(to_string(Rule::cohen_coon), "cc");
  EXPECT_EQ(to_string(Rule::tyreus_luyben), "tl");
}

}  // namespace
}  // namespace unflex::hotend
