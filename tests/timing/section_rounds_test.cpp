#include "section_rounds.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace unflex::timing {
namespace {

constexpr std::size_t kPeriods = 200;

std::vector<Excess> with(std::size_t period, const Excess& excess) {
  std::vector<Excess> result(kPeriods, Excess{0.9, 0.9, 0.9});
  result[period] = excess;
  return result;
}

TEST(SectionRounds, KnowWhatIsKept) {
  SectionRounds rounds(kPeriods, false);
  EXPECT_TRUE(rounds.is_far());
  rounds.show(with(50, {1.02, 1.0, 1.0}), 0.0);
  EXPECT_TRUE(rounds.is_kept());
  EXPECT_FALSE(rounds.is_far());
  EXPECT_EQ(rounds.worst().accel, 1.02);
  EXPECT_EQ(rounds.worst().error, 1.0);
  rounds.show(with(50, {1.0, 1.0, 1.1}), 0.0);
  EXPECT_FALSE(rounds.is_kept());
  rounds.show(with(50, {1.0, 1.0, 1.0}), 1.1);
  EXPECT_FALSE(rounds.is_kept());
}

// What a step comes out otherwise by goes with its square.
TEST(SectionRounds, TrustStepsAsFarAsTheyComeOutAsForeseen) {
  SectionRounds rounds(kPeriods, false);
  const double first = rounds.trust(0);
  rounds.show(with(0, {}), 0.0);
  std::vector<double> surprise(kPeriods, 0.15);
  surprise[100] = 0.6;
  rounds.adapt(surprise, 0);
  EXPECT_NEAR(rounds.trust(100), 0.5 * first, 1e-12);
  EXPECT_NEAR(rounds.trust(100 + 8), 0.5 * first, 1e-12);
  EXPECT_GT(rounds.trust(100 + 10), 0.8 * first);
  EXPECT_GT(rounds.trust(kPeriods), 0.8 * first);
  // It never falls all at once, and has an end.
  surprise[100] = 1e6;
  rounds.adapt(surprise, 1);
  EXPECT_NEAR(rounds.trust(100), 0.125 * first, 1e-12);
  for (int round = 2; round < 30; ++round) {
    rounds.adapt(surprise, round);
  }
  EXPECT_GT(rounds.trust(100), 0.0);
}

TEST(SectionRounds, MaySlowDownWhereSomethingIsBroken) {
  SectionRounds rounds(kPeriods, true);
  std::vector<double> surprise(kPeriods, 100.0);
  rounds.show(with(60, {1.2, 1.0, 1.0}), 0.0);
  rounds.adapt(surprise, 0);
  rounds.adapt(surprise, 1);
  EXPECT_LT(rounds.trust(60), 0.05);
  EXPECT_GE(rounds.trust_to_slow(60), 0.1);
  EXPECT_GE(rounds.trust_to_slow(66), 0.1);
  EXPECT_EQ(rounds.trust_to_slow(80), rounds.trust(80));
  EXPECT_EQ(rounds.trust_to_slow(kPeriods), rounds.trust(kPeriods));
}

TEST(SectionRounds, TightenWhatIsBrokenByALittle) {
  SectionRounds rounds(kPeriods, false);
  const std::vector<double> surprise(kPeriods, 0.1);
  const Excess before = rounds.factors(60);
  rounds.show(with(60, {1.0, 1.2, 3.0}), 0.0);
  rounds.adapt(surprise, 0);
  EXPECT_EQ(rounds.factors(60).error, before.error);
  rounds.adapt(surprise, 2);
  EXPECT_NEAR(rounds.factors(60).error, before.error / 1.2, 1e-12);
  EXPECT_NEAR(rounds.factors(61).error, before.error / 1.2, 1e-12);
  EXPECT_EQ(rounds.factors(62).error, before.error);
  // What is broken by far has another reason.
  EXPECT_EQ(rounds.factors(60).feed, before.feed);
  for (int round = 3; round < 20; ++round) {
    rounds.adapt(surprise, round);
  }
  EXPECT_GE(rounds.factors(60).error, 0.5);
}

TEST(SectionRounds, AccelerateLessBeforeAnEndThatSwings) {
  SectionRounds rounds(kPeriods, true);
  const std::vector<double> surprise(kPeriods, 0.1);
  const double before = rounds.factors(kPeriods - 1).accel;
  rounds.show(with(0, {}), 1.44);
  rounds.adapt(surprise, 0);
  EXPECT_NEAR(rounds.factors(kPeriods - 1).accel, before / 1.2, 1e-12);
  EXPECT_EQ(rounds.factors(0).accel, before);
  // Once it is calm, a little comes back.
  rounds.show(with(0, {}), 0.9);
  rounds.adapt(surprise, 1);
  EXPECT_GT(rounds.factors(kPeriods - 1).accel, before / 1.2);
  EXPECT_LE(rounds.factors(kPeriods - 1).accel, before);
}

TEST(SectionRounds, SayWhenTheSearchIsStuck) {
  SectionRounds rounds(kPeriods, false);
  rounds.show(with(60, {2.0, 1.0, 1.0}), 0.0);
  rounds.show(with(60, {2.01, 1.0, 1.0}), 0.0);
  EXPECT_FALSE(rounds.is_stuck(1));
  EXPECT_TRUE(rounds.is_stuck(6));
  rounds.show(with(60, {1.8, 1.0, 1.0}), 0.0);
  EXPECT_FALSE(rounds.is_stuck(6));
  rounds.show(with(60, {1.2, 1.0, 1.0}), 0.0);
  rounds.show(with(60, {1.2, 1.0, 1.0}), 0.0);
  EXPECT_FALSE(rounds.is_stuck(6));
}

}  // namespace
}  // namespace unflex::timing
