#include "smoothed_filament.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace unflex::emit {
namespace {

constexpr double kSmooth_s = 0.006;
constexpr double kFree = std::numeric_limits<double>::infinity();
constexpr SmoothingExtruder kFreely{.smooth_s = kSmooth_s};

// E of knots that are joined by straight lines, smoothed by Klipper's triangle: a plain sum.
double smoothed_mm(const std::vector<double>& times_s, const std::vector<double>& e_mm,
                   double smooth_s, double at_s) {
  const auto line_mm = [&](double t) {
    const auto after = std::clamp<std::ptrdiff_t>(
        std::upper_bound(times_s.begin(), times_s.end(), t) - times_s.begin(), 1,
        std::ssize(times_s) - 1);
    const auto k = static_cast<std::size_t>(after);
    const double share = (t - times_s[k - 1]) / (times_s[k] - times_s[k - 1]);
    return e_mm[k - 1] + share * (e_mm[k] - e_mm[k - 1]);
  };
  constexpr int kParts = 400;
  const double half_s = 0.5 * smooth_s;
  double sum = 0.0;
  for (int i = 0; i < kParts; ++i) {
    const double away_s = half_s * ((2.0 * i + 1.0) / kParts - 1.0);
    sum += (1.0 - std::abs(away_s) / half_s) * line_mm(at_s + away_s);
  }
  return sum * 2.0 / kParts;
}

LinesInTime lines_of(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> duration_s(0.0015, 0.006);
  constexpr double kSpeed_mm_s = 60.0;
  LinesInTime lines{.times_s = {0.0}, .lengths_mm = {}};
  for (std::size_t i = 0; i < count; ++i) {
    const double one_s = duration_s(random);
    lines.times_s.push_back(lines.times_s.back() + one_s);
    lines.lengths_mm.push_back(kSpeed_mm_s * one_s);
  }
  return lines;
}

// A flow that rises and falls with the corners of a wall.
double wall_mm(double t) {
  constexpr double kOften = 2.0 * std::numbers::pi * 25.0;
  return 3.0 * t - 1.5 / kOften * std::sin(kOften * t);
}

double error_mm(const LinesInTime& lines, const std::vector<double>& e_mm) {
  double sum = 0.0;
  int count = 0;
  for (double t = 0.02; t < lines.times_s.back() - 0.02; t += 3.7e-4) {
    sum += std::pow(smoothed_mm(lines.times_s, e_mm, kSmooth_s, t) - wall_mm(t), 2);
    ++count;
  }
  return std::sqrt(sum / count);
}

TEST(SmoothedFilament, ComesNearerThanWhatIsWanted) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const LinesInTime lines = lines_of(60, seed);
    std::vector<double> wanted;
    for (const double t : lines.times_s) {
      wanted.push_back(wall_mm(t));
    }
    const std::vector<double> e_mm = filament_to_smooth(lines, kFreely, wall_mm);
    ASSERT_EQ(e_mm.size(), wanted.size());
    EXPECT_EQ(e_mm.front(), wanted.front());
    EXPECT_EQ(e_mm.back(), wanted.back());
    const double fitted_mm = error_mm(lines, e_mm);
    EXPECT_LT(fitted_mm, 0.3 * error_mm(lines, wanted)) << seed;
    // No knot can be moved for the better.
    std::mt19937 random(seed);
    std::uniform_int_distribution<std::size_t> any(8, 50);
    for (int i = 0; i < 5; ++i) {
      for (const double by_mm : {-2e-4, 2e-4}) {
        std::vector<double> other = e_mm;
        other[any(random)] += by_mm;
        EXPECT_GT(error_mm(lines, other), fitted_mm);
      }
    }
  }
}

TEST(SmoothedFilament, LeavesEvenFlowAsItIs) {
  const LinesInTime lines = lines_of(30, 5);
  const std::vector<double> e_mm =
      filament_to_smooth(lines, kFreely, [](double t) { return 2.0 * t; });
  for (std::size_t k = 0; k < e_mm.size(); ++k) {
    EXPECT_NEAR(e_mm[k], 2.0 * lines.times_s[k], 1e-12);
  }
}

// Travel between two lines of plastic stays without filament, and no line draws any back.
TEST(SmoothedFilament, MovesNoFilamentIntoTravel) {
  const LinesInTime lines = lines_of(60, 9);
  const double from_s = lines.times_s[20];
  const double to_s = lines.times_s[33];
  const auto laid_mm = [&](double t) {
    return 4.0 * (std::min(t, from_s) + std::max(t - to_s, 0.0));
  };
  const std::vector<double> e_mm = filament_to_smooth(lines, kFreely, laid_mm);
  for (std::size_t k = 20; k <= 33; ++k) {
    EXPECT_EQ(e_mm[k], laid_mm(lines.times_s[k]));
  }
  EXPECT_TRUE(std::ranges::is_sorted(e_mm));
}

// By how much the changes of the flow where lines join exceed `most`, in total, mm/s.
double excess_mm_s(const LinesInTime& lines, const std::vector<double>& e_mm, double most_mm_s) {
  const auto flow_mm_s = [&](std::size_t k) {
    return (e_mm[k + 1] - e_mm[k]) / (lines.times_s[k + 1] - lines.times_s[k]);
  };
  double sum_mm_s = 0.0;
  for (std::size_t k = 0; k + 2 < e_mm.size(); ++k) {
    sum_mm_s += std::max(std::abs(flow_mm_s(k + 1) - flow_mm_s(k)) - most_mm_s, 0.0);
  }
  return sum_mm_s;
}

