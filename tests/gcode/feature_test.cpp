#include "unflex/gcode/feature.hpp"

#include <gtest/gtest.h>

namespace unflex::gcode {
namespace {

FeatureKind kind_behind(const char* line) {
  const auto name = feature_name(line);
  return name ? feature_by_name(*name) : FeatureKind::travel;
}

TEST(Feature, OfEverySlicerIsKnown) {
  for (const char* const line :
       {";TYPE:External perimeter", ";TYPE:Outer wall", "; FEATURE: Outer wall", ";TYPE:WALL-OUTER",
        "; feature outer perimeter", ";TYPE:outer perimeter", ";TYPE:EXTERNAL PERIMETER"}) {
    EXPECT_EQ(kind_behind(line), FeatureKind::outer_wall) << line;
  }
  for (const char* const line : {";TYPE:Perimeter", ";TYPE:Inner wall", "; FEATURE: Inner wall",
                                 ";TYPE:WALL-INNER", "; feature inner perimeter"}) {
    EXPECT_EQ(kind_behind(line), FeatureKind::inner_wall) << line;
  }
  EXPECT_EQ(kind_behind(";TYPE:Internal infill"), FeatureKind::infill);
  EXPECT_EQ(kind_behind("; FEATURE: Sparse infill"), FeatureKind::infill);
  EXPECT_EQ(kind_behind(";TYPE:FILL"), FeatureKind::infill);
  EXPECT_EQ(kind_behind("; FEATURE: Bottom surface"), FeatureKind::solid_infill);
  EXPECT_EQ(kind_behind(";TYPE:Top solid infill"), FeatureKind::top);
  EXPECT_EQ(kind_behind(";TYPE:Overhang perimeter"), FeatureKind::bridge);
  EXPECT_EQ(kind_behind(";TYPE:SUPPORT-INTERFACE"), FeatureKind::support);
  EXPECT_EQ(kind_behind(";TYPE:Skirt/Brim"), FeatureKind::skirt);
}

TEST(Feature, OfAnUnknownNameIsOther) {
  EXPECT_EQ(kind_behind(";TYPE:Wipe tower"), FeatureKind::other);
  EXPECT_EQ(kind_behind(";TYPE:"), FeatureKind::other);
  EXPECT_EQ(kind_behind(";TYPE:Outer walls"), FeatureKind::other);
}

TEST(Feature, IsSaidByNoOtherLine) {
  for (const char* const line : {"", "G1 X1 ;TYPE:Perimeter", ";WIDTH:0.4", "; features: 3"}) {
    EXPECT_FALSE(feature_name(line)) << line;
  }
}

TEST(Feature, HasAWord) {
  for (std::size_t i = 0; i < kFeatureWords.size(); ++i) {
    EXPECT_EQ(feature_by_word(kFeatureWords[i]), static_cast<FeatureKind>(i));
  }
  EXPECT_EQ(kFeatureWords.back(), "other");
  EXPECT_EQ(feature_by_word("other"), FeatureKind::other);
  EXPECT_FALSE(feature_by_word("walls"));
}

}  // namespace
}  // namespace unflex::gcode
