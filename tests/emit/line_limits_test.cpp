// The height of lines, and their changes of speed.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "drawn_path.hpp"
#include "plain_base.hpp"
#include "strokes.hpp"

namespace unflex::emit {
namespace {

using gcode::Z;
using testing::kPeriod_s;
using testing::options;
using testing::Path;
using testing::random_path;

std::array<double, 2> velocity_mm_s(const Stroke& from, const Stroke& to) {
  const double duration_s = to.end_s - from.end_s;
  return {(to.place_mm.x - from.place_mm.x) / duration_s,
          (to.place_mm.y - from.place_mm.y) / duration_s};
}

TEST(Strokes, CarryTheHeightOfASpiral) {
  std::vector<gcode::Position> points;
  for (int i = 0; i <= 200; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 100.0;
    points.push_back({100.0 + 20.0 * std::cos(angle), 100.0 + 20.0 * std::sin(angle),
                      0.2 + 0.003 * i, 0.05 * i});
  }
  const Path path(points);
  const std::vector<Stroke> drawn = path.draw(testing::plan_as_base(path.moves));
  double start = 0.0;
  std::size_t i = 0;
  for (const Stroke& stroke : drawn) {
    while (i + 1 < path.moves.size() && stroke.end_s > start + path.moves[i].duration_s()) {
      start += path.moves[i++].duration_s();
    }
    EXPECT_NEAR(stroke.z_mm, path.moves[i].position_mm(stroke.end_s - start)[Z], 0.51e-4);
  }
  EXPECT_EQ(drawn.back().z_mm, points.back()[Z]);
  EXPECT_GT(drawn.size(), 200U);
}

// Klipper gives a line with a change of Z its own acceleration. This may be so low that a short
// line at a sharp bend takes longer than planned. Such a line must not change Z; the next ones do.
TEST(Strokes, ClimbWhereThatCostsNoTime) {
  std::vector<gcode::Position> points;
  for (int i = 0; i <= 60; ++i) {
    points.push_back({100.0 + 0.5 * i, 100.0 + (i % 2), 0.2 + 0.004 * i, 0.05 * i});
  }
  const Path path(points, 20.0);
  EmitOptions how = options();
  how.fixed.max_z_accel_mm_s2 = 100.0;
  how.fixed.max_z_velocity_mm_s = 15.0;
  const std::vector<Stroke> drawn = path.draw(testing::plan_as_base(path.moves), how);
  Stroke from{0.0, 100.0, 100.0, 0.2};
  std::array<double, 2> before{};
  int level = 0;
  for (const Stroke& to : drawn) {
    const double duration_s = to.end_s - from.end_s;
    const std::array<double, 2> v = velocity_mm_s(from, to);
    const double dz = std::abs(to.z_mm - from.z_mm);
    if (dz > 1e-9) {
      const double accel = 100.0 * std::hypot(v[0], v[1]) * duration_s / dz;
      EXPECT_LE(std::hypot(v[0] - before[0], v[1] - before[1]) / accel, 0.05 * duration_s)
          << to.end_s;
    } else {
      ++level;
    }
    EXPECT_NEAR(to.z_mm, 0.2 + 0.004 * (to.place_mm.x - 100.0) / 0.5, 0.02);
    before = v;
    from = to;
  }
  EXPECT_EQ(drawn.back().z_mm, points.back()[Z]);
  EXPECT_GT(level, 0) << "the case shows nothing";
}

// The limit holds however hard the base works, and wherever filament per millimetre changes.
TEST(Strokes, ChangeSpeedByNoMoreThanIsAllowedAnywhere) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const Path path = random_path(seed, 12);
    const auto nodes = static_cast<std::size_t>(planner::duration_s(path.moves) / kPeriod_s);
    const dynamics::BaseTrajectory base = testing::bang_bang(seed, 26000.0, nodes / 2 + 2);
    std::array<double, 2> before{};
    Stroke from{0.0, base.x.position_mm.front(), base.y.position_mm.front()};
    for (const Stroke& to : path.draw(base)) {
      const std::array<double, 2> v = velocity_mm_s(from, to);
      // Skip both ends: the run of this test begins and ends elsewhere than its base.
      if (from.end_s > 0.0 && before != std::array<double, 2>{} &&
          to.end_s < base.duration_s() - 2e-3) {
        EXPECT_LE(std::abs(v[0] - before[0]), 30.5) << seed << ' ' << to.end_s;
        EXPECT_LE(std::abs(v[1] - before[1]), 30.5) << seed << ' ' << to.end_s;
      }
      before = from.end_s > 0.0 ? v : std::array<double, 2>{};
      from = to;
    }
  }
}

}  // namespace
}  // namespace unflex::emit
