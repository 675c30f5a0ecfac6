// A firmware that counts motor steps takes a line's end to the nearest of them, and may refuse
// lines of less than a few. Where a line ends, and when, are then whole numbers, and the best are
// searched for: of all lines that begin where a kept state is, those that cost least are kept for
// each candidate time, kKept of them (the M-algorithm; Anderson & Mohan, IEEE Trans. Comm. 32
// (1984), 169). A state's cost is that of its lines so far and of the best lines to come if places
// were no whole numbers and times fixed, which is a linear-quadratic regulator's (Anderson & Moore,
// Optimal Control: Linear Quadratic Methods, § 2.4 and 4.1). line_cost.hpp has the notation.
#include "step_path.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "line_cost.hpp"

namespace unflex::emit {
namespace {

// States kept for each candidate time.
constexpr std::size_t kKept = 4;
// Ends tried for each state and duration.
constexpr std::size_t kEnds = 3;
// How many places off the best one, along the path, an end may lie.
constexpr int kAlong = 3;
// Candidates that are searched at once, and how far beyond them.
constexpr std::size_t kBlock = 4096;
constexpr std::size_t kBeyond = 512;
// Lines up to this long may lie across a wanted time.
constexpr double kAcross_mm = 0.25;
// A line is worth this much time of an error as large as the tolerance.
constexpr double kLineWorth_s = 0.01;
// What lines faster than an even pace cost beyond their worth, per (pace² − 1).
constexpr double kHaste = 20.0;
// How much longer than an even pace a line is reckoned to take at most.
constexpr double kPatience = 2.5;
// States that cost this many lines more than the best one are left.
constexpr double kMargin = 400.0;
// However many lines follow a run, it gets this many within the time that lines are counted over.
constexpr int kFewest = 4;
// What too quick a change of speed costs, mm²·s.
constexpr double kTooQuick = 1e-4;
// What a line too many costs.
constexpr double kTooMany = 1e-4;

using Place = std::array<std::int64_t, 2>;  // in steps

struct State {
  double total = 0.0;  // what it has cost and will cost
  double spent = 0.0;
  Vector6d z = Vector6d::Zero();
  Place at{};
  Eigen::Vector2d speed_mm_s = Eigen::Vector2d::Zero();  // of the line that ends here
  double line_s = 0.0;                                   // its duration
  std::size_t k = 0;
  std::int32_t parent = -1;
};

std::int64_t nearest(double steps) { return static_cast<std::int64_t>(std::floor(steps + 0.5)); }

class Search {
 public:
  Search(const LineCosts& costs, const std::vector<double>& wanted, const RunEnds& ends,
         const AxisGrid& x, const AxisGrid& y, const LineRules& rules)
      : costs_(&costs), ends_(ends), grid_{&x, &y}, rules_(&rules), last_(costs.size() - 1) {
    end_ = {steps(0, ends.end_x_mm), steps(1, ends.end_y_mm)};
    least_ = candidates(rules.min_line_s);
    most_ = static_cast<std::size_t>(rules.max_line_s / costs.dt_s() + 1e-9);
    for (const double t : wanted) {
      wanted_.push_back(static_cast<std::size_t>(nearest(t / costs.dt_s())));
    }
    line_worth_ = 0.5 * rules.tolerance_mm * rules.tolerance_mm * kLineWorth_s;
  }

  Polygon run(const std::vector<double>& lines_before_s) {
    begins_s_ = lines_before_s;
    begins_s_.push_back(0.0);
    State begin = start();
    std::size_t from = 0;
    while (true) {
      const std::size_t until = from + kBlock;
      const bool is_last = until + kBeyond >= last_;
      const std::optional<std::size_t> best =
          block(begin, from, is_last ? last_ : until + kBeyond, is_last);
      if (!best) {
        return {};
      }
      // The best state's ancestors, the youngest last.
      std::vector<const State*> way;
      for (auto i = static_cast<std::int32_t>(*best); i >= 0;
           i = arena_[static_cast<std::size_t>(i)].parent) {
        way.push_back(&arena_[static_cast<std::size_t>(i)]);
      }
      std::ranges::reverse(way);
      std::size_t taken = 0;
      for (const State* state : way) {
        if (!is_last && state->k > until) {
          break;
        }
        if (taken++ > 0 || from == 0) {
          if (taken > 1) {
            begins_s_.push_back(costs_->time_s(state->k));
          }
          polygon_.times_s.push_back(costs_->time_s(state->k));
          polygon_.x_mm.push_back(mm(0, state->at[0]));
          polygon_.y_mm.push_back(mm(1, state->at[1]));
        }
      }
      if (is_last) {
        return std::move(polygon_);
      }
      if (taken < 2) {
        return {};  // a line longer than a block
      }
      State next = *way[taken - 1];
      next.parent = -1;
      from = next.k;
      begin = next;
    }
  }

