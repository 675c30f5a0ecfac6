#include "moment_ring.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace unflex::record {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

// Moves of 1 mm, 10 ms each. Reference, base and nozzle all go along with them.
void play(MomentRing& ring, double& t, double until_s) {
  constexpr double kStep_s = 1e-4;
  for (; t < until_s; t += kStep_s) {
    if (!ring.advance(kStep_s)) {
      continue;
    }
    verify::NozzleStep step;
    step.measured = true;
    step.reference_mm.x = step.base.x.position = 100.0 * t;
    step.nozzle.x.position = 100.0 * t + 1.0;
    step.contour2_mm2 = 0.25;
    const auto move = static_cast<std::size_t>(100.0 * t);
    ring.add(step, {move, 100.0 * t - static_cast<double>(move)});
  }
}

TEST(MomentRing, GivesWhatWasAroundAPlaceBothBehindAndAhead) {
  for (const double asked_s : {0.5, 0.9}) {
    MomentRing ring(0.075);
    double t = 0.0;
    play(ring, t, asked_s);
    ring.request(17, {70, 0.25});  // t = 0.7025
    play(ring, t, 0.74);
    if (asked_s < 0.7) {
      EXPECT_THAT(ring.take(false), IsEmpty());
    }
    play(ring, t, 1.0);
    const std::vector<MomentRing::Taken> taken = ring.take(false);
    ASSERT_THAT(taken, SizeIs(1));
    EXPECT_EQ(taken[0].id, 17U);
    const std::vector<report::Moment>& moments = taken[0].moments;
    ASSERT_THAT(moments, SizeIs(151));
    EXPECT_EQ(moments[75].time_s, 0.0);
    EXPECT_NEAR(moments[75].reference_mm.x, 70.25, 0.15);
    EXPECT_NEAR(moments.front().time_s, -0.075, 0.01);
    EXPECT_NEAR(moments.back().time_s, 0.075, 0.01);
    EXPECT_EQ(moments[3].contour_mm, 0.5);
    for (const report::Moment& moment : moments) {
      EXPECT_NEAR(moment.reference_mm.x, moments[75].reference_mm.x + 100.0 * moment.time_s, 0.02);
    }
    EXPECT_FALSE(ring.has_requests());
  }
}

TEST(MomentRing, GivesWhatThereIsAtTheEnd) {
  MomentRing ring(0.075);
  double t = 0.0;
  play(ring, t, 0.05);
  ring.request(1, {4, 0.0});
  ring.request(2, {99, 0.0});
  EXPECT_THAT(ring.take(false), IsEmpty());
  const std::vector<MomentRing::Taken> taken = ring.take(true);
  ASSERT_THAT(taken, SizeIs(2));
  EXPECT_GT(taken[0].moments.size(), 40U);
  EXPECT_THAT(taken[1].moments, IsEmpty());
}

TEST(MomentRing, ForgetsWhatIsLongPastAndWhatIsNoLongerWanted) {
  MomentRing ring(0.075);
  double t = 0.0;
  play(ring, t, 20.0);
  ring.request(1, {4, 0.0});
  ring.request(2, {2500, 0.0});
  ring.cancel(2);
  const std::vector<MomentRing::Taken> taken = ring.take(false);
  ASSERT_THAT(taken, SizeIs(1));
  EXPECT_THAT(taken[0].moments, IsEmpty());
  EXPECT_FALSE(ring.has_requests());
}

}  // namespace
}  // namespace unflex::record
