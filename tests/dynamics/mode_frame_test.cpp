#include "unflex/dynamics/mode_frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace unflex::dynamics {
namespace {

using Matrix = ModeFrame::Matrix;
using Vector = ModeFrame::Vector;

// m I + Jᵀ diag(of_motors) J
Matrix sum(const Vector& of_axes, const Matrix& rows, const Vector& of_motors) {
  Matrix result{};
  for (std::size_t i = 0; i < 3; ++i) {
    result[i][i] = of_axes[i];
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t motor = 0; motor < 3; ++motor) {
        result[i][j] += rows[motor][i] * of_motors[motor] * rows[motor][j];
      }
    }
  }
  return result;
}

constexpr Matrix kTripteron = {{{1.0, 1.0, -1.0}, {1.0, -1.0, -1.0}, {1.0, 0.0, 1.0}}};
constexpr Matrix kCoreXY = {{{1.0, 1.0, 0.0}, {1.0, -1.0, 0.0}, {0.0, 0.0, 0.0}}};

ModeFrame tripteron() {
  return ModeFrame::of({sum({0.3, 0.3, 0.3}, kTripteron, {0.2, 0.2, 0.2}),
                        {},
                        sum({}, kTripteron, {40.0, 40.0, 40.0})})
      .value();
}

ModeFrame corexy(double a_n_mm, double b_n_mm) {
  return ModeFrame::of(
             {sum({0.3, 0.6, 0.3}, kCoreXY, {}), {}, sum({}, kCoreXY, {a_n_mm, b_n_mm, 0.0})})
      .value();
}

double hz(const ModeFrame& frame, std::size_t i) {
  return frame.mode(i).value().omega_rad_s / (2.0 * std::numbers::pi);
}

// p − b, µm, while the base accelerates for ever: −Φ β̈/ω².
Vector lag_um(const ModeFrame& frame, const Vector& accel_mm_s2) {
  Vector modes = frame.to_modes(accel_mm_s2);
  for (std::size_t i = 0; i < 3; ++i) {
    modes[i] = frame.mode(i) ? -1e3 * modes[i] / frame.mode(i)->stiffness_per_s2() : 0.0;
  }
  return frame.to_axes(modes);
}

double degrees(const ModeFrame& frame, std::size_t mode) {
  const double x = frame.to_axes()[0][mode];
  const double y = frame.to_axes()[1][mode];
  return 180.0 / std::numbers::pi *
         (mode == 0 ? std::atan2(std::abs(y), x) : std::atan2(std::abs(x), y));
}

TEST(ATripteron, SwingsAtTwoFrequencies) {
  const ModeFrame frame = tripteron();
  EXPECT_NEAR(hz(frame, 1), 53.8042, 5e-5);
  const double low = std::min(hz(frame, 0), hz(frame, 2));
  const double high = std::max(hz(frame, 0), hz(frame, 2));
  EXPECT_NEAR(low, 53.8042, 5e-5);
  EXPECT_NEAR(high, 60.6993, 5e-5);
  const Vector x_um = lag_um(frame, {5000.0, 0.0, 0.0});
  EXPECT_NEAR(x_um[0], -39.0625, 5e-5);
  EXPECT_NEAR(x_um[1], 0.0, 1e-9);
  EXPECT_NEAR(x_um[2], -4.6875, 5e-5);
  const Vector y_um = lag_um(frame, {0.0, 5000.0, 0.0});
  EXPECT_NEAR(y_um[0], 0.0, 1e-9);
  EXPECT_NEAR(y_um[1], -43.75, 5e-5);
  EXPECT_NEAR(y_um[2], 0.0, 1e-9);
}

TEST(ACoreXY, SwingsAlongItsAxesWhereItsBeltsAreEqual) {
  const ModeFrame frame = corexy(40.0, 40.0);
  EXPECT_NEAR(hz(frame, 1), 58.1152, 5e-5);
  EXPECT_NEAR(hz(frame, 0), 82.1873, 5e-5);
  EXPECT_FALSE(frame.mode(2));
  EXPECT_NEAR(lag_um(frame, {5000.0, 0.0, 0.0})[0], -18.75, 1e-9);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(degrees(frame, i), 0.0, 1e-6);
    EXPECT_NEAR(frame.gain(i, i), 1.0, 1e-12);
  }
}

TEST(ACoreXY, TurnsItsModesWhereItsBeltsDiffer) {
  const ModeFrame frame = corexy(40.0, 36.0);
  EXPECT_NEAR(hz(frame, 1), 56.4874, 5e-5);
  EXPECT_NEAR(hz(frame, 0), 80.2165, 5e-5);
  EXPECT_NEAR(std::max(degrees(frame, 0), degrees(frame, 1)), 6.0, 0.05);
  EXPECT_NEAR(std::min(degrees(frame, 0), degrees(frame, 1)), 3.0, 0.05);
  EXPECT_NEAR(std::abs(lag_um(frame, {5000.0, 0.0, 0.0})[1]), 1.04, 0.005);
  const ModeFrame more = corexy(40.0, 30.0);
  EXPECT_NEAR(hz(more, 1), 53.2836, 5e-5);
  EXPECT_NEAR(hz(more, 0), 77.6303, 5e-5);
  EXPECT_NEAR(std::max(degrees(more, 0), degrees(more, 1)), 15.4, 0.05);
  EXPECT_NEAR(std::min(degrees(more, 0), degrees(more, 1)), 7.8, 0.05);
}

