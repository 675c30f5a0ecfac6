#include "layer_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "record/decoded_paths.hpp"

namespace unflex::record {
namespace {

using testing::decoded;
using testing::DecodedPath;
using testing::DecodedPoint;
using ::testing::ElementsAre;
using ::testing::SizeIs;

Stretch stretch(double x0, double y0, double x1, double y1, unsigned char before,
                unsigned char after) {
  return {.layer = 0,
          .feature = 1,
          .line = 7,
          .from_mm = {x0, y0},
          .to_mm = {x1, y1},
          .before = before,
          .after = after};
}

std::vector<DecodedPath> layer(const report::LayerPaths& paths,
                               const std::vector<std::size_t>& ends, std::size_t number) {
  return decoded(paths.bytes, number == 0 ? 0 : ends[number - 1], ends[number]);
}

// Rings with random deviations. None of their stretches can be merged while the store is exact.
void add_rings(LayerStore& store, std::size_t layers, std::size_t rings, std::size_t points,
               unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-0.4, 0.4);
  std::uniform_int_distribution<int> code(60, 150);
  std::size_t line = 1;
  for (std::size_t number = 0; number < layers; ++number) {
    for (std::size_t ring = 0; ring < rings; ++ring) {
      double x = static_cast<double>(5 * ring);
      double y = 0.0;
      for (std::size_t i = 0; i < points; ++i) {
        const double next_x = x + 1.0 + noise(random);
        const double next_y = y + noise(random);
        store.add({number,
                   ring % 3,
                   line++,
                   {x, y},
                   {next_x, next_y},
                   static_cast<unsigned char>(code(random)),
                   static_cast<unsigned char>(code(random) / 2)});
        x = next_x;
        y = next_y;
      }
    }
  }
}

TEST(LayerStore, KeepsEveryPointOfWhatIsSmall) {
  LayerStore store(10'000);
  store.add(stretch(1.0, 2.0, 11.0, 2.0, 90, 30));
  store.add(stretch(11.0, 2.0, 11.0, -12.34, 120, 50));
  store.add(stretch(-5.0, 0.0, -5.0, 0.5, 100, 20));
  std::vector<std::size_t> ends;
  const report::LayerPaths paths = store.encode(1, ends);
  EXPECT_EQ(paths.layer_step, 1U);
  const std::vector<DecodedPath> found = layer(paths, ends, 0);
  ASSERT_THAT(found, SizeIs(2));
  EXPECT_THAT(found[0].points, ElementsAre(DecodedPoint{1.0, 2.0}, DecodedPoint{11.0, 2.0, 90, 30},
                                           DecodedPoint{11.0, -12.34, 120, 50}));
  EXPECT_THAT(found[1].points,
              ElementsAre(DecodedPoint{-5.0, 0.0}, DecodedPoint{-5.0, 0.5, 100, 20}));
  EXPECT_EQ(found[0].feature, 1U);
  EXPECT_EQ(found[0].first_line, 7U);
  EXPECT_EQ(found[0].last_line, 7U);
}

TEST(LayerStore, DrawsCellsOfAStraightLineThatLookAlikeAsOne) {
  LayerStore store(10'000);
  for (int i = 0; i < 40; ++i) {
    // The deviation changes at the 30th stretch.
    store.add(stretch(0.5 * i, 0.0, 0.5 * (i + 1), 0.0, i < 30 ? 100 : 140, 10));
  }
  std::vector<std::size_t> ends;
  const report::LayerPaths paths = store.encode(1, ends);
  EXPECT_THAT(layer(paths, ends, 0).at(0).points,
              ElementsAre(DecodedPoint{0.0, 0.0}, DecodedPoint{15.0, 0.0, 100, 10},
                          DecodedPoint{20.0, 0.0, 140, 10}));
}

TEST(LayerStore, BeginsAPathWhereFeatureOrLayerChanges) {
  LayerStore store(10'000);
  Stretch next = stretch(0.0, 0.0, 1.0, 0.0, 100, 50);
  store.add(next);
  next.from_mm.x = 1.0;
  next.to_mm.x = 2.0;
  next.feature = 2;
  store.add(next);
  next.from_mm.x = 2.0;
  next.to_mm.x = 3.0;
  next.layer = 2;
  next.line = 3;
  store.add(next);
  std::vector<std::size_t> ends;
  const report::LayerPaths paths = store.encode(4, ends);
  EXPECT_THAT(layer(paths, ends, 0), SizeIs(2));
  EXPECT_THAT(layer(paths, ends, 1), SizeIs(0));
  ASSERT_THAT(layer(paths, ends, 2), SizeIs(1));
  EXPECT_THAT(layer(paths, ends, 3), SizeIs(0));
  EXPECT_EQ(layer(paths, ends, 2)[0].points.front(), (DecodedPoint{2.0, 0.0}));
  EXPECT_EQ(layer(paths, ends, 2)[0].first_line, 3U);
}

TEST(LayerStore, StaysWithinItsBudgetAndLosesNoMaximum) {
  constexpr std::size_t kBudget = 50'000;
  for (const std::size_t layers : {1U, 10U, 100U}) {
    LayerStore store(kBudget);
    add_rings(store, layers, 4, 400, 1);
    EXPECT_LE(store.size_bytes(), kBudget);
    std::vector<std::size_t> ends;
    const report::LayerPaths paths = store.encode(layers, ends);
    EXPECT_LE(paths.bytes.size(), kBudget) << layers;
    EXPECT_GT(paths.bytes.size(), kBudget / 20) << layers;
    EXPECT_EQ(ends.back(), paths.bytes.size());
    unsigned most = 0;
    for (const DecodedPath& path : layer(paths, ends, 0)) {
      for (const DecodedPoint& point : path.points) {
        most = std::max(most, point.before);
      }
    }
    // Among 1600 numbers up to 150 the largest is hardly below 150.
    EXPECT_GE(most, 149U) << layers;
  }
}

TEST(LayerStore, MovesNoPointFurtherThanItSays) {
  LayerStore store(20'000);
  std::vector<std::array<double, 2>> points;
  double x = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    const auto y_at = [](double at) { return 10.0 * std::sin(0.2 * at); };
    store.add(stretch(x, y_at(x), x + 0.02, y_at(x + 0.02), 100, 50));
    points.push_back({x, y_at(x)});
    x += 0.02;
  }
  std::vector<std::size_t> ends;
  const report::LayerPaths paths = store.encode(1, ends);
  const std::vector<DecodedPath> found = layer(paths, ends, 0);
  ASSERT_THAT(found, SizeIs(1));
  double farthest = 0.0;
  for (const auto& [px, py] : points) {
    double best = 1e9;
    for (std::size_t i = 1; i < found[0].points.size(); ++i) {
      const DecodedPoint& a = found[0].points[i - 1];
      const DecodedPoint& b = found[0].points[i];
      const double dx = b.x_mm - a.x_mm;
      const double dy = b.y_mm - a.y_mm;
      const double along =
          std::clamp(((px - a.x_mm) * dx + (py - a.y_mm) * dy) / (dx * dx + dy * dy), 0.0, 1.0);
      best = std::min(best, std::hypot(px - a.x_mm - along * dx, py - a.y_mm - along * dy));
    }
    farthest = std::max(farthest, best);
  }
  // Each time the store gets coarser, the errors add up. Their sum is at most twice the last
  // tolerance.
  EXPECT_LE(farthest, 2.0 * paths.tolerance_mm + 0.01);
}

TEST(LayerStore, LeavesOutLayersRatherThanDrawingThemBeyondRecognition) {
  LayerStore store(20'000);
  add_rings(store, 2000, 8, 20, 2);
  std::vector<std::size_t> ends;
  const report::LayerPaths paths = store.encode(2000, ends);
  EXPECT_GT(paths.layer_step, 1U);
  EXPECT_LE(paths.tolerance_mm, 0.08);
  EXPECT_FALSE(layer(paths, ends, 0).empty());
  EXPECT_TRUE(layer(paths, ends, 1).empty());
  EXPECT_FALSE(layer(paths, ends, paths.layer_step).empty());
}

TEST(LayerStore, IsBoundedByIslandsWithoutNumberAndByPlacesThatAreNone) {
  LayerStore store(5'000);
  for (int i = 0; i < 100'000; ++i) {
    const double x = 3.0 * (i % 300);
    const double y = 3.0 * (i / 300);
    store.add(stretch(x, y, x + 1.0, y, 100, 50));
  }
  store.add(stretch(std::nan(""), 0.0, 1e300, -1e300, 100, 50));
  std::vector<std::size_t> ends;
  EXPECT_LE(store.encode(1, ends).bytes.size(), 5'000U);
}

TEST(LayerStore, IsTheSameEveryTime) {
  const auto bytes = [] {
    LayerStore store(30'000);
    add_rings(store, 30, 4, 200, 3);
    std::vector<std::size_t> ends;
    return store.encode(30, ends).bytes;
  };
  EXPECT_EQ(bytes(), bytes());
}

TEST(LayerStore, KnowsWhereThePrintIsBesideAPurgeLine) {
  LayerStore store(100'000);
  store.add(stretch(0.0, -3.0, 60.0, -3.0, 100, 50));
  for (int i = 0; i < 1000; ++i) {
    const double y = 50.0 + 0.04 * i;
    store.add(stretch(100.0, y, 140.0, y, 100, 50));
  }
  std::vector<std::size_t> ends;
  const report::LayerPaths paths = store.encode(1, ends);
  EXPECT_DOUBLE_EQ(paths.min_mm.x, 100.0);
  EXPECT_DOUBLE_EQ(paths.max_mm.x, 140.0);
  EXPECT_NEAR(paths.min_mm.y, 50.0, 0.2);
  EXPECT_NEAR(paths.max_mm.y, 90.0, 0.2);
}

TEST(DeviationCode, IsLogarithmic) {
  EXPECT_EQ(report::deviation_code(0.0), 0);
  EXPECT_EQ(report::deviation_code(5e-5 * 5e-5), 0);
  EXPECT_EQ(report::deviation_code(1e-4 * 1e-4), 15);
  EXPECT_EQ(report::deviation_code(51.2 * 51.2), 255);
  // 0.0256 mm = 0.05 µm · 2⁹.
  EXPECT_EQ(report::deviation_code(0.0256 * 0.0256), 135);
}

}  // namespace
}  // namespace unflex::record
