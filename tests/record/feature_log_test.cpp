#include "feature_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace unflex::record {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

std::string feature_after(const char* comment) {
  FeatureLog log;
  log.read(comment, 1);
  return log.names()[log.at(2).feature];
}

std::size_t layers_after(const char* comment) {
  FeatureLog log;
  log.read(comment, 1);
  return log.at(2).layers_begun;
}

TEST(FeatureLog, ReadsTheCommentsOfEverySlicer) {
  EXPECT_EQ(feature_after(";TYPE:External perimeter"), "External perimeter");
  EXPECT_EQ(feature_after(";TYPE:WALL-OUTER"), "WALL-OUTER");
  EXPECT_EQ(feature_after("; FEATURE: Outer wall"), "Outer wall");
  EXPECT_EQ(feature_after("; feature outer perimeter"), "outer perimeter");
  for (const char* const other : {"; external perimeters extrusion width = 0.44mm", ";WIDTH:0.45",
                                  "G1 X1 ;TYPE:x", "", ";LAYER_CHANGE"}) {
    EXPECT_EQ(feature_after(other), "") << other;
  }
}

TEST(FeatureLog, KnowsWhereALayerBegins) {
  for (const char* const begin :
       {";LAYER_CHANGE", "; CHANGE_LAYER", ";LAYER:12", ";LAYER:-1", "; layer 12, Z = 2.4"}) {
    EXPECT_EQ(layers_after(begin), 1U) << begin;
  }
  for (const char* const none : {";LAYER_COUNT:100", ";AFTER_LAYER_CHANGE", "; layer_height = 0.2",
                                 "; layer z_gcode = x", ";TYPE:LAYER_CHANGE"}) {
    EXPECT_EQ(layers_after(none), 0U) << none;
  }
}

TEST(FeatureLog, AppliesACommentFromItsLineOn) {
  FeatureLog log;
  log.read(";TYPE:Perimeter", 10);
  log.read("G1 X1", 11);
  log.read(";TYPE:Fill", 20);
  log.read(";TYPE:Perimeter", 30);
  EXPECT_EQ(log.at(9).feature, 0U);
  EXPECT_EQ(log.at(10).feature, 1U);
  EXPECT_EQ(log.at(19).feature, 1U);
  EXPECT_EQ(log.at(25).feature, 2U);
  EXPECT_EQ(log.at(31).feature, 1U);
  EXPECT_THAT(log.names(), ElementsAre("", "Perimeter", "Fill"));
}

TEST(FeatureLog, BoundsNumberAndLengthOfNames) {
  FeatureLog log;
  for (std::size_t i = 0; i < 1000; ++i) {
    log.read(";TYPE:" + std::to_string(i) + std::string(500, 'x'), i + 1);
  }
  EXPECT_THAT(log.names(), SizeIs(48));
  EXPECT_EQ(log.names().back(), "others");
  EXPECT_EQ(log.names()[1].size(), 60U);
  EXPECT_EQ(log.at(1000).feature, 47U);
}

}  // namespace
}  // namespace unflex::record
