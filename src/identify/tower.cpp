#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "modes_interval.hpp"
#include "response.hpp"
#include "unflex/core/math.hpp"

namespace unflex::identify {
namespace {

// ζ from the ratio of two successive waves: δ = ln ratio = 2πζ / √(1 − ζ²).
double damping_of(double ratio) {
  const double decrement = math::log(ratio);
  return decrement / math::hypot(2.0 * std::numbers::pi, decrement);
}

}  // namespace

Result<RecordFit> fit_tower(const Tower& tower) {
  constexpr double kLeast = 1e-3;
  if (!(tower.spacing_mm > 0.0) || !(tower.speed_mm_s > 0.0)) {
    return fail(ErrorKind::usage, "the waves' spacing and the speed must be above 0");
  }
  if (tower.decay != 0.0 && !(tower.decay > 1.0)) {
    return fail(ErrorKind::usage,
                "the decay is how many times lower a wave is than the one before, above 1");
  }
  // The frequencies that dynamics.x.freq_hz may have.
  constexpr double kLeast_hz = 1.0;
  constexpr double kMost_hz = 1000.0;
  const double freq_hz = tower.speed_mm_s / tower.spacing_mm;
  if (!(freq_hz >= kLeast_hz) || !(freq_hz <= kMost_hz)) {
    return fail(
        ErrorKind::usage,
        fmt::format("waves {:g} mm apart at {:g} mm/s are a frequency of {:.4g} Hz, which no "
                    "printer's belts have; give the spacing in mm and the speed in mm/s",
                    tower.spacing_mm, tower.speed_mm_s, freq_hz));
  }
  RecordFit record;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(3, 3);
  const double spread = std::max(tower.spacing_spread_mm / tower.spacing_mm, kLeast);
  covariance(0, 0) = math::square(spread / kQuantile);
  Estimate damping{.value = 0.1, .low = 0.03, .high = 0.2};
  if (tower.decay == 0.0) {
    record.warnings.emplace_back(
        "the damping is a guess: measure how much lower each wave is than the one before");
  } else {
    const double least = std::max(tower.decay - tower.decay_spread, 1.0 + kLeast);
    damping = {.value = damping_of(tower.decay),
               .low = damping_of(least),
               .high = damping_of(tower.decay + tower.decay_spread)};
  }
  covariance(1, 1) = math::square(math::log(damping.high / damping.low) / (2.0 * kQuantile));
  record.model = model_of(Method::tower, {{freq_hz, damping.value}}, covariance);
  record.model.modes.front().damping_ratio = damping;
  return record;
}

}  // namespace unflex::identify
