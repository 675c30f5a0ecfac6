// Nozzles in lanes: they move as one by one, and are measured as closely as by many more looks.
#include "bundle.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "replaying.hpp"
#include "unflex/core/lanes.hpp"

namespace unflex::verify {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<NozzleModel> models_of(std::size_t count, std::size_t modes) {
  std::vector<NozzleModel> models;
  for (std::size_t i = 0; i < count; ++i) {
    NozzleModel model;
    std::vector<dynamics::Mode> x;
    std::vector<dynamics::Mode> y;
    // The nozzles differ in how many modes they have, too.
    const std::size_t own = 1 + (i + modes - 1) % modes;
    for (std::size_t mode = 0; mode < own; ++mode) {
      const auto number = static_cast<double>(mode + 1);
      const double gain = 1.0 / static_cast<double>(own);
      x.push_back({(230.0 + 11.0 * static_cast<double>(i)) * number, 0.05 * number, gain});
      y.push_back({(290.0 - 7.0 * static_cast<double>(i)) * number, 0.04 * number, gain});
    }
    model.x = dynamics::FlexibleAxis(x);
    model.y = dynamics::FlexibleAxis(y);
    models.push_back(model);
  }
  return models;
}

NozzleXY somewhere(const NozzleModel& model, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  NozzleXY nozzle{model.x.riding(100.0, 20.0), model.y.riding(50.0, -30.0)};
  for (std::size_t i = 0; i < model.x.mode_count(); ++i) {
    nozzle.x.parts[i].position += 0.1 * uniform(random);
    nozzle.y.parts[i].velocity += 10.0 * uniform(random);
  }
  return nozzle;
}

// Straight along x.
std::vector<planner::PlannedMove> straight() {
  return testing::plan_path({{0.0, 0.0, 0.0}, {1000.0, 0.0, 100.0, 1.0}}, planner::Limits{});
}

// Rk4Step's tests hold for the bundle, too.
TEST(Bundle, StepsAsRungeAndKuttaDo) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int trial = 0; trial < 500; ++trial) {
    NozzleModel model;
    model.x = dynamics::from_frequency(60.0 + 40.0 * unit(random), 0.6 + 0.6 * unit(random));
    model.y = dynamics::from_frequency(60.0 + 40.0 * unit(random), 0.6 + 0.6 * unit(random));
    const auto segment = [&] {
      return dynamics::BaseSegment{200.0 * unit(random), 100.0 * unit(random), 2e4 * unit(random)};
    };
    const dynamics::BaseSegment x = segment();
    const dynamics::BaseSegment y = segment();
    const NozzleXY start{{x.position + unit(random), 100.0 * unit(random)},
                         {y.position + unit(random), 100.0 * unit(random)}};
    // One step of Runge and Kutta's. More are made of one that is longer against the period.
    const double h = 0.15 * (1.01 + 0.98 * unit(random)) /
                     std::max(model.x.fastest_rad_s(), model.y.fastest_rad_s());
    const NozzleXY wanted{dynamics::rk4_step(model.x, start.x, x, h),
                          dynamics::rk4_step(model.y, start.y, y, h)};
    // By a single step, and by a map.
    for (const double steps : {1.0, 20.0}) {
      Bundle bundle({model});
      bundle.set_nozzle(0, start);
      bundle.begin_steps(steps, h);
      bundle.step({x, y});
      const NozzleXY found = bundle.nozzle();
      ASSERT_NEAR(found.x.position(), wanted.x.position(), 1e-12);
      ASSERT_NEAR(found.x.velocity(), wanted.x.velocity(), 1e-9);
      ASSERT_NEAR(found.y.position(), wanted.y.position(), 1e-12);
      ASSERT_NEAR(found.y.velocity(), wanted.y.velocity(), 1e-9);
    }
  }
}

// Modes that lie along no axis. The masses' own equation, by RK4 in X, Y and Z with finer steps:
// M p̈ = C (ḃ − ṗ) + K (b − p). The base leaps to another velocity halfway.
class MassesByThemselves {
 public:
  using Vector = dynamics::ModeFrame::Vector;

  MassesByThemselves(const dynamics::ModeFrame::Masses& masses, const Vector& place_mm)
      : masses_(masses), p_(place_mm) {}

