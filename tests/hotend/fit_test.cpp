#include "unflex/hotend/fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "hotend/reference.hpp"
#include "unflex/hotend/closed_loop.hpp"

namespace unflex::hotend {
namespace {

constexpr double kNoise_c = 0.2;

// The reference's K and τ₁ within 3 %, and θ within 0.5 s.
void expect_reference(const Result<PlantFit>& fit) {
  ASSERT_TRUE(fit) << to_string(fit.error());
  const Plant& plant = kReference;
  EXPECT_NEAR(fit->plant.gain_c, plant.gain_c, 0.03 * plant.gain_c);
  EXPECT_NEAR(fit->plant.time_constant_s, plant.time_constant_s, 0.03 * plant.time_constant_s);
  EXPECT_NEAR(fit->plant.dead_time_s, plant.dead_time_s, 0.5);
  EXPECT_TRUE(fit->is_explained());
}

// What is left of a log that has every change of power is the noise.
void expect_noise(const Result<PlantFit>& fit) {
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->noise_c, kNoise_c, 0.1 * kNoise_c);
}

using Power = std::function<double(double time_s)>;

// A row each `every_s`, or about so often.
Log open_loop(unsigned seed, const Power& power, double duration_s, double every_s,
              double start_c = kReference.ambient_c, double jitter = 0.0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise_c(0.0, kNoise_c);
  std::uniform_real_distribution<double> uneven(1.0 - jitter, 1.0 + jitter);
  Simulation simulation(kReference, start_c);
  Log log;
  for (double time_s = 0.0; time_s < duration_s;) {
    log.samples.push_back({time_s, simulation.temperature_c() + noise_c(random), power(time_s)});
    const double step_s = every_s * uneven(random);
    simulation.advance(power(time_s), step_s);
    time_s += step_s;
  }
  return log;
}

TEST(Fit, FindsThePlantInAnOpenStep) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Power step = [](double time_s) { return time_s < 10.0 || time_s > 120.0 ? 0.0 : 255.0; };
    const Result<PlantFit> fit = fit_plant(open_loop(seed, step, 900.0, 1.0));
    expect_reference(fit);
    expect_noise(fit);
  }
}

TEST(Fit, FindsThePlantInAStepThatBeginsWithTheLog) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Power step = [](double time_s) { return time_s < 90.0 ? 255.0 : 80.0; };
    const Result<PlantFit> fit = fit_plant(open_loop(seed, step, 900.0, 1.0));
    expect_reference(fit);
    expect_noise(fit);
    EXPECT_TRUE(fit && fit->started_at_rest);
  }
}

TEST(Fit, FindsThePlantInUnevenSamples) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Power pulses = [](double time_s) {
      return std::fmod(time_s, 200.0) < 60.0 ? 200.0 : 30.0;
    };
    expect_reference(fit_plant(open_loop(seed, pulses, 1000.0, 0.7, 25.0, 0.8)));
  }
}

// A hotend that comes from elsewhere, at any moment.
TEST(Fit, FindsThePlantWhenTheLogBeginsHot) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Power steps = [](double time_s) {
      return time_s < 60.0 ? 87.5 : time_s < 500.0 ? 0.0 : 120.0;
    };
    const Log log = open_loop(seed, steps, 1200.0, 0.5, 200.0);
    const Result<PlantFit> fit = fit_plant(log);
    expect_reference(fit);
    EXPECT_FALSE(fit && fit->started_at_rest);
    EXPECT_NEAR(fit->ambient_c.value, 25.0, 4.0 * fit->ambient_c.error);
    const Result<PlantFit> known = fit_plant(log, {.ambient_c = 25.0});
    expect_reference(known);
    EXPECT_EQ(known->ambient_c.error, 0.0);
    EXPECT_LT(known->gain_c.error, fit->gain_c.error);
  }
}

// Heats as Klipper does: a reading and a new power every 0.3 s, its derivative smoothed, and a line
// of the log each second, with a digit of the temperature and three of the power. The log has the
// noise, and the controller's readings have it too if it feels it.
enum class Feels { nothing, noise };
Log as_klipper(unsigned seed, double target_c, double duration_s, double line_s, Feels feels) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise_c(0.0, kNoise_c);
  const double on_s = 4.0 + std::uniform_real_distribution<double>(0.0, 2.0)(random);
  constexpr double kReading_s = 0.3;
  constexpr double kSmooth_s = 1.0;
  const Gains gains = *hotend::gains(Rule::simc_pid, kReference);
  Simulation simulation(kReference, 25.0);
  Log log;
  log.hold = Hold::to_nearer;
  double integral = 0.0;
  double last_c = 25.0;
  double slope_c_s = 0.0;
  double power = 0.0;
  double next_line_s = 0.0;
  for (double time_s = 0.0; time_s < duration_s; time_s += kReading_s) {
    const double logged_c = simulation.temperature_c() + noise_c(random);
    const double shown_c = feels == Feels::noise ? logged_c : simulation.temperature_c();
    slope_c_s += (-(shown_c - last_c) / kReading_s - slope_c_s) / (1.0 + kSmooth_s / kReading_s);
    last_c = shown_c;
    const double error_c = (time_s < on_s ? 0.0 : target_c) - shown_c;
    const double sum = integral + error_c * kReading_s;
    const double wanted = gains.p * error_c + gains.i * sum + gains.d * slope_c_s;
    power = std::clamp(wanted, 0.0, kFullPower);
    if (power == wanted) {
      integral = sum;
    }
    if (time_s >= next_line_s) {
      log.samples.push_back({time_s, std::round(10.0 * logged_c) / 10.0,
                             std::round(1000.0 * power / kFullPower) / 1000.0 * kFullPower});
      next_line_s += line_s;
    }
    simulation.advance(power, kReading_s);
  }
  return log;
}