// All lines are of one speed, so it is the steps of the flow that the limit is about.
TEST(SmoothedFilament, KeepsTheStepOfTheFlow) {
  constexpr double kMost_mm_s = 1.0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const LinesInTime lines = lines_of(60, seed);
    const std::vector<double> free = filament_to_smooth(lines, kFreely, wall_mm);
    const std::vector<double> e_mm =
        filament_to_smooth(lines, {.smooth_s = kSmooth_s, .most_step_mm_s = kMost_mm_s}, wall_mm);
    EXPECT_LT(excess_mm_s(lines, e_mm, kMost_mm_s), 0.1 * excess_mm_s(lines, free, kMost_mm_s));
    EXPECT_LT(error_mm(lines, e_mm), 3.0 * error_mm(lines, free)) << seed;
  }
}

// The largest mean acceleration over 4 ms of what Klipper pushes, S(E + K Ė), by differences.
double largest_accel_mm_s2(const LinesInTime& lines, const std::vector<double>& e_mm,
                           const SmoothingExtruder& extruder) {
  constexpr double kStep_s = 2e-4;
  constexpr double kOver_s = 4e-3;
  const auto smooth_mm = [&](double t) {
    return smoothed_mm(lines.times_s, e_mm, extruder.smooth_s, t);
  };
  const auto pushed_mm = [&](double t) {
    return smooth_mm(t) +
           extruder.advance_s * (smooth_mm(t + kStep_s) - smooth_mm(t - kStep_s)) / (2.0 * kStep_s);
  };
  const auto speed_mm_s = [&](double t) {
    return (pushed_mm(t + kStep_s) - pushed_mm(t - kStep_s)) / (2.0 * kStep_s);
  };
  double largest = 0.0;
  for (double t = 0.02; t < lines.times_s.back() - 0.02; t += 7e-4) {
    largest = std::max(
        largest, std::abs(speed_mm_s(t + 0.5 * kOver_s) - speed_mm_s(t - 0.5 * kOver_s)) / kOver_s);
  }
  return largest;
}

TEST(SmoothedFilament, AsksForNoMoreAccelerationThanTheExtruderHas) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const LinesInTime lines = lines_of(60, seed);
    SmoothingExtruder extruder{.advance_s = 0.4, .smooth_s = 2.0 * kSmooth_s};
    const double free_mm_s2 =
        largest_accel_mm_s2(lines, filament_to_smooth(lines, extruder, wall_mm), extruder);
    double last_mm = error_mm(lines, filament_to_smooth(lines, extruder, wall_mm));
    for (const double share : {0.6, 0.3}) {
      extruder.most_accel_mm_s2 = share * free_mm_s2;
      const std::vector<double> e_mm = filament_to_smooth(lines, extruder, wall_mm);
      EXPECT_LT(largest_accel_mm_s2(lines, e_mm, extruder), 1.1 * share * free_mm_s2) << seed;
      // The tighter the limit, the less of the flow's changes is left.
      EXPECT_GT(error_mm(lines, e_mm), 0.999 * last_mm) << seed;
      last_mm = error_mm(lines, e_mm);
    }
  }
}

// Limits that E keeps by itself change nothing.
TEST(SmoothedFilament, TakesNoNoticeOfLimitsThatItKeeps) {
  const LinesInTime lines = lines_of(60, 4);
  const std::vector<double> free = filament_to_smooth(lines, kFreely, wall_mm);
  const std::vector<double> bounded = filament_to_smooth(
      lines, {.advance_s = 0.4, .smooth_s = kSmooth_s, .most_accel_mm_s2 = 1e7}, wall_mm);
  EXPECT_EQ(bounded, free);
}

// Also where smoothing reaches over three times as many lines as elsewhere.
TEST(SmoothedFilament, FitsShortLines) {
  LinesInTime lines{.times_s = {0.0}, .lengths_mm = {}};
  for (int i = 0; i < 300; ++i) {
    lines.times_s.push_back(lines.times_s.back() + 5e-4);
    lines.lengths_mm.push_back(0.03);
  }
  const SmoothingExtruder extruder{.advance_s = 0.4, .smooth_s = 0.012};
  const auto error_of = [&](const std::vector<double>& e_mm) {
    double sum = 0.0;
    for (double t = 0.03; t < lines.times_s.back() - 0.03; t += 3.7e-4) {
      sum += std::pow(smoothed_mm(lines.times_s, e_mm, extruder.smooth_s, t) - wall_mm(t), 2);
    }
    return std::sqrt(sum);
  };
  std::vector<double> wanted;
  for (const double t : lines.times_s) {
    wanted.push_back(wall_mm(t));
  }
  EXPECT_LT(error_of(filament_to_smooth(lines, extruder, wall_mm)), 0.2 * error_of(wanted));
}

// A smooth time of far more lines than there is room for leaves E as it is wanted.
TEST(SmoothedFilament, LeavesLinesThatAreTooShortForTheSmoothTime) {
  const LinesInTime lines = lines_of(60, 4);
  const std::vector<double> e_mm = filament_to_smooth(lines, {.smooth_s = 0.2}, wall_mm);
  for (std::size_t k = 0; k < e_mm.size(); ++k) {
    EXPECT_EQ(e_mm[k], wall_mm(lines.times_s[k]));
  }
}

TEST(SmoothedFilament, HoldsForFewLines) {
  for (const std::size_t count : {1, 2, 3}) {
    const LinesInTime lines = lines_of(count, 3);
    const std::vector<double> e_mm = filament_to_smooth(lines, kFreely, wall_mm);
    EXPECT_EQ(e_mm.size(), count + 1);
    EXPECT_EQ(e_mm.back(), wall_mm(lines.times_s.back()));
  }
}

}  // namespace
}  // namespace unflex::emit
