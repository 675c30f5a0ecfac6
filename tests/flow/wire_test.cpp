#include "wire.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace unflex::flow {
namespace {

compensate::AxisWindow some_window() {
  compensate::AxisWindow window;
  window.axis = {123.25, 0.0625};
  window.period_s = 0.75e-3;
  window.reference_mm = {1.0 / 3.0, -0.0, 5e-324, 1e300, -7.5};
  window.weight = {1.0, 0.1, 0.1, 1.0, 1.0};
  window.jerk_weight = 0.03;
  window.limits = {600.0, 20000.0, std::numeric_limits<double>::infinity(), -3.0, 253.0};
  return window;
}

void expect_same(const compensate::AxisWindow& a, const compensate::AxisWindow& b) {
  EXPECT_EQ(a.axis.main().omega_rad_s, b.axis.main().omega_rad_s);
  EXPECT_EQ(a.axis.main().zeta, b.axis.main().zeta);
  ASSERT_EQ(a.plants.size(), b.plants.size());
  for (std::size_t i = 0; i < a.plants.size(); ++i) {
    EXPECT_EQ(a.plants[i].axis.main().omega_rad_s, b.plants[i].axis.main().omega_rad_s);
    EXPECT_EQ(a.plants[i].axis.main().zeta, b.plants[i].axis.main().zeta);
    EXPECT_EQ(a.plants[i].share, b.plants[i].share);
  }
  EXPECT_EQ(a.period_s, b.period_s);
  EXPECT_EQ(a.reference_mm, b.reference_mm);
  EXPECT_EQ(a.weight, b.weight);
  EXPECT_EQ(a.aims_mm, b.aims_mm);
  EXPECT_EQ(a.jerk_weight, b.jerk_weight);
  EXPECT_EQ(a.limits.max_velocity_mm_s, b.limits.max_velocity_mm_s);
  EXPECT_EQ(a.limits.max_accel_mm_s2, b.limits.max_accel_mm_s2);
  EXPECT_EQ(a.limits.max_jerk_mm_s3, b.limits.max_jerk_mm_s3);
  EXPECT_EQ(a.limits.min_position_mm, b.limits.min_position_mm);
  EXPECT_EQ(a.limits.max_position_mm, b.limits.max_position_mm);
  ASSERT_EQ(a.start.has_value(), b.start.has_value());
  if (a.start) {
    EXPECT_EQ(a.start->nozzle.position(), b.start->nozzle.position());
    EXPECT_EQ(a.start->nozzle.velocity(), b.start->nozzle.velocity());
    EXPECT_EQ(a.start->base_mm, b.start->base_mm);
  }
  EXPECT_EQ(a.end_base_mm, b.end_base_mm);
}

TEST(Wire, BringsAWindowAcrossUnchanged) {
  compensate::AxisWindow window = some_window();
  expect_same(window, unpack_window(pack(window)));
  window.start = compensate::AxisWindow::Start{{2.5, -31.0}, 2.25};
  window.end_base_mm = -0.125;
  window.plants = {{{100.5, 0.03}, 0.25}, {{140.0, 0.3}, 0.125}};
  window.aims_mm = {{1.0, 2.0, 3.0, 4.0, 5.0}, {0.1, 0.2, 0.3, 0.4, 0.5}, {}};
  expect_same(window, unpack_window(pack(window)));
}

TEST(Wire, BringsASolutionAcrossUnchanged) {
  const compensate::AxisSolution solution{{{1.0, 2.0}, {-3.0, 4.0}, {5.0, 0.1}}, 1.5e-9, 42};
  const Result<compensate::AxisSolution> there =
      unpack_solution(pack(Result<compensate::AxisSolution>(solution)));
  ASSERT_TRUE(there.has_value());
  EXPECT_EQ(there->base.position_mm, solution.base.position_mm);
  EXPECT_EQ(there->base.velocity_mm_s, solution.base.velocity_mm_s);
  EXPECT_EQ(there->base.accel_mm_s2, solution.base.accel_mm_s2);
  EXPECT_EQ(there->objective, solution.objective);
  EXPECT_EQ(there->iterations, solution.iterations);
}

TEST(Wire, BringsAnErrorAcrossWithItsMessage) {
  const Result<compensate::AxisSolution> there = unpack_solution(
      pack(Result<compensate::AxisSolution>(fail(ErrorKind::internal, "infeasible; no way"))));
  ASSERT_FALSE(there.has_value());
  EXPECT_EQ(there.error().message, "infeasible; no way");
  EXPECT_EQ(there.error().kind, ErrorKind::internal);
}

}  // namespace
}  // namespace unflex::flow
