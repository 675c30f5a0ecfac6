#include "unflex/dynamics/flexible_axis.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace unflex::dynamics {
namespace {

constexpr double kPi = std::numbers::pi;

NozzleState advance_rk4(const FlexibleAxis& axis, NozzleState state, BaseSegment base,
                        double duration, int steps) {
  const double h = duration / steps;
  for (int i = 0; i < steps; ++i) {
    state = rk4_step(axis, state, base, h);
    base.position += h * (base.velocity + 0.5 * base.acceleration * h);
    base.velocity += base.acceleration * h;
  }
  return state;
}

TEST(FlexibleAxis, TakesItsFrequencyInHertz) {
  const FlexibleAxis axis = from_frequency(45.0, 0.06);
  EXPECT_NEAR(axis.main().omega_rad_s, 282.74333882308139, 1e-12);
  EXPECT_DOUBLE_EQ(axis.main().zeta, 0.06);
}

TEST(ExactStep, RespondsToAStepOfTheBaseAsTheTextbookSays) {
  // p(t) = 1 − e^{−ζωt} (cos ω_d t + ζω/ω_d sin ω_d t), base at 1 from t = 0.
  const FlexibleAxis axis{100.0, 0.3};
  const double wd = 100.0 * std::sqrt(1.0 - 0.09);
  for (const double t : {1e-6, 1e-3, 0.01, 0.05, 0.3}) {
    const double decay = std::exp(-30.0 * t);
    const NozzleState state = exact_step(axis, {}, {1.0, 0.0, 0.0}, t);
    EXPECT_NEAR(state.position(), 1.0 - decay * (std::cos(wd * t) + 30.0 / wd * std::sin(wd * t)),
                1e-14);
    EXPECT_NEAR(state.velocity(), decay * 1e4 / wd * std::sin(wd * t), 1e-11);
  }
}

TEST(ExactStep, OvershootsAStepByTheLogarithmicDecrement) {
  const FlexibleAxis axis{282.7, 0.06};
  const double root = std::sqrt(1.0 - 0.06 * 0.06);
  const NozzleState peak = exact_step(axis, {}, {1.0, 0.0, 0.0}, kPi / (282.7 * root));
  EXPECT_NEAR(peak.position(), 1.0 + std::exp(-kPi * 0.06 / root), 1e-13);
  EXPECT_NEAR(peak.velocity(), 0.0, 1e-10);
}

TEST(ExactStep, RespondsToAStepWithoutOvershootWhenCriticallyDamped) {
  // p(t) = 1 − (1 + ωt) e^{−ωt}
  for (const double t : {1e-4, 0.01, 0.1}) {
    const NozzleState state = exact_step({100.0, 1.0}, {}, {1.0, 0.0, 0.0}, t);
    EXPECT_NEAR(state.position(), 1.0 - (1.0 + 100.0 * t) * std::exp(-100.0 * t), 1e-14);
    EXPECT_NEAR(state.velocity(), 1e4 * t * std::exp(-100.0 * t), 1e-11);
  }
}

TEST(ExactStep, RespondsToAStepWithTwoDecaysWhenOverdamped) {
  // Poles −50 and −200 rad/s: ω = 100, ζ = 1.25.
  const double t = 0.013;
  const NozzleState state = exact_step({100.0, 1.25}, {}, {1.0, 0.0, 0.0}, t);
  EXPECT_NEAR(state.position(),
              1.0 - (200.0 * std::exp(-50.0 * t) - 50.0 * std::exp(-200.0 * t)) / 150.0, 1e-14);
  EXPECT_NEAR(state.velocity(), 1e4 * (std::exp(-50.0 * t) - std::exp(-200.0 * t)) / 150.0, 1e-11);
}

TEST(ExactStep, IsContinuousInTheDampingRatioAroundOne) {
  const BaseSegment base{0.2, 30.0, 2000.0};
  const NozzleState start{0.1, -20.0};
  for (const double h : {1e-4, 0.01, 1.0}) {
    const NozzleState critical = exact_step({300.0, 1.0}, start, base, h);
    for (const double off : {-1e-9, -1e-13, -1e-16, 1e-16, 1e-13, 1e-9}) {
      const NozzleState near = exact_step({300.0, 1.0 + off}, start, base, h);
      EXPECT_NEAR(near.position(), critical.position(), 1e-10) << off;
      EXPECT_NEAR(near.velocity(), critical.velocity(), 1e-7) << off;
    }
  }
}

TEST(ExactStep, StaysFiniteWhenHeavilyOverdampedOverALongTime) {
  const NozzleState state = exact_step({1000.0, 50.0}, {1.0, 5.0}, {3.0, 0.0, 0.0}, 1e4);
  EXPECT_NEAR(state.position(), 3.0, 1e-12);
  EXPECT_NEAR(state.velocity(), 0.0, 1e-12);
}

TEST(ExactStep, FollowsAConstantVelocityAndLagsUnderConstantAcceleration) {
  const FlexibleAxis axis{100.0, 0.4};
  const NozzleState cruising = exact_step(axis, {2.0, 50.0}, {2.0, 50.0, 0.0}, 0.3);
  EXPECT_NEAR(cruising.position(), 17.0, 1e-12);
  EXPECT_NEAR(cruising.velocity(), 50.0, 1e-12);
  // The steady lag a/ω² = 5000/10⁴ mm stays as it is.
  const NozzleState accelerating = exact_step(axis, {-0.5, 0.0}, {0.0, 0.0, 5000.0}, 0.1);
  EXPECT_NEAR(accelerating.position(), 24.5, 1e-11);
  EXPECT_NEAR(accelerating.velocity(), 500.0, 1e-10);
}

TEST(ExactStep, KeepsTheEnergyOfAnUndampedAxis) {
  const FlexibleAxis axis{282.7, 0.0};
  NozzleState state{0.3, 40.0};
  const auto energy = [&axis](const NozzleState& s) {
    return s.velocity() * s.velocity() +
           axis.main().omega_rad_s * axis.main().omega_rad_s * s.position() * s.position();
  };
  const double before = energy(state);
  for (int i = 0; i < 100000; ++i) state = exact_step(axis, state, {}, 1e-3);
  EXPECT_NEAR(energy(state) / before, 1.0, 1e-10);
}

TEST(ExactStep, ComposesToTheSameStateHoweverTheTimeIsDivided) {
  std::mt19937_64 random(20240501);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int trial = 0; trial < 2000; ++trial) {
    const FlexibleAxis axis{std::exp(5.0 + unit(random)), 1.0 + unit(random)};
    const NozzleState start{unit(random), 100.0 * unit(random)};
    const BaseSegment base{unit(random), 300.0 * unit(random), 1e4 * unit(random)};
    const double h1 = 0.01 * (1.0 + unit(random));
    const double h2 = 0.01 * (1.0 + unit(random));
    const BaseSegment later{base.position + h1 * (base.velocity + 0.5 * base.acceleration * h1),
                            base.velocity + base.acceleration * h1, base.acceleration};
    const NozzleState once = exact_step(axis, start, base, h1 + h2);
    const NozzleState twice = exact_step(axis, exact_step(axis, start, base, h1), later, h2);
    ASSERT_NEAR(once.position(), twice.position(), 1e-11);
    ASSERT_NEAR(once.velocity(), twice.velocity(), 1e-9);
  }
}