 private:
  [[nodiscard]] std::int64_t steps(std::size_t axis, double mm) const {
    return nearest((mm - grid_[axis]->offset_mm) / grid_[axis]->step_mm);
  }
  [[nodiscard]] double mm(std::size_t axis, std::int64_t steps) const {
    return grid_[axis]->offset_mm + static_cast<double>(steps) * grid_[axis]->step_mm;
  }
  [[nodiscard]] Eigen::Vector2d mm(const Place& at) const { return {mm(0, at[0]), mm(1, at[1])}; }

  [[nodiscard]] State start() const {
    State state;
    state.at = {steps(0, ends_.start_x_mm), steps(1, ends_.start_y_mm)};
    state.z[2] = ends_.start_x_mm - costs_->base_mm(0)[0];
    state.z[5] = ends_.start_y_mm - costs_->base_mm(0)[1];
    return state;
  }

  // The number of candidates that take at least this long.
  [[nodiscard]] std::size_t candidates(double duration_s) const {
    return static_cast<std::size_t>(std::ceil(duration_s / costs_->dt_s() - 1e-9));
  }

  // The durations tried for a line from candidate k on, in candidates.
  void durations(std::size_t k, std::vector<std::size_t>& result) const {
    result.clear();
    const std::size_t most = std::min(most_, last_ - k);
    const auto wanted = std::ranges::upper_bound(wanted_, k);
    const std::size_t until = wanted == wanted_.end() ? most : std::min(most, *wanted - k);
    std::size_t m = least_;
    for (; m <= until; m += std::max<std::size_t>(m / 12, 1)) {
      result.push_back(m);
    }
    if (until >= least_ && result.back() != until) {
      result.push_back(until);
    }
    // Across the wanted time.
    const std::size_t any_length = too_many_wanted(k) ? candidates(rules_->even_line_s()) : 0;
    for (m = std::max(least_, until + 1); m <= most; ++m) {
      if (m > std::max(2 * least_, any_length) &&
          (costs_->base_mm(k + m) - costs_->base_mm(k)).norm() > kAcross_mm) {
        break;
      }
      result.push_back(m);
    }
  }

  // Whether lines from k on that end at every wanted time would be more than the budget has.
  [[nodiscard]] bool too_many_wanted(std::size_t k) const {
    constexpr std::ptrdiff_t kSome = 4;
    const auto next = std::ranges::upper_bound(wanted_, k);
    return wanted_.end() - next >= kSome &&
           *(next + kSome - 1) < k + kSome * candidates(rules_->even_line_s());
  }

  // The duration of a line from k on that the cost to go reckons with: the shortest that covers
  // enough steps at an even pace.
  [[nodiscard]] std::size_t usual(std::size_t k) const {
    const std::size_t left = last_ - k;
    std::size_t m = candidates(rules_->even_line_s());
    if (left < 2 * m) {
      return left;
    }
    const auto covers = [&](std::size_t candidates) {
      const Eigen::Vector2d way = costs_->base_mm(k + candidates) - costs_->base_mm(k);
      return std::max(std::abs(way[0]) / grid_[0]->step_mm, std::abs(way[1]) / grid_[1]->step_mm) >=
             rules_->min_steps;
    };
    // Where the base turns round, that may be never.
    const std::size_t patience = candidates(kPatience * rules_->even_line_s());
    while (m < std::min(patience, left - m) && !covers(m)) {
      ++m;
    }
    return m;
  }

  // After the last line: the machine rests at the run's end while the base still moves, from
  // candidate k on. Of e alone, that is of z with o as it must be.
  void set_rest_costs(std::size_t from) {
    rest_.assign(last_ - from + 1, {});
    rest_.back() = costs_->ring_down();
    for (std::size_t k = last_; k-- > from;) {
      const LineCost line = costs_->line(k, 1);
      const Eigen::Vector2d o = mm(end_) - costs_->base_mm(k);
      const Eigen::Vector2d u = mm(end_) - costs_->base_mm(k + 1);
      const Quadratic& next = rest_[k + 1 - from];
      const auto [all, slope, constant] = whole_cost(line, next);
      // w = e + fixed
      Vector8d fixed = Vector8d::Zero();
      fixed[2] = o[0];
      fixed[5] = o[1];
      fixed[6] = u[0];
      fixed[7] = u[1];
      Quadratic& here = rest_[k - from];
      here.matrix = all.topLeftCorner<6, 6>();
      here.slope = (slope + all * fixed).head<6>();
      here.constant = constant + slope.dot(fixed) + 0.5 * fixed.dot(all * fixed);
      for (const Eigen::Index i : {2, 5}) {
        here.matrix.row(i).setZero();
        here.matrix.col(i).setZero();
        here.slope[i] = 0.0;
      }
    }
  }

