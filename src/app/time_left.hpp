// How long work will still take, by how it went so far.
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

namespace unflex::app {

// Judges by the later half of the known part of a stage, since parts of a print differ. An estimate
// counts down with the clock. It is corrected only where it has become wrong, so that the time does
// not jump about.
class TimeLeft {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  using Seconds = std::chrono::duration<double>;

  // The estimate at `now`, or none while too little is known. fraction: the share of the stage that
  // is done, negative if unknown. Another stage, or one that starts again, is judged anew.
  [[nodiscard]] std::optional<Seconds> update(std::string_view stage, double fraction,
                                              TimePoint now);

 private:
  struct Sample {
    TimePoint time;
    double fraction;
  };

  void forget_older_half(TimePoint now);

  std::string stage_;
  std::optional<TimePoint> start_;  // when the stage's first fraction was known
  double first_fraction_ = 0.0;
  std::deque<Sample> samples_;
  std::optional<TimePoint> end_;  // as last estimated
};

// "2 h 10 min left", "3 min left", "40 s left".
[[nodiscard]] std::string time_left_text(TimeLeft::Seconds left);

}  // namespace unflex::app
