// Spectra of axes with several modes, with the scatter of an average over Kaiser windows.
#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

#include "unflex/identify/axis_model.hpp"

namespace unflex::identify {

struct SimulatedSpectrum {
  std::vector<ModeOfAxis> modes;
  std::array<double, 3> direction = {1.0, 0.0, 0.0};  // of the motion, as the sensor sees it
  double noise = 1e-3;                                // white, as a share of the density's peak
  double rise = 1e-3;                                 // likewise at 20 Hz, falling with 1/f
  int windows = 20;
  std::uint32_t seed = 1;
};

inline double gain_of(const std::vector<ModeOfAxis>& modes, double freq_hz) {
  std::complex<double> sum = 0.0;
  for (const ModeOfAxis& mode : modes) {
    const double r = freq_hz / mode.freq_hz;
    const std::complex<double> loss(0.0, 2.0 * mode.damping_ratio * r);
    sum += mode.gain * (1.0 + loss) / (1.0 - r * r + loss);
  }
  return std::abs(sum);
}

// Each window sees random motion of the density 1/8 of a bin apart, through the Kaiser window's
// spectrum.
inline Spectrum simulate(const SimulatedSpectrum& of) {
  constexpr int kBins = 100;
  constexpr int kParts = 8;
  constexpr int kReach = 4;
  constexpr double kStep_hz = 1.5625;
  constexpr double kEnd_hz = 133.0;
  std::vector<double> window;
  double energy = 0.0;
  for (int i = 0; i <= 2 * kReach * kParts; ++i) {
    const double x = static_cast<double>(i) / kParts - kReach;
    const double square = 36.0 - std::numbers::pi * std::numbers::pi * x * x;
    const double root = std::sqrt(std::abs(square));
    const double size =
        root < 1e-9 ? 1.0 : (square > 0.0 ? std::sinh(root) : std::sin(root)) / root;
    window.push_back(i % 2 == 0 ? size : -size);
    energy += size * size;
  }
  const std::size_t places = (kBins + 2 * kReach) * kParts;
  std::vector<double> place_hz(places);
  std::vector<double> motion(places);  // standard deviation
  double peak = 0.0;
  for (std::size_t j = 0; j < places; ++j) {
    place_hz[j] = std::max(1.0, (static_cast<double>(j) / kParts - kReach) * kStep_hz);
    motion[j] = place_hz[j] < kEnd_hz ? place_hz[j] * gain_of(of.modes, place_hz[j]) : 0.0;
    peak = std::max(peak, motion[j] * motion[j]);
  }
  std::mt19937 random(of.seed);
  std::normal_distribution<double> chance(0.0, std::sqrt(0.5));
  const auto drawn = [&] { return std::complex<double>(chance(random), chance(random)); };
  Spectrum spectrum{.step_hz = kStep_hz, .density = {}};
  spectrum.density.fill(std::vector<double>(kBins, 0.0));
  std::array<std::vector<std::complex<double>>, 3> parts;
  for (int k = 0; k < of.windows; ++k) {
    parts.fill({});
    for (std::size_t j = 0; j < places; ++j) {
      const std::complex<double> move = motion[j] * drawn();
      const double noise = std::sqrt(peak * (of.noise + of.rise * 20.0 / place_hz[j]) / 3.0);
      for (std::size_t c = 0; c < 3; ++c) {
        parts[c].push_back(of.direction[c] * move + noise * drawn());
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < kBins; ++i) {
        std::complex<double> sum = 0.0;
        for (std::size_t q = 0; q < window.size(); ++q) {
          sum += window[q] * parts[c][i * kParts + q];
        }
        spectrum.density[c][i] += std::norm(sum) / energy / of.windows;
      }
    }
  }
  return spectrum;
}

// One mode of 25 to 110 Hz with up to two weaker ones, at least 8 Hz apart.
inline std::vector<ModeOfAxis> drawn_modes(std::mt19937& random) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto swing = [](const ModeOfAxis& m) {
    return std::abs(m.gain) / (m.damping_ratio * m.freq_hz);
  };
  const auto count = static_cast<std::size_t>(uniform(1.0, 3.999));
  for (;;) {
    std::vector<ModeOfAxis> modes = {{uniform(25.0, 110.0), uniform(0.03, 0.15), 1.0}};
    bool is_fine = true;
    while (modes.size() < count) {
      const double gain = uniform(0.05, 0.4) * (uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0);
      modes.push_back({uniform(25.0, 125.0), uniform(0.03, 0.15), gain});
      modes.front().gain -= gain;
      for (std::size_t i = 0; i + 1 < modes.size(); ++i) {
        is_fine &= std::abs(modes[i].freq_hz - modes.back().freq_hz) >= 8.0;
      }
    }
    for (std::size_t i = 1; i < modes.size(); ++i) {
      // Chance would tell which of two alike is the main one.
      is_fine &= 1.3 * swing(modes[i]) < swing(modes.front());
    }
    if (is_fine) {
      return modes;
    }
  }
}

}  // namespace unflex::identify
