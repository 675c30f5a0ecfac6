// How many lines a file asks of the firmware per second.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <vector>

#include "unflex/planner/planner.hpp"

namespace unflex::verify {

// Counts the lines that move the machine. All segments of an arc count as one line.
class LineRate {
 public:
  void add(const planner::PlannedMove& move) {
    if (move.segment.line != line_) {
      line_ = move.segment.line;
      starts_s_.push_back(time_s_);
      while (starts_s_.front() <= time_s_ - kSpan_s) {
        starts_s_.pop_front();
      }
      if (starts_s_.size() > most_) {
        most_ = starts_s_.size();
        most_line_ = line_;
      }
    }
    time_s_ += move.duration_s();
  }

  // The next lines come from another text, with line numbers of its own.
  void change_text() { line_ = 0; }
  // How many lines of these moves begin within 100 ms of the first one.
  [[nodiscard]] static int first_lines(const std::vector<planner::PlannedMove>& moves) {
    int count = 0;
    double time_s = 0.0;
    std::size_t line = 0;
    for (const planner::PlannedMove& move : moves) {
      if (time_s >= kSpan_s) {
        break;
      }
      count += move.segment.line != line ? 1 : 0;
      line = move.segment.line;
      time_s += move.duration_s();
    }
    return count;
  }
  // Most lines begun within any 100 ms, per second, since the last forget().
  [[nodiscard]] double max_per_s() const { return static_cast<double>(most_) / kSpan_s; }
  // The line at which max_per_s() was reached; 0: none.
  [[nodiscard]] std::size_t densest_line() const { return most_line_; }
  // The largest max_per_s() since the beginning.
  [[nodiscard]] double largest_per_s() const {
    return static_cast<double>(std::max(most_ever_, most_)) / kSpan_s;
  }
  void forget() {
    most_ever_ = std::max(most_ever_, most_);
    most_ = most_line_ = 0;
  }
  // When the lines of the last 100 ms began, relative to the end of the last move (so below 0).
  [[nodiscard]] std::vector<double> last_begins_s() const {
    std::vector<double> result;
    for (const double start : starts_s_) {
      result.push_back(start - time_s_);
    }
    return result;
  }

 private:
  static constexpr double kSpan_s = 0.1;
  std::deque<double> starts_s_;
  double time_s_ = 0.0;
  std::size_t line_ = 0;
  std::size_t most_ = 0;
  std::size_t most_ever_ = 0;
  std::size_t most_line_ = 0;
};

}  // namespace unflex::verify