  void step(const std::array<dynamics::BaseSegment, 3>& base, double t, double h) {
    const auto [v1, a1] = rates(base, t, p_, v_);
    const auto [v2, a2] = rates(base, t + 0.5 * h, plus(p_, v1, 0.5 * h), plus(v_, a1, 0.5 * h));
    const auto [v3, a3] = rates(base, t + 0.5 * h, plus(p_, v2, 0.5 * h), plus(v_, a2, 0.5 * h));
    const auto [v4, a4] = rates(base, t + h, plus(p_, v3, h), plus(v_, a3, h));
    for (std::size_t i = 0; i < 3; ++i) {
      p_[i] += h / 6.0 * (v1[i] + 2.0 * v2[i] + 2.0 * v3[i] + v4[i]);
      v_[i] += h / 6.0 * (a1[i] + 2.0 * a2[i] + 2.0 * a3[i] + a4[i]);
    }
  }
  [[nodiscard]] const Vector& place_mm() const { return p_; }
  [[nodiscard]] const Vector& velocity_mm_s() const { return v_; }

 private:
  static Vector plus(Vector a, const Vector& b, double times) {
    for (std::size_t i = 0; i < 3; ++i) {
      a[i] += times * b[i];
    }
    return a;
  }
  std::pair<Vector, Vector> rates(const std::array<dynamics::BaseSegment, 3>& base, double t,
                                  const Vector& p, const Vector& v) const {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    Eigen::Matrix3d mass;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const auto [a, b] = std::pair(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
        const dynamics::BaseSegment& of = base[b];
        const double ahead = of.position + t * (of.velocity + 0.5 * of.acceleration * t) - p[b];
        const double faster = of.velocity + t * of.acceleration - v[b];
        mass(i, j) = masses_.mass_kg[a][b];
        force(i) +=
            1e3 * (masses_.stiffness_n_mm[a][b] * ahead + masses_.damping_n_s_mm[a][b] * faster);
      }
    }
    const Eigen::Vector3d accel = mass.inverse() * force;
    return {v, {accel(0), accel(1), accel(2)}};
  }

  dynamics::ModeFrame::Masses masses_;
  Vector p_;
  Vector v_{};
};

TEST(Bundle, MovesNozzlesWhoseModesAreNotTheAxes) {
  constexpr double kShare_s = 4e-4;
  dynamics::ModeFrame::Masses masses;
  masses.mass_kg = {{{0.7, 0.0, -0.1}, {0.0, 0.7, 0.05}, {-0.1, 0.05, 0.9}}};
  masses.stiffness_n_mm = {{{120.0, 6.0, -40.0}, {6.0, 80.0, 0.0}, {-40.0, 0.0, 120.0}}};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      masses.damping_n_s_mm[i][j] = kShare_s * masses.stiffness_n_mm[i][j];
    }
  }
  NozzleModel model;
  model.frame = dynamics::ModeFrame::of(masses).value();
  model.x = dynamics::from_frequency(80.0, 0.05);
  model.y = model.x;
  Bundle bundle({model, model});
  bundle.shift({100.0, 50.0});
  MassesByThemselves alone(masses, {100.0, 50.0, 7.0});
  std::array<dynamics::BaseSegment, 3> base = {
      {{100.0, 20.0, 3000.0}, {50.0, -30.0, -4000.0}, {7.0, 1.0, 500.0}}};
  constexpr double kH_s = 5e-4;
  constexpr int kFiner = 20;
  for (int step = 0; step < 40; ++step) {
    if (step == 20) {
      base[0].velocity -= 15.0;
    }
    bundle.begin_steps(1.0, kH_s);
    bundle.step({base[0], base[1]}, base[2]);
    for (int i = 0; i < kFiner; ++i) {
      alone.step(base, i * kH_s / kFiner, kH_s / kFiner);
    }
    for (dynamics::BaseSegment& axis : base) {
      axis.position += kH_s * (axis.velocity + 0.5 * axis.acceleration * kH_s);
      axis.velocity += kH_s * axis.acceleration;
    }
    for (const std::size_t number : {0U, 1U}) {
      const dynamics::NozzleMotionXY found = bundle.motion(number);
      ASSERT_NEAR(found.x.position, alone.place_mm()[0], 5e-6) << step;
      ASSERT_NEAR(found.y.position, alone.place_mm()[1], 5e-6) << step;
      ASSERT_NEAR(found.x.velocity, alone.velocity_mm_s()[0], 4e-3) << step;
      ASSERT_NEAR(found.y.velocity, alone.velocity_mm_s()[1], 4e-3) << step;
      ASSERT_NEAR(base[2].position + bundle.above_mm(number), alone.place_mm()[2], 5e-6) << step;
    }
  }
  const dynamics::BaseXY xy{base[0], base[1]};
  EXPECT_FALSE(bundle.rest_on(xy));
  bundle.ride_on(xy);
  EXPECT_TRUE(bundle.rest_on(xy));
  EXPECT_EQ(bundle.motion(1).y.position, xy.y.position);
}