TEST(Fit, FindsThePlantInAHeatingThatKlipperLogs) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    expect_reference(fit_plant(as_klipper(seed, 200.0, 600.0, 1.0, Feels::nothing)));
    expect_reference(fit_plant(as_klipper(seed, 150.0, 300.0, 1.0, Feels::nothing)));
  }
}

// Power that follows noisy readings moves between the rows of a log. What it does there is not
// known, so that the two delays are hard to tell apart.
TEST(Fit, FindsMostOfThePlantInAHeatingByNoisyReadings) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    for (const double line_s : {1.0, 2.0}) {
      const Result<PlantFit> fit = fit_plant(as_klipper(seed, 200.0, 600.0, line_s, Feels::noise));
      ASSERT_TRUE(fit);
      EXPECT_NEAR(fit->plant.gain_c, 2.0, 0.06);
      EXPECT_NEAR(fit->plant.time_constant_s, 300.0, 9.0);
      EXPECT_NEAR(fit->plant.dead_time_s + fit->plant.sensor_lag_s, 7.5, line_s);
    }
  }
}

TEST(Fit, KnowsHowSureItIs) {
  const Power step = [](double time_s) { return time_s < 10.0 ? 0.0 : 80.0; };
  double chi = 0.0;
  constexpr unsigned kSeeds = 20;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const Result<PlantFit> fit = fit_plant(open_loop(seed, step, 600.0, 1.0));
    ASSERT_TRUE(fit);
    chi += std::pow((fit->gain_c.value - 2.0) / fit->gain_c.error, 2) +
           std::pow((fit->time_constant_s.value - 300.0) / fit->time_constant_s.error, 2) +
           std::pow((fit->dead_time_s.value - 5.0) / fit->dead_time_s.error, 2);
  }
  EXPECT_GT(chi / (3.0 * kSeeds), 0.4);
  EXPECT_LT(chi / (3.0 * kSeeds), 2.0);
}

// Power that moves between the rows is part of what is not known.
TEST(Fit, KnowsHowSureItIsOfAHostsLog) {
  double chi = 0.0;
  double chi_of_dead_time = 0.0;
  constexpr unsigned kSeeds = 16;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const Result<PlantFit> fit = fit_plant(as_klipper(seed, 200.0, 400.0, 1.0, Feels::noise));
    ASSERT_TRUE(fit);
    chi += std::pow((fit->gain_c.value - 2.0) / fit->gain_c.error, 2) +
           std::pow((fit->time_constant_s.value - 300.0) / fit->time_constant_s.error, 2);
    chi_of_dead_time += std::pow((fit->dead_time_s.value - 5.0) / fit->dead_time_s.error, 2);
  }
  EXPECT_GT(chi / (2.0 * kSeeds), 0.2);
  EXPECT_LT(chi / (2.0 * kSeeds), 2.0);
  EXPECT_LT(chi_of_dead_time / kSeeds, 1.5);
}

TEST(Fit, SaysWhatTheModelDoesNotExplain) {
  const Power step = [](double time_s) { return time_s < 10.0 ? 0.0 : 80.0; };
  Log log = open_loop(1, step, 600.0, 1.0);
  for (Sample& sample : log.samples) {
    sample.temperature_c += 15.0 * std::sin(0.1 * sample.time_s);
  }
  const Result<PlantFit> fit = fit_plant(log);
  ASSERT_TRUE(fit);
  EXPECT_FALSE(fit->is_explained());
  EXPECT_EQ(fit->fitted_c.size(), log.samples.size());
}

std::string error_of(const Log& log) {
  const Result<PlantFit> fit = fit_plant(log);
  return fit ? "none" : fit.error().message;
}

TEST(Fit, RefusesLogsThatTellNothing) {
  const Power off = [](double) { return 0.0; };
  const Power on = [](double) { return 255.0; };
  EXPECT_EQ(error_of({}), "has fewer than 30 samples; log a whole heating, once a second");
  EXPECT_EQ(error_of(open_loop(1, off, 100.0, 1.0, 200.0)),
            "has no change of power; log a heating from the cold");
  EXPECT_EQ(error_of(open_loop(
                1, [](double t) { return t < 50.0 ? 87.5 : 88.0; }, 100.0, 1.0, 200.0)),
            "has a temperature that changes by less than 10 °C; log a heating from the cold");
  EXPECT_EQ(error_of(open_loop(1, on, 40.0, 1.0)),
            "leaves open how far the heater can heat; log on until the temperature holds for some "
            "minutes");
  Log other = open_loop(
      1, [](double t) { return t < 50.0 ? 200.0 : 0.0; }, 400.0, 1.0);
  for (Sample& sample : other.samples) {
    sample.temperature_c = 300.0 - sample.temperature_c;
  }
  EXPECT_EQ(error_of(other),
            "has a temperature that does not follow the power; check that both are of the same "
            "heater");
}

}  // namespace
}  // namespace unflex::hotend