  void set_costs_to_go(std::size_t from, std::size_t until, bool is_last) {
    to_go_.assign(until - from + 1, {});
    rest_from_ = until + 1;
    if (is_last) {
      rest_from_ = std::max(from, until - std::min(until, kBeyond));
      set_rest_costs(rest_from_);
    }
    const Quadratic at_end = costs_->ring_down();
    for (std::size_t k = until + 1; k-- > from;) {
      Quadratic& here = to_go_[k - from];
      const std::size_t m = k < until ? usual(k) : 0;
      if (k == until || k + m > until) {
        here = is_last ? rest_[k - rest_from_] : at_end;
      } else if (is_last && k + m == until) {
        here = ending_on_base(costs_->line(k, m), to_go_[k + m - from]);
      } else {
        here = best_end(costs_->line(k, m), to_go_[k + m - from]).value;
      }
    }
  }

  // Searches candidates from `from` to `until`; the best state at the end, in arena_.
  std::optional<std::size_t> block(State begin, std::size_t from, std::size_t until, bool is_last) {
    set_costs_to_go(from, until, is_last);
    arena_.clear();
    from_ = from;
    kept_.assign(until - from + 1, {});
    finished_.reset();
    begin.total = begin.spent + to_go_[0].at(begin.z);
    keep(begin);
    std::vector<std::size_t> tried;
    for (std::size_t k = from; k < until; ++k) {
      std::vector<State>& states = kept_[k - from];
      if (states.empty()) {
        continue;
      }
      const double most = best_open(k, until) + kMargin * line_worth_;
      const std::size_t first = arena_.size();
      for (const State& state : states) {
        if (state.total <= most) {
          arena_.push_back(state);
        }
      }
      std::vector<State>().swap(states);
      if (arena_.size() == first) {
        continue;
      }
      earliest_s_.clear();
      for (std::size_t i = first; i < arena_.size(); ++i) {
        earliest_s_.push_back(earliest_end_s(i));
      }
      first_ = first;
      durations(k, tried);
      for (const std::size_t m : tried) {
        if (k + m > until) {
          continue;
        }
        const LineCost line = costs_->line(k, m);
        const Quadratic& after = to_go_[k + m - from];
        const LineChoice choice = best_end(line, after);
        const std::size_t count = arena_.size();
        for (std::size_t i = first; i < count; ++i) {
          if (is_last && k + m >= rest_from_) {
            finish(i, m, line);
          }
          if (!is_last || k + m < until) {
            extend(i, m, line, choice);
          }
        }
      }
    }
    if (is_last) {
      if (!finished_) {
        return std::nullopt;
      }
      arena_.push_back(*finished_);
      return arena_.size() - 1;
    }
    // Of the states at the end of the block.
    std::optional<std::size_t> best;
    for (std::size_t k = until; k > from && k + kBeyond / 2 > until; --k) {
      for (const State& state : kept_[k - from]) {
        arena_.push_back(state);
      }
    }
    for (std::size_t i = 0; i < arena_.size(); ++i) {
      if (arena_[i].k + kBeyond / 2 > until && (!best || arena_[i].total < arena_[*best].total)) {
        best = i;
      }
    }
    return best;
  }

  // From when on a line that begins with state i may end, for no more than burst_lines to begin
  // within any burst_s.
  [[nodiscard]] double earliest_end_s(std::size_t i) const {
    if (rules_->burst_lines <= 0) {
      return 0.0;
    }
    const bool near_end = costs_->time_s(arena_[i].k) + rules_->burst_s > costs_->time_s(last_);
    const int allowed = std::max(rules_->burst_lines - (near_end ? ends_.lines_after : 0), kFewest);
    auto ancestor = static_cast<std::int32_t>(i);
    int lines = 1;
    for (; lines < allowed && arena_[static_cast<std::size_t>(ancestor)].parent >= 0; ++lines) {
      ancestor = arena_[static_cast<std::size_t>(ancestor)].parent;
    }
    if (lines == allowed) {
      return rules_->burst_s + costs_->time_s(arena_[static_cast<std::size_t>(ancestor)].k);
    }
    // The youngest in begins_s_ is the oldest of the block.
    const auto before = static_cast<std::size_t>(allowed - lines);
    return before < begins_s_.size() ? rules_->burst_s + begins_s_[begins_s_.size() - 1 - before]
                                     : 0.0;
  }

