#include "vertices.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "plain_base.hpp"

namespace unflex::emit {
namespace {

constexpr double kNode_s = testing::kPeriod_s;
constexpr double kGrid_mm = 1e-4;

// The bound with a margin for the splitting method and the rounding to the grid.
double nearly(double bound_mm_s) { return bound_mm_s + 0.7; }

// A base from rest to rest. Its acceleration is a random sum of sines under a window, scaled to the
// given largest value.
dynamics::BaseTrajectory random_base(unsigned seed, double max_accel_mm_s2) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  constexpr std::size_t kNodes = 401;
  constexpr int kWaves = 12;
  std::vector<double> accel(kNodes, 0.0);
  for (int wave = 1; wave <= kWaves; ++wave) {
    const double size = uniform(random);
    const double phase = std::numbers::pi * uniform(random);
    for (std::size_t k = 0; k < kNodes; ++k) {
      const double s = static_cast<double>(k) / (kNodes - 1);
      const double window = std::sin(std::numbers::pi * s);
      accel[k] += size * window * window * std::sin(2.0 * std::numbers::pi * wave * s + phase);
    }
  }
  // Subtract the part that would leave the base in motion.
  double sum = 0.0;
  double windows = 0.0;
  for (std::size_t k = 0; k < kNodes; ++k) {
    sum += accel[k];
    windows += std::sin(std::numbers::pi * static_cast<double>(k) / (kNodes - 1));
  }
  double largest = 0.0;
  for (std::size_t k = 0; k < kNodes; ++k) {
    accel[k] -= sum / windows * std::sin(std::numbers::pi * static_cast<double>(k) / (kNodes - 1));
    largest = std::max(largest, std::abs(accel[k]));
  }
  for (double& a : accel) {
    a *= max_accel_mm_s2 / largest;
  }
  dynamics::BaseTrajectory base;
  base.period_s = kNode_s;
  base.x = testing::accelerated(std::move(accel));
  base.y = base.x;
  return base;
}

struct Measured {
  double largest_step_mm_s = 0.0;
  double rms_um = 0.0;
};

class Vertices : public ::testing::TestWithParam<unsigned> {
 protected:
  [[nodiscard]] Measured measure(const std::vector<double>& times, const SpeedSteps& most,
                                 const Ends& ends = {}) const {
    const AxisVertices chosen =
        VertexChooser(base_, 0, nozzle_).choose(times, {0.0, kGrid_mm}, {}, most, ends);
    Measured result;
    double last = ends.from_rest ? 0.0 : base_.x.velocity_mm_s.front();
    double square = 0.0;
    for (std::size_t k = 1; k < times.size(); ++k) {
      const double v =
          (chosen.position_mm[k] - chosen.position_mm[k - 1]) / (times[k] - times[k - 1]);
      result.largest_step_mm_s = std::max(result.largest_step_mm_s, std::abs(v - last));
      last = v;
      square += chosen.nozzle_error_mm[k] * chosen.nozzle_error_mm[k];
      if (k + 1 < times.size()) {
        EXPECT_NEAR(std::remainder(chosen.position_mm[k], kGrid_mm), 0.0, 1e-9);
      }
    }
    if (ends.to_rest) {
      // The last line comes to rest within half of its own time, as at any join.
      result.largest_step_mm_s = std::max(result.largest_step_mm_s, std::abs(last));
    }
    result.rms_um = 1e3 * std::sqrt(square / static_cast<double>(times.size() - 1));
    return result;
  }

  // Lines of one to one and a half node periods.
  [[nodiscard]] std::vector<double> short_lines() const {
    std::mt19937 random(GetParam() + 1000U);
    std::uniform_real_distribution<double> length(1.0, 1.5);
    std::vector<double> times = {0.0};
    while (times.back() + 3.0 * kNode_s < base_.duration_s()) {
      times.push_back(times.back() + kNode_s * length(random));
    }
    times.push_back(base_.duration_s());
    return times;
  }

