#include "step_path.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include "line_cost.hpp"
#include "line_fan.hpp"
#include "plain_base.hpp"
#include "step_ends.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::emit {
namespace {

using dynamics::BaseTrajectory;
using dynamics::NozzleState;

using PathFunction = std::function<std::array<double, 2>(double)>;

// Rises from 0 to 1 over the duration, with the first two derivatives zero at both ends.
double rise(double t, double duration_s) {
  const double s = std::clamp(t / duration_s, 0.0, 1.0);
  return s * s * s * (10.0 + s * (6.0 * s - 15.0));
}

BaseTrajectory wavy_base() {
  return testing::sampled(
      [](double t) {
        return std::array{5.0 * rise(t, 0.1), 2.0 * std::sin(30.0 * t) * rise(t, 0.1)};
      },
      0.1);
}

ErrorWeight all_alike(double) { return {}; }

// Moves a nozzle by exact_step, in steps of at most 0.1 ms, while the base follows straight lines
// between the polygon's vertices. `look` gets the time and both axes.
void follow(const Polygon& polygon, const LineRules& rules, double until_s,
            const std::function<void(double, NozzleState, NozzleState)>& look) {
  NozzleState x{polygon.places_mm.x.front(), 0.0};
  NozzleState y{polygon.places_mm.y.front(), 0.0};
  const auto hold = [&](double from, double to, std::array<double, 2> at,
                        std::array<double, 2> speed) {
    const int steps = std::max(static_cast<int>(std::ceil((to - from) / 1e-4)), 1);
    const double h = (to - from) / steps;
    for (int i = 0; i < steps; ++i) {
      const double t = h * i;
      x = dynamics::exact_step(rules.nozzle.x, x, {at[0] + speed[0] * t, speed[0], 0.0}, h);
      y = dynamics::exact_step(rules.nozzle.y, y, {at[1] + speed[1] * t, speed[1], 0.0}, h);
      look(from + t + h, x, y);
    }
  };
  for (std::size_t i = 1; i < polygon.times_s.size(); ++i) {
    const double duration = polygon.times_s[i] - polygon.times_s[i - 1];
    hold(polygon.times_s[i - 1], polygon.times_s[i],
         {polygon.places_mm.x[i - 1], polygon.places_mm.y[i - 1]},
         {(polygon.places_mm.x[i] - polygon.places_mm.x[i - 1]) / duration,
          (polygon.places_mm.y[i] - polygon.places_mm.y[i - 1]) / duration});
  }
  if (until_s > polygon.times_s.back() + 1e-9) {
    hold(polygon.times_s.back(), until_s, {polygon.places_mm.x.back(), polygon.places_mm.y.back()},
         {0.0, 0.0});
  }
}

// RMS distance in µm, across `normal`, between this nozzle and the one that follows the base
// itself.
double error_um(const Polygon& polygon, const BaseTrajectory& base, const LineRules& rules,
                std::array<double, 2> normal) {
  const Followed fx(base, 0, rules.nozzle.x);
  const Followed fy(base, 1, rules.nozzle.y);
  double sum = 0.0;
  int count = 0;
  follow(polygon, rules, base.duration_s(), [&](double t, NozzleState x, NozzleState y) {
    const double off = normal[0] * (x.position() - fx.at(t).position()) +
                       normal[1] * (y.position() - fy.at(t).position());
    sum += off * off;
    ++count;
  });
  return 1e3 * std::sqrt(sum / count);
}

LineRules marlin_rules() {
  LineRules rules;
  rules.min_line_s = 2e-3;
  rules.min_steps = 6;
  rules.burst_lines = 18;
  return rules;
}

const AxisGrid kSteps{0.0, 0.0125};

TEST(LineCosts, AgreeWithTheNozzleStepByStep) {
  const BaseTrajectory base = wavy_base();
  LineRules rules;
  rules.nozzle.y = dynamics::from_frequency(37.0, 0.1);
  const ErrorWeight weight{0.9, 0.2, 0.3};
  const LineCosts<1> costs(
      base, [&](double t) { return t < 0.06 ? weight : ErrorWeight{}; }, rules);
  const Followed fx(base, 0, rules.nozzle.x);
  const Followed fy(base, 1, rules.nozzle.y);
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 0.02);
  for (const std::size_t k : {0U, 50U, 115U}) {  // the last line sees two weights
    const std::size_t m = 10;
    WVector<1> w;
    for (Eigen::Index i = 0; i < 8; ++i) {
      w[i] = normal(random) * (i == 1 || i == 4 ? 100.0 : 1.0);
    }
    const double from = costs.time_s(k);
    const double duration = costs.time_s(k + m) - from;
    const Eigen::Vector2d start = costs.base_mm(k) + Eigen::Vector2d(w[2], w[5]);
    const Eigen::Vector2d end = costs.base_mm(k + m) + Eigen::Vector2d(w[6], w[7]);
    const Eigen::Vector2d speed = (end - start) / duration;
    NozzleState x{fx.at(from).position() + w[0], fx.at(from).velocity() + w[1]};
    NozzleState y{fy.at(from).position() + w[3], fy.at(from).velocity() + w[4]};
    double cost = 0.0;
    for (std::size_t j = 1; j <= m; ++j) {
      const double h = costs.dt_s();
      const Eigen::Vector2d at = start + speed * (static_cast<double>(j - 1) * h);
      x = dynamics::exact_step(rules.nozzle.x, x, {at[0], speed[0], 0.0}, h);
      y = dynamics::exact_step(rules.nozzle.y, y, {at[1], speed[1], 0.0}, h);
      const double t = costs.time_s(k + j);
      const double ex = x.position() - fx.at(t).position();
      const double ey = y.position() - fy.at(t).position();
      const ErrorWeight used = t < 0.06 ? weight : ErrorWeight{};
      const Eigen::Vector2d off = at + speed * h - costs.base_mm(k + j);
      cost += 0.5 * h * (used.xx * ex * ex + 2.0 * used.xy * ex * ey + used.yy * ey * ey) +
              0.5 * h * 1e-3 * off.squaredNorm();
    }
    const LineCost<1> line = costs.line(k, m);
    const ZVector<1> z = line.move * w + line.shift;
    EXPECT_NEAR(z[0], x.position() - fx.at(from + duration).position(), 1e-10);
    EXPECT_NEAR(z[1], x.velocity() - fx.at(from + duration).velocity(), 1e-8);
    EXPECT_DOUBLE_EQ(z[2], w[6]);
    EXPECT_NEAR(z[3], y.position() - fy.at(from + duration).position(), 1e-10);
    EXPECT_NEAR(z[4], y.velocity() - fy.at(from + duration).velocity(), 1e-8);
    EXPECT_DOUBLE_EQ(z[5], w[7]);
    const double claimed = w.dot(0.5 * (line.matrix * w) + line.slope) + line.constant;
    EXPECT_NEAR(claimed, cost, 1e-9 * cost);
  }
}

