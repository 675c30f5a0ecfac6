// Records are read as printers write them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "unflex/identify/record.hpp"

namespace unflex::identify {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

template <class... Values>
std::string line(const char* format, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return std::string(text.data()) + "\n";
}

std::string klipper_samples(int count) {
  std::string text = "#time,accel_x,accel_y,accel_z\n";
  for (int i = 0; i < count; ++i) {
    text += line("%.6f,%.6f,%.6f,%.6f", 100.0 + i / 3200.0, 1.0 * i, -2.0 * i, 9800.0);
  }
  return text;
}

std::vector<DataSet> good(const std::string& text, const std::string& name) {
  Result<std::vector<DataSet>> sets = parse_records(text, name);
  EXPECT_TRUE(sets) << to_string(sets.error());
  return sets.value_or(std::vector<DataSet>{});
}

TEST(KlipperRecording, IsRead) {
  const auto sets = good(klipper_samples(64), "dir_x/raw_data_y_20240102_1.csv");
  ASSERT_THAT(sets, SizeIs(1));
  EXPECT_EQ(sets[0].axis, Axis::y);
  const auto& recording = std::get<Recording>(sets[0].data);
  EXPECT_NEAR(recording.rate_hz, 3200.0, 0.1);
  EXPECT_THAT(recording.accel[1], SizeIs(64));
  EXPECT_DOUBLE_EQ(recording.accel[1][5], -10.0);
  EXPECT_TRUE(sets[0].notes.empty());
}

TEST(KlipperRecording, WithMissingSamplesBringsANote) {
  const auto sets = good(klipper_samples(64) + "100.5,0,0,0\n", "raw_data_x.csv");
  ASSERT_THAT(sets[0].notes, SizeIs(1));
  EXPECT_THAT(sets[0].notes[0], HasSubstr("samples are missing"));
}

TEST(KlipperSpectrum, IsReadOnTheFrequenciesBehindTheRoundedOnes) {
  std::string text = "freq,psd_x,psd_y,psd_z,psd_xyz\n";
  for (int i = 0; i < 100; ++i) {
    text += line("%.1f,%.3e,%.3e,%.3e,%.3e", i * 1.5625, 1.0 * i, 2.0 * i, 3.0 * i, 6.0 * i);
  }
  const auto sets = good(text, "resonances_x_a.csv");
  ASSERT_THAT(sets, SizeIs(1));
  const auto& spectrum = std::get<Spectrum>(sets[0].data);
  EXPECT_NEAR(spectrum.step_hz, 1.5625, 1e-3);
  EXPECT_NEAR(spectrum.density[1][40], 80.0, 0.1);
  EXPECT_FALSE(spectrum.is_normalized);
}

TEST(KlipperSpectrum, OfACalibrationIsDividedByItsFrequencies) {
  std::string text = "freq,psd_x,psd_y,psd_z,psd_xyz,shapers:,zv(59.0),mzv(52.8)\n";
  for (int i = 0; i < 100; ++i) {
    text += line("%.1f,1.0e+00,2.0e+00,3.0e+00,6.0e+00,,%.3f,0.5", i * 1.5625, 1.0);
  }
  EXPECT_TRUE(std::get<Spectrum>(good(text, "calibration_data_y.csv")[0].data).is_normalized);
}

TEST(KlipperSpectrum, OfSeveralPointsIsSeveralSets) {
  std::string text = "freq,resonances_x_1.csv,resonances_x_2.csv\n";
  for (int i = 0; i < 600; ++i) {
    text += line("%.1f,%.3e,%.3e", i * 0.2, 1.0 * i, 2.0 * i);
  }
  const auto sets = good(text, "all.csv");
  ASSERT_THAT(sets, SizeIs(2));
  EXPECT_EQ(sets[1].name, "all.csv (resonances_x_2.csv)");
  EXPECT_EQ(sets[1].axis, Axis::x);
  const auto& spectrum = std::get<Spectrum>(sets[1].data);
  EXPECT_DOUBLE_EQ(spectrum.step_hz, 1.5625);
  EXPECT_NEAR(spectrum.density[0][32], 500.0, 1e-6);
}

TEST(KlipperSpectrum, WithFewColumnsBeforeTheShapersReadsNoOthers) {
  std::string text = "freq,psd_x,shapers:,mzv\n";
  for (int i = 0; i < 100; ++i) {
    text += line("%.1f,%.3e,,0.5", i * 1.5625, 1.0 * i);
  }
  const auto sets = good(text, "a.csv");
  ASSERT_THAT(sets, SizeIs(1));
  EXPECT_EQ(sets[0].name, "a.csv (psd_x)");
  EXPECT_NEAR(std::get<Spectrum>(sets[0].data).density[2][40], 40.0, 0.1);
}

std::string rrf_samples(const std::string& last) {
  std::string text = "Sample,X,Y,Z\n";
  for (int i = 0; i < 40; ++i) {
    text += line("%d,%.3f,%.3f,%.3f", i, 0.001 * i, 0.5, 1.0);
  }
  return text + last;
}

TEST(RrfRecording, IsRead) {
  const auto sets = good(rrf_samples("Rate 1344, overflows 0\n"), "0_2024 X.csv");
  const auto& recording = std::get<Recording>(sets[0].data);
  EXPECT_DOUBLE_EQ(recording.rate_hz, 1344.0);
  EXPECT_DOUBLE_EQ(recording.accel[0][39], 0.039);
  EXPECT_EQ(sets[0].axis, Axis::x);
  EXPECT_TRUE(sets[0].notes.empty());
  EXPECT_THAT(good(rrf_samples("Rate 1344, overflows 3\n"), "a.csv")[0].notes, SizeIs(1));
}

std::string repeated(const std::string& row, int times) {
  std::string rows;
  for (int i = 0; i < times; ++i) {
    rows += row;
  }
  return rows;
}

TEST(Records, ThatAreNoneNameTheirPlace) {
  const auto failure = [](const std::string& text) {
    const auto sets = parse_records(text, "a.csv");
    EXPECT_FALSE(sets);
    EXPECT_TRUE(sets || sets.error().kind == ErrorKind::input);
    return sets ? "" : to_string(sets.error());
  };
  EXPECT_EQ(failure(""), "a.csv: is empty");
  EXPECT_THAT(failure("G1 X1\n"), HasSubstr("a.csv:1: is no record that unflex knows"));
  EXPECT_EQ(failure(klipper_samples(40) + "1,2,x,4\n"), "a.csv:42: must be a row of 4 numbers");
  EXPECT_EQ(failure(klipper_samples(40) + "1,2,nan,4\n"), "a.csv:42: must be a row of 4 numbers");
  EXPECT_EQ(failure(klipper_samples(4)), "a.csv: has 4 rows, too few to tell a resonance");
  EXPECT_THAT(failure(rrf_samples("")), HasSubstr("was broken off"));
  EXPECT_EQ(failure("#time,accel_x,accel_y,accel_z\n" + repeated("1,2,3,4\n", 40)),
            "a.csv: its times do not grow");
  EXPECT_EQ(failure("freq,psd_x,psd_y,psd_z,psd_xyz\n" + repeated("5,1,1,1,3\n", 40)),
            "a.csv: its frequencies do not grow");
  EXPECT_EQ(failure("freq,shapers:,mzv\n" + repeated("5,,1\n", 40)),
            "a.csv:1: has no column between the frequencies and 'shapers:'; give the file as "
            "Klipper wrote it");
  std::string far = "freq,psd_x,psd_y,psd_z,psd_xyz\n";
  for (int i = 0; i < 100; ++i) {
    far += line("%.1f,1,1,1,3", 2e7 + i);
  }
  EXPECT_EQ(failure(far),
            "a.csv: ends at 20000099 Hz, but no printer's accelerometer measures above 10000 Hz; "
            "the first column must be in Hz");
}

TEST(AxisInName, IsALetterThatStandsAlone) {
  EXPECT_EQ(axis_in_name("raw_data_x_2024.csv"), Axis::x);
  EXPECT_EQ(axis_in_name("/home/x/resonances_Y.csv"), Axis::y);
  EXPECT_EQ(axis_in_name("raw_data_axis=0.000,1.000,0.000_a.csv"), Axis::y);
  EXPECT_EQ(axis_in_name("raw_data_axis=1.000,1.000,0.000_a.csv"), std::nullopt);
  EXPECT_EQ(axis_in_name("x_and_y.csv"), std::nullopt);
  EXPECT_EQ(axis_in_name("extra.csv"), std::nullopt);
}

}  // namespace
}  // namespace unflex::identify