  // The least that any state costs that is still to be extended, from candidate k on.
  [[nodiscard]] double best_open(std::size_t k, std::size_t until) const {
    double best = finished_ ? finished_->total : std::numeric_limits<double>::infinity();
    const double until_s = costs_->time_s(k) + rules_->max_line_s;
    for (; k <= until && costs_->time_s(k) <= until_s; ++k) {
      if (const std::vector<State>& states = kept_[k - from_]; !states.empty()) {
        best = std::min(best, states.front().total);
      }
    }
    return best;
  }

  // State i with a line over m candidates to u.
  [[nodiscard]] State after_line(std::size_t i, std::size_t m, const LineCost& line,
                                 const Place& to, const Quadratic& to_go) const {
    const State& state = arena_[i];
    State next;
    next.k = state.k + m;
    next.at = to;
    next.parent = static_cast<std::int32_t>(i);
    next.line_s = costs_->time_s(next.k) - costs_->time_s(state.k);
    next.speed_mm_s = (mm(to) - mm(state.at)) / next.line_s;
    Vector8d w;
    w << state.z, mm(to) - costs_->base_mm(next.k);
    next.z = line.move * w + line.shift;
    next.spent = state.spent + w.dot(0.5 * (line.matrix * w) + line.slope) + line.constant +
                 price(m) +
                 too_quick(next.speed_mm_s - state.speed_mm_s, state.line_s + next.line_s) +
                 (costs_->time_s(next.k) < earliest_s_[i - first_] ? kTooMany : 0.0);
    next.total = next.spent + to_go.at(next.z);
    return next;
  }

  // What a line over m candidates costs for being one. The shorter, the more: it takes from the
  // lines that may follow within the time they are counted over.
  [[nodiscard]] double price(std::size_t m) const {
    const double pace = rules_->even_line_s() / (static_cast<double>(m) * costs_->dt_s());
    return line_worth_ * (1.0 + kHaste * std::max(pace * pace - 1.0, 0.0));
  }

  [[nodiscard]] double too_quick(const Eigen::Vector2d& change_mm_s, double both_s) const {
    const double allowed = rules_->max_accel_mm_s2 * 0.5 * both_s;
    const double excess = change_mm_s.cwiseAbs().maxCoeff() / allowed - 1.0;
    return excess > 0.0 ? kTooQuick * (1.0 + excess) : 0.0;
  }

  [[nodiscard]] bool enough(const Place& from, const Place& to) const {
    return std::max(std::abs(to[0] - from[0]), std::abs(to[1] - from[1])) >= rules_->min_steps;
  }

  // The last line, after which the machine rests.
  void finish(std::size_t i, std::size_t m, const LineCost& line) {
    const State& state = arena_[i];
    if (!enough(state.at, end_)) {
      return;
    }
    State done = after_line(i, m, line, end_, rest_[state.k + m - rest_from_]);
    done.total += too_quick(done.speed_mm_s, done.line_s);
    if (!finished_ || done.total < finished_->total) {
      finished_ = done;
    }
  }