// Two modes along X and three along Y: the cost and the state behind a line, and the same from the
// fan, against the nozzle step by step.
TEST(LineCosts, AgreeWithANozzleOfSeveralModes) {
  using dynamics::Mode;
  constexpr int kThree = 3;
  const BaseTrajectory base = wavy_base();
  const std::array along_x = {Mode{282.7, 0.06, 1.2}, Mode{691.2, 0.1, -0.2}};
  const std::array along_y = {Mode{285.3, 0.071, 0.36}, Mode{365.1, 0.085, 0.37},
                              Mode{206.1, 0.152, 0.27}};
  LineRules rules;
  rules.nozzle.x = dynamics::FlexibleAxis(along_x);
  rules.nozzle.y = dynamics::FlexibleAxis(along_y);
  const ErrorWeight weight{0.9, 0.2, 0.3};
  const LineCosts<kThree> costs(
      base, [&](double) { return weight; }, rules);
  const Followed fx(base, 0, rules.nozzle.x);
  const Followed fy(base, 1, rules.nozzle.y);
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 0.02);
  const auto swing = [&](const dynamics::FlexibleAxis& axis) {
    NozzleState state;
    for (std::size_t i = 0; i < axis.modes().size(); ++i) {
      state.parts[i] = {normal(random), 100.0 * normal(random)};
    }
    return state;
  };
  LineFan<kThree> fan(costs);
  for (const std::size_t k : {0U, 50U, 115U}) {
    const std::size_t m = 10;
    const NozzleState swing_x = swing(rules.nozzle.x);
    const NozzleState swing_y = swing(rules.nozzle.y);
    WVector<kThree> w;
    w << vector_of<kThree>(swing_x), normal(random), vector_of<kThree>(swing_y), normal(random),
        normal(random), normal(random);
    const ZVector<kThree> z_before = w.head<kOfZ<kThree>>();
    const double from = costs.time_s(k);
    const double duration = costs.time_s(k + m) - from;
    const Eigen::Vector2d start = costs.base_mm(k) + Eigen::Vector2d(w[6], w[13]);
    const Eigen::Vector2d end = costs.base_mm(k + m) + Eigen::Vector2d(w[14], w[15]);
    const Eigen::Vector2d speed = (end - start) / duration;
    NozzleState x = fx.at(from);
    NozzleState y = fy.at(from);
    x.add(swing_x);
    y.add(swing_y);
    double cost = 0.0;
    const double h = costs.dt_s();
    for (std::size_t j = 1; j <= m; ++j) {
      const Eigen::Vector2d at = start + speed * (static_cast<double>(j - 1) * h);
      x = dynamics::exact_step(rules.nozzle.x, x, {at[0], speed[0], 0.0}, h);
      y = dynamics::exact_step(rules.nozzle.y, y, {at[1], speed[1], 0.0}, h);
      const double t = costs.time_s(k + j);
      const double ex = x.position() - fx.at(t).position();
      const double ey = y.position() - fy.at(t).position();
      const Eigen::Vector2d off = at + speed * h - costs.base_mm(k + j);
      cost += 0.5 * h * (weight.xx * ex * ex + 2.0 * weight.xy * ex * ey + weight.yy * ey * ey) +
              0.5 * h * 1e-3 * off.squaredNorm();
    }
    x.add(fx.at(from + duration), -1.0);
    y.add(fy.at(from + duration), -1.0);
    ZVector<kThree> expected;
    expected << vector_of<kThree>(x), w[14], vector_of<kThree>(y), w[15];
    const LineCost<kThree> line = costs.line(k, m);
    EXPECT_LE((line.move * w + line.shift - expected).cwiseAbs().maxCoeff(), 1e-7);
    EXPECT_NEAR(w.dot(0.5 * (line.matrix * w) + line.slope) + line.constant, cost, 1e-9 * cost);
    fan.begin(k, std::span(&z_before, 1));
    fan.reach(m);
    EXPECT_LE((fan.after(0, speed) - expected).cwiseAbs().maxCoeff(), 1e-7);
    EXPECT_NEAR(fan.cost(0, speed), cost, 1e-8 * cost);
    const Quadratic<kThree> to_go = costs.ring_down();
    EXPECT_NEAR(fan.choice(to_go).at(0, speed), cost + to_go.at(expected),
                1e-8 * (cost + to_go.at(expected)));
  }
}