// The states stay, and from then on the nozzles move as those of the slower models.
TEST(Bundle, GoesOnWithOtherFrequencies) {
  std::mt19937_64 random(12);
  const Axes<double> shares{0.9, 0.8};
  const std::vector<NozzleModel> models = models_of(3, 2);
  std::vector<NozzleModel> slower = models;
  for (NozzleModel& model : slower) {
    model.x = model.x.detuned(shares.x);
    model.y = model.y.detuned(shares.y);
  }
  for (const bool keeps_first : {false, true}) {
    Bundle bundle(models);
    Bundle expected(slower);
    for (std::size_t i = 0; i < models.size(); ++i) {
      const NozzleXY nozzle = somewhere(models[i], random);
      bundle.set_nozzle(i, nozzle);
      expected.set_nozzle(i, nozzle);
    }
    bundle.set_frequencies(on_all_axes(0.5));
    bundle.set_frequencies(shares);
    if (keeps_first) {
      bundle.keep_first();
      expected.keep_first();
    }
    for (const double steps : {1.0, 20.0}) {
      bundle.begin_steps(steps, 5e-4);
      expected.begin_steps(steps, 5e-4);
      const dynamics::BaseXY base{{100.0, 20.0, 3000.0}, {50.0, -30.0, -4000.0}};
      bundle.step(base);
      expected.step(base);
    }
    EXPECT_EQ(bundle.states(), expected.states());
    EXPECT_EQ(bundle.step_s(), expected.step_s());
  }
}

TEST(Bundle, MovesNozzlesAsOneByOne) {
  constexpr double kStep_s = 5e-4;
  std::mt19937_64 random(1);
  for (const std::size_t modes : {1U, 3U}) {
    for (std::size_t count = 1; count <= 9; ++count) {
      const std::vector<NozzleModel> models = models_of(count, modes);
      Bundle bundle(models);
      std::vector<NozzleXY> alone;
      for (std::size_t i = 0; i < count; ++i) {
        alone.push_back(somewhere(models[i], random));
        bundle.set_nozzle(i, alone[i]);
      }
      // By single steps, and by maps.
      for (const double steps : {2.0, 20.0}) {
        dynamics::BaseSegment x{100.0, 20.0, 3000.0};
        dynamics::BaseSegment y{50.0, -30.0, 2000.0};
        bundle.begin_steps(steps, kStep_s);
        for (double step = 0.0; step < steps; ++step) {
          bundle.step({x, y});
          for (std::size_t i = 0; i < count; ++i) {
            alone[i].x = dynamics::exact_step(models[i].x, alone[i].x, x, kStep_s);
            alone[i].y = dynamics::exact_step(models[i].y, alone[i].y, y, kStep_s);
          }
          for (dynamics::BaseSegment* base : {&x, &y}) {
            base->position += kStep_s * (base->velocity + 0.5 * kStep_s * base->acceleration);
            base->velocity += kStep_s * base->acceleration;
          }
        }
      }
      for (std::size_t i = 0; i < count; ++i) {
        // RK4 errs by a share of the swing, which is a tenth of a millimetre.
        EXPECT_LE(apart_mm(bundle.nozzle(i), alone[i], models[i]), 1e-4) << i;
      }
    }
  }
}

TEST(Bundle, FindsEachNozzlesDistanceFromThePath) {
  const std::vector<planner::PlannedMove> moves = testing::plan_path(
      {{0.0, 0.0, 0.0}, {5.0, 0.0, 100.0, 1.0}, {5.0, 5.0, 100.0, 1.0}, {8.0, 5.0, 100.0, 1.0}},
      planner::Limits{});
  ReferencePath path = testing::path_of(moves, 10.0);
  const std::vector<NozzleModel> models = models_of(6, 1);
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(-1.0, 9.0);
  for (double t = 0.0; t < path.end_s(); t += 0.003) {
    Bundle bundle(models);
    NearPath near(0.03);
    near.begin(path);
    near.slide(path, t);
    std::vector<std::pair<double, double>> places;
    for (std::size_t i = 0; i < models.size(); ++i) {
      places.emplace_back(uniform(random), uniform(random));
      bundle.set_nozzle(
          i, {models[i].x.riding(places[i].first), models[i].y.riding(places[i].second)});
    }
    bundle.look(path, near, 0.0);
    for (std::size_t i = 0; i < models.size(); ++i) {
      std::size_t nearest = 0;
      EXPECT_DOUBLE_EQ(bundle.now_mm2(i), near.squared_contour_error(
                                              path, {places[i].first, places[i].second}, nearest));
      if (i == 0) {
        EXPECT_EQ(bundle.nearest(), nearest);
      }
    }
  }
}

