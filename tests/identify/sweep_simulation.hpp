// An accelerometer on a nozzle that swings while Klipper's resonance test shakes it.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

namespace unflex::identify {

struct FurtherMode {
  double freq_hz = 0.0;
  double damping_ratio = 0.0;
  double gain = 0.0;
};

struct SimulatedTest {
  double mode_hz = 45.0;
  double damping_ratio = 0.06;
  double rate_hz = 3200.0;
  double start_hz = 5.0;
  double end_hz = 135.0;
  double accel_per_hz = 60.0;
  double hz_per_s = 1.0;
  double sweeping_accel = 400.0;  // the slow to and fro of newer Klippers; 0 for older
  double sweeping_period_s = 1.2;
  double noise_share = 0.1;  // standard deviation, as a share of the response's peak
  double offset = 250.0;     // gravity on a chip that is not level
  std::uint32_t seed = 1;
  std::vector<FurtherMode> further = {};  // the first mode has the gain that they leave
};

struct Pulse {
  double until_s = 0.0;
  double accel_mm_s2 = 0.0;
};

// The law of klippy/extras/resonance_tester.py: per half period two pulses of a quarter period with
// opposite signs; the frequency grows by what the half period lasted.
inline std::vector<Pulse> vibration(const SimulatedTest& test) {
  std::vector<Pulse> pulses;
  double time_s = 0.0;
  double sign = 1.0;
  for (double f = test.start_hz; f <= test.end_hz + 1e-6; sign = -sign) {
    const double quarter_s = 0.25 / f;
    const double accel = test.accel_per_hz * f;
    pulses.push_back({time_s += quarter_s, sign * accel});
    pulses.push_back({time_s += quarter_s, -sign * accel});
    f += 2.0 * quarter_s * test.hz_per_s;
  }
  return pulses;
}

// The pulses with the slow square wave added, whose first two stretches are shorter.
inline std::vector<Pulse> with_sweeping(const SimulatedTest& test,
                                        const std::vector<Pulse>& pulses) {
  if (test.sweeping_accel == 0.0) {
    return pulses;
  }
  std::vector<Pulse> result;
  const double eighth = std::numbers::sqrt2 / 8.0;
  double turn_s = test.sweeping_period_s * eighth;
  double stretch = eighth + 0.25;
  double sign = 1.0;
  for (const Pulse& pulse : pulses) {
    while (turn_s <= pulse.until_s) {
      result.push_back({turn_s, pulse.accel_mm_s2 + sign * test.sweeping_accel});
      turn_s += test.sweeping_period_s * stretch;
      stretch = 0.5;
      sign = -sign;
    }
    result.push_back({pulse.until_s, pulse.accel_mm_s2 + sign * test.sweeping_accel});
  }
  return result;
}

// The stretch q = b − p of the belt under the base's acceleration u: q̈ = u − 2ζω q̇ − ω² q; the
// nozzle's acceleration is 2ζω q̇ + ω² q. Exact while u is constant.
class Belt {
 public:
  Belt(double mode_hz, double damping_ratio)
      : omega_(2.0 * std::numbers::pi * mode_hz),
        sigma_(damping_ratio * omega_),
        omega_d_(omega_ * std::sqrt(1.0 - damping_ratio * damping_ratio)) {}

  void advance(double u, double dt) {
    const double rest = u / (omega_ * omega_);
    const double e = std::exp(-sigma_ * dt);
    const double c = std::cos(omega_d_ * dt);
    const double s = std::sin(omega_d_ * dt);
    const double a = q_ - rest;
    const double b = (v_ + sigma_ * a) / omega_d_;
    q_ = rest + e * (a * c + b * s);
    v_ = e * ((b * omega_d_ - sigma_ * a) * c - (a * omega_d_ + sigma_ * b) * s);
  }
  [[nodiscard]] double accel() const { return 2.0 * sigma_ * v_ + omega_ * omega_ * q_; }

 private:
  double omega_;
  double sigma_;
  double omega_d_;
  double q_ = 0.0;
  double v_ = 0.0;
};

// One mode's acceleration at the samples' times, with half a second of rest before and after.
inline std::vector<double> response_of_mode(const SimulatedTest& test, Belt belt,
                                            const std::vector<Pulse>& pulses, double shift_s) {
  constexpr double kRest_s = 0.5;
  std::vector<double> samples;
  double now_s = -kRest_s + shift_s;
  std::size_t pulse = 0;
  const double end_s = pulses.back().until_s + kRest_s;
  for (double next_s = now_s; next_s < end_s; next_s += 1.0 / test.rate_hz) {
    while (now_s < next_s) {
      const bool before = now_s < 0.0;
      const bool over = pulse == pulses.size();
      const double change_s = before ? 0.0 : over ? next_s : pulses[pulse].until_s;
      const double until_s = std::min(next_s, change_s);
      belt.advance(before || over ? 0.0 : pulses[pulse].accel_mm_s2, until_s - now_s);
      now_s = until_s;
      pulse += !before && !over && now_s >= pulses[pulse].until_s ? 1 : 0;
    }
    samples.push_back(belt.accel());
  }
  return samples;
}

// The nozzle's acceleration: that of all modes by their gains.
inline std::vector<double> response(const SimulatedTest& test, const std::vector<Pulse>& pulses,
                                    double shift_s) {
  std::vector<double> sum =
      response_of_mode(test, Belt(test.mode_hz, test.damping_ratio), pulses, shift_s);
  double first_gain = 1.0;
  for (const FurtherMode& mode : test.further) {
    first_gain -= mode.gain;
  }
  for (double& sample : sum) {
    sample *= first_gain;
  }
  for (const FurtherMode& mode : test.further) {
    const std::vector<double> samples =
        response_of_mode(test, Belt(mode.freq_hz, mode.damping_ratio), pulses, shift_s);
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] += mode.gain * samples[i];
    }
  }
  return sum;
}

inline std::vector<double> simulate(const SimulatedTest& test) {
  std::mt19937 random(test.seed);
  const double shift_s = std::uniform_real_distribution<double>(0.0, 1.0 / test.rate_hz)(random);
  std::vector<double> samples = response(test, with_sweeping(test, vibration(test)), shift_s);
  double peak = 0.0;
  for (const double sample : samples) {
    peak = std::max(peak, std::abs(sample));
  }
  std::normal_distribution<double> noise(0.0, test.noise_share * peak);
  for (double& sample : samples) {
    sample += test.offset + noise(random);
  }
  return samples;
}

}  // namespace unflex::identify
