#include "step.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "unflex/core/math.hpp"

namespace unflex::study {
namespace {

constexpr double kLook_s = 5e-5;
// How long the nozzle is watched after the last jump: ten periods of the table's axis.
constexpr double kWatched_s = 0.63;
constexpr double kWithin = 0.05;
constexpr double kFreqError = 0.1;

// A nozzle that is still off by more than kWithin in the last period has not settled.
constexpr double kPeriod_s = 2.0 * std::numbers::pi / kStepOmega_rad_s;

}  // namespace

Staircase::Staircase(double omega_rad_s, double zeta, dynamics::ShaperPulses pulses)
    : omega_rad_s_(omega_rad_s), zeta_(zeta), pulses_(std::move(pulses)) {
  const double first_s = pulses_.front().time_s;
  for (dynamics::Pulse& pulse : pulses_) {
    pulse.time_s -= first_s;
  }
}

double Staircase::base_mm(double time_s) const {
  double sum = 0.0;
  for (const dynamics::Pulse& pulse : pulses_) {
    sum += pulse.time_s <= time_s ? pulse.weight : 0.0;
  }
  return sum;
}

dynamics::NozzleMotion Staircase::nozzle(double time_s) const {
  const dynamics::FlexibleAxis axis(omega_rad_s_, zeta_);
  dynamics::NozzleState after_jump;
  after_jump.parts[0].velocity = axis.damping_per_s();
  const dynamics::BaseSegment jumped{1.0, 0.0, 0.0};
  dynamics::NozzleState sum;
  for (const dynamics::Pulse& pulse : pulses_) {
    if (pulse.time_s <= time_s) {
      sum.add(dynamics::exact_step(axis, after_jump, jumped, time_s - pulse.time_s), pulse.weight);
    }
  }
  return sum.motion();
}

double Staircase::left_mm() const {
  const dynamics::NozzleMotion at = nozzle(last_s());
  const double y_mm = at.position - 1.0;
  const double damped_rad_s = omega_rad_s_ * std::sqrt(1.0 - zeta_ * zeta_);
  return math::hypot(y_mm, (at.velocity + zeta_ * omega_rad_s_ * y_mm) / damped_rad_s);
}

std::vector<NamedStaircase> staircases(double zeta, double freq_factor) {
  using dynamics::ShaperKind;
  const double omega_rad_s = freq_factor * kStepOmega_rad_s;
  std::vector<NamedStaircase> result = {{"none", {omega_rad_s, zeta, {{0.0, 1.0}}}}};
  for (const ShaperKind kind : {ShaperKind::zv, ShaperKind::mzv, ShaperKind::zvd}) {
    const double freq_hz = kStepOmega_rad_s / (2.0 * std::numbers::pi);
    result.push_back(
        {dynamics::name(kind), {omega_rad_s, zeta, *dynamics::shaper_pulses(kind, freq_hz, zeta)}});
  }
  return result;
}

StepRow step_row(const Staircase& staircase) {
  StepRow row;
  const double end_s = staircase.last_s() + kWatched_s;
  double before_mm = -1.0;
  for (std::size_t k = 1; static_cast<double>(k) * kLook_s < end_s; ++k) {
    const double t = static_cast<double>(k) * kLook_s;
    const double beyond_mm = staircase.nozzle(t).position - 1.0;
    row.overshoot = std::max(row.overshoot, beyond_mm);
    const double outside = std::abs(beyond_mm) - kWithin;
    const double outside_before = std::abs(before_mm) - kWithin;
    if (outside > 0.0) {
      row.settled_s = std::nullopt;
    } else if (outside_before > 0.0) {
      row.settled_s = t - kLook_s * outside / (outside - outside_before);
    }
    before_mm = beyond_mm;
  }
  if (row.settled_s && *row.settled_s > end_s - kPeriod_s) {
    row.settled_s = std::nullopt;
  }
  row.left = staircase.left_mm();
  return row;
}

std::vector<StepRow> step_table() {
  std::vector<StepRow> rows;
  for (const double zeta : kStepZetas) {
    const std::vector<NamedStaircase> exact = staircases(zeta);
    const std::vector<NamedStaircase> lower = staircases(zeta, 1.0 - kFreqError);
    const std::vector<NamedStaircase> higher = staircases(zeta, 1.0 + kFreqError);
    for (std::size_t i = 0; i < exact.size(); ++i) {
      StepRow row = step_row(exact[i].staircase);
      row.shaper = exact[i].shaper;
      row.zeta = zeta;
      row.left_off = std::max(lower[i].staircase.left_mm(), higher[i].staircase.left_mm());
      rows.push_back(row);
    }
  }
  return rows;
}

}  // namespace unflex::study
