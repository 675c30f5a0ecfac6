// Shake&Tune's packed measurements.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zstd.h>

#include <string>

#include "unflex/identify/record.hpp"

namespace unflex::identify {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

std::string packed(const std::string& text) {
  std::string bytes(ZSTD_compressBound(text.size()), '\0');
  bytes.resize(ZSTD_compress(bytes.data(), bytes.size(), text.data(), text.size(), 3));
  return bytes;
}

std::string measurement(const std::string& name, int count) {
  std::string samples;
  for (int i = 0; i < count; ++i) {
    samples += (i > 0 ? ", [" : "[") + std::to_string(10.0 + i / 3200.0) + ", " +
               std::to_string(i) + ".5, -2, 9800.25]";
  }
  return R"({"name": ")" + name + R"(", "samples": [)" + samples + "]}\n";
}

std::string refusal(const std::string& bytes) {
  const auto sets = parse_records(bytes, "a.stdata");
  return sets ? std::string{} : to_string(sets.error());
}

TEST(StData, IsReadMeasurementByMeasurement) {
  const std::string text =
      measurement("axis_Y_20241001_120000", 64) + "\n" + measurement("belt_A_20241001_120500", 40);
  const auto sets = parse_records(packed(text), "dir_x/inputshaper_20241001.stdata");
  ASSERT_TRUE(sets) << to_string(sets.error());
  ASSERT_THAT(*sets, SizeIs(2));
  EXPECT_EQ(sets->front().axis, Axis::y);
  EXPECT_FALSE(sets->front().is_diagonal);
  EXPECT_THAT(sets->front().name, HasSubstr("inputshaper_20241001.stdata (axis_Y"));
  const auto& recording = std::get<Recording>(sets->front().data);
  EXPECT_NEAR(recording.rate_hz, 3200.0, 1.0);
  ASSERT_THAT(recording.accel[0], SizeIs(64));
  EXPECT_EQ(recording.accel[0][5], 5.5);
  EXPECT_EQ(recording.accel[2][63], 9800.25);
  EXPECT_FALSE(sets->back().axis);
  EXPECT_TRUE(sets->back().is_diagonal);
}

TEST(StData, ThatIsNoneNamesWhatIsWrong) {
  const std::string good = packed(measurement("axis_X_1", 64));
  EXPECT_EQ(refusal(good), "");
  EXPECT_EQ(refusal(good.substr(0, good.size() / 2)),
            "a.stdata: is broken off; give the file as Shake&Tune wrote it");
  std::string spoilt = good;
  spoilt[6] = static_cast<char>(spoilt[6] ^ 0x55);
  EXPECT_NE(refusal(spoilt), "");
  EXPECT_THAT(refusal(packed("")), HasSubstr("holds no measurement"));
  EXPECT_THAT(refusal(packed("{\"name\": 3}\n")), HasSubstr("a line that is no measurement"));
  EXPECT_THAT(refusal(packed(measurement("axis_X_1", 5))), HasSubstr("has 5 samples, too few"));
  EXPECT_THAT(refusal(packed(R"({"name": "x", "samples": [[1, 2, 3]]})")),
              HasSubstr("sample 1 is not four numbers"));
  EXPECT_THAT(refusal(packed("[[[[[[")), HasSubstr("no measurement"));
}

}  // namespace
}  // namespace unflex::identify