TEST(LineCosts, RingDownIsTheIntegralOfTheSquareOfSeveralModes) {
  using dynamics::Mode;
  const std::array modes = {Mode{282.7, 0.06, 1.2}, Mode{691.2, 0.1, -0.2}, Mode{300.0, 0.05, 0.0}};
  const dynamics::FlexibleAxis axis(modes);
  NozzleState state;
  state.parts = {dynamics::NozzleMotion{0.01, -2.0}, dynamics::NozzleMotion{-0.004, 5.0},
                 dynamics::NozzleMotion{0.003, 1.0}};
  const ModesVector<3> z = vector_of<3>(state);
  double sum = 0.0;
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 100000; ++i) {
    const NozzleState next = dynamics::exact_step(axis, state, {}, kStep);
    sum += 0.5 * kStep * (std::pow(state.position(), 2) + std::pow(next.position(), 2));
    state = next;
  }
  EXPECT_NEAR(z.dot(ring_down_square<3>(axis) * z), sum, 1e-5 * sum);
}

TEST(LineFan, AgreesWithLineCostsAndBestEnd) {
  const BaseTrajectory base = wavy_base();
  LineRules rules;
  rules.nozzle.y = dynamics::from_frequency(37.0, 0.1);
  const LineCosts<1> costs(
      base,
      [](double t) {
        return t < 0.06 ? ErrorWeight{0.9, 0.2, 0.3} : ErrorWeight{};
      },
      rules);
  std::mt19937 random(11);
  std::normal_distribution<double> normal(0.0, 0.02);
  Quadratic<1> to_go = costs.ring_down();
  const ZMatrix<1> any = ZMatrix<1>::NullaryExpr([&] { return 1e-2 * normal(random); });
  to_go.matrix += any * any.transpose();
  to_go.slope = ZVector<1>::NullaryExpr([&] { return 1e-3 * normal(random); });
  to_go.constant = 1e-5;
  LineFan<1> fan(costs);
  for (const std::size_t k : {0U, 50U, 115U}) {  // some of the last lines see two weights
    std::array<ZVector<1>, kLanes - 1> states;
    for (ZVector<1>& z : states) {
      z = ZVector<1>::NullaryExpr([&] { return normal(random); });
      z[1] *= 100.0;
      z[4] *= 100.0;
    }
    fan.begin(k, states);
    for (const std::size_t m : {1U, 7U, 12U, 16U}) {
      fan.reach(m);
      const LineCost<1> line = costs.line(k, m);
      const LineChoice<1> expected = best_end(line, to_go);
      const FanChoice choice = fan.choice(to_go);
      for (std::size_t lane = 0; lane < states.size(); ++lane) {
        const ZVector<1>& z = states[lane];
        const Eigen::Vector2d start = costs.base_mm(k) + Eigen::Vector2d(z[2], z[5]);
        const Eigen::Vector2d best_mm =
            costs.base_mm(k + m) + expected.feedback * z + expected.feed_forward;
        EXPECT_LE((start + fan.duration_s() * choice.best_mm_s(lane) - best_mm).norm(), 1e-9);
        const double least = expected.value.at(z);
        EXPECT_NEAR(choice.least[static_cast<Eigen::Index>(lane)], least, 1e-9 * std::abs(least));

        const Eigen::Vector2d v(normal(random) * 1e3, normal(random) * 1e3);
        WVector<1> w;
        w << z, start + fan.duration_s() * v - costs.base_mm(k + m);
        const ZVector<1> after = line.move * w + line.shift;
        EXPECT_LE((fan.after(lane, v) - after).cwiseAbs().maxCoeff(), 1e-8);
        const double cost = w.dot(0.5 * (line.matrix * w) + line.slope) + line.constant;
        EXPECT_NEAR(fan.cost(lane, v), cost, 1e-9 * cost);
        const double whole = cost + to_go.at(after);
        EXPECT_NEAR(choice.at(lane, v), whole, 1e-9 * std::abs(whole));
      }
    }
  }
}