TEST(ExactStep, LeavesTheStateAloneOverNoTime) {
  for (const double zeta : {0.0, 0.5, 1.0, 3.0}) {
    const NozzleState state = exact_step({100.0, zeta}, {0.7, -3.0}, {5.0, 1.0, 9.0}, 0.0);
    EXPECT_NEAR(state.position(), 0.7, 1e-14);
    EXPECT_NEAR(state.velocity(), -3.0, 1e-14);
  }
}

TEST(Rk4Step, ConvergesWithTheFourthOrder) {
  for (const double zeta : {0.0, 0.06, 0.5, 1.0, 1.5}) {
    const FlexibleAxis axis{100.0, zeta};
    const NozzleState start{0.5, -10.0};
    const BaseSegment base{0.1, 60.0, 5000.0};
    const double duration = 0.05;
    const NozzleState exact = exact_step(axis, start, base, duration);
    const auto error = [&](int steps) {
      const NozzleState got = advance_rk4(axis, start, base, duration, steps);
      return std::hypot(got.position() - exact.position(),
                        (got.velocity() - exact.velocity()) / axis.main().omega_rad_s);
    };
    const double order = std::log2(error(100) / error(200));
    EXPECT_NEAR(order, 4.0, 0.15) << "damping ratio " << zeta;
  }
}

