// Registers of two numbers and of four give equal bits, for any number of modes, models and pairs.
#include "unflex/core/lanes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "banded_engine.hpp"
#include "lane_kernels.hpp"
#include "window_makers.hpp"

namespace unflex::compensate {
namespace {

using testing::largest_difference;
using testing::random_path;
using testing::solve_by_ipopt;
using testing::WindowKind;

class Lanes : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!has_four_lanes()) {
      GTEST_SKIP() << "This processor has registers of two numbers only.";
    }
  }
  void TearDown() override { prefer_two_lanes(false); }
};

// An axis that may be `models` things, each of so many modes.
AxisWindow window_of(std::mt19937_64& random, std::size_t models, std::size_t modes,
                     const WindowKind& kind) {
  std::uniform_real_distribution<double> uniform(0.7, 1.4);
  AxisWindow window = random_path(random, 70, kind);
  const auto axis = [&] {
    std::vector<dynamics::Mode> parts;
    for (std::size_t i = 0; i < modes; ++i) {
      parts.push_back({kind.omega_rad_s * uniform(random) * static_cast<double>(i + 1), 0.06,
                       1.0 / static_cast<double>(modes)});
    }
    return dynamics::FlexibleAxis(parts);
  };
  window.axis = axis();
  for (std::size_t i = 1; i < models; ++i) {
    window.plants.push_back({axis(), 0.8 / static_cast<double>(models)});
  }
  return window;
}

TEST_F(Lanes, OfStagesMakeNoDifference) {
  std::mt19937_64 random(11);
  int limited = 0;
  for (std::size_t models = 1; models <= 10; ++models) {
    for (std::size_t modes = 1; modes <= dynamics::kMostModes; ++modes) {
      SCOPED_TRACE(::testing::PrintToString(models) + " models of " +
                   ::testing::PrintToString(modes) + " modes");
      AxisWindow window =
          window_of(random, models, modes, {.start = models % 2 == 0, .end = models % 3 == 0});
      window.limits.max_accel_mm_s2 = 6e3;
      prefer_two_lanes(false);
      const Result<AxisSolution> by_four = make_banded_engine(BandedForm::stages)->solve(window);
      prefer_two_lanes(true);
      const Result<AxisSolution> by_two = make_banded_engine(BandedForm::stages)->solve(window);
      ASSERT_EQ(by_four.has_value(), by_two.has_value());
      if (by_four) {
        EXPECT_EQ(by_four->base.position_mm, by_two->base.position_mm);
        EXPECT_EQ(by_four->base.accel_mm_s2, by_two->base.accel_mm_s2);
        EXPECT_EQ(by_four->objective, by_two->objective);
        EXPECT_EQ(by_four->iterations, by_two->iterations);
        limited += by_four->iterations > 1 ? 1 : 0;
      }
    }
  }
  EXPECT_GE(limited, 10);
}

TEST_F(Lanes, OfTheContourMakeNoDifference) {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  constexpr std::size_t kNodes = 40;
  constexpr std::size_t kModels = 8;
  for (std::size_t pairs = 1; pairs <= 17; ++pairs) {
    SCOPED_TRACE(::testing::PrintToString(pairs) + " pairs");
    std::vector<Edge> edges;
    for (int i = 0; i < 20; ++i) {
      const XY way_mm{uniform(random), uniform(random)};
      edges.push_back({{uniform(random), uniform(random)}, way_mm, 1.0 / squared(way_mm)});
    }
    edges[3].inverse_square = 0.0;
    edges[3].way_mm = {};
    std::vector<Reach> reach;
    for (std::size_t k = 0; k < kNodes; ++k) {
      reach.push_back({k / 4, k / 4 + 9});
    }
    LaneArray nozzles;
    nozzles.resize(2 * kNodes * kModels);
    for (std::size_t i = 0; i < nozzles.size(); ++i) {
      nozzles[i] = uniform(random);
    }
    std::vector<std::size_t> of_pair;
    for (std::size_t c = 0; c < pairs + kLanes; ++c) {
      of_pair.push_back(c < pairs ? (3 * c) % kModels : 0);
    }
    std::vector<double> along(2 * kNodes, 0.3);
    LaneArray parts;
    parts.resize((pairs + kLanes) * kModels);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      parts[i] = uniform(random);
    }
    struct Followed {
      double farthest_mm = 0.0;
      std::vector<double> q_mm;
      std::vector<double> aims_mm;
      bool operator==(const Followed&) const = default;
    };
    const auto follow = [&](const ContourKernel& kernel) {
      PairPlaces q;
      const std::size_t places = kNodes * kernel.pair_places();
      for (LaneArray* of : {&q.x.place_mm, &q.x.way_mm, &q.y.place_mm, &q.y.way_mm, &q.vertex}) {
        of->resize(places);
        std::fill_n(of->data(), places, 0.0);
      }
      const Axes<PairNozzles> of_axes{{nozzles.data(), kModels, of_pair.data()},
                                      {nozzles.data() + kNodes * kModels, kModels, of_pair.data()}};
      Followed result;
      for (const bool everywhere : {true, true, false, false}) {
        result.farthest_mm = kernel.follow(edges, reach, of_axes, everywhere, q);
      }
      LaneArray node_aims;
      LaneArray middle_aims;
      for (LaneArray* aims : {&node_aims, &middle_aims}) {
        aims->resize(kNodes * kModels);
        std::fill_n(aims->data(), aims->size(), 0.0);
      }
      kernel.set_aims({nozzles.data(), along.data(), parts.data(), kModels}, q.x.place_mm, kNodes,
                      node_aims, middle_aims);
      result.q_mm.assign(q.y.place_mm.data(), q.y.place_mm.data() + places);
      for (const LaneArray* aims : {&node_aims, &middle_aims}) {
        result.aims_mm.insert(result.aims_mm.end(), aims->data(), aims->data() + aims->size());
      }
      return result;
    };
    const Followed by_four = follow(*make_four_lanes_contour(pairs));
    EXPECT_EQ(by_four, follow(*make_two_lanes_contour(pairs)));
    EXPECT_GT(by_four.farthest_mm, 0.0);
  }
}

