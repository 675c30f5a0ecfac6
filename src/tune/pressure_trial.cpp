#include "unflex/tune/pressure_trial.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "comment_fields.hpp"
#include "unflex/core/math.hpp"

namespace unflex::tune {
namespace {

// Values that the first tower tries if nothing is known.
constexpr double kLeastSum_s = 0.012;
constexpr double kMostSum_s = 1.0;
constexpr std::size_t kMostBands = 41;
// Values that the first tower for the dead time tries.
constexpr double kLeastDeadTime_s = -0.002;
constexpr double kMostDeadTime_s = 0.010;
constexpr double kDeadTimeStep_s = 0.0005;
// The least advance that a band is made for.
constexpr double kLeastAdvance_s = 0.001;
// The least reach of later towers to either side.
constexpr double kLeastReach_s = 0.002;
constexpr double kLeastReach = 0.03;  // share of s
constexpr double kLeastDeadTimeReach_s = 0.0015;
// How far the middle of a zone may be off, in halves of its width: eyes are not the same at both
// edges.
constexpr double kUnevenEye = 0.25;

PressureTrial broad_trial(const PressureKnowledge& known) {
  PressureTrial trial{.known = known};
  trial.bands = kMostBands;
  trial.first_s = kLeastSum_s;
  trial.step = math::pow(kMostSum_s / kLeastSum_s, 1.0 / static_cast<double>(kMostBands - 1));
  return trial;
}

// Bands from `low` to `high`, evenly spread.
void spread(PressureTrial& trial, double low_s, double high_s, std::size_t bands) {
  trial.bands = bands;
  trial.first_s = low_s;
  trial.step = (high_s - low_s) / static_cast<double>(bands - 1);
}

PressureTrial sum_trial(const PressureKnowledge& known) {
  PressureTrial trial{.known = known};
  const double reach_s = std::max({known.sum_error_s, kLeastReach_s, kLeastReach * known.sum_s});
  spread(trial, std::max(known.sum_s - reach_s, known.dead_time_s + kLeastAdvance_s),
         known.sum_s + reach_s, kMostBands);
  return trial;
}

PressureTrial dead_time_trial(const PressureKnowledge& known) {
  PressureTrial trial{.parameter = PressureParameter::dead_time, .known = known};
  const double most_s = known.sum_s - kLeastAdvance_s;
  if (known.rounds <= 2) {
    const double high_s = std::min(kMostDeadTime_s, most_s);
    spread(trial, kLeastDeadTime_s, high_s,
           1 + static_cast<std::size_t>(std::ceil((high_s - kLeastDeadTime_s) / kDeadTimeStep_s)));
  } else {
    const double reach_s = std::max(known.dead_time_error_s, kLeastDeadTimeReach_s);
    spread(trial, known.dead_time_s - reach_s, std::min(known.dead_time_s + reach_s, most_s),
           kMostBands);
  }
  return trial;
}

bool is_broad(const PressureTrial& trial) {
  return trial.parameter == PressureParameter::sum && !trial.known.has_sum();
}

std::string_view word(PressureParameter parameter) {
  return parameter == PressureParameter::sum ? "sum" : "dead_time";
}

}  // namespace

double PressureTrial::value_s(std::size_t band) const {
  const double steps = static_cast<double>(band) - 1.0;
  return is_broad(*this) ? first_s * math::pow(step, steps) : first_s + step * steps;
}

double PressureTrial::advance_s(std::size_t band) const {
  constexpr double kDigits = 1e6;  // as many as commands have
  const double advance_s = parameter == PressureParameter::sum
                               ? std::max(value_s(band) - known.dead_time_s, kLeastAdvance_s)
                               : known.sum_s - value_s(band);
  return std::round(kDigits * advance_s) / kDigits;
}

double PressureTrial::dead_time_s(std::size_t band) const {
  return parameter == PressureParameter::sum ? known.dead_time_s : value_s(band);
}

PressureTrial next_trial(const PressureKnowledge& known) {
  if (!known.has_sum()) {
    return broad_trial(known);
  }
  return known.rounds >= 2 && known.rounds % 2 == 0 ? dead_time_trial(known) : sum_trial(known);
}

Result<PressureKnowledge> read(const PressureTrial& trial, const Zone& zone) {
  if (zone.first < 1 || zone.first > zone.last || zone.last > trial.bands) {
    return fail(ErrorKind::usage,
                fmt::format("the tower has the bands 1 to {}, counted from the bed; give the first "
                            "and the last that are even as 12..19",
                            trial.bands));
  }
  PressureKnowledge known = trial.known;
  const double low_s = trial.value_s(zone.first);
  const double high_s = trial.value_s(zone.last);
  const double middle_s = 0.5 * (low_s + high_s);
  const double half_s = 0.5 * (high_s - low_s);
  const double next_s = trial.value_s(zone.last + 1) - high_s;
  const bool is_at_end = zone.first == 1 || zone.last == trial.bands;
  // A broad tower is read coarsely: the true value may be anywhere in the zone.
  const double error_s =
      is_broad(trial) || is_at_end ? half_s + next_s : std::max(0.5 * next_s, kUnevenEye * half_s);
  if (trial.parameter == PressureParameter::sum) {
    known.sum_s = middle_s;
    known.sum_error_s = error_s;
  } else {
    known.dead_time_s = middle_s;
    known.dead_time_error_s = error_s;
  }
  // At an end of the bands, the next tower tries this value once more, around the zone.
  known.rounds += is_at_end && !is_broad(trial) ? 0 : 1;
  return known;
}

std::string to_comment(const PressureTrial& trial) {
  return fmt::format(
      "{} parameter={} bands={} first={:.7f} step={:.7f} sum={:.7f} sum_error={:.7f} "
      "dead_time={:.7f} dead_time_error={:.7f} rounds={}",
      kPressureMark, word(trial.parameter), trial.bands, trial.first_s, trial.step,
      trial.known.sum_s, trial.known.sum_error_s, trial.known.dead_time_s,
      trial.known.dead_time_error_s, trial.known.rounds);
}

Result<PressureTrial> pressure_trial(std::string_view line, const SourcePlace& place) {
  PressureTrial trial;
  std::string_view rest = line;
  rest.remove_prefix(std::min(rest.size(), kPressureMark.size()));
  const std::optional<std::string_view> parameter = take(rest, "parameter");
  double bands = 0.0;
  double rounds = 0.0;
  const bool is_sum = parameter == word(PressureParameter::sum);
  const bool good =
      (is_sum || parameter == word(PressureParameter::dead_time)) &&
      take_number(rest, "bands", bands) && take_number(rest, "first", trial.first_s) &&
      take_number(rest, "step", trial.step) && take_number(rest, "sum", trial.known.sum_s) &&
      take_number(rest, "sum_error", trial.known.sum_error_s) &&
      take_number(rest, "dead_time", trial.known.dead_time_s) &&
      take_number(rest, "dead_time_error", trial.known.dead_time_error_s) &&
      take_number(rest, "rounds", rounds);
  constexpr double kMost = 1000.0;
  if (!good || bands < 1.0 || bands > kMost || rounds < 0.0 || rounds > kMost ||
      trial.step <= 0.0 || trial.known.sum_s < 0.0) {
    return fail(ErrorKind::input, place,
                "is not as unflex tune has written it; give the tower's file as it was made");
  }
  trial.parameter = is_sum ? PressureParameter::sum : PressureParameter::dead_time;
  trial.bands = static_cast<std::size_t>(bands);
  trial.known.rounds = static_cast<std::size_t>(rounds);
  return trial;
}

}  // namespace unflex::tune
