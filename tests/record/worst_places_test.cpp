#include "worst_places.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace unflex::record {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

PlaceCandidate candidate(double contour_mm, double x_mm, double y_mm = 0.0) {
  PlaceCandidate result;
  result.contour2_mm2 = contour_mm * contour_mm;
  result.xy_mm = {x_mm, y_mm};
  return result;
}

std::vector<std::size_t> ids(const WorstPlaces& worst) {
  std::vector<std::size_t> result;
  for (const WorstPlaces::Kept& kept : worst.places()) {
    result.push_back(kept.id);
  }
  return result;
}

TEST(WorstPlaces, KeepsTheWorstInOrder) {
  WorstPlaces worst(3);
  EXPECT_TRUE(worst.add(candidate(0.2, 0.0), 0).added);
  EXPECT_TRUE(worst.add(candidate(0.4, 10.0), 1).added);
  EXPECT_TRUE(worst.add(candidate(0.3, 20.0), 2).added);
  EXPECT_FALSE(worst.add(candidate(0.1, 30.0), 3).added);
  const WorstPlaces::Change change = worst.add(candidate(0.35, 40.0), 4);
  EXPECT_TRUE(change.added);
  EXPECT_THAT(change.removed, ElementsAre(0));
  EXPECT_THAT(ids(worst), ElementsAre(1, 4, 2));
}

TEST(WorstPlaces, NamesASpotOnce) {
  WorstPlaces worst(3);
  worst.add(candidate(0.2, 0.0), 0);
  EXPECT_FALSE(worst.add(candidate(0.2, 1.0), 1).added);
  EXPECT_FALSE(worst.add(candidate(0.19, 0.5), 2).added);
  const WorstPlaces::Change change = worst.add(candidate(0.3, 1.5, 0.5), 3);
  EXPECT_THAT(change.removed, ElementsAre(0));
  EXPECT_THAT(ids(worst), ElementsAre(3));
}

TEST(WorstPlaces, FindsTheWorstOfManyWhateverTheirOrder) {
  std::vector<PlaceCandidate> all;
  for (int i = 0; i < 500; ++i) {
    all.push_back(candidate(1e-3 * (i + 1), 5.0 * i));
  }
  std::mt19937 random(4);
  for (int round = 0; round < 10; ++round) {
    std::shuffle(all.begin(), all.end(), random);
    WorstPlaces worst(5);
    for (std::size_t i = 0; i < all.size(); ++i) {
      worst.add(all[i], i);
    }
    std::vector<double> found;
    for (const WorstPlaces::Kept& kept : worst.places()) {
      found.push_back(kept.candidate.xy_mm.x / 5.0);
    }
    EXPECT_THAT(found, ElementsAre(499.0, 498.0, 497.0, 496.0, 495.0));
  }
}

}  // namespace
}  // namespace unflex::record
