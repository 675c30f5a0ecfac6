#include "unflex/compensate/band.hpp"

#include <array>

namespace unflex::compensate {
namespace {

// What the middle of a band has of its share; the edges have the rest.
constexpr double kMiddleShare = 1.0 / 3.0;

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
    result.push_back({axis.detuned(freq_factor, damping_factor)});
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