  dynamics::FlexibleAxis nozzle_ = dynamics::from_frequency(45.0, 0.06);
  dynamics::BaseTrajectory base_ = random_base(GetParam(), 18000.0);
};

// A base of 18000 mm/s² needs 27 mm/s with lines of 1.5 ms, so the bound of 28.5 hardly exceeds its
// need.
TEST_P(Vertices, ChangeSpeedByNoMoreThanIsAllowed) {
  const std::vector<double> times = short_lines();
  const Measured free = measure(times, {});
  const Measured bound = measure(times, {28.5, 1e9});
  EXPECT_LE(bound.largest_step_mm_s, nearly(28.5));
  // The bound costs accuracy only where it cuts something.
  EXPECT_LE(bound.rms_um, 1.5 * free.rms_um + 0.02);
}

// This base needs the whole bound nearly everywhere, so little is left to correct rounding errors.
// An error at one place must not grow at the next. The last line must come to rest within the bound
// as well.
TEST_P(Vertices, FollowABaseThatNeedsAllThatIsAllowed) {
  base_ = testing::bang_bang(GetParam(), 28400.0, 150);
  std::vector<double> times;
  for (std::size_t k = 0; k < base_.nodes(); ++k) {
    times.push_back(static_cast<double>(k) * kNode_s);
  }
  const Measured free = measure(times, {});
  const Measured bound = measure(times, {28.5, 40000.0});
  EXPECT_LE(bound.largest_step_mm_s, nearly(28.5));
  EXPECT_LE(bound.rms_um, 1.5 * free.rms_um + 1.0);
}

TEST_P(Vertices, KeepTheAccelerationBetweenTheMiddlesOfLines) {
  const std::vector<double> times = short_lines();
  const AxisVertices chosen =
      VertexChooser(base_, 0, nozzle_).choose(times, {0.0, kGrid_mm}, {}, {1e9, 19500.0});
  for (std::size_t k = 2; k < times.size(); ++k) {
    const double before_s = times[k - 1] - times[k - 2];
    const double after_s = times[k] - times[k - 1];
    const double step = (chosen.position_mm[k] - chosen.position_mm[k - 1]) / after_s -
                        (chosen.position_mm[k - 1] - chosen.position_mm[k - 2]) / before_s;
    EXPECT_LE(std::abs(step), nearly(19500.0 * 0.5 * (before_s + after_s))) << k;
  }
}

// Where a part continues another one, each of the two gets half of the change of speed.
TEST_P(Vertices, TakeHalfOfTheChangeWhereOthersGoOn) {
  dynamics::BaseTrajectory moving = base_;
  constexpr std::size_t kFirst = 120;
  for (auto* values : {&moving.x.position_mm, &moving.x.velocity_mm_s, &moving.x.accel_mm_s2}) {
    values->erase(values->begin(), values->begin() + kFirst);
  }
  moving.y = moving.x;
  base_ = moving;
  const AxisVertices chosen =
      VertexChooser(base_, 0, nozzle_)
          .choose(short_lines(), {0.0, kGrid_mm}, {}, {28.5, 1e9}, {false, true});
  const double first = (chosen.position_mm[1] - chosen.position_mm[0]) / short_lines()[1];
  EXPECT_LE(std::abs(first - moving.x.velocity_mm_s.front()), nearly(0.5 * 28.5));
}

TEST_P(Vertices, StayWithinReach) {
  const std::vector<double>& x = base_.x.position_mm;
  const Reach reach{*std::ranges::min_element(x) + 1.0, *std::ranges::max_element(x) + 1e-3};
  const AxisVertices chosen =
      VertexChooser(base_, 0, nozzle_).choose(short_lines(), {0.0, kGrid_mm}, reach, {28.5, 1e9});
  for (const double at : chosen.position_mm) {
    EXPECT_GE(at, *std::ranges::min_element(x) - kGrid_mm) << "the base's own reach counts";
    EXPECT_LE(at, reach.max_mm + kGrid_mm);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Vertices, ::testing::Range(1U, 9U));

}  // namespace
}  // namespace unflex::emit