TEST(CheapestEnds, AreTheCheapestOfAll) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d best(50.0 * uniform(random), 50.0 * uniform(random));
    const double xx = 1.5 + uniform(random);
    const double yy = 1.5 + uniform(random);
    const double xy = 0.4 * uniform(random);
    const Places places{{static_cast<std::int64_t>(best[0]), 0}, 3, {-45, -45}, {45, 45}};
    const StepEnds found = cheapest_ends(Bowl(xx, xy, yy), best, places, 100.0);
    double cheapest = 100.0;
    for (std::int64_t x = -45; x <= 45; ++x) {
      for (std::int64_t y = -45; y <= 45; ++y) {
        const double dx = static_cast<double>(x) - best[0];
        const double dy = static_cast<double>(y) - best[1];
        if (places.far_enough({x, y})) {
          cheapest = std::min(cheapest, 0.5 * (xx * dx * dx + 2.0 * xy * dx * dy + yy * dy * dy));
        }
      }
    }
    if (std::abs(best[0]) > 44.0 || std::abs(best[1]) > 44.0) {
      continue;  // near the edge only some candidates are tried
    }
    ASSERT_GT(found.count, 0U);
    EXPECT_NEAR(found.ends[0].extra, cheapest, 1e-9);
    EXPECT_TRUE(places.far_enough(found.ends[0].at));
  }
}

TEST(LineCosts, RingDownIsTheIntegralOfTheSquare) {
  const BaseTrajectory base = testing::sampled([](double) { return std::array{0.0, 0.0}; }, 0.01);
  const LineRules rules;
  const LineCosts<1> costs(base, all_alike, rules);
  ZVector<1> z = ZVector<1>::Zero();
  z[0] = 0.01;
  z[1] = -2.0;
  NozzleState x{z[0], z[1]};
  double sum = 0.0;
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 200000; ++i) {
    const NozzleState next = dynamics::exact_step(rules.nozzle.x, x, {}, kStep);
    sum += 0.25 * kStep * (x.position() * x.position() + next.position() * next.position());
    x = next;
  }
  EXPECT_NEAR(costs.ring_down().at(z), sum, 1e-5 * sum);
}

TEST(LineCosts, BestEndIsTheMinimum) {
  const BaseTrajectory base = testing::sampled(
      [](double t) {
        return std::array{3.0 * rise(t, 0.05), 1.0 * rise(t, 0.05)};
      },
      0.05);
  const LineCosts<1> costs(base, all_alike, LineRules{});
  const Quadratic<1> to_go = costs.ring_down();
  const LineCost<1> line = costs.line(20, 8);
  const LineChoice<1> choice = best_end(line, to_go);
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, 0.01);
  for (int i = 0; i < 20; ++i) {
    ZVector<1> z;
    for (Eigen::Index j = 0; j < 6; ++j) {
      z[j] = normal(random);
    }
    const Eigen::Vector2d best = choice.feedback * z + choice.feed_forward;
    const Eigen::Vector2d off(normal(random), normal(random));
    WVector<1> w;
    w << z, best + off;
    const double real = w.dot(0.5 * (line.matrix * w) + line.slope) + line.constant +
                        to_go.at(line.move * w + line.shift);
    EXPECT_NEAR(real, choice.value.at(z) + 0.5 * off.dot(choice.stiffness * off), 1e-12);
  }
  const ZVector<1> rest = ZVector<1>::Zero();
  WVector<1> on_base = WVector<1>::Zero();
  EXPECT_NEAR(ending_on_base(line, to_go).at(rest),
              on_base.dot(line.slope) + line.constant + to_go.at(line.shift), 1e-15);
}