TEST(AModeFrame, GoesToItsCoordinatesAndBack) {
  for (const ModeFrame& frame : {tripteron(), corexy(40.0, 31.0)}) {
    const Vector p = {3.0, -7.0, 11.0};
    const Vector back = frame.to_axes(frame.to_modes(p));
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(back[i], p[i], 1e-12);
      double gains = 0.0;
      for (std::size_t j = 0; j < 3; ++j) {
        gains += frame.gain(i, j);
      }
      EXPECT_NEAR(gains, 1.0, 1e-12);
    }
  }
}

// The equation of motion itself, by RK4 in the axes: M p̈ = C (ḃ − ṗ) + K (b − p). Damping is
// proportional to stiffness, so that nothing is left out.
TEST(AModeFrame, MovesAsTheMassesDo) {
  constexpr double kShare_s = 4e-4;
  const double ka = 40.0;
  const double kb = 30.0;
  ModeFrame::Masses masses{
      sum({0.3, 0.6, 0.3}, kCoreXY, {0.05, 0.05, 0.0}), {}, sum({}, kCoreXY, {ka, kb, 0.0})};
  masses.mass_kg[2][2] = 1.0;
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t j = 0; j < 2; ++j) {
      masses.damping_n_s_mm[i][j] = kShare_s * masses.stiffness_n_mm[i][j];
    }
  }
  const ModeFrame frame = ModeFrame::of(masses).value();
  EXPECT_NEAR(frame.left_out(), 0.0, 1e-12);
  const Vector accel = {3000.0, -1200.0, 0.0};
  NozzleXY nozzle;
  // y = p − b, and its rate.
  std::array<double, 4> state{};
  const double determinant =
      masses.mass_kg[0][0] * masses.mass_kg[1][1] - masses.mass_kg[0][1] * masses.mass_kg[1][0];
  const auto rate = [&](const std::array<double, 4>& s) {
    std::array<double, 2> force{};
    for (std::size_t i = 0; i < 2; ++i) {
      for (std::size_t j = 0; j < 2; ++j) {
        force[i] -=
            1e3 * (masses.stiffness_n_mm[i][j] * s[j] + masses.damping_n_s_mm[i][j] * s[2 + j]);
      }
    }
    return std::array<double, 4>{
        s[2], s[3],
        (masses.mass_kg[1][1] * force[0] - masses.mass_kg[0][1] * force[1]) / determinant -
            accel[0],
        (masses.mass_kg[0][0] * force[1] - masses.mass_kg[1][0] * force[0]) / determinant -
            accel[1]};
  };
  constexpr double kH_s = 1e-5;
  for (int step = 0; step < 2000; ++step) {
    const auto plus = [&](const std::array<double, 4>& k, double h) {
      std::array<double, 4> next = state;
      for (std::size_t i = 0; i < 4; ++i) {
        next[i] += h * k[i];
      }
      return next;
    };
    const auto k1 = rate(state);
    const auto k2 = rate(plus(k1, 0.5 * kH_s));
    const auto k3 = rate(plus(k2, 0.5 * kH_s));
    const auto k4 = rate(plus(k3, kH_s));
    for (std::size_t i = 0; i < 4; ++i) {
      state[i] += kH_s / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    }
  }
  for (int step = 0; step < 20; ++step) {
    const double t = 1e-3 * step;
    frame.advance({accel[0] * t, accel[1] * t, 0.0}, accel, 1e-3, nozzle);
  }
  const auto ahead = frame.ahead(nozzle);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(ahead[i].position, state[i], 1e-9);
    EXPECT_NEAR(ahead[i].velocity, state[2 + i] + accel[i] * 20e-3, 1e-6);
  }
  EXPECT_EQ(ahead[2].position, 0.0);
}

TEST(AModeFrame, RefusesWhatCannotSwing) {
  EXPECT_FALSE(ModeFrame::of({}).has_value());
  EXPECT_FALSE(ModeFrame::of({{}, {}, sum({}, kCoreXY, {40.0, 40.0, 0.0})}).has_value());
  // One belt alone holds one direction alone.
  EXPECT_FALSE(
      ModeFrame::of({sum({0.3, 0.3, 0.3}, kCoreXY, {}), {}, sum({}, kCoreXY, {40.0, 0.0, 0.0})})
          .has_value());
}

}  // namespace
}  // namespace unflex::dynamics
