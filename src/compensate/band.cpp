#include "unflex/compensate/band.hpp"

#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <span>

#include "unflex/core/math.hpp"

namespace unflex::compensate {
namespace {

// The middle's part of the share of a band. The edges have the rest.
constexpr double kMiddleShare = 1.0 / 3.0;
// An edge keeps a mode of the axis if this changes the edge by less than this share of its distance
// from the axis. Each mode that edge and axis have in common makes the base cheaper to solve.
constexpr double kNothing = 0.1;

// A mode's response to the base at ω, before the gain.
std::complex<double> response(const dynamics::Mode& mode, double omega_rad_s) {
  const double r = omega_rad_s / mode.omega_rad_s;
  const double loss = 2.0 * mode.zeta * r;
  const double left = 1.0 - r * r;
  // (1 + i loss) / (left + i loss), not by the compiler's division, which differs between
  // compilers.
  const double size = left * left + loss * loss;
  return {(left + loss * loss) / size, loss * (left - 1.0) / size};
}

// The norm of the distance between two axes after a step of the base's speed, up to a factor. The
// step has a spectrum of 1/ω². Frequencies from a quarter of the slowest mode's to twice the
// fastest's count.
double apart(std::span<const dynamics::Mode> a, std::span<const dynamics::Mode> b,
             const dynamics::FlexibleAxis& middle) {
  constexpr std::size_t kPlaces = 200;
  const double from = 0.25 * middle.slowest_rad_s();
  const double step = (2.0 * middle.fastest_rad_s() - from) / kPlaces;
  double sum = 0.0;
  for (std::size_t k = 0; k < kPlaces; ++k) {
    const double omega = from + static_cast<double>(k) * step;
    std::complex<double> difference;
    for (const dynamics::Mode& mode : a) {
      difference += mode.gain * response(mode, omega);
    }
    for (const dynamics::Mode& mode : b) {
      difference -= mode.gain * response(mode, omega);
    }
    sum += std::norm(difference) / math::power(omega, 4);
  }
  return std::sqrt(sum);
}

// The axis with its modes detuned, but for those whose detuning changes nothing.
dynamics::FlexibleAxis edge(const dynamics::FlexibleAxis& axis, double freq_factor,
                            double damping_factor) {
  const dynamics::FlexibleAxis all = axis.detuned(freq_factor, damping_factor);
  std::vector<dynamics::Mode> modes(all.modes().begin(), all.modes().end());
  const double most = kNothing * apart(axis.modes(), all.modes(), axis);
  while (true) {
    double least = most;
    std::vector<dynamics::Mode> best;
    for (std::size_t i = 0; i < modes.size(); ++i) {
      const dynamics::Mode& as_given = axis.modes()[i];
      if (modes[i].omega_rad_s == as_given.omega_rad_s || as_given.lead_s != 0.0) {
        continue;
      }
      std::vector<dynamics::Mode> one_less = modes;
      one_less[i] = as_given;
      const double change = apart(one_less, all.modes(), axis);
      if (change < least) {
        least = change;
        best = std::move(one_less);
      }
    }
    if (best.empty()) {
      return dynamics::FlexibleAxis(modes);
    }
    modes = std::move(best);
  }
}

}  // namespace

Plant with_unknown_mode(const dynamics::FlexibleAxis& axis) {
  constexpr double kTimesFaster = 2.4;
  constexpr double kGain = 0.2;
  constexpr double kShare = 0.04;
  const std::array<dynamics::Mode, 2> modes = {
      {{axis.main_rad_s(), axis.main_damping_ratio(), 1.0 - kGain},
       {kTimesFaster * axis.main_rad_s(), axis.main_damping_ratio(), kGain}}};
  return {dynamics::FlexibleAxis(modes), kShare};
}

std::vector<Plant> edges(const dynamics::FlexibleAxis& axis, const Band& band, double share) {
  std::vector<Plant> result;
  if (band.is_exact()) {
    return result;
  }
  const auto add = [&](double freq_factor, double damping_factor) {
    result.push_back({edge(axis, freq_factor, damping_factor)});
  };
  for (const double sign : {-1.0, 1.0}) {
    if (band.freq_error > 0.0 && band.damping_error > 0.0) {
      add(1.0 + sign * band.freq_error, 1.0 - band.damping_error);
      add(1.0 + sign * band.freq_error, 1.0 + band.damping_error);
    } else {
      add(1.0 + sign * band.freq_error, 1.0 + sign * band.damping_error);
    }
  }
  // The slower an axis, the farther it strays for the same error of its frequency. With shares as
  // 1/ω both edges come out nearly alike.
  double periods = 0.0;
  for (const Plant& edge : result) {
    periods += 1.0 / edge.axis.main_hz();
  }
  for (Plant& edge : result) {
    edge.share = share * (1.0 - kMiddleShare) / (edge.axis.main_hz() * periods);
    edge.is_edge = true;
  }
  return result;
}

}  // namespace unflex::compensate
