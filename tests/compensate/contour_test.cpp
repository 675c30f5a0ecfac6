// Windows whose nozzle may be early or late on its path.
#include "contour.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "playback.hpp"

namespace unflex::compensate {
namespace {

using testing::planner_limits;
using testing::setup_for;

const dynamics::FlexibleAxis kAxis = dynamics::from_frequency(45.0, 0.06);

compensate::Setup robust(double freq_error) {
  compensate::Setup setup = setup_for(kAxis, 2e4);
  for (AxisSetup* axis : {&setup.x, &setup.y}) {
    axis->plants = {{kAxis.detuned(1.0 - freq_error), 1.0 / 3.0},
                    {kAxis.detuned(1.0 + freq_error), 1.0 / 3.0}};
  }
  return setup;
}

Setup with_contour(compensate::Setup setup) {
  setup.jerk_weight = 15.0;
  setup.contour = Contour{.pairs = pairs_of(setup)};
  return setup;
}

struct Path {
  std::vector<double> x_mm;
  std::vector<double> y_mm;
};

// The nozzle, each axis detuned by a factor, on the base of a run solved as one window.
Path nozzle_path(const std::vector<planner::PlannedMove>& moves, const Setup& setup,
                 double x_factor, double y_factor) {
  const std::size_t nodes = node_grid(moves, setup).count;
  const WindowSpan span{0, nodes - 1, 0, nodes - 1};
  RunWindow window = windows(moves, {span}, testing::at_rest(moves), setup).front();
  const Axes<Result<AxisSolution>> solved = solve(*make_banded_engine(), span, window);
  const auto& [x, y] = solved;
  const auto place = [&](const Result<AxisSolution>& solution, double factor) {
    std::vector<double> places;
    const dynamics::FlexibleAxis axis = kAxis.detuned(factor);
    for (const dynamics::NozzleState& state :
         testing::play(axis, solution->base, setup.period_s,
                       axis.riding(solution->base.position_mm.front()))) {
      places.push_back(state.position());
    }
    return places;
  };
  return {place(x, x_factor), place(y, y_factor)};
}

// RMS of the distance from a polyline, looked for all over it.
double rms_mm(const Path& path, const std::vector<testing::Point>& line) {
  double sum = 0.0;
  for (std::size_t i = 0; i < path.x_mm.size(); ++i) {
    double least = 1e9;
    for (std::size_t k = 0; k + 1 < line.size(); ++k) {
      const double dx = line[k + 1].x_mm - line[k].x_mm;
      const double dy = line[k + 1].y_mm - line[k].y_mm;
      const double s =
          std::clamp(((path.x_mm[i] - line[k].x_mm) * dx + (path.y_mm[i] - line[k].y_mm) * dy) /
                         (dx * dx + dy * dy),
                     0.0, 1.0);
      least = std::min(least, std::hypot(line[k].x_mm + s * dx - path.x_mm[i],
                                         line[k].y_mm + s * dy - path.y_mm[i]));
    }
    sum += least * least;
  }
  return std::sqrt(sum / static_cast<double>(path.x_mm.size()));
}

// How far the nozzle's path stays from a point.
double distance_mm(const Path& path, double x_mm, double y_mm) {
  double least = 1e9;
  for (std::size_t i = 0; i < path.x_mm.size(); ++i) {
    least = std::min(least, std::hypot(path.x_mm[i] - x_mm, path.y_mm[i] - y_mm));
  }
  return least;
}

const std::vector<testing::Point> kCorners = {{0.0, 0.0},   {30.0, 0.0}, {30.0, 20.0},
                                              {10.0, 35.0}, {0.0, 20.0}, {12.0, 8.0}};

std::vector<planner::PlannedMove> corners() {
  return testing::plan(kCorners, planner_limits(150.0, 5000.0, 5.0));
}

TEST(Pairs, GiveEachModelItsShare) {
  compensate::Setup setup = robust(0.1);
  setup.y.plants = {{kAxis.detuned(0.8), 0.1}, {kAxis.detuned(1.3), 0.25}, {kAxis, 0.15}};
  const std::vector<ModelPair> pairs = pairs_of(setup);
  std::map<std::size_t, double> x;
  std::map<std::size_t, double> y;
  for (const ModelPair& pair : pairs) {
    EXPECT_GT(pair.share, 0.0);
    x[pair.x] += pair.share;
    y[pair.y] += pair.share;
  }
  for (const auto& [model, share] : x) {
    EXPECT_NEAR(share, 1.0 / 3.0, 1e-9) << model;
  }
  const std::vector<double> shares = {0.5, 0.1, 0.25, 0.15};
  for (std::size_t model = 0; model < shares.size(); ++model) {
    EXPECT_NEAR(y[model], shares[model], 1e-9) << model;
  }
}

TEST(Pairs, HoldBothAxesOffTheSameWayMoreOftenThanOppositeWays) {
  const compensate::Setup setup = robust(0.1);
  double same = 0.0;
  double opposite = 0.0;
  for (const ModelPair& pair : pairs_of(setup)) {
    (pair.x == pair.y ? same : opposite) += pair.x > 0 && pair.y > 0 ? pair.share : 0.0;
  }
  EXPECT_NEAR(same, 0.7 * 2.0 / 3.0, 1e-9);
  EXPECT_NEAR(opposite, 0.3 * 2.0 / 3.0, 1e-9);
}

// With one model the pair is alone.
TEST(Pairs, OfAxesThatAreKnownAreOne) {
  const compensate::Setup setup = setup_for(kAxis, 2e4);
  const std::vector<ModelPair> pairs = pairs_of(setup);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_DOUBLE_EQ(pairs[0].share, 1.0);
}

TEST(ContourWindow, StraysFromThePathFarLessWhereTheFrequencyIsOff) {
  const auto moves = corners();
  const compensate::Setup tracking = robust(0.1);
  const compensate::Setup contour = with_contour(tracking);
  for (const double factor : {0.9, 0.95, 1.0, 1.05, 1.1}) {
    const double before = rms_mm(nozzle_path(moves, tracking, factor, factor), kCorners);
    const double after = rms_mm(nozzle_path(moves, contour, factor, factor), kCorners);
    EXPECT_LT(after, 0.7 * before) << factor;
  }
}

TEST(ContourWindow, DoesNotCutCorners) {
  const auto moves = corners();
  compensate::Setup setup = with_contour(robust(0.1));
  const auto worst = [&](const compensate::Setup& of) {
    const Path path = nozzle_path(moves, of, 1.0, 1.0);
    double most = 0.0;
    for (std::size_t k = 1; k + 1 < kCorners.size(); ++k) {
      most = std::max(most, distance_mm(path, kCorners[k].x_mm, kCorners[k].y_mm));
    }
    return most;
  };
  const double held = worst(setup);
  setup.contour->corner_weight = 0.0;
  const double cut = worst(setup);
  EXPECT_LT(held, 0.012);
  EXPECT_LT(held, 0.6 * cut);
}

// Where nothing is uncertain and both directions weigh the same, it is the window without contour.
TEST(ContourWindow, IsTheTrackingWindowIfAlongWeighsAsMuchAsMuchMore) {
  const auto moves = corners();
  compensate::Setup setup = setup_for(kAxis, 2e4);
  const Path tracking = nozzle_path(moves, setup, 1.0, 1.0);
  setup.contour = Contour{.along_weight = 1e6, .corner_weight = 0.0};
  setup.jerk_weight *= 1e6;
  const Path heavy = nozzle_path(moves, setup, 1.0, 1.0);
  for (std::size_t i = 0; i < tracking.x_mm.size(); i += 50) {
    EXPECT_NEAR(heavy.x_mm[i], tracking.x_mm[i], 1e-5);
    EXPECT_NEAR(heavy.y_mm[i], tracking.y_mm[i], 1e-5);
  }
}

TEST(ContourWindow, TakesAModelWithoutAnyShare) {
  const auto moves = corners();
  compensate::Setup setup = robust(0.1);
  setup.x.plants.push_back({kAxis.detuned(1.2), 0.0});
  const Path path = nozzle_path(moves, with_contour(setup), 1.0, 1.0);
  const Path without = nozzle_path(moves, with_contour(robust(0.1)), 1.0, 1.0);
  for (std::size_t i = 0; i < path.x_mm.size(); i += 50) {
    EXPECT_NEAR(path.x_mm[i], without.x_mm[i], 1e-5);
  }
}

// The rounds end with a solution without limits. Where it keeps the limits, the engine need not
// solve the window again; where it does not, the engine must.
TEST(ContourWindow, HasTheEnginesSolutionWithAndWithoutActiveLimits) {
  const std::vector<planner::PlannedMove> moves = corners();
  for (const double limit_mm_s2 : {5e4, 4000.0}) {
    compensate::Setup setup = with_contour(robust(0.1));
    setup.x.limits.max_accel_mm_s2 = setup.y.limits.max_accel_mm_s2 = limit_mm_s2;
    const std::size_t nodes = node_grid(moves, setup).count;
    const WindowSpan span{0, nodes - 1, 0, nodes - 1};
    RunWindow window = windows(moves, {span}, testing::at_rest(moves), setup).front();
    const auto engine = make_banded_engine();
    const auto solved = solve(*engine, span, window);
    double fastest_mm_s2 = 0.0;
    for (const auto& [axis, solution] :
         {std::pair(&window.x, &solved[0]), std::pair(&window.y, &solved[1])}) {
      const Result<AxisSolution> by_engine = engine->solve(*axis);
      ASSERT_TRUE(*solution && by_engine);
      for (std::size_t k = 0; k < nodes; ++k) {
        EXPECT_NEAR((*solution)->base.position_mm[k], by_engine->base.position_mm[k], 1e-6);
        fastest_mm_s2 = std::max(fastest_mm_s2, std::abs((*solution)->base.accel_mm_s2[k]));
      }
      EXPECT_NEAR((*solution)->objective, by_engine->objective, 1e-7 * by_engine->objective);
    }
    EXPECT_LE(fastest_mm_s2, limit_mm_s2 * (1.0 + 1e-6));
    EXPECT_GT(fastest_mm_s2, 3990.0);
  }
}

TEST(ContourWindow, IsAProblemOfEachAxisThatBothEnginesSolveAlike) {
  const auto moves =
      testing::plan({{0.0, 0.0}, {6.0, 0.0}, {6.0, 4.0}}, planner_limits(100.0, 5000.0, 5.0));
  const compensate::Setup setup = with_contour(robust(0.1));
  const std::size_t nodes = node_grid(moves, setup).count;
  const WindowSpan span{0, nodes - 1, 0, nodes - 1};
  RunWindow window = windows(moves, {span}, testing::at_rest(moves), setup).front();
  const Axes<Result<AxisSolution>> solved = solve(*make_banded_engine(), span, window);
  const auto& [x, y] = solved;
  const Result<AxisSolution> by_ipopt = make_ipopt_engine()->solve(window.x);
  ASSERT_TRUE(x && y && by_ipopt);
  EXPECT_NEAR(x->objective, by_ipopt->objective, 1e-4 * by_ipopt->objective);
  for (std::size_t k = 0; k < nodes; ++k) {
    EXPECT_NEAR(x->base.position_mm[k], by_ipopt->base.position_mm[k], 2e-4);
  }
}

}  // namespace
}  // namespace unflex::compensate