// A nozzle that swings across a straight path, looked at as rarely as it may be.
TEST(Bundle, MeasuresASwingFromFewLooks) {
  constexpr double kAmplitude_mm = 0.01;
  const std::vector<planner::PlannedMove> moves = straight();
  ReferencePath path = testing::path_of(moves, 20.0);
  const NozzleModel model;
  const double omega = model.y.main_rad_s();
  for (const double looks : {16.0, 17.3, 25.0}) {
    Bundle bundle({model});
    NearPath near(reach_s(model));
    near.begin(path);
    const double h = 2.0 * kPi / (omega * looks);
    const double begin_s = 1.0;
    double sum = 0.0;
    double largest = 0.0;
    for (int i = 0; i <= 1000; ++i) {
      const double t = i * h;
      NozzleXY nozzle;
      nozzle.x = model.x.riding(100.0 * (begin_s + t) - 1.0, 100.0);
      nozzle.y.parts[0] = {kAmplitude_mm * std::sin(omega * t + 0.3),
                           kAmplitude_mm * omega * std::cos(omega * t + 0.3)};
      bundle.set_nozzle(0, nozzle);
      near.slide(path, begin_s + t);
      bundle.look(path, near, i > 0 ? h : 0.0);
      if (i > 0) {
        sum += bundle.mean_mm2();
        largest = std::max(largest, bundle.largest_mm2());
      }
    }
    const double mean = 0.5 * kAmplitude_mm * kAmplitude_mm;
    EXPECT_NEAR(sum / 1000.0, mean, 3e-3 * mean) << looks;
    EXPECT_NEAR(std::sqrt(largest), kAmplitude_mm, 2e-3 * kAmplitude_mm) << looks;
  }
}

TEST(Bundle, CountsATopOnlyWhileFilamentIsLaid) {
  const std::vector<planner::PlannedMove> moves = straight();
  ReferencePath path = testing::path_of(moves, 20.0);
  const NozzleModel model;
  Bundle bundle({model});
  NearPath near(reach_s(model));
  near.begin(path);
  constexpr double kStep_s = 5e-4;
  // Looks on both sides of a top, and one at it.
  for (int i = 0; i < 4; ++i) {
    const double off_mm = std::array{0.0, 1.0, 0.9, 0.1}[static_cast<std::size_t>(i)];
    bundle.set_nozzle(0, {model.x.riding(100.0), model.y.riding(off_mm)});
    near.slide(path, 1.0 + i * kStep_s);
    bundle.look(path, near, i > 0 ? kStep_s : 0.0);
    if (i > 0) {
      bundle.count(true, i == 2);
    }
  }
  const Deviation deviation = bundle.deviation(0);
  EXPECT_DOUBLE_EQ(deviation.extruding.contour_max_mm, 1.0);
  EXPECT_DOUBLE_EQ(deviation.extruding.duration_s, kStep_s);
  EXPECT_GT(deviation.all.contour_max_mm, 1.0);
  EXPECT_LT(deviation.all.contour_max_mm, std::sqrt(1.125));
}

TEST(Bundle, IsTheSameInRegistersOfTwoNumbersAndOfFour) {
  if (!has_four_lanes()) {
    GTEST_SKIP() << "This processor has registers of two numbers only.";
  }
  const auto measured = [](bool two_lanes) {
    prefer_two_lanes(two_lanes);
    const std::vector<planner::PlannedMove> moves = testing::plan_path(
        {{0.0, 0.0, 0.0}, {2.0, 0.0, 100.0, 1.0}, {2.0, 2.0, 100.0, 1.0}, {3.0, 5.0, 100.0, 1.0}},
        planner::Limits{});
    ReferencePath path = testing::path_of(moves, 10.0);
    Bundle bundle(models_of(7, 2));
    NearPath near(0.03);
    near.begin(path);
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> uniform(-5e3, 5e3);
    dynamics::BaseSegment x;
    dynamics::BaseSegment y;
    std::vector<double> figures;
    for (int i = 0; i < 300; ++i) {
      constexpr double kStep_s = 4e-4;
      x.acceleration = uniform(random);
      y.acceleration = uniform(random);
      bundle.begin_steps(i % 2 == 0 ? 1.0 : 10.0, kStep_s);
      bundle.step({x, y});
      near.slide(path, i * kStep_s);
      bundle.look(path, near, i > 0 ? kStep_s : 0.0);
      bundle.count(true, i % 7 != 0);
      figures.insert(figures.end(), bundle.states().begin(), bundle.states().end());
      for (std::size_t number = 0; number < bundle.count(); ++number) {
        figures.push_back(bundle.mean_mm2(number));
        figures.push_back(bundle.largest_mm2(number));
      }
    }
    prefer_two_lanes(false);
    return figures;
  };
  EXPECT_EQ(measured(true), measured(false));
}

}  // namespace
}  // namespace unflex::verify
