#include "time_left.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace unflex::app {
namespace {

using Seconds = TimeLeft::Seconds;

// The least time and share of a stage that must be known for an estimate.
constexpr Seconds kLeastTime{3.0};
constexpr double kLeastFraction = 0.03;
// The least time between samples. It bounds the memory.
constexpr Seconds kSampleInterval{0.5};
// An estimate may be off by this share of the time left before it is corrected, but at least by
// kTolerated, since near the end every share is short.
constexpr double kToleratedShare = 0.15;
constexpr Seconds kTolerated{3.0};

}  // namespace

std::optional<Seconds> TimeLeft::update(std::string_view stage, double fraction, TimePoint now) {
  const bool known = fraction >= 0.0 && fraction <= 1.0;
  const bool again = !samples_.empty() && fraction < samples_.back().fraction;
  if (stage != stage_ || !known || again) {
    stage_ = stage;
    start_.reset();
    samples_.clear();
    end_.reset();
  }
  if (!known) {
    return std::nullopt;
  }
  if (!start_) {
    start_ = now;
    first_fraction_ = fraction;
  }
  if (samples_.empty() || now - samples_.back().time >= kSampleInterval) {
    samples_.push_back({now, fraction});
    forget_older_half(now);
  }
  const Sample& since = samples_.front();
  const double gained = fraction - since.fraction;
  if (now - *start_ < kLeastTime || fraction - first_fraction_ < kLeastFraction || gained <= 0.0) {
    // A stage that stands still gives no estimate, and its earlier estimate no longer holds.
    end_ = gained <= 0.0 ? std::nullopt : end_;
    return std::nullopt;
  }
  const Seconds left = Seconds(now - since.time) * ((1.0 - fraction) / gained);
  const TimePoint end = now + std::chrono::duration_cast<TimePoint::duration>(left);
  const Seconds tolerated = std::max(kTolerated, kToleratedShare * left);
  if (!end_ || std::chrono::abs(Seconds(end - *end_)) > tolerated) {
    end_ = end;
  }
  return std::max(Seconds(*end_ - now), Seconds(0.0));
}

void TimeLeft::forget_older_half(TimePoint now) {
  while (samples_.size() > 2 && 2 * (now - samples_[1].time) >= now - *start_) {
    samples_.pop_front();
  }
}

std::string time_left_text(Seconds left) {
  constexpr double kMinute = 60.0;
  constexpr double kStep = 5.0;
  // Rounded up, so that the text never says that nothing is left.
  const double seconds = std::max(kStep, kStep * std::ceil(left.count() / kStep));
  if (seconds <= kMinute) {
    return fmt::format("{:.0f} s left", seconds);
  }
  const double minutes = std::ceil(left.count() / kMinute);
  if (minutes < kMinute) {
    return fmt::format("{:.0f} min left", minutes);
  }
  // An hour or more before the end, single minutes would be made up.
  const double rounded = kStep * std::ceil(minutes / kStep);
  const double hours = std::floor(rounded / kMinute);
  return fmt::format("{:.0f} h {:.0f} min left", hours, rounded - kMinute * hours);
}

}  // namespace unflex::app