// Random motion from rest to rest, like that of a base.
struct RandomWay {
  explicit RandomWay(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> anywhere(-1.0, 1.0);
    duration_s = 0.3 + 0.2 * anywhere(random);
    const double x = 10.0 * anywhere(random);
    const double y = 10.0 * anywhere(random);
    const double bulge = 2.0 * anywhere(random);
    const double duration = duration_s;
    path = [=](double t) {
      const double s = rise(t, duration);
      const double side = bulge * std::pow(std::sin(std::numbers::pi * s), 3);
      return std::array{x * s - side * y / 10.0, y * s + side * x / 10.0};
    };
    const auto last = path(duration);
    ends = {
        0.0, 0.0, 0.0125 * std::round(last[0] / 0.0125), 0.0125 * std::round(last[1] / 0.0125), {}};
  }

  double duration_s = 0.0;
  PathFunction path;
  RunEnds ends;
};

// Two nozzles whose frequencies are off, each with two modes along Y: the cost is the mean of what
// each costs alone, step by step, and the states stand beside each other.
TEST(LineCosts, AreTheMeanOfTwoNozzlesWhereFrequenciesMayBeOff) {
  using dynamics::Mode;
  constexpr int kAll = 4;
  const BaseTrajectory base = wavy_base();
  const std::array along_y = {Mode{285.3, 0.071, 0.7}, Mode{365.1, 0.085, 0.3}};
  LineRules rules;
  rules.nozzle.y = dynamics::FlexibleAxis(along_y);
  const ErrorWeight weight{0.9, 0.2, 0.3};
  const auto at_all_times = [&](double) { return weight; };
  LineRules robust = rules;
  robust.freq_error = 0.1;
  const LineCosts<kAll> costs(base, at_all_times, robust);
  ASSERT_EQ(costs.nozzles(), 2U);
  const std::size_t k = 50;
  const std::size_t m = 10;
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 0.02);
  WVector<kAll> w = WVector<kAll>::NullaryExpr([&] { return normal(random); });
  // X has one mode, so that the other one of each nozzle never moves.
  for (const Eigen::Index i : {2, 3, 6, 7}) {
    w[i] = 0.0;
  }
  double mean = 0.0;
  double ringing = 0.0;
  ZVector<kAll> expected = ZVector<kAll>::Zero();
  for (Eigen::Index nozzle = 0; nozzle < 2; ++nozzle) {
    LineRules alone = rules;
    const double factor = nozzle == 0 ? 1.0 - 0.07 : 1.0 + 0.07;
    alone.nozzle.x = rules.nozzle.x.detuned(factor);
    alone.nozzle.y = rules.nozzle.y.detuned(factor);
    const LineCosts<2> one(base, at_all_times, alone);
    WVector<2> v;
    v << w.segment<4>(4 * nozzle), w[8], w.segment<4>(9 + 4 * nozzle), w[17], w[18], w[19];
    const LineCost<2> line = one.line(k, m);
    mean += 0.5 * (v.dot(0.5 * (line.matrix * v) + line.slope) + line.constant);
    const ZVector<2> after = line.move * v + line.shift;
    expected.segment<4>(4 * nozzle) = after.head<4>();
    expected[8] = after[4];
    expected.segment<4>(9 + 4 * nozzle) = after.segment<4>(5);
    expected[17] = after[9];
    ringing += 0.5 * one.ring_down().at(after);
  }
  const LineCost<kAll> line = costs.line(k, m);
  EXPECT_NEAR(w.dot(0.5 * (line.matrix * w) + line.slope) + line.constant, mean, 1e-12 * mean);
  EXPECT_LE((line.move * w + line.shift - expected).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_NEAR(costs.ring_down().at(expected), ringing, 1e-12 * ringing);

  LineFan<kAll> fan(costs);
  const ZVector<kAll> before = w.head<kOfZ<kAll>>();
  fan.begin(k, std::span(&before, 1));
  fan.reach(m);
  const Eigen::Vector2d speed =
      (costs.base_mm(k + m) - costs.base_mm(k) + w.tail<2>() - Eigen::Vector2d(w[8], w[17])) /
      fan.duration_s();
  EXPECT_LE((fan.after(0, speed) - expected).cwiseAbs().maxCoeff(), 1e-9);
  // The fan looks at each candidate, the line at no more than 16 moments: at ten candidates both
  // see the same.
  EXPECT_NEAR(fan.cost(0, speed), mean, 1e-9 * mean);
  const Quadratic<kAll> to_go = costs.ring_down();
  EXPECT_NEAR(fan.choice(to_go).at(0, speed), mean + ringing, 1e-9 * (mean + ringing));
}

// Round a circle, from rest to 9 rad/s.
struct Circle {
  double radius_mm = 0.0;
  static constexpr double kUntil_s = 1.0;