TEST_F(Lanes, AddUpInOneOrder) {
  // 1 is lost beside the large numbers unless these meet first.
  const double numbers[kLanes] = {1e16, 1.0, -1e16, 1.0};
  EXPECT_EQ(sum(load<TwoLanes>(numbers)), 2.0);
}

// More modes and models than there is a kernel of its own for.
TEST(Stages, TakeAnyNumberOfModesAndModels) {
  std::mt19937_64 random(13);
  const WindowKind kind{.start = true, .end = true};
  AxisWindow window = random_path(random, 40, kind);
  for (int i = 0; i < 9; ++i) {
    const std::array modes = {dynamics::Mode{kind.omega_rad_s * (0.8 + 0.03 * i), 0.06, 0.8},
                              dynamics::Mode{kind.omega_rad_s * (2.0 + 0.03 * i), 0.05, 0.2}};
    window.plants.push_back({dynamics::FlexibleAxis(modes), 0.08});
  }
  const Result<AxisSolution> banded = make_banded_engine()->solve(window);
  const Result<AxisSolution> ipopt = solve_by_ipopt(window, {}, 1e-12);
  ASSERT_TRUE(banded.has_value());
  ASSERT_TRUE(ipopt.has_value());
  EXPECT_LE(largest_difference(banded->base.position_mm, ipopt->base.position_mm), 5e-5);
  EXPECT_NEAR(banded->objective, ipopt->objective, 1e-6 * ipopt->objective);
}

// A mode that several models have is worked on once, unless it begins differently in them.
TEST(Stages, ShareModesThatAreAlike) {
  std::mt19937_64 random(14);
  for (const bool swings : {false, true}) {
    const WindowKind kind{.start = true, .end = true};
    AxisWindow window = random_path(random, 60, kind);
    const std::array modes = {dynamics::Mode{kind.omega_rad_s, kind.zeta, 0.8},
                              dynamics::Mode{2.4 * kind.omega_rad_s, kind.zeta, 0.2}};
    const std::array others = {dynamics::Mode{kind.omega_rad_s, kind.zeta, 0.6},
                               dynamics::Mode{2.4 * kind.omega_rad_s, kind.zeta, 0.4}};
    window.axis = dynamics::FlexibleAxis(modes);
    window.plants = {{dynamics::FlexibleAxis(others), 0.4}};
    window.start->nozzle = window.axis.riding(window.start->base_mm);
    window.start->nozzle.parts[0].velocity += swings ? 0.7 : 0.0;
    const Result<AxisSolution> banded = make_banded_engine()->solve(window);
    const Result<AxisSolution> ipopt = solve_by_ipopt(window, {}, 1e-12);
    ASSERT_TRUE(banded.has_value());
    ASSERT_TRUE(ipopt.has_value());
    // States: so many modes of place and rate, and three of the base, at 60 nodes and 59 intervals.
    EXPECT_EQ(banded->size.unknowns, 60U * (2U * (swings ? 3U : 2U) + 3U) + 59U);
    EXPECT_LE(largest_difference(banded->base.position_mm, ipopt->base.position_mm), 5e-5);
    EXPECT_NEAR(banded->objective, ipopt->objective, 1e-6 * ipopt->objective);
  }
}

}  // namespace
}  // namespace unflex::compensate
