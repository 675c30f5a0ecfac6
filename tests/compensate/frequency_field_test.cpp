// Windows on a machine whose frequencies change over the bed.
#include "unflex/dynamics/frequency_field.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "playback.hpp"
#include "unflex/compensate/run.hpp"
#include "window_makers.hpp"

namespace unflex::compensate {
namespace {

using dynamics::FrequencyField;
using testing::largest_difference;

// 45 Hz at X = 0, and 40 Hz at X = 200 mm.
FrequencyField falling_along_x() {
  FrequencyField field;
  field.x = {{0.0, 200.0}, {1.0, 40.0 / 45.0}};
  return field;
}

struct Error {
  double max_um = 0.0;
  double rms_um = 0.0;
};

// How far the nozzle is from the plan in X while the base moves, by RK4 with the frequency of the
// base's place at each stage.
Error error_of(const std::vector<planner::PlannedMove>& moves, const Setup& setup,
               const dynamics::BaseTrajectory& base, const FrequencyField& field) {
  constexpr int kSteps = 10;
  const double h = base.period_s / kSteps;
  const double omega = setup.x.axis.main_rad_s();
  const double zeta = setup.x.axis.main_damping_ratio();
  double p = base.x.position_mm.front();
  double v = 0.0;
  Error error;
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t k = 0; k + 1 < base.nodes(); ++k) {
    for (int i = 0; i < kSteps; ++i) {
      const auto rate = [&](double t, double place, double velocity) {
        const dynamics::AxisMotion b = dynamics::between(base.x, k, t, base.period_s);
        const double w = omega * field.at({b.position_mm, 0.0});
        return 2.0 * zeta * w * (b.velocity_mm_s - velocity) + w * w * (b.position_mm - place);
      };
      const double t = i * h;
      const double v1 = v;
      const double a1 = rate(t, p, v1);
      const double v2 = v + 0.5 * h * a1;
      const double a2 = rate(t + 0.5 * h, p + 0.5 * h * v1, v2);
      const double v3 = v + 0.5 * h * a2;
      const double a3 = rate(t + 0.5 * h, p + 0.5 * h * v2, v3);
      const double v4 = v + h * a3;
      const double a4 = rate(t + h, p + h * v3, v4);
      p += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
      v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
      const double now_s = static_cast<double>(k) * base.period_s + (i + 1) * h;
      const double wanted = testing::plan_at(moves, std::max(now_s - setup.lead_in_s, 0.0))[0];
      error.max_um = std::max(error.max_um, 1e3 * std::abs(p - wanted));
      sum += 1e6 * (p - wanted) * (p - wanted);
      ++count;
    }
  }
  error.rms_um = std::sqrt(sum / static_cast<double>(count));
  return error;
}

dynamics::BaseTrajectory solved(const std::vector<planner::PlannedMove>& moves,
                                const Setup& setup) {
  const NodeGrid grid = node_grid(moves, setup);
  const std::vector<WindowSpan> spans = mesh(moves, grid, setup);
  auto of_run = windows(moves, spans, testing::at_rest(moves), setup);
  return solve_all(*make_banded_engine(), spans, of_run).value();
}

struct Motion {
  std::string name;
  std::vector<testing::Point> points;
  double speed_mm_s = 0.0;
  Error followed;  // on the windows with the frequencies of the place
  Error constant;  // on windows with 45 Hz throughout
};

class Along : public ::testing::TestWithParam<Motion> {};

// The figures of a prototype, within 30 %.
TEST_P(Along, FollowsTheFrequencyOfThePlace) {
  const Motion& motion = GetParam();
  const auto moves =
      testing::plan(motion.points, testing::planner_limits(motion.speed_mm_s, 5000.0, 5.0));
  compensate::Setup setup = testing::setup_for(dynamics::from_frequency(45.0, 0.06), 20000.0);
  setup.lead_in_s = 20e-3;
  setup.tail_s = 40e-3;
  setup.period_s = 5e-4;
  const FrequencyField field = falling_along_x();
  const Error ignored = error_of(moves, setup, solved(moves, setup), field);
  setup.x.field = field;
  const Error followed = error_of(moves, setup, solved(moves, setup), field);
  EXPECT_LT(followed.max_um, 1.3 * motion.followed.max_um);
  EXPECT_LT(followed.rms_um, 1.3 * motion.followed.rms_um);
  EXPECT_NEAR(ignored.max_um, motion.constant.max_um, 0.3 * motion.constant.max_um);
  EXPECT_NEAR(ignored.rms_um, motion.constant.rms_um, 0.3 * motion.constant.rms_um);
}

INSTANTIATE_TEST_SUITE_P(
    X, Along,
    ::testing::Values(
        Motion{"far", {{190, 0}, {200, 0}, {190, 0}}, 100.0, {0.73, 0.19}, {28.9, 12.3}},
        Motion{"near", {{0, 0}, {10, 0}, {0, 0}}, 100.0, {0.67, 0.17}, {1.23, 0.39}},
        Motion{"across", {{200, 0}, {120, 0}}, 200.0, {0.74, 0.11}, {30.3, 8.07}}),
    [](const auto& of_motion) { return of_motion.param.name; });

// Shares that fall by a tenth over the window, and swing a little.
std::vector<double> falling_shares(std::size_t samples) {
  std::vector<double> shares;
  for (std::size_t i = 0; i < samples; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(samples - 1);
    shares.push_back(1.03 - 0.1 * part + 0.01 * std::sin(9.0 * part));
  }
  return shares;
}

TEST(FrequencyShares, GiveTheSameBaseByIpoptAndByStages) {
  std::mt19937_64 random(66);
  const auto engine = make_banded_engine();
  for (int i = 0; i < 4; ++i) {
    AxisWindow window = testing::random_path(random, 160, {});
    window.freq_shares = falling_shares(window.reference_mm.size());
    if (i % 2 == 1) {
      window.limits.max_accel_mm_s2 = 6500.0;
    }
    const auto stages = engine->solve(window);
    ASSERT_TRUE(stages.has_value()) << stages.error().message;
    ActiveLimits active;
    active.accel = i % 2 == 1;
    const auto ipopt = testing::solve_by_ipopt(window, active, 1e-10);
    ASSERT_TRUE(ipopt.has_value()) << ipopt.error().message;
    EXPECT_LT(largest_difference(stages->base.position_mm, ipopt->base.position_mm), 2e-5) << i;
  }
}

// A window of equal shares is the window of an axis with those frequencies, whose form is another.
TEST(FrequencyShares, AreThoseOfADetunedAxisWhereTheyAreEqual) {
  std::mt19937_64 random(67);
  const auto engine = make_banded_engine();
  for (const double share : {0.9, 1.0, 1.07}) {
    AxisWindow window = testing::random_path(random, 300, {});
    AxisWindow detuned = window;
    detuned.axis = window.axis.detuned(share);
    window.freq_shares.assign(window.reference_mm.size(), share);
    const auto by_shares = engine->solve(window);
    const auto by_axis = engine->solve(detuned);
    ASSERT_TRUE(by_shares && by_axis);
    // Shares are met within 0.01 %.
    EXPECT_LT(largest_difference(by_shares->base.position_mm, by_axis->base.position_mm), 3e-5)
        << share;
  }
}

TEST(Windows, TakeTheMeanOfAFieldThatHardlyChanges) {
  const auto moves = testing::plan({{100, 0}, {102, 0}}, testing::planner_limits(100, 5000, 5));
  compensate::Setup setup = testing::setup_for(dynamics::from_frequency(45.0, 0.06), 20000.0);
  setup.x.field = falling_along_x();
  const AxisWindow window = testing::x_window(moves, setup);
  EXPECT_TRUE(window.freq_shares.empty());
  EXPECT_NEAR(window.axis.main_hz(), 45.0 - 5.0 * 101.0 / 200.0, 1e-9);
}

TEST(Windows, TakeTheFrequencyOfThePlaceAtEachSample) {
  const auto moves = testing::plan({{0, 50}, {100, 50}}, testing::planner_limits(100, 5000, 5));
  compensate::Setup setup = testing::setup_for(dynamics::from_frequency(45.0, 0.06), 20000.0);
  setup.x.field = falling_along_x();
  setup.x.field.y = {{0.0, 100.0}, {1.0, 1.2}};
  const AxisWindow window = testing::x_window(moves, setup);
  ASSERT_EQ(window.freq_shares.size(), window.reference_mm.size());
  for (std::size_t i = 0; i < window.freq_shares.size(); ++i) {
    EXPECT_NEAR(window.freq_shares[i], 1.1 * (1.0 - window.reference_mm[i] / 1800.0), 1e-12);
  }
}

}  // namespace
}  // namespace unflex::compensate
