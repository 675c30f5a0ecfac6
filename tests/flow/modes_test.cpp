// Prints on axes of several modes.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"

namespace unflex::flow {
namespace {

using testing::JobFolder;

struct Case {
  std::string name;
  std::string modes;
  std::string firmware;
  double most_um = 0.0;
};

void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

const std::string kTwo =
    "[{freq_hz=45, damping_ratio=0.06, gain=0.8}, {freq_hz=110, damping_ratio=0.06, gain=0.2}]";
const std::string kOpposed =
    "[{freq_hz=45, damping_ratio=0.06, gain=1.2}, {freq_hz=110, damping_ratio=0.06, gain=-0.2}]";
const std::string kThree =
    "[{freq_hz=45.4, damping_ratio=0.071, gain=0.36}, {freq_hz=58.1, damping_ratio=0.085, "
    "gain=0.37}, {freq_hz=32.8, damping_ratio=0.152, gain=0.27}]";

// Two squares with a notch each, 80 mm/s.
std::string squares() {
  std::string text = "G28\nG90\nM83\nG1 X80 Y80 Z0.2 F6000\nG4 P500\nG1 F4800\n";
  for (int i = 0; i < 2; ++i) {
    text +=
        "G1 X110 E1\nG1 Y110 E1\nG1 X97 E0.5\nG1 X95 Y106 E0.2\nG1 X93 Y110 E0.2\n"
        "G1 X80 E0.5\nG1 Y80 E1\n";
  }
  return text + "M84\n";
}

class Modes : public ::testing::TestWithParam<Case> {};

TEST_P(Modes, AreCompensated) {
  const Case& one = GetParam();
  const JobFolder folder(squares(),
                         {"printer.firmware=" + one.firmware, "dynamics.x.mode=" + one.modes,
                          "dynamics.y.mode=" + one.modes});
  SilentProgress progress;
  const Result<report::Report> result = compensate(folder.job(), progress);
  ASSERT_TRUE(result) << to_string(result.error());
  const report::Report& made = *result;
  EXPECT_EQ(made.violation_count, 0U) << testing::complaints(made);
  EXPECT_EQ(made.runs.fallback, 0U) << testing::complaints(made);
  const double after_mm = made.measured.compensated.extruding.contour_rms_mm;
  EXPECT_LE(1e3 * after_mm, one.most_um);
  EXPECT_GE(testing::unshaped(made).extruding.contour_rms_mm, 5.0 * after_mm);
}

INSTANTIATE_TEST_SUITE_P(On, Modes,
                         ::testing::Values(Case{"TwoOnKlipper", kTwo, "klipper", 0.5},
                                           Case{"OpposedOnKlipper", kOpposed, "klipper", 0.5},
                                           Case{"ThreeOnKlipper", kThree, "klipper", 0.7},
                                           Case{"TwoOnMarlin", kTwo, "marlin", 2.0},
                                           Case{"ThreeOnRrf", kThree, "rrf", 1.5}),
                         [](const auto& one) { return one.param.name; });

// The axis is either as given or as one of two plants, each with this share.
std::string plants(double share) {
  const auto plant = [&](int freq_hz) {
    return "{share=" + std::to_string(share) + ", mode=[{freq_hz=" + std::to_string(freq_hz) +
           ", damping_ratio=0.06, gain=1}]}";
  };
  return "[" + plant(42) + ", " + plant(49) + "]";
}

report::Report made_for(const std::vector<std::string>& plants) {
  std::vector<std::string> settings = {"printer.firmware=klipper", "dynamics.x.freq_hz=45",
                                       "dynamics.y.freq_hz=45"};
  settings.insert(settings.end(), plants.begin(), plants.end());
  const JobFolder folder(squares(), settings);
  SilentProgress progress;
  Result<report::Report> result = compensate(folder.job(), progress);
  EXPECT_TRUE(result) << to_string(result.error());
  return *result;
}

TEST(Plants, AreSuitedByTheBaseAndMeasured) {
  EXPECT_TRUE(made_for({}).others.plants.empty());
  const auto of_both = [](double share) {
    return made_for({"dynamics.x.plant=" + plants(share), "dynamics.y.plant=" + plants(share)});
  };
  const report::Report hardly = of_both(1e-6);
  const report::Report suited = of_both(0.3);
  EXPECT_EQ(suited.runs.fallback, 0U) << testing::complaints(suited);
  ASSERT_EQ(suited.others.plants.size(), 2U);
  ASSERT_EQ(hardly.others.plants.size(), 2U);
  ASSERT_TRUE(suited.others.robustness.has_value());
  const auto together_mm = [](const report::Report& made) {
    return std::hypot(made.others.plants[0].compensated.rms_mm,
                      made.others.plants[1].compensated.rms_mm);
  };
  EXPECT_LT(together_mm(suited), 0.85 * together_mm(hardly));
  EXPECT_GT(suited.measured.compensated.extruding.contour_rms_mm,
            hardly.measured.compensated.extruding.contour_rms_mm);
  // One axis alone may have plants.
  const report::Report of_y = made_for({"dynamics.y.plant=" + plants(0.3)});
  EXPECT_EQ(of_y.others.plants.size(), 2U);
  EXPECT_TRUE(of_y.others.robustness.has_value());
}

}  // namespace
}  // namespace unflex::flow
