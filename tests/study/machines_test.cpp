// The bench of real machines, and the fit that stands for a machine on it.
#include "unflex/study/machines.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <set>

#include "paths.hpp"
#include "report/documented_keys.hpp"
#include "unflex/study/case.hpp"
#include "unflex/study/truth.hpp"

namespace unflex::study {
namespace {

using ::testing::HasSubstr;

constexpr double kStep_hz = 1.5625;

dynamics::Mode mode(double freq_hz, double zeta, double gain) {
  return {2.0 * std::numbers::pi * freq_hz, zeta, gain};
}

std::complex<double> response(const std::vector<dynamics::Mode>& modes, double freq_hz) {
  std::complex<double> sum = 0.0;
  const std::complex<double> s(0.0, 2.0 * std::numbers::pi * freq_hz);
  for (const dynamics::Mode& m : modes) {
    const double w = m.omega_rad_s;
    sum += m.gain * (2.0 * m.zeta * w * s + w * w) / (s * s + 2.0 * m.zeta * w * s + w * w);
  }
  return sum;
}

// The density that a sweep leaves, scattered by a tenth.
std::vector<double> density_of(const std::vector<dynamics::Mode>& modes) {
  std::mt19937 random(3);
  std::normal_distribution<double> chance(0.0, 0.1);
  std::vector<double> density;
  for (int k = 0; k < 100; ++k) {
    const double freq_hz = k * kStep_hz;
    density.push_back(1e3 * freq_hz * freq_hz * std::norm(response(modes, freq_hz)) *
                          std::exp(chance(random)) +
                      1e3);
  }
  return density;
}

TEST(FittedTruth, RespondsAsTheMachineDoes) {
  for (const std::vector<dynamics::Mode>& machine :
       {std::vector{mode(48.0, 0.08, 1.0)},
        std::vector{mode(45.0, 0.07, 0.8), mode(75.0, 0.06, 0.35), mode(105.0, 0.06, -0.15)}}) {
    const auto truth = fitted_truth(kStep_hz, density_of(machine));
    ASSERT_TRUE(truth);
    double off = 0.0;
    double whole = 0.0;
    for (double freq_hz = 15.0; freq_hz < 120.0; freq_hz += 1.0) {
      off += std::norm((response(*truth, freq_hz) - response(machine, freq_hz)) / freq_hz);
      whole += std::norm((response(machine, freq_hz) - 1.0) / freq_hz);
    }
    EXPECT_LT(std::sqrt(off / whole), 0.15) << machine.size();
  }
}

TEST(FittedTruth, NeedsMotion) {
  EXPECT_FALSE(fitted_truth(kStep_hz, std::vector<double>(100, 0.0)));
  EXPECT_FALSE(fitted_truth(kStep_hz, {1.0, 2.0}));
}

// A machine of the corner's case, known exactly or 10 % off.
Machine machine_of(double known_hz) {
  const std::vector<dynamics::Mode> truth = {mode(45.0, 0.06, 1.0)};
  const auto shapers = *rivals::klipper_calibration(kStep_hz, density_of(truth));
  const MachineAxis axis{"known.csv", "truth.csv", truth, shapers};
  Case of;
  of.axis = dynamics::FlexibleAxis(2.0 * std::numbers::pi * known_hz, 0.06);
  Machine machine{"machine", {axis, axis}, corner_setup(of).unflex};
  for (compensate::AxisSetup* const one : {&machine.unflex.x, &machine.unflex.y}) {
    one->limits.max_accel_mm_s2 = 20000.0;
  }
  return machine;
}

MachineResult measured(const Machine& machine, unsigned workers = 1) {
  MachineBench bench(machine, {.workers = workers});
  const Run run{corner({}, 5000.0), {}};
  bench.add({run, run});
  return bench.result();
}

TEST(MachineBench, ShowsWhatAModelIsWorth) {
  const MachineResult exact = measured(machine_of(45.0));
  const MachineResult off = measured(machine_of(49.5));
  EXPECT_EQ(exact.failed_runs, 0U);
  EXPECT_GT(exact.of(Contender::uncompensated).rms_mm, 4.0 * exact.of(Contender::zv).rms_mm);
  EXPECT_LT(exact.of(Contender::unflex).rms_mm, 0.05 * exact.best_shaper().rms_mm);
  EXPECT_GT(off.of(Contender::unflex).rms_mm, 0.3 * exact.best_shaper().rms_mm);
  // What unflex knows is nothing to shapers.
  EXPECT_EQ(off.of(Contender::mzv).rms_mm, exact.of(Contender::mzv).rms_mm);
  for (const ContenderResult& of : exact.shifted[kNoShift]) {
    EXPECT_LE(of.rms_mm, of.p99_mm);
    EXPECT_LE(of.p99_mm, 1.01 * of.max_mm);
    EXPECT_LE(of.corner_rms_mm, of.corner_max_mm);
  }
}

TEST(MachineBench, GivesTheSameForAnyNumberOfThreads) {
  const MachineResult one = measured(machine_of(47.0));
  const MachineResult three = measured(machine_of(47.0), 3);
  for (std::size_t c = 0; c < kContenderCount; ++c) {
    EXPECT_EQ(one.shifted[0][c].rms_mm, three.shifted[0][c].rms_mm);
    EXPECT_EQ(one.shifted[kNoShift][c].p99_mm, three.shifted[kNoShift][c].p99_mm);
  }
}

TEST(MachineBench, MeasuresARunWithoutASolutionAsSliced) {
  Machine machine = machine_of(45.0);
  machine.unflex.x.limits.max_velocity_mm_s = 1.0;
  const MachineResult result = measured(machine);
  EXPECT_EQ(result.failed_runs, 2U);
  EXPECT_EQ(result.of(Contender::unflex).rms_mm, result.of(Contender::uncompensated).rms_mm);
}

TEST(MachineBench, TellsOfFrequenciesThatAreOff) {
  const MachineResult result = measured(machine_of(45.0));
  for (const std::size_t shift : {0U, 2U}) {
    EXPECT_GT(result.of(Contender::unflex, shift).rms_mm,
              10.0 * result.of(Contender::unflex).rms_mm);
  }
  EXPECT_NEAR(result.ratio(kNoShift),
              result.of(Contender::unflex).rms_mm / result.best_shaper().rms_mm, 1e-12);
}

TEST(MachinesReport, IsDocumentedAndNamesEachContender) {
  MachinesOutcome outcome;
  outcome.input = "print.gcode";
  outcome.printer.push_back({"limits.max_accel_mm_s2", "5000", "default"});
  outcome.machines.push_back(measured(machine_of(45.0)));
  outcome.machines.front().name = "<b>&";
  std::set<std::string> keys;
  report::collect_keys(nlohmann::json::parse(to_json(outcome)), "", keys);
  EXPECT_EQ(
      report::documented_keys(std::string(test_paths::kDocs) + "/report.md", "study --machines"),
      keys);
  const std::string text = to_text(outcome);
  const std::string page = to_html(outcome);
  for (std::size_t c = 0; c < kContenderCount; ++c) {
    EXPECT_THAT(text, HasSubstr(std::string(name(static_cast<Contender>(c)))));
  }
  EXPECT_THAT(page, HasSubstr("<h2>&lt;b&gt;&amp;</h2>"));
  EXPECT_THAT(text, HasSubstr("known from known.csv: 45.0 Hz ζ 0.060"));
}

}  // namespace
}  // namespace unflex::study