TEST(Rk4Step, HasTheLocalErrorOfAFourthOrderTaylorSeries) {
  // Undamped free motion from p = 1: after one step the error in p is (ωh)⁶/720 − …, in ṗ/ω
  // (ωh)⁵/120 − ….
  const double x = 0.1;
  const NozzleState got = rk4_step({100.0, 0.0}, {1.0, 0.0}, {}, x / 100.0);
  EXPECT_NEAR(got.position(), 1.0 - x * x / 2.0 + std::pow(x, 4) / 24.0, 1e-15);
  EXPECT_NEAR(got.velocity() / 100.0, -x + x * x * x / 6.0, 1e-15);
}

NozzleState stepped(const ExactMap& map, NozzleState state, const BaseSegment& base) {
  map.advance(base, state);
  return state;
}

TEST(ExactMap, IsItsStep) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int trial = 0; trial < 500; ++trial) {
    const FlexibleAxis axis = from_frequency(60.0 + 40.0 * unit(random), 0.6 + 0.6 * unit(random));
    const NozzleState start{200.0 * unit(random), 100.0 * unit(random)};
    const BaseSegment base{start.position() + unit(random), 100.0 * unit(random),
                           2e4 * unit(random)};
    const double h = 1e-3 * (1.01 + unit(random));
    const NozzleState exact = exact_step(axis, start, base, h);
    const NozzleState by_exact_map = stepped(ExactMap(axis, h), start, base);
    ASSERT_NEAR(by_exact_map.position(), exact.position(), 1e-12);
    ASSERT_NEAR(by_exact_map.velocity(), exact.velocity(), 1e-9);
  }
}

TEST(Rk4Step, AgreesWithTheExactStepForSmallSteps) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int trial = 0; trial < 500; ++trial) {
    const FlexibleAxis axis = from_frequency(60.0 + 40.0 * unit(random), 0.6 + 0.6 * unit(random));
    const NozzleState start{unit(random), 100.0 * unit(random)};
    const BaseSegment base{start.position() + 0.1 * unit(random), 100.0 * unit(random),
                           2e4 * unit(random)};
    const NozzleState exact = exact_step(axis, start, base, 1e-3);
    const NozzleState got = advance_rk4(axis, start, base, 1e-3, 100);
    ASSERT_NEAR(got.position(), exact.position(), 1e-9);
    ASSERT_NEAR(got.velocity(), exact.velocity(), 1e-6);
  }
}

const std::array<Mode, 3> kModes = {Mode{280.0, 0.06, 1.1}, Mode{690.0, 0.1, -0.25},
                                    Mode{430.0, 0.03, 0.15}};

// p(s) = Σ g H_i(s) b(s), so each mode moves as it would alone, times its gain.
TEST(SeveralModes, AddUp) {
  const FlexibleAxis axis(kModes);
  NozzleState all = axis.riding(3.0, -7.0);
  std::array<NozzleState, 3> alone;
  for (std::size_t i = 0; i < 3; ++i) {
    alone[i] = FlexibleAxis{kModes[i].omega_rad_s, kModes[i].zeta}.riding(3.0, -7.0);
  }
  BaseSegment base{3.0, -7.0, 4000.0};
  for (int step = 0; step < 20; ++step) {
    all = exact_step(axis, all, base, 1e-3);
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      alone[i] = exact_step({kModes[i].omega_rad_s, kModes[i].zeta}, alone[i], base, 1e-3);
      sum += kModes[i].gain * alone[i].position();
    }
    ASSERT_NEAR(all.position(), sum, 1e-13);
    base.position += 1e-3 * (base.velocity + 0.5 * base.acceleration * 1e-3);
    base.velocity += base.acceleration * 1e-3;
  }
}

