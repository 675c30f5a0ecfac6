#include "filament_lag.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "replaying.hpp"

namespace unflex::verify {
namespace {

// 20 mm to the right, 10 mm without filament, 20 mm back with half as much, 1 mm beside.
class Lag : public ::testing::Test {
 protected:
  Lag() {
    planner::Limits limits;
    limits.max_accel_mm_s2 = 1e6;
    moves_ = testing::plan_path({{0.0, 0.0, 100.0},
                                 {20.0, 0.0, 100.0, 2.0},
                                 {30.0, 0.0, 100.0},
                                 {30.0, 1.0, 100.0},
                                 {10.0, 1.0, 100.0, 1.0}},
                                limits);
    path_.begin_section();
    path_.extend_to(10.0);
  }

  // The lag of one moment.
  double lag_mm(std::size_t piece, double reference_mm, double nozzle_x_mm, double nozzle_y_mm,
                double laid_mm, bool flows = true) {
    const PathPiece& on = path_[piece];
    FilamentLag lag;
    const PathPlace nozzle = nearest_place(path_, piece, on.start_mm + reference_mm * on.direction,
                                           {nozzle_x_mm, nozzle_y_mm});
    lag.add(path_, nozzle, laid_mm, flows, 1e-4);
    return lag.stats().max_mm;
  }

  std::vector<planner::PlannedMove> moves_;
  std::size_t taken_ = 0;
  ReferencePath path_{[this](ReferenceMove& next) {
    if (taken_ == moves_.size()) {
      return false;
    }
    next.move = moves_[taken_++];
    return true;
  }};
};

TEST_F(Lag, IsNoneWhereTheNozzleHasItsFilament) {
  EXPECT_NEAR(lag_mm(0, 5.0, 5.0, 0.0, 0.5), 0.0, 1e-12);
  // The nozzle is beside the path and behind the reference, but with the filament of its own place.
  EXPECT_NEAR(lag_mm(0, 5.0, 4.9, 0.05, 0.49), 0.0, 1e-12);
  EXPECT_NEAR(lag_mm(3, 5.0, 25.0, 1.0, 2.25), 0.0, 1e-12);
}

TEST_F(Lag, IsTheDistanceFromTheNozzleToThePlaceWhoseFilamentComesOut) {
  // 0.02 mm of filament too little or too much are 0.2 mm of the first move, 0.4 of the last.
  EXPECT_NEAR(lag_mm(0, 5.0, 5.0, 0.0, 0.48), 0.2, 1e-12);
  EXPECT_NEAR(lag_mm(0, 5.0, 5.0, 0.0, 0.52), 0.2, 1e-12);
  EXPECT_NEAR(lag_mm(3, 5.0, 25.0, 1.0, 2.23), 0.4, 1e-12);
  // The nozzle is 0.1 mm behind, the filament is the reference's.
  EXPECT_NEAR(lag_mm(0, 5.0, 4.9, 0.0, 0.5), 0.1, 1e-12);
}

TEST_F(Lag, LeavesOutTravelBetweenTheNozzleAndItsFilament) {
  // 0.1 mm on the last move, with the filament of a place 0.2 mm before the end of the first.
  EXPECT_NEAR(lag_mm(3, 0.1, 29.9, 1.0, 1.98), 0.3, 1e-12);
  // The nozzle is before the end of the first move, with the filament of a place on the last.
  EXPECT_NEAR(lag_mm(0, 19.8, 19.8, 0.0, 2.01), 0.4, 1e-12);
}

TEST_F(Lag, CountsTravelWhileFilamentComesOut) {
  // 0.3 mm behind the end of the first move, of which 0.01 mm of filament are missing: 0.1 mm.
  EXPECT_NEAR(lag_mm(0, 19.9, 20.3, 0.0, 1.99), 0.4, 1e-12);
  EXPECT_NEAR(lag_mm(1, 0.2, 20.3, 0.0, 1.99), 0.4, 1e-12);
  // 0.4 mm before the begin of the last move, of which 0.005 mm of filament are laid: 0.1 mm.
  EXPECT_NEAR(lag_mm(2, 0.5, 30.0, 0.6, 2.005), 0.5, 1e-12);
  // All that is laid before the travel is laid, and nothing of what comes behind it.
  EXPECT_EQ(lag_mm(1, 5.0, 25.0, 0.0, 2.0 - 1e-9), 0.0);
  // Nothing comes out, so what is missing is somewhere else.
  EXPECT_EQ(lag_mm(1, 5.0, 25.0, 0.0, 1.0, false), 0.0);
}

TEST_F(Lag, IsNoneOfAPlaceThatIsOnlyNearInSpace) {
  // The last move is 0.6 mm away, the first, where the reference is, 0.4.
  EXPECT_NEAR(lag_mm(0, 15.0, 15.0, 0.4, 1.5), 0.0, 1e-12);
}

TEST_F(Lag, IsWeighedByTime) {
  FilamentLag lag;
  lag.add(path_, {0, 5.0}, 0.48, true, 3e-4);
  lag.add(path_, {0, 6.0}, 0.6, true, 1e-4);
  EXPECT_NEAR(lag.stats().rms_mm, 0.2 * std::sqrt(0.75), 1e-12);
  EXPECT_NEAR(lag.stats().max_mm, 0.2, 1e-12);
  EXPECT_EQ(FilamentLag().stats().rms_mm, 0.0);
}

}  // namespace
}  // namespace unflex::verify
