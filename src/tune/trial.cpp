#include "unflex/tune/trial.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "comment_fields.hpp"
#include "unflex/core/math.hpp"

namespace unflex::tune {
namespace {

constexpr double kPi = std::numbers::pi;

// The frequencies of the first tower of an axis of which nothing is known.
constexpr double kSlowest_hz = 22.0;
constexpr double kFastest_hz = 104.0;
constexpr double kBroadStep = 1.04;
// One wave of this frequency makes every axis between those two swing about as much for an error of
// 1 %. An axis of twice the frequency would not swing at all, so that must be out of range.
constexpr double kBroadWave_hz = 70.0;
constexpr double kBroadAccel_mm_s2 = 2500.0;

// The height of waves in a wall that an eye sees, from trough to crest.
constexpr double kSeen_um = 8.0;
// Share of the print's acceleration that the waves use. The rest keeps the speed even.
constexpr double kShareOfAccel = 0.7;
constexpr int kMostWaves = 8;
// The zone shall be wider, by this factor, than the zone that the other value's error alone closes.
constexpr double kWiderThanOther = 1.4;
constexpr double kNarrowestZone = 0.02;
// Bands extend kBeyond half-zones past the value's uncertainty.
constexpr double kBeyond = 1.3;
constexpr double kStepsPerHalfZone = 5.0;
constexpr double kMostBands = 41.0;
constexpr double kLeastDamping = 0.005;
constexpr double kMostDamping = 0.25;
// How far the middle of a zone may be off, in halves of its width: eyes are not the same at both
// edges.
constexpr double kUnevenEye = 0.25;

double omega(double freq_hz) { return 2.0 * kPi * freq_hz; }

// How high the waves in the wall are for an error of 1 %, from trough to crest.
//
// n waves at the axis' own frequency and of acceleration a leave a swing of a π n D/ω², D being the
// mean of what is left of each by the end. An error of 1 % lets 0.02 of that pass, either way.
double um_per_percent(const Waves& waves, double damping_ratio) {
  const double fading = 2.0 * kPi * waves.count * damping_ratio;
  const double mean_left = (1.0 - math::exp(-fading)) / fading;
  return 2e3 * 0.02 * kPi * waves.count * mean_left * waves.accel_mm_s2 /
         math::square(omega(waves.freq_hz));
}

// Half the width of the zone that the waves will leave if the other value is right.
double half_zone_of(const Waves& waves, double damping_ratio) {
  return kSeen_um / (100.0 * um_per_percent(waves, damping_ratio));
}

// The fewest waves for which an axis shows a zone of this half width.
Waves waves_for(const Knowledge& known, double half_zone, double accel_mm_s2) {
  Waves waves{known.freq_hz, kShareOfAccel * accel_mm_s2, 1};
  while (waves.count < kMostWaves && half_zone_of(waves, known.damping_ratio) > half_zone) {
    ++waves.count;
  }
  waves.accel_mm_s2 *= std::min(1.0, half_zone_of(waves, known.damping_ratio) / half_zone);
  return waves;
}

Trial broad_trial(const Knowledge& known, double accel_mm_s2) {
  Trial trial{.known = known};
  trial.first = kSlowest_hz;
  trial.step = kBroadStep;
  trial.bands = static_cast<std::size_t>(
      1.0 + std::floor(math::log(kFastest_hz / kSlowest_hz) / math::log(kBroadStep)));
  trial.waves = {kBroadWave_hz, std::min(kBroadAccel_mm_s2, kShareOfAccel * accel_mm_s2), 1};
  return trial;
}

// How many steps lead from the middle band to the last one, `reach` away.
double steps_to_end(double reach, double half_zone) {
  return std::min(std::ceil(reach / (half_zone / kStepsPerHalfZone)), (kMostBands - 1.0) / 2.0);
}

Trial freq_trial(const Knowledge& known, double accel_mm_s2) {
  Trial trial{.known = known};
  trial.waves = waves_for(known, std::max(kNarrowestZone, kWiderThanOther * known.damping_error),
                          accel_mm_s2);
  const double half_zone = half_zone_of(trial.waves, known.damping_ratio);
  const double reach = known.freq_error + kBeyond * half_zone;
  const double steps = steps_to_end(reach, half_zone);
  trial.bands = static_cast<std::size_t>(2.0 * steps + 1.0);
  trial.step = 1.0 + reach / steps;
  trial.first = known.freq_hz * math::pow(trial.step, -steps);
  return trial;
}

Trial damping_trial(const Knowledge& known, double accel_mm_s2) {
  Trial trial{.parameter = Parameter::damping_ratio, .known = known};
  trial.waves =
      waves_for(known, std::max(kNarrowestZone, kWiderThanOther * known.freq_error), accel_mm_s2);
  const double half_zone = half_zone_of(trial.waves, known.damping_ratio);
  const double reach = known.damping_error + kBeyond * half_zone;
  trial.first = std::max(kLeastDamping, known.damping_ratio - reach);
  const double last = std::min(kMostDamping, known.damping_ratio + reach);
  const double half = (last - trial.first) / 2.0;
  const double steps = steps_to_end(half, half_zone);
  trial.bands = static_cast<std::size_t>(2.0 * steps + 1.0);
  trial.step = half / steps;
  return trial;
}

std::string_view word(Parameter parameter) {
  return parameter == Parameter::freq_hz ? "freq_hz" : "damping_ratio";
}

// A number that is not negative.
bool take_positive(std::string_view& line, std::string_view name, double& number) {
  return take_number(line, name, number) && number >= 0.0;
}

}  // namespace

double Waves::height_mm() const { return 2.0 * accel_mm_s2 / math::square(omega(freq_hz)); }

double Trial::value(std::size_t band) const {
  const double steps = static_cast<double>(band) - 1.0;
  return parameter == Parameter::freq_hz ? first * math::pow(step, steps) : first + step * steps;
}

double Trial::freq_hz(std::size_t band) const {
  return parameter == Parameter::freq_hz ? value(band) : known.freq_hz;
}

double Trial::damping_ratio(std::size_t band) const {
  return parameter == Parameter::damping_ratio ? value(band) : known.damping_ratio;
}

Trial next_trial(const Knowledge& known, double accel_mm_s2) {
  if (!known.has_freq()) {
    return broad_trial(known, accel_mm_s2);
  }
  return known.rounds % 2 == 0 ? freq_trial(known, accel_mm_s2) : damping_trial(known, accel_mm_s2);
}

double needed_accel_mm_s2(const Trial& trial, double accel_mm_s2) {
  // A zone of 30 % either way is most of the first tower.
  constexpr double kWidest = 0.3;
  const double half_zone = half_zone_of(trial.waves, trial.known.damping_ratio);
  return half_zone > kWidest ? accel_mm_s2 * half_zone / kWidest : 0.0;
}

Result<Knowledge> read(const Trial& trial, const Zone& zone) {
  if (zone.first < 1 || zone.first > zone.last || zone.last > trial.bands) {
    return fail(ErrorKind::usage,
                fmt::format("the tower has the bands 1 to {}, counted from the bed; give the first "
                            "and the last without waves as 12..19",
                            trial.bands));
  }
  Knowledge known = trial.known;
  ++known.rounds;
  // The eye tells bands apart, so that an edge lies anywhere between two.
  const double low = trial.value(zone.first);
  const double high = trial.value(zone.last);
  const bool at_low_end = zone.first == 1;
  const bool at_high_end = zone.last == trial.bands;
  if (trial.parameter == Parameter::freq_hz) {
    // The part that passes at the pole is |1 − (f/f_c)²|, which is the same at both edges.
    known.freq_hz = std::sqrt(2.0 / (1.0 / (low * low) + 1.0 / (high * high)));
    const double half = 0.5 * math::log(high / low);
    const double step = math::log(trial.step);
    known.freq_error = std::max(0.5 * step, kUnevenEye * half);
    if (at_low_end || at_high_end) {
      // The zone may go on beyond the bands. The next tower tries once more, around here.
      known.freq_error = std::max(known.freq_error, half + step);
      known.rounds = trial.known.rounds;
    }
  } else {
    known.damping_ratio = 0.5 * (low + high);
    const double half = 0.5 * (high - low);
    known.damping_error = std::max(0.5 * trial.step, kUnevenEye * half);
    if (at_low_end || at_high_end) {
      known.damping_error = std::max(known.damping_error, 0.5 * half);
    }
  }
  return known;
}

std::string to_comment(char axis, const Trial& trial) {
  return fmt::format(
      "{}{} parameter={} bands={} first={:.6f} step={:.6f} freq_hz={:.4f} freq_error={:.5f} "
      "damping_ratio={:.5f} damping_error={:.5f} rounds={} wave_hz={:.4f} wave_accel={:.1f} "
      "waves={}",
      kTrialMark, axis, word(trial.parameter), trial.bands, trial.first, trial.step,
      trial.known.freq_hz, trial.known.freq_error, trial.known.damping_ratio,
      trial.known.damping_error, trial.known.rounds, trial.waves.freq_hz, trial.waves.accel_mm_s2,
      trial.waves.count);
}

Result<AxisTrial> from_comment(std::string_view line, const SourcePlace& place) {
  AxisTrial result;
  Trial& trial = result.trial;
  std::string_view rest = line;
  rest.remove_prefix(std::min(rest.size(), kTrialMark.size()));
  const bool has_axis = rest.starts_with('x') || rest.starts_with('y');
  if (has_axis) {
    result.axis = rest.front();
    rest.remove_prefix(1);
  }
  double bands = 0.0;
  double rounds = 0.0;
  double count = 0.0;
  const std::optional<std::string_view> parameter =
      has_axis ? take(rest, "parameter") : std::nullopt;
  const bool good =
      parameter &&
      (*parameter == word(Parameter::freq_hz) || *parameter == word(Parameter::damping_ratio)) &&
      take_positive(rest, "bands", bands) && take_positive(rest, "first", trial.first) &&
      take_positive(rest, "step", trial.step) &&
      take_positive(rest, "freq_hz", trial.known.freq_hz) &&
      take_positive(rest, "freq_error", trial.known.freq_error) &&
      take_positive(rest, "damping_ratio", trial.known.damping_ratio) &&
      take_positive(rest, "damping_error", trial.known.damping_error) &&
      take_positive(rest, "rounds", rounds) &&
      take_positive(rest, "wave_hz", trial.waves.freq_hz) &&
      take_positive(rest, "wave_accel", trial.waves.accel_mm_s2) &&
      take_positive(rest, "waves", count);
  constexpr double kMost = 1000.0;
  if (!good || bands < 1.0 || bands > kMost || rounds > kMost || count > kMost ||
      trial.first <= 0.0 || trial.step <= 0.0) {
    return fail(ErrorKind::input, place,
                "is not as unflex tune has written it; give the tower's file as it was made");
  }
  trial.parameter =
      *parameter == word(Parameter::freq_hz) ? Parameter::freq_hz : Parameter::damping_ratio;
  trial.bands = static_cast<std::size_t>(bands);
  trial.known.rounds = static_cast<std::size_t>(rounds);
  trial.waves.count = static_cast<int>(count);
  return result;
}

}  // namespace unflex::tune