  static double angle(double t) {
    return 9.0 * (t < 0.1 ? t * t * t / 0.02 * (2.0 - t / 0.1) : t - 0.05);
  }
  [[nodiscard]] std::array<double, 2> operator()(double t) const {
    return {radius_mm * std::sin(angle(t)), radius_mm * (1.0 - std::cos(angle(t)))};
  }
  // Only the error across the path counts.
  static ErrorWeight weight(double t) {
    const double x = std::sin(angle(t));
    const double y = -std::cos(angle(t));
    return {x * x + 1e-2 * y * y, 0.99 * x * y, y * y + 1e-2 * x * x};
  }
  // ∫ of the square of the error across the path, µm²·s, of a nozzle whose frequency is off by this
  // factor, while the circle is even.
  [[nodiscard]] double square_of_error(const LineRules& rules, double factor) const {
    const BaseTrajectory base = testing::sampled(*this, kUntil_s + 0.3);
    RunEnds ends;
    ends.end_mm.x = (*this)(kUntil_s)[0];
    ends.end_mm.y = (*this)(kUntil_s)[1];
    ends.until_s = kUntil_s;
    const Polygon polygon = step_path(base, {}, weight, ends, on_all_axes(kSteps), rules);
    EXPECT_GE(polygon.times_s.size(), 2U) << radius_mm;
    LineRules real = rules;
    real.nozzle.x = rules.nozzle.x.detuned(factor);
    real.nozzle.y = rules.nozzle.y.detuned(factor);
    const Followed fx(base, 0, real.nozzle.x);
    const Followed fy(base, 1, real.nozzle.y);
    double sum = 0.0;
    double before_s = 0.0;
    follow(polygon, real, kUntil_s, [&](double t, NozzleState x, NozzleState y) {
      const double off_x = 1e3 * (x.position() - fx.at(t).position());
      const double off_y = 1e3 * (y.position() - fy.at(t).position());
      const double across = off_x * std::sin(angle(t)) - off_y * std::cos(angle(t));
      sum += t > 0.2 ? (t - before_s) * across * across : 0.0;
      before_s = t;
    });
    return sum;
  }
};

// Whole steps leave errors that cancel each other at one frequency, or little of them over a band.
TEST(StepPath, SuitsABandOfFrequencies) {
  const LineRules exact = marlin_rules();
  LineRules robust = exact;
  robust.freq_error = 0.1;
  const auto rms_um = [&](const LineRules& rules, double factor) {
    double sum = 0.0;
    for (const double radius_mm : {4.0, 5.0, 6.0, 7.0}) {
      sum += Circle{radius_mm}.square_of_error(rules, factor);
    }
    return std::sqrt(sum / 4.0 / 0.8);
  };
  for (const double factor : {0.9, 1.1}) {
    EXPECT_LT(rms_um(robust, factor), 0.8 * rms_um(exact, factor)) << factor;
  }
  EXPECT_LT(rms_um(robust, 1.0), 1.3 * rms_um(exact, 1.0));
}

TEST(StepPath, KeepsAllRulesOnRandomWays) {
  const LineRules rules = marlin_rules();
  for (unsigned seed = 0; seed < 40; ++seed) {
    const RandomWay way(seed);
    const BaseTrajectory base = testing::sampled(way.path, std::ceil(way.duration_s * 1e3) * 1e-3);
    const Polygon polygon = step_path(base, {}, all_alike, way.ends, on_all_axes(kSteps), rules);
    ASSERT_GE(polygon.times_s.size(), 2U) << seed;
    EXPECT_DOUBLE_EQ(polygon.times_s.front(), 0.0);
    EXPECT_LE(polygon.times_s.back(), base.duration_s() + 1e-9);
    EXPECT_NEAR(polygon.places_mm.x.front(), 0.0, 1e-12);
    EXPECT_NEAR(polygon.places_mm.x.back(), way.ends.end_mm.x, 1e-12);
    EXPECT_NEAR(polygon.places_mm.y.back(), way.ends.end_mm.y, 1e-12);
    for (std::size_t i = 1; i < polygon.times_s.size(); ++i) {
      const double dx = (polygon.places_mm.x[i] - polygon.places_mm.x[i - 1]) / 0.0125;
      const double dy = (polygon.places_mm.y[i] - polygon.places_mm.y[i - 1]) / 0.0125;
      EXPECT_NEAR(dx, std::round(dx), 1e-6);
      EXPECT_NEAR(dy, std::round(dy), 1e-6);
      EXPECT_GE(std::max(std::abs(dx), std::abs(dy)), 6.0 - 1e-6);
      const double duration = polygon.times_s[i] - polygon.times_s[i - 1];
      EXPECT_GE(duration, rules.min_line_s - 1e-9);
      EXPECT_LE(duration, rules.max_line_s + 1e-9);
      if (i >= 18) {
        EXPECT_GE(polygon.times_s[i] - polygon.times_s[i - 18], rules.burst_s - 1e-9) << seed;
      }
    }
  }
}

