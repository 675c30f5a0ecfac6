#include "unflex/dynamics/shapers.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

#include "unflex/core/math.hpp"

namespace unflex::dynamics {
namespace {

// The vibration that EI admits at the frequency it is built for.
constexpr double kVibrationTolerance = 1.0 / 20.0;

double damped_period(double freq_hz, double zeta) {
  return 1.0 / (freq_hz * std::sqrt(1.0 - zeta * zeta));
}

// The share of a vibration that damping leaves after this number of damped periods.
double decay(double zeta, double periods) {
  return math::exp(-2.0 * std::numbers::pi * zeta * periods / std::sqrt(1.0 - zeta * zeta));
}

// ZV convolved with itself: half periods apart, weights C(n, i) Kⁱ.
ShaperPulses repeated_zv(int repeats, double freq_hz, double zeta) {
  const double period = damped_period(freq_hz, zeta);
  const double k = decay(zeta, 0.5);
  ShaperPulses pulses;
  double weight = 1.0;
  for (int i = 0; i <= repeats; ++i) {
    pulses.push_back({0.5 * i * period, weight});
    weight *= k * (repeats - i) / (i + 1);
  }
  return pulses;
}

// Klipper wants n − 1 zeros evenly spaced in frequency, the first at the vibration's, 1/T_d, and
// solves for the weights (shaper_defs.py, get_mzv_coeffs). On the unit circle of z = e^{iθ}, θ the
// angle from pulse to pulse, these are all the angles from θ₀ = 2πt/(n − 1) to 2π − θ₀ in n − 2
// equal steps of 2β. Their product Π (1 − z e^{−iθ}) is that of the q-binomial theorem with q =
// e^{2iβ}, so that the weights have a closed form:
//
//   w_k = w_{k−1} sin((n − k) β)/sin(k β)     β = π (n − 1 − 2t)/((n − 1)(n − 2))
//
// Three pulses over 0.75 get the weights 1, √2, 1. Weights are symmetric. The second half is copied
// from the first, since at t = ½ the ratio for the last weight is 0/0.
ShaperPulses mzv(const MzvForm& form, double freq_hz, double zeta) {
  const int n = form.pulses;
  const double beta =
      std::numbers::pi * (n - 1 - 2.0 * form.duration_periods) / ((n - 1.0) * (n - 2.0));
  std::vector<double> weights(static_cast<std::size_t>(n), 1.0);
  for (int k = 1; k < n; ++k) {
    const auto at = static_cast<std::size_t>(k);
    weights[at] = 2 * k <= n - 1 ? weights[at - 1] * math::sin((n - k) * beta) / math::sin(k * beta)
                                 : weights[static_cast<std::size_t>(n - 1 - k)];
  }
  const double spacing = form.duration_periods / (n - 1);
  const double period = damped_period(freq_hz, zeta);
  ShaperPulses pulses;
  for (int k = 0; k < n; ++k) {
    pulses.push_back(
        {k * spacing * period, weights[static_cast<std::size_t>(k)] * decay(zeta, k * spacing)});
  }
  return pulses;
}

ShaperPulses ei(double freq_hz, double zeta) {
  constexpr double v = kVibrationTolerance;
  const double period = damped_period(freq_hz, zeta);
  const double first =
      (0.24968 + 0.24961 * v) + ((0.80008 + 1.23328 * v) + (0.49599 + 3.17316 * v) * zeta) * zeta;
  const double last =
      (0.25149 + 0.21474 * v) + ((-0.83249 + 1.41498 * v) + (0.85181 - 4.90094 * v) * zeta) * zeta;
  const double middle_time =
      0.4999 + (((0.46159 + 8.57843 * v) * v) +
                (((4.26169 - 108.644 * v) * v) + ((1.75601 + 336.989 * v) * v) * zeta) * zeta) *
                   zeta;
  return {{0.0, first}, {middle_time * period, 1.0 - first - last}, {period, last}};
}

// Time, in undamped periods, and weight of a pulse as cubics of ζ, lowest order first.
struct FittedPulse {
  std::array<double, 4> time;
  std::array<double, 4> weight;
};

constexpr std::array<FittedPulse, 4> kTwoHumps = {{
    {{0.0, 0.0, 0.0, 0.0}, {0.16054, 0.76699, 2.26560, -1.22750}},
    {{0.49890, 0.16270, -0.54262, 6.16180}, {0.33911, 0.45081, -2.58080, 1.73650}},
    {{0.99748, 0.18382, -1.58270, 8.17120}, {0.34089, -0.61533, -0.68765, 0.42261}},
    {{1.49920, -0.09297, -0.28338, 1.85710}, {0.15997, -0.60246, 1.00280, -0.93145}},
}};

constexpr std::array<FittedPulse, 5> kThreeHumps = {{
    {{0.0, 0.0, 0.0, 0.0}, {0.11275, 0.76632, 3.29160, -1.44380}},
    {{0.49974, 0.23834, 0.44559, 12.4720}, {0.23698, 0.61164, -2.57850, 4.85220}},
    {{0.99849, 0.29808, -2.36460, 23.3990}, {0.30008, -0.19062, -2.14560, 0.13744}},
    {{1.49870, 0.10306, -2.01390, 17.0320}, {0.23775, -0.73297, 0.46885, -2.08650}},
    {{1.99960, -0.28231, 0.61536, 5.40450}, {0.11244, -0.45439, 0.96382, -1.46000}},
}};

double cubic(const std::array<double, 4>& c, double x) {
  return c[0] + x * (c[1] + x * (c[2] + x * c[3]));
}

template <std::size_t N>
ShaperPulses fitted(const std::array<FittedPulse, N>& fits, double freq_hz, double zeta) {
  ShaperPulses pulses;
  for (const FittedPulse& fit : fits) {
    pulses.push_back({cubic(fit.time, zeta) / freq_hz, cubic(fit.weight, zeta)});
  }
  return pulses;
}

// The weights need not add up to 1 yet. The times begin at 0.
ShaperPulses raw_pulses(const Shaper& shaper, double freq_hz, double zeta) {
  switch (shaper.kind) {
    case ShaperKind::zv:
      return repeated_zv(1, freq_hz, zeta);
    case ShaperKind::mzv:
      return mzv(shaper.form, freq_hz, zeta);
    case ShaperKind::zvd:
      return repeated_zv(2, freq_hz, zeta);
    case ShaperKind::zvdd:
      return repeated_zv(3, freq_hz, zeta);
    case ShaperKind::zvddd:
      return repeated_zv(4, freq_hz, zeta);
    case ShaperKind::ei:
      return ei(freq_hz, zeta);
    case ShaperKind::two_hump_ei:
      return fitted(kTwoHumps, freq_hz, zeta);
    case ShaperKind::three_hump_ei:
      return fitted(kThreeHumps, freq_hz, zeta);
  }
  return {};
}

}  // namespace

std::string_view name(ShaperKind kind) {
  switch (kind) {
    case ShaperKind::zv:
      return "ZV";
    case ShaperKind::mzv:
      return "MZV";
    case ShaperKind::zvd:
      return "ZVD";
    case ShaperKind::zvdd:
      return "ZVDD";
    case ShaperKind::zvddd:
      return "ZVDDD";
    case ShaperKind::ei:
      return "EI";
    case ShaperKind::two_hump_ei:
      return "2HUMP_EI";
    case ShaperKind::three_hump_ei:
      return "3HUMP_EI";
  }
  return {};
}

double max_damping_ratio(ShaperKind kind) {
  switch (kind) {
    case ShaperKind::ei:
      return 0.4;
    case ShaperKind::two_hump_ei:
      return 0.3;
    case ShaperKind::three_hump_ei:
      return 0.2;
    default:
      return 0.99;
  }
}

// The lower and upper ends are from shaper_defs.py, get_mzv_coeffs. More than ten pulses do not fit
// into chelper/kin_shaper.c. Below half a period weights would be negative, and close to the upper
// end sin β is 0.
bool MzvForm::is_defined() const {
  constexpr int kMostPulses = 10;
  constexpr double kLeastBelowTheEnd = 1e-6;
  return pulses >= 3 && pulses <= kMostPulses && duration_periods >= 0.5 &&
         2.0 * duration_periods + 1.0 < pulses - kLeastBelowTheEnd;
}

std::optional<ShaperPulses> shaper_pulses(const Shaper& shaper, double freq_hz,
                                          double damping_ratio) {
  if (damping_ratio > max_damping_ratio(shaper.kind) || !shaper.form.is_defined()) {
    return std::nullopt;
  }
  ShaperPulses pulses = raw_pulses(shaper, freq_hz, damping_ratio);
  double sum = 0.0;
  double moment_s = 0.0;
  for (const Pulse& pulse : pulses) {
    sum += pulse.weight;
    moment_s += pulse.weight * pulse.time_s;
  }
  for (Pulse& pulse : pulses) {
    pulse.weight /= sum;
    pulse.time_s -= moment_s / sum;
  }
  return pulses;
}

}  // namespace unflex::dynamics
