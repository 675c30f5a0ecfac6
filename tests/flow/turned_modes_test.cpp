// A machine whose modes do not lie along its axes.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "made_prints.hpp"

namespace unflex::flow {
namespace {

using testing::JobFolder;
using testing::Made;
using testing::rms_mm;
using Overrides = std::vector<std::string>;

// A CoreXY with belts of 40 and 36 N/mm, whose modes are at 80.2 and 56.5 Hz, 3° and 6° off X and
// Y.
Overrides belts(double b_n_mm) {
  return {"kinematics.type=corexy",
          "dynamics.of=masses",
          "dynamics.tool_mass_g=300",
          "dynamics.y.gantry_mass_g=300",
          "dynamics.a.stiffness_n_mm=40",
          "dynamics.a.damping_n_s_mm=0.012",
          "dynamics.b.stiffness_n_mm=" + std::to_string(b_n_mm),
          "dynamics.b.damping_n_s_mm=" + std::to_string(0.012 * b_n_mm / 40.0),
          "dynamics.freq_error=0"};
}

// Its frequencies, along the axes.
const Overrides kOfAxes = {"kinematics.type=corexy",          "dynamics.x.freq_hz=80.2165",
                           "dynamics.x.damping_ratio=0.0756", "dynamics.y.freq_hz=56.4874",
                           "dynamics.y.damping_ratio=0.0532", "dynamics.freq_error=0"};

// Square rings of 40 mm.
std::string print() {
  std::string text = "G90\nM83\nG1 X100 Y100 Z0.2 F9000\n";
  for (int ring = 0; ring < 6; ++ring) {
    for (const char* const corner : {"X140 Y100", "X140 Y140", "X100 Y140", "X100 Y100"}) {
      text += std::string("G1 ") + corner + " E1.3\n";
    }
  }
  return text;
}

Made made(const std::vector<std::string>& overrides, unsigned workers = 2) {
  return testing::made(print(), overrides, workers);
}

TEST(BeltsThatDiffer, AreCompensatedAlongTheirModes) {
  const Made turned = made(belts(36.0));
  const JobFolder ignored(print(), belts(36.0));
  ignored.set_output(made(kOfAxes).text);
  SilentProgress progress;
  const Result<report::Report> measured = verify(ignored.job(), progress);
  ASSERT_TRUE(measured) << to_string(measured.error());
  EXPECT_LE(rms_mm(turned.report), 0.3 * rms_mm(*measured));
  EXPECT_LE(rms_mm(turned.report), 1.3 * rms_mm(made(belts(40.0)).report));
}

// Equal belts swing along the axes, so both ways to say it judge a print alike.
TEST(EqualBelts, AreTheAxes) {
  const Made by_masses = made(belts(40.0));
  const Overrides axes = {"kinematics.type=corexy",
                          "dynamics.x.freq_hz=82.18725920819999",
                          "dynamics.x.damping_ratio=0.07745966692414834",
                          "dynamics.y.freq_hz=58.11516831313255",
                          "dynamics.y.damping_ratio=0.054772255750516606",
                          "dynamics.freq_error=0"};
  const JobFolder folder(print(), axes);
  folder.set_output(by_masses.text);
  SilentProgress progress;
  const Result<report::Report> measured = verify(folder.job(), progress);
  ASSERT_TRUE(measured) << to_string(measured.error());
  EXPECT_NEAR(rms_mm(*measured), rms_mm(by_masses.report), 2e-3 * rms_mm(*measured));
  EXPECT_NEAR(measured->measured.uncompensated.extruding.contour_rms_mm,
              by_masses.report.measured.uncompensated.extruding.contour_rms_mm,
              1e-3 * by_masses.report.measured.uncompensated.extruding.contour_rms_mm);
}

TEST(BeltsThatDiffer, MakeTheSameTextForAnyNumberOfWorkers) {
  EXPECT_EQ(made(belts(36.0), 1).text, made(belts(36.0), 3).text);
}

// Tool of 300 g, carriages of 200 g, drives of 40 N/mm: X moves the nozzle in Z.
Overrides tripteron_overrides() {
  Overrides tripteron = {"kinematics.type=tripteron", "dynamics.of=masses",
                         "dynamics.tool_mass_g=300", "dynamics.freq_error=0"};
  for (const char* const motor : {"a", "b", "c"}) {
    for (const char* const key :
         {".carriage_mass_g=200", ".stiffness_n_mm=40", ".damping_n_s_mm=0.0142"}) {
      tripteron.push_back(std::string("dynamics.") + motor + key);
    }
  }
  return tripteron;
}

TEST(ATripteron, IsCompensatedInZToo) {
  const Overrides tripteron = tripteron_overrides();
  const Made whole = made(tripteron);
  const verify::Measured& measured = whole.report.measured;
  ASSERT_TRUE(measured.compensated.height && measured.uncompensated.height);
  // The sliced print has the printer's shaper, MZV.
  EXPECT_LE(rms_mm(whole.report), 0.3 * measured.uncompensated.extruding.contour_rms_mm);
  EXPECT_LE(measured.compensated.height->rms_mm, 0.3 * measured.uncompensated.height->rms_mm);
  EXPECT_GT(measured.uncompensated.height->rms_mm, 1e-3);
  EXPECT_NE(whole.text.find(" Z0."), std::string::npos);
  EXPECT_EQ(made(tripteron, 3).text, whole.text);
}

TEST(ATripteron, IsNotForIpopt) {
  const JobFolder folder(print(), tripteron_overrides());
  Job job = folder.job();
  job.engine = EngineChoice::ipopt;
  SilentProgress progress;
  const Result<report::Report> report = compensate(job, progress);
  ASSERT_FALSE(report);
  EXPECT_NE(to_string(report.error()).find("take the banded engine"), std::string::npos);
}

}  // namespace
}  // namespace unflex::flow