TEST(StepPath, IsNoFurtherOffThanStepsAre) {
  LineRules rules = marlin_rules();
  rules.min_steps = 1;
  for (unsigned seed = 0; seed < 10; ++seed) {
    const RandomWay way(seed);
    const BaseTrajectory base = testing::sampled(way.path, std::ceil(way.duration_s * 1e3) * 1e-3);
    const Polygon polygon = step_path(base, {}, all_alike, way.ends, on_all_axes(kSteps), rules);
    // Rounding to the nearest step gives an error of 3.6 µm RMS on each axis. The nozzle's error is
    // larger, because the rounding makes it ring.
    EXPECT_LE(error_um(polygon, base, rules, {1.0, 0.0}), 4.5) << seed;
    EXPECT_LE(error_um(polygon, base, rules, {0.0, 1.0}), 4.5) << seed;
  }
}

TEST(StepPath, DrawsASlantedLineToAFractionOfAStep) {
  // The slant is 17.3 by 5.1 mm, so that nowhere whole steps on both axes lie on the line.
  const double slant = std::hypot(17.3, 5.1);
  const std::array<double, 2> normal = {-5.1 / slant, 17.3 / slant};
  const BaseTrajectory base = testing::sampled(
      [](double t) {
        return std::array{17.3 * rise(t, 0.4), 5.1 * rise(t, 0.4)};
      },
      0.42);
  const auto across = [&](double) {
    constexpr double kAlong = 1e-3;
    return ErrorWeight{kAlong + normal[0] * normal[0], normal[0] * normal[1],
                       kAlong + normal[1] * normal[1]};
  };
  const Polygon polygon =
      step_path(base, {}, across, {0.0, 0.0, 17.3, 5.1}, on_all_axes(kSteps), marlin_rules());
  ASSERT_FALSE(polygon.times_s.empty());
  EXPECT_LE(error_um(polygon, base, marlin_rules(), normal), 0.6);
}

TEST(StepPath, CountsTheLinesBeforeTheRun) {
  const BaseTrajectory base = testing::sampled(
      [](double t) {
        return std::array{8.0 * rise(t, 0.2), 3.0 * rise(t, 0.2)};
      },
      0.21);
  RunEnds ends{0.0, 0.0, 8.0, 3.0, {}};
  for (int i = 18; i >= 1; --i) {
    ends.lines_before_s.push_back(-1e-4 * i);
  }
  const LineRules rules = marlin_rules();
  const Polygon polygon = step_path(base, {}, all_alike, ends, on_all_axes(kSteps), rules);
  ASSERT_GE(polygon.times_s.size(), 2U);
  // There were 18 lines in the last 2 ms, so the next line must take as long as a line may.
  EXPECT_GE(polygon.times_s[1], 0.5 * rules.max_line_s);
}

TEST(StepPath, LinesAcrossAWantedTimeAreShort) {
  const BaseTrajectory base = testing::sampled(
      [](double t) {
        return std::array{40.0 * rise(t, 0.5), 0.0};
      },
      0.5);
  const std::vector<double> wanted = {0.2, 0.25, 0.3};
  const Polygon polygon = step_path(base, wanted, all_alike, {0.0, 0.0, 40.0, 0.0},
                                    on_all_axes(kSteps), marlin_rules());
  for (std::size_t i = 1; i < polygon.times_s.size(); ++i) {
    for (const double t : wanted) {
      if (polygon.times_s[i - 1] < t - 3e-4 && polygon.times_s[i] > t + 3e-4) {
        EXPECT_LE(polygon.times_s[i] - polygon.times_s[i - 1], 4e-3 + 1e-9);
      }
    }
  }
}

TEST(StepPath, IsEmptyWhereNoLineIsLongEnough) {
  const BaseTrajectory base = testing::sampled(
      [](double t) {
        return std::array{0.03 * rise(t, 0.003), 0.0};
      },
      0.003);
  EXPECT_TRUE(
      step_path(base, {}, all_alike, {0.0, 0.0, 0.025, 0.0}, on_all_axes(kSteps), marlin_rules())
          .times_s.empty());
}

