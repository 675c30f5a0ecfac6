#include "step.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace unflex::study {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kOmega = kStepOmega_rad_s;
constexpr double kHz = kOmega / (2.0 * kPi);

Staircase plain(double zeta) { return {kOmega, zeta, {{0.0, 1.0}}}; }

Staircase shaped(dynamics::ShaperKind kind, double zeta, double freq_factor = 1.0) {
  return {freq_factor * kOmega, zeta, *dynamics::shaper_pulses(kind, kHz, zeta)};
}

// With y = p − 1: y(0) = −1, ẏ(0) = 2ζω, so that
// y = e^{−ζωt} (ζ/√(1 − ζ²) sin ω_d t − cos ω_d t).
TEST(Staircase, OfOneStepMovesTheNozzleByTheClosedForm) {
  for (const double zeta : {0.0, 0.1, 0.5, 0.9}) {
    const double root = std::sqrt(1.0 - zeta * zeta);
    for (const double t : {0.0, 0.003, 0.01, 0.04, 0.2}) {
      const double angle = kOmega * root * t;
      const double y =
          std::exp(-zeta * kOmega * t) * (zeta / root * std::sin(angle) - std::cos(angle));
      EXPECT_NEAR(plain(zeta).nozzle(t).position, 1.0 + y, 1e-12) << zeta << ' ' << t;
    }
    EXPECT_NEAR(plain(zeta).nozzle(0.0).velocity, 2.0 * zeta * kOmega, 1e-12);
  }
}

// ẏ = 0 at tan ω_d t = −2ζ√(1 − ζ²)/(1 − 2ζ²) = −tan(2 asin ζ), first at ω_d t = π − 2 asin ζ.
// There the bracket is 1. Without the damper on the base it would be e^{−πζ/√(1 − ζ²)}, which is
// less.
TEST(StepRow, OvershootsByTheClosedForm) {
  for (const double zeta : {0.0, 0.1, 0.5, 0.9}) {
    const double root = std::sqrt(1.0 - zeta * zeta);
    const double overshoot = std::exp(-zeta * (kPi - 2.0 * std::asin(zeta)) / root);
    EXPECT_NEAR(step_row(plain(zeta)).overshoot, overshoot, 1e-5) << zeta;
    EXPECT_GE(overshoot, std::exp(-kPi * zeta / root));
    EXPECT_NEAR(plain(zeta).left_mm(), 1.0 / root, 1e-12);
  }
}

TEST(StepRow, NeverSettlesAfterAPlainStepWithoutDamping) {
  EXPECT_FALSE(step_row(plain(0.0)).settled_s.has_value());
  EXPECT_TRUE(step_row(plain(0.1)).settled_s.has_value());
}

// p = ½ (1 − cos ωt) up to the second jump at half the period, where it has arrived at rest.
TEST(StepRow, OfZvWithoutDampingArrivesWithItsLastPulse) {
  const Staircase zv = shaped(dynamics::ShaperKind::zv, 0.0);
  EXPECT_NEAR(zv.last_s(), kPi / kOmega, 1e-15);
  for (const double after_s : {0.0, 0.01, 0.03, 0.2}) {
    const dynamics::NozzleMotion at = zv.nozzle(zv.last_s() + after_s);
    EXPECT_NEAR(at.position, 1.0, 1e-12);
    EXPECT_NEAR(at.velocity, 0.0, 1e-10);
  }
  const StepRow row = step_row(zv);
  EXPECT_NEAR(row.overshoot, 0.0, 1e-12);
  EXPECT_NEAR(row.left, 0.0, 1e-12);
  ASSERT_TRUE(row.settled_s.has_value());
  EXPECT_NEAR(*row.settled_s, std::acos(-0.9) / kOmega, 1e-6);
}

TEST(Staircase, OfEveryShaperLeavesNoVibrationAtItsFrequency) {
  for (const double zeta : kStepZetas) {
    for (const NamedStaircase& of : staircases(zeta)) {
      EXPECT_NEAR(of.staircase.base_mm(1.0), 1.0, 1e-14);
      if (of.shaper != "none") {
        EXPECT_NEAR(of.staircase.left_mm(), 0.0, 1e-12) << of.shaper << ' ' << zeta;
      }
    }
  }
}

// Without damping ZV leaves |cos(πr/2)|, r the frequency's factor, and ZVD the square of it.
TEST(Staircase, OfZvdMindsAWrongFrequencyLess) {
  using dynamics::ShaperKind;
  for (const double factor : {0.9, 0.95, 1.05, 1.1}) {
    const double zv = std::abs(std::cos(0.5 * kPi * factor));
    EXPECT_NEAR(shaped(ShaperKind::zv, 0.0, factor).left_mm(), zv, 1e-12);
    EXPECT_NEAR(shaped(ShaperKind::zvd, 0.0, factor).left_mm(), zv * zv, 1e-12);
  }
}

TEST(StepTable, HasEveryShaperForEveryDamping) {
  const std::vector<StepRow> rows = step_table();
  ASSERT_EQ(rows.size(), 12U);
  for (std::size_t i = 0; i < rows.size(); i += 4) {
    EXPECT_EQ(rows[i].shaper, "none");
    EXPECT_EQ(rows[i].zeta, kStepZetas[i / 4]);
    EXPECT_LT(rows[i + 3].left_off, rows[i + 2].left_off);
    EXPECT_LT(rows[i + 2].left_off, rows[i + 1].left_off);
    EXPECT_LT(rows[i + 1].left_off, rows[i].left_off);
  }
}

}  // namespace
}  // namespace unflex::study