TEST(SeveralModes, StepAsFineRungeKuttaStepsDo) {
  const FlexibleAxis axis(kModes);
  NozzleState start;
  start.parts = {NozzleMotion{0.2, -3.0}, NozzleMotion{-0.1, 9.0}, NozzleMotion{0.05, 1.0}};
  const BaseSegment base{0.3, 20.0, -9000.0};
  const NozzleState exact = exact_step(axis, start, base, 5e-3);
  const NozzleState fine = advance_rk4(axis, start, base, 5e-3, 500);
  const NozzleState by_map = stepped(ExactMap(axis, 5e-3), start, base);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(exact.parts[i].position, fine.parts[i].position, 1e-9) << i;
    EXPECT_NEAR(exact.parts[i].velocity, fine.parts[i].velocity, 1e-6) << i;
    EXPECT_NEAR(exact.parts[i].position, by_map.parts[i].position, 1e-13) << i;
  }
}

TEST(SeveralModes, GoAlongWithAnEvenMotion) {
  const FlexibleAxis axis(kModes);
  const NozzleState later = exact_step(axis, axis.riding(10.0, 30.0), {10.0, 30.0, 0.0}, 0.25);
  const FlexibleAxis::Gap gap = axis.gap(later, axis.riding(17.5, 30.0));
  EXPECT_LE(gap.place_mm + gap.speed_mm, 1e-12);
  EXPECT_NEAR(later.position(), 17.5, 1e-12);
  EXPECT_NEAR(later.velocity(), 30.0, 1e-10);
}

TEST(SeveralModes, TellWhatIsAskedOfThem) {
  const FlexibleAxis axis(kModes);
  EXPECT_EQ(axis.main().omega_rad_s, 280.0);
  EXPECT_EQ(axis.slowest_rad_s(), 280.0);
  EXPECT_EQ(axis.fastest_rad_s(), 690.0);
  EXPECT_DOUBLE_EQ(axis.settling_s(), 4.0 / (0.03 * 430.0));
  EXPECT_DOUBLE_EQ(axis.decay_per_s(), 0.03 * 430.0);
  EXPECT_NEAR(axis.stiffness_per_s2(),
              1.1 * 280.0 * 280.0 - 0.25 * 690.0 * 690.0 + 0.15 * 430.0 * 430.0, 1e-8);
  EXPECT_DOUBLE_EQ(axis.detuned(1.1).fastest_rad_s(), 759.0);
}

// A base that moves as e^{st} with s at a zero leaves the nozzle at rest. For two modes of equal
// damping ratio the zeros come from the antiresonance, f₁f₂/√(g₁f₁² + g₂f₂²).
TEST(SeveralModes, AreBlindAtTheirZeros) {
  EXPECT_EQ(FlexibleAxis(280.0, 0.06).unseen_s(), 0.0);
  const std::array<Mode, 2> modes = {Mode{282.743, 0.06, 0.8}, Mode{691.150, 0.06, 0.2}};
  const double antiresonance =
      282.743 * 691.150 / std::sqrt(0.8 * 282.743 * 282.743 + 0.2 * 691.150 * 691.150);
  // Lightly damped modes: the zero's real part is nearly ζ times what both modes' dampings leave.
  const double longest = std::log(1e5) / FlexibleAxis(modes).unseen_s();
  EXPECT_NEAR(longest / antiresonance, 0.06, 0.02);
}

// A mode behind the nozzle of another axis: p̈₂ = 2ζω(ṗ − ṗ₂) + ω²(p − p₂), by Runge–Kutta steps of
// both equations as they stand.
struct Chain {
  Mode first;
  Mode second;
  std::array<double, 4> state{};  // p, ṗ, p₂, ṗ₂

  [[nodiscard]] std::array<double, 4> slope(const std::array<double, 4>& z, double b,
                                            double rate) const {
    const auto pull = [](const Mode& mode, double place, double speed) {
      return mode.damping_per_s() * speed + mode.stiffness_per_s2() * place;
    };
    return {z[1], pull(first, b - z[0], rate - z[1]), z[3], pull(second, z[0] - z[2], z[1] - z[3])};
  }

