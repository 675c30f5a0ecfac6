// Notation as in line_cost.hpp.
#include "leaps.hpp"

#include <algorithm>
#include <limits>

namespace unflex::emit {
namespace {

// A base that accelerates less than this follows a straight line as far as the nozzle can tell.
constexpr double kStraight_mm_s2 = 1.0;
// The base may stray from the leap by this share of the tolerance.
constexpr double kStray = 0.5;
// The nozzle's swing dies away in this time on both sides of a leap.
constexpr double kMargin_s = 0.15;
// A leap's ends are chosen among the candidates of this time.
constexpr double kChoice_s = 0.05;
// A shorter leap is not worth it.
constexpr double kShort_s = 0.4;

// A stretch of candidates.
struct Cruise {
  std::size_t from = 0;
  std::size_t until = 0;
};

class Cruises {
 public:
  Cruises(const Candidates& costs, const std::vector<std::size_t>& wanted, std::size_t last)
      : costs_(&costs), wanted_(&wanted), last_(last) {}

  // The next stretch without acceleration from candidate k on; empty at the end.
  [[nodiscard]] Cruise next(std::size_t k) const {
    while (k < last_ && !is_straight(k + 1)) {
      ++k;
    }
    const auto wanted = std::ranges::upper_bound(*wanted_, k);
    const std::size_t most = wanted == wanted_->end() ? last_ : std::min(*wanted, last_);
    std::size_t until = std::min(k + 1, last_);
    while (until < most && is_straight(until)) {
      ++until;
    }
    return {k, until};
  }

 private:
  [[nodiscard]] bool is_straight(std::size_t k) const {
    if (k == 0 || k + 1 >= costs_->size()) {
      return false;
    }
    const Eigen::Vector2d bend =
        costs_->base_mm(k + 1) - 2.0 * costs_->base_mm(k) + costs_->base_mm(k - 1);
    return bend.norm() <= kStraight_mm_s2 * costs_->dt_s() * costs_->dt_s();
  }

  const Candidates* costs_;
  const std::vector<std::size_t>* wanted_;
  std::size_t last_;
};

// The candidate of the stretch at which the base is closest to whole steps across its path.
std::size_t closest_to_steps(const Candidates& costs, const StepGrid& grid, const Cruise& stretch) {
  std::size_t best = stretch.from;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = stretch.from; k <= stretch.until; ++k) {
    const Eigen::Vector2d off = grid.mm(grid.nearest(costs.base_mm(k))) - costs.base_mm(k);
    const ErrorWeight& w = costs.weight(k);
    const double cost =
        w.xx * off[0] * off[0] + 2.0 * w.xy * off[0] * off[1] + w.yy * off[1] * off[1];
    if (cost < least) {
      least = cost;
      best = k;
    }
  }
  return best;
}

// Whether the base stays near the straight line between the two candidates, in place and time.
bool is_near_chord(const Candidates& costs, std::size_t from, std::size_t until, double most_mm) {
  const Eigen::Vector2d way = costs.base_mm(until) - costs.base_mm(from);
  for (std::size_t k = from; k <= until; ++k) {
    const double share = static_cast<double>(k - from) / static_cast<double>(until - from);
    if ((costs.base_mm(from) + share * way - costs.base_mm(k)).norm() > most_mm) {
      return false;
    }
  }
  return true;
}

}  // namespace

std::vector<Leap> leaps(const Candidates& costs, const std::vector<std::size_t>& wanted,
                        const Place& start, std::size_t last, const Place& end,
                        const StepGrid& grid, const LineRules& rules) {
  std::vector<Leap> result;
  const Cruises cruises(costs, wanted, last);
  const auto place = [&](std::size_t k) { return grid.nearest(costs.base_mm(k)); };
  for (std::size_t k = 0; k < last;) {
    const Cruise cruise = cruises.next(k);
    k = cruise.until;
    // Where the base goes so slowly that a line of usual duration would be too short, the leap
    // takes all of the cruise.
    const double speed_mm_s = (costs.base_mm(cruise.until) - costs.base_mm(cruise.from)).norm() /
                              (costs.time_s(cruise.until) - costs.time_s(cruise.from));
    const bool is_slow =
        speed_mm_s * rules.max_line_s < 2.0 * rules.min_steps * grid.step_mm().maxCoeff();
    const std::size_t margin = is_slow ? 0 : costs.candidates(kMargin_s);
    const std::size_t choice = is_slow ? 0 : costs.candidates(kChoice_s);
    if (cruise.until - cruise.from < 2 * (margin + choice) + costs.candidates(kShort_s)) {
      continue;
    }
    const std::size_t first = cruise.from + margin;
    const std::size_t final = cruise.until - margin;
    const std::size_t from = closest_to_steps(costs, grid, {first, first + choice});
    const std::size_t until = closest_to_steps(costs, grid, {final - choice, final});
    if (!is_near_chord(costs, from, until, kStray * rules.tolerance_mm)) {
      continue;
    }
    Leap leap{from, until, place(from), place(until)};
    // No line can cover the few steps between the run's end and a slow cruise.
    if (is_slow && !Places{start, rules.min_steps}.far_enough(leap.begin)) {
      leap.from = 0;
      leap.begin = start;
    }
    if (is_slow && !Places{leap.end, rules.min_steps}.far_enough(end)) {
      leap.until = last;
      leap.end = end;
    }
    const bool has_lines_before =
        leap.from == 0 ? leap.begin == start : result.empty() || result.back().until < leap.from;
    if (has_lines_before && Places{leap.begin, rules.min_steps}.far_enough(leap.end)) {
      result.push_back(leap);
    }
  }
  return result;
}

}  // namespace unflex::emit
