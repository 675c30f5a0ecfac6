#include "unflex/gcode/compensable.hpp"

#include <gtest/gtest.h>

namespace unflex::gcode {
namespace {

Segment segment(double dx, double dy, double dz, double de) {
  Segment result;
  result.start_mm = {10.0, 20.0, 0.5, 100.0};
  result.end_mm = {10.0 + dx, 20.0 + dy, 0.5 + dz, 100.0 + de};
  result.feed_mm_s = 50.0;
  return result;
}

TEST(Compensable, TravelAndExtrusionInThePlaneAre) {
  EXPECT_TRUE(compensable(segment(3.0, 0.0, 0.0, 0.0)));
  EXPECT_TRUE(compensable(segment(0.0, -3.0, 0.0, 0.1)));
  EXPECT_EQ(kept_reason(segment(1.0, 1.0, 0.0, 0.1)), "");
}

TEST(Compensable, AWipeThatPullsFilamentBackIsNot) {
  EXPECT_EQ(kept_reason(segment(3.0, 0.0, 0.0, -0.1)), "retracting move");
}

TEST(Compensable, RoundoffInTheRunningSumOfFilamentIsNoRetraction) {
  EXPECT_TRUE(compensable(segment(3.0, 0.0, 0.0, -1e-12)));
}

TEST(Compensable, OnlyFilamentOrOnlyZIsNot) {
  EXPECT_EQ(kept_reason(segment(0.0, 0.0, 0.0, 2.0)), "extrude only");
  EXPECT_EQ(kept_reason(segment(0.0, 0.0, 0.4, 0.0)), "Z move");
}

TEST(Compensable, ASpiralVaseIsButAZHopIsNot) {
  EXPECT_TRUE(compensable(segment(3.0, 4.0, 0.099, 0.1)));
  EXPECT_TRUE(compensable(segment(3.0, 4.0, -0.099, 0.1)));
  EXPECT_EQ(kept_reason(segment(3.0, 4.0, 0.101, 0.1)), "Z move");
}

TEST(Compensable, AMoveFromAnUnknownPlaceIsNot) {
  Segment unknown = segment(3.0, 0.0, 0.0, 0.0);
  unknown.start_known = false;
  EXPECT_EQ(kept_reason(unknown), "start unknown");
  EXPECT_FALSE(compensable(unknown));
}

TEST(Compensable, ALineIsOnlyIfAllItsSegmentsAre) {
  Event event;
  event.kind = EventKind::move;
  EXPECT_FALSE(compensable(event));
  event.segments = {segment(1.0, 0.0, 0.0, 0.1), segment(1.0, 0.1, 0.0, 0.1)};
  EXPECT_TRUE(compensable(event));
  event.segments.push_back(segment(1.0, 0.0, 0.0, -0.1));
  EXPECT_FALSE(compensable(event));
}

}  // namespace
}  // namespace unflex::gcode