  void step(const BaseSegment& base, double h) {
    const auto at = [&](double t, const std::array<double, 4>& z) {
      return slope(z, base.position + t * (base.velocity + 0.5 * base.acceleration * t),
                   base.velocity + base.acceleration * t);
    };
    const auto moved = [&](const std::array<double, 4>& k, double t) {
      std::array<double, 4> z = state;
      for (std::size_t i = 0; i < 4; ++i) {
        z[i] += t * k[i];
      }
      return z;
    };
    const auto k1 = at(0.0, state);
    const auto k2 = at(0.5 * h, moved(k1, 0.5 * h));
    const auto k3 = at(0.5 * h, moved(k2, 0.5 * h));
    const auto k4 = at(h, moved(k3, h));
    for (std::size_t i = 0; i < 4; ++i) {
      state[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
    }
  }
};

TEST(FollowedBy, SwingsAsTheChainDoes) {
  for (const auto& [first, second] : {std::pair(Mode{282.7, 0.06}, Mode{691.0, 0.05}),
                                      std::pair(Mode{400.0, 0.3}, Mode{200.0, 0.1}),
                                      std::pair(Mode{282.7, 0.0}, Mode{691.0, 0.0}),
                                      std::pair(Mode{300.0, 1.2}, Mode{500.0, 0.4})}) {
    const FlexibleAxis axis =
        FlexibleAxis(first.omega_rad_s, first.zeta).followed_by(second.omega_rad_s, second.zeta);
    Chain chain{first, second};
    NozzleState exact;
    NozzleState rk4;
    BaseSegment base;
    std::mt19937 random(5);
    std::uniform_real_distribution<double> accel(-1e4, 1e4);
    constexpr double kStep_s = 1e-3;
    constexpr int kFine = 50;
    for (int i = 0; i < 200; ++i) {
      base.acceleration = accel(random);
      exact = exact_step(axis, exact, base, kStep_s);
      for (int k = 0; k < kFine; ++k) {
        const double h = kStep_s / kFine;
        chain.step(base, h);
        rk4 = rk4_step(axis, rk4, base, h);
        base.position += h * (base.velocity + 0.5 * base.acceleration * h);
        base.velocity += base.acceleration * h;
      }
      EXPECT_NEAR(exact.position(), chain.state[2], 1e-7);
      EXPECT_NEAR(exact.velocity(), chain.state[3], 1e-4);
      EXPECT_NEAR(rk4.position(), chain.state[2], 1e-7);
    }
  }
}

TEST(FollowedBy, RidesWithoutLag) {
  const FlexibleAxis axis = from_frequency(45.0, 0.06).followed_by(691.0, 0.05);
  const NozzleState riding = axis.riding(3.0, 100.0);
  EXPECT_NEAR(riding.position(), 3.0, 1e-12);
  EXPECT_NEAR(riding.velocity(), 100.0, 1e-10);
  const NozzleState later = exact_step(axis, riding, {3.0, 100.0, 0.0}, 0.01);
  EXPECT_NEAR(later.position(), 4.0, 1e-12);
  EXPECT_NEAR(later.velocity(), 100.0, 1e-9);
}

TEST(FollowedBy, HasNoZerosButThoseOfTheDampers) {
  // (2ζ₁ω₁ s + ω₁²)(2ζ₂ω₂ s + ω₂²), so −ω/2ζ for each, and one that has gone to infinity.
  const FlexibleAxis axis = FlexibleAxis(300.0, 0.1).followed_by(700.0, 0.2);
  std::vector<double> near;
  for (const std::complex<double>& zero : axis.zeros()) {
    if (std::abs(zero) < 1e5) {
      EXPECT_NEAR(zero.imag(), 0.0, 1e-3);
      near.push_back(zero.real());
    }
  }
  std::ranges::sort(near);
  ASSERT_EQ(near.size(), 2U);
  EXPECT_NEAR(near[0], -1750.0, 0.1);
  EXPECT_NEAR(near[1], -1500.0, 0.1);
}

TEST(FollowedBy, MayBeDetuned) {
  const FlexibleAxis once = FlexibleAxis(300.0, 0.1).followed_by(700.0, 0.2).detuned(1.1);
  const FlexibleAxis twice = FlexibleAxis(330.0, 0.1).followed_by(770.0, 0.2);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(once.modes()[i].gain, twice.modes()[i].gain, 1e-12);
    EXPECT_NEAR(once.modes()[i].lead_s, twice.modes()[i].lead_s, 1e-15);
  }
}

}  // namespace
}  // namespace unflex::dynamics
