// Klipper's calibration of input shapers is followed figure by figure: what is expected is what
// Klipper itself (klippy/extras/shaper_calibrate.py, commit 84104bb) gives for these records.

#include "unflex/rivals/klipper_calibration.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

#include "paths.hpp"

namespace unflex::rivals {
namespace {

using dynamics::ShaperKind;

// The sum of the columns of a record as Klipper writes it, as a density of acceleration.
struct Record {
  double step_hz = 0.0;
  std::vector<double> density;
};

Record read(const std::string& name) {
  std::ifstream file(std::string(test_paths::kData) + "/spectra/" + name + ".csv");
  Record record;
  std::string line;
  std::getline(file, line);
  const bool is_normalized = line.find("shapers:") != std::string::npos;
  std::vector<double> freq_hz;
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    double values[4] = {};
    char comma = 0;
    cells >> values[0];
    for (int c = 1; c < 4; ++c) {
      cells >> comma >> values[c];
    }
    freq_hz.push_back(values[0]);
    const double sum = values[1] + values[2] + values[3];
    record.density.push_back(is_normalized ? sum * (values[0] + 0.1) : sum);
  }
  EXPECT_FALSE(freq_hz.empty()) << name;
  record.step_hz = freq_hz.back() / static_cast<double>(freq_hz.size() - 1);
  return record;
}

struct Expected {
  std::string record;
  ShaperKind recommended;
  double recommended_hz;
  std::array<double, 5> freq_hz;  // of ZV, MZV, EI, 2HUMP_EI, 3HUMP_EI
  std::array<double, 5> vibration;
  std::array<double, 5> smoothing_mm;
};

TEST(KlipperCalibration, GivesKlippersOwnFigures) {
  const std::vector<Expected> all = {{"ender3_resonances_x_20210701_223821",
                                      ShaperKind::ei,
                                      46.0,
                                      {49.4, 37.8, 46.0, 59.8, 75.4},
                                      {0.1556, 0.0152, 0.0004, 0.0005, 0.0004},
                                      {0.0691, 0.1425, 0.1557, 0.1583, 0.1590}},
                                     {"ender3_resonances_x_20210821_152037",
                                      ShaperKind::ei,
                                      51.4,
                                      {58.2, 41.2, 51.4, 66.2, 83.6},
                                      {0.1577, 0.0207, 0.0011, 0.0005, 0.0004},
                                      {0.0521, 0.1200, 0.1247, 0.1292, 0.1294}},
                                     {"ender3_resonances_y_20210630_223910",
                                      ShaperKind::ei,
                                      40.6,
                                      {46.0, 29.6, 40.6, 53.0, 67.0},
                                      {0.0953, 0.0100, 0.0004, 0.0005, 0.0005},
                                      {0.0783, 0.2325, 0.1999, 0.2016, 0.2014}},
                                     {"switchwire_resonances_x_20211024_204517",
                                      ShaperKind::two_hump_ei,
                                      64.6,
                                      {60.2, 40.4, 58.2, 64.6, 81.6},
                                      {0.1855, 0.0468, 0.0363, 0.0004, 0.0005},
                                      {0.0491, 0.1248, 0.0973, 0.1357, 0.1358}},
                                     {"v24_calibration_data_x_20220611_200739",
                                      ShaperKind::mzv,
                                      46.0,
                                      {48.6, 46.0, 44.6, 47.4, 60.4},
                                      {0.0804, 0.0161, 0.0029, 0.0005, 0.0005},
                                      {0.0711, 0.0963, 0.1656, 0.2520, 0.2478}},
                                     {"v24_calibration_data_y_20220611_200739",
                                      ShaperKind::three_hump_ei,
                                      53.4,
                                      {50.4, 35.0, 46.4, 42.2, 53.4},
                                      {0.3690, 0.1041, 0.1267, 0.0304, 0.0302},
                                      {0.0668, 0.1663, 0.1530, 0.3180, 0.3171}}};
  for (const Expected& expected : all) {
    SCOPED_TRACE(expected.record);
    const Record record = read(expected.record);
    const auto found = klipper_calibration(record.step_hz, record.density);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->recommended.kind, expected.recommended);
    EXPECT_NEAR(found->recommended.freq_hz, expected.recommended_hz, 0.21);
    ASSERT_EQ(found->shapers.size(), 5U);
    for (std::size_t i = 0; i < 5; ++i) {
      // Klipper's files round frequencies to 0.1 Hz, so that a frequency may be one of the next.
      EXPECT_NEAR(found->shapers[i].freq_hz, expected.freq_hz[i], 0.61) << i;
      EXPECT_NEAR(found->shapers[i].vibration, expected.vibration[i],
                  1e-3 + 0.03 * expected.vibration[i])
          << i;
      EXPECT_NEAR(found->shapers[i].smoothing_mm, expected.smoothing_mm[i],
                  0.03 * expected.smoothing_mm[i])
          << i;
    }
    EXPECT_EQ(&found->of(ShaperKind::mzv), &found->shapers[1]);
  }
}

// As find_shaper_max_accel finds it by bisection.
TEST(KlipperCalibration, AdvisesAnAcceleration) {
  const auto advised = [](ShaperKind kind, double freq_hz, double damping_ratio) {
    return advised_accel_mm_s2(*dynamics::shaper_pulses(kind, freq_hz, damping_ratio));
  };
  EXPECT_NEAR(advised(ShaperKind::zv, 45.0, 0.1), 7891.70438, 1e-4);
  EXPECT_NEAR(advised(ShaperKind::zv, 25.0, 0.1), 2118.00705, 1e-4);
  EXPECT_NEAR(advised(ShaperKind::mzv, 45.0, 0.1), 5965.50953, 1e-4);
  EXPECT_NEAR(advised(ShaperKind::mzv, 30.0, 0.06), 2632.56221, 1e-4);
  // At 5 mm/s it cuts more than that at any acceleration.
  EXPECT_EQ(advised(ShaperKind::zv, 1.0, 0.1), 0.0);
}

TEST(KlipperCalibration, NeedsMotion) {
  EXPECT_FALSE(klipper_calibration(1.5625, std::vector<double>(128, 0.0)));
  EXPECT_FALSE(klipper_calibration(1.5625, {}));
}

}  // namespace
}  // namespace unflex::rivals