  // Tries lines over m candidates from state i to the places nearest to the best one, as the cost
  // has it.
  void extend(std::size_t i, std::size_t m, const LineCost& line, const LineChoice& choice) {
    const State state = arena_[i];
    const std::size_t k = state.k + m;
    const std::vector<State>& rivals = kept_[k - from_];
    const double least = state.spent + choice.value.at(state.z) + price(m);
    const double room = rivals.size() < kKept ? std::numeric_limits<double>::infinity()
                                              : rivals.back().total - least;
    if (room <= 0.0) {
      return;
    }
    // From here on in steps.
    const Eigen::Vector2d best_mm =
        costs_->base_mm(k) + choice.feedback * state.z + choice.feed_forward;
    const std::array<double, 2> step = {grid_[0]->step_mm, grid_[1]->step_mm};
    const std::array<double, 2> best = {(best_mm[0] - grid_[0]->offset_mm) / step[0],
                                        (best_mm[1] - grid_[1]->offset_mm) / step[1]};
    const double xx = choice.stiffness(0, 0) * step[0] * step[0];
    const double xy = choice.stiffness(0, 1) * step[0] * step[1];
    const double yy = choice.stiffness(1, 1) * step[1] * step[1];
    struct End {
      Place at{};
      double extra = 0.0;
    };
    std::array<End, kEnds> ends;
    std::size_t count = 0;
    const auto consider = [&](const Place& to) {
      const double dx = static_cast<double>(to[0]) - best[0];
      const double dy = static_cast<double>(to[1]) - best[1];
      const End end{to, 0.5 * (xx * dx * dx + 2.0 * xy * dx * dy + yy * dy * dy)};
      if (end.extra >= (count < kEnds ? room : std::min(room, ends[count - 1].extra)) ||
          !enough(state.at, to) || !within(0, to[0], k) || !within(1, to[1], k)) {
        return;
      }
      for (std::size_t j = 0; j < count; ++j) {
        if (ends[j].at == to) {
          return;
        }
      }
      if (count < kEnds) {
        ++count;
      }
      ends[count - 1] = end;
      for (std::size_t j = count - 1; j > 0 && ends[j].extra < ends[j - 1].extra; --j) {
        std::swap(ends[j], ends[j - 1]);
      }
    };
    // The best place among those with this many steps on one axis.
    const auto consider_line = [&](std::size_t axis, std::int64_t steps_there) {
      const double off = static_cast<double>(steps_there) - best[axis];
      const double ratio = xy / (axis == 0 ? yy : xx);
      Place to{};
      to[axis] = steps_there;
      to[1 - axis] = nearest(best[1 - axis] - ratio * off);
      consider(to);
    };
    const std::size_t along = xx < yy ? 0 : 1;
    for (int d = -kAlong; d <= kAlong; ++d) {
      consider_line(along, nearest(best[along]) + d);
    }
    for (int d = -1; d <= 1; ++d) {
      consider_line(1 - along, nearest(best[1 - along]) + d);
    }
    if (count < kEnds && rules_->min_steps > 1) {
      for (const std::size_t axis : {0U, 1U}) {
        consider_line(axis, state.at[axis] - rules_->min_steps);
        consider_line(axis, state.at[axis] + rules_->min_steps);
      }
    }
    for (std::size_t j = 0; j < count; ++j) {
      if (worth_keeping(k, least + ends[j].extra)) {
        keep(after_line(i, m, line, ends[j].at, to_go_[k - from_]));
      }
    }
  }

  // Neither beyond the travel nor further out than the base.
  [[nodiscard]] bool within(std::size_t axis, std::int64_t at, std::size_t k) const {
    const Reach& reach = axis == 0 ? rules_->reach_x : rules_->reach_y;
    const double base = costs_->base_mm(k)[static_cast<Eigen::Index>(axis)];
    const double there = mm(axis, at);
    const double slack = grid_[axis]->step_mm;
    return there >= std::min(reach.min_mm, base - slack) &&
           there <= std::max(reach.max_mm, base + slack);
  }

  [[nodiscard]] bool worth_keeping(std::size_t k, double total) const {
    const std::vector<State>& states = kept_[k - from_];
    return states.size() < kKept || total < states.back().total;
  }

  // Keeps the best kKept states of a candidate time, one of each place, in order.
  void keep(const State& state) {
    std::vector<State>& states = kept_[state.k - from_];
    const auto same = std::ranges::find(states, state.at, &State::at);
    if (same != states.end()) {
      if (same->total <= state.total) {
        return;
      }
      states.erase(same);
    }
    const auto place = std::ranges::upper_bound(states, state.total, {}, &State::total);
    states.insert(place, state);
    if (states.size() > kKept) {
      states.pop_back();
    }
  }

  const LineCosts* costs_;
  RunEnds ends_;
  std::array<const AxisGrid*, 2> grid_;
  const LineRules* rules_;
  std::size_t last_;       // candidate
  std::size_t least_ = 1;  // candidates that a line takes
  std::size_t most_ = 1;
  std::vector<std::size_t> wanted_;
  Place end_{};
  double line_worth_ = 0.0;
  Polygon polygon_;               // of the blocks before
  std::vector<double> begins_s_;  // of their lines, and of those before the run
  // Of the block that is being searched.
  std::size_t from_ = 0;
  std::vector<Quadratic> to_go_;
  std::size_t rest_from_ = 0;
  std::vector<Quadratic> rest_;
  std::vector<State> arena_;
  // Of the states of the candidate time that is being extended, which begin at first_.
  std::size_t first_ = 0;
  std::vector<double> earliest_s_;
  std::vector<std::vector<State>> kept_;
  std::optional<State> finished_;
};

}  // namespace

Polygon step_path(const dynamics::BaseTrajectory& base, const std::vector<double>& wanted,
                  const std::function<ErrorWeight(double)>& weight, const RunEnds& ends,
                  const AxisGrid& x, const AxisGrid& y, const LineRules& rules) {
  const LineCosts costs(base, weight, rules);
  return Search(costs, wanted, ends, x, y, rules).run(ends.lines_before_s);
}

}  // namespace unflex::emit