TEST(StepPath, IsTheSameWayAcrossBlocks) {
  // The path lasts some seconds, so the search continues from what it has decided.
  const BaseTrajectory base = testing::sampled(
      [](double t) {
        return std::array{20.0 * std::sin(0.8 * t) * rise(t, 1.0), 15.0 * rise(t, 6.0)};
      },
      6.0);
  const double x = 0.0125 * std::round(20.0 * std::sin(4.8) / 0.0125);
  const Polygon polygon =
      step_path(base, {}, all_alike, {0.0, 0.0, x, 15.0}, on_all_axes(kSteps), marlin_rules());
  ASSERT_FALSE(polygon.times_s.empty());
  for (std::size_t i = 18; i < polygon.times_s.size(); ++i) {
    EXPECT_GE(polygon.times_s[i] - polygon.times_s[i - 18], 0.1 - 1e-9);
  }
  EXPECT_LE(error_um(polygon, base, marlin_rules(), {0.0, 1.0}), 7.0);
}

// Starts and stops within 0.1 s and goes straight on at constant speed between.
struct LongWay {
  LongWay(double x_mm_s, double y_mm_s, double a_duration_s)
      : duration_s(a_duration_s), x(x_mm_s), y(y_mm_s) {}

  [[nodiscard]] BaseTrajectory base() const {
    // A speed rises by the integral of s³(10 − 15s + 6s²), which is ½ at s = 1.
    const auto ramp = [](double t) {
      const double s = std::clamp(t / 0.1, 0.0, 1.0);
      return 0.1 * (std::pow(s, 4) * 2.5 - 3.0 * std::pow(s, 5) + std::pow(s, 6)) +
             std::max(t - 0.1, 0.0);
    };
    const auto way = [=, end = duration_s](double t) { return ramp(t) - ramp(t - end + 0.1); };
    return testing::sampled(
        [=, of_x = x, of_y = y](double t) {
          return std::array{of_x * way(t), of_y * way(t)};
        },
        duration_s + 0.02);
  }
  [[nodiscard]] RunEnds ends(const BaseTrajectory& base) const {
    const auto steps = [](double mm) { return 0.0125 * std::round(mm / 0.0125); };
    return {0.0, 0.0, steps(base.x.position_mm.back()), steps(base.y.position_mm.back())};
  }

  double duration_s;
  double x;
  double y;
};

double longest_line_s(const Polygon& polygon) {
  double longest_s = 0.0;
  for (std::size_t i = 1; i < polygon.times_s.size(); ++i) {
    longest_s = std::max(longest_s, polygon.times_s[i] - polygon.times_s[i - 1]);
  }
  return longest_s;
}

TEST(StepPath, CoversALongCruiseByOneLine) {
  const LongWay way(17.3, 5.1, 4.0);
  const double slant = std::hypot(17.3, 5.1);
  const BaseTrajectory base = way.base();
  const std::array<double, 2> normal = {-5.1 / slant, 17.3 / slant};
  const auto across = [&](double) {
    constexpr double kAlong = 1e-3;
    return ErrorWeight{kAlong + normal[0] * normal[0], normal[0] * normal[1],
                       kAlong + normal[1] * normal[1]};
  };
  const Polygon polygon =
      step_path(base, {}, across, way.ends(base), on_all_axes(kSteps), marlin_rules());
  ASSERT_FALSE(polygon.times_s.empty());
  EXPECT_GT(longest_line_s(polygon), 3.0);
  EXPECT_LT(polygon.times_s.size(), 60U);
  EXPECT_LE(error_um(polygon, base, marlin_rules(), normal), 0.6);
}

TEST(StepPath, DoesNotPassAWantedTimeOnItsWay) {
  const LongWay way(30.0, 11.0, 5.0);
  const BaseTrajectory base = way.base();
  const Polygon polygon =
      step_path(base, {2.5}, all_alike, way.ends(base), on_all_axes(kSteps), marlin_rules());
  ASSERT_FALSE(polygon.times_s.empty());
  EXPECT_GT(longest_line_s(polygon), 1.5);
  for (std::size_t i = 1; i < polygon.times_s.size(); ++i) {
    if (polygon.times_s[i - 1] < 2.499 && polygon.times_s[i] > 2.501) {
      EXPECT_LE(polygon.times_s[i] - polygon.times_s[i - 1], marlin_rules().max_line_s);
    }
  }
}

// At 0.5 mm/s a line of seven steps takes 175 ms, more than any other line may.
TEST(StepPath, GoesSlowly) {
  const LongWay way(0.5, 0.0, 20.0);
  const BaseTrajectory base = way.base();
  LineRules rules = marlin_rules();
  const Polygon polygon =
      step_path(base, {}, all_alike, way.ends(base), on_all_axes(kSteps), rules);
  ASSERT_FALSE(polygon.times_s.empty());
  EXPECT_GT(longest_line_s(polygon), 15.0);
  EXPECT_LE(error_um(polygon, base, rules, {0.0, 1.0}), 7.0);
}

}  // namespace
}  // namespace unflex::emit
