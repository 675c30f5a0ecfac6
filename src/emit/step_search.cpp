// A firmware that counts motor steps moves a line's end to the nearest step, and may refuse lines
// of less than a few steps. So the ends of lines, and their times, are whole numbers, and we search
// for the best ones. For each candidate time we keep the kKept cheapest lines that end there, among
// all that begin at a kept state (the M-algorithm; Anderson & Mohan, IEEE Trans. Comm. 32 (1984),
// 169). A state's cost is that of its lines so far and of those to come (cost_to_go.hpp).
// line_cost.hpp has the notation.
#include "step_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "cost_to_go.hpp"
#include "line_fan.hpp"

namespace unflex::emit {
namespace {

// States kept for each candidate time.
constexpr std::size_t kKept = kLanes;
// This many of the most promising lines to a candidate are tried first. They lower the cost that
// the other lines may have to be kept.
constexpr std::ptrdiff_t kFirst = 8;
// Candidates of one block, and how many beyond the block are searched with it.
constexpr std::size_t kBlock = 4096;
constexpr std::size_t kBeyond = 512;
// Lines up to this long may lie across a wanted time.
constexpr double kAcross_mm = 0.25;
// One more line costs as much as an error of the size of the tolerance costs over this time.
constexpr double kLineWorth_s = 0.01;
// Lines faster than an even pace cost this many line worths more, per (pace² − 1).
constexpr double kHaste = 20.0;
// However many lines follow a run, this many of its own may begin within burst_s before its end.
constexpr int kFewest = 4;
// Cost of a change of speed that the motors cannot make, mm²·s.
constexpr double kTooQuick = 1e-4;
// Cost of a line more than a burst may have, mm²·s.
constexpr double kTooMany = 1e-4;

// All lines from the states of one candidate time.
template <int kModes>
struct Lines {
  explicit Lines(const LineCosts<kModes>& costs) : fan(costs) {}

  LineFan<kModes> fan;
  // For the lines that end at the candidate being searched:
  double duration_s = 0.0;
  double price = 0.0;  // see Search::price()
  FanChoice choice;
  Bowl bowl;
  std::size_t k = 0;
  std::size_t first = 0;  // place in the arena of the first state
  std::size_t count = 0;
  std::array<double, kKept> earliest_s{};  // when a line from each state may end
};

// All lines of one duration from one state.
template <int kModes>
struct Option {
  double least = 0.0;  // total
  const Lines<kModes>* lines = nullptr;
  std::size_t lane = 0;
};

// One line of an Option.
template <int kModes>
struct Choice {
  double total = 0.0;
  Place to{};
  const Lines<kModes>* lines = nullptr;
  std::size_t lane = 0;
};

template <int kModes>
class Search {
 public:
  Search(const LineCosts<kModes>& costs, const std::vector<std::size_t>& wanted,
         const Stretch<kModes>& stretch, const StepGrid& grid, const LineRules& rules)
      : costs_(&costs),
        begin_(stretch.begin),
        goes_on_(stretch.goes_on),
        lines_after_(stretch.lines_after),
        grid_(grid),
        rules_(&rules),
        last_(stretch.last),
        shortest_(costs.candidates(rules.min_line_s)),
        longest_(static_cast<std::size_t>(rules.max_line_s / costs.dt_s() + 1e-9)),
        wanted_(&wanted),
        end_(stretch.end),
        to_go_(costs, rules, grid_.step_mm(), grid_.mm(end_)),
        lines_(longest_ + 1, Lines<kModes>(costs)),
        ending_(longest_ + 1) {
    line_worth_ = 0.5 * rules.tolerance_mm * rules.tolerance_mm * kLineWorth_s;
  }

  Polygon run(const std::vector<double>& lines_before_s) {
    begins_s_ = lines_before_s;
    begins_s_.push_back(costs_->time_s(begin_.k));
    State<kModes> begin = begin_;
    std::size_t from = begin_.k;
    while (true) {
      const std::size_t until = from + kBlock;
      const bool is_last = until + kBeyond >= last_;
      const std::optional<std::size_t> best =
          block(begin, from, is_last ? last_ : until + kBeyond, is_last);
      if (!best) {
        return {};
      }
      // The best state's ancestors, the youngest last.
      std::vector<const State<kModes>*> way;
      for (auto i = static_cast<std::int32_t>(*best); i >= 0;
           i = arena_[static_cast<std::size_t>(i)].parent) {
        way.push_back(&arena_[static_cast<std::size_t>(i)]);
      }
      std::ranges::reverse(way);
      std::size_t taken = 0;
      for (const State<kModes>* state : way) {
        if (!is_last && state->k > until) {
          break;
        }
        if (taken++ > 0 || from == begin_.k) {
          if (taken > 1) {
            begins_s_.push_back(costs_->time_s(state->k));
          }
          polygon_.times_s.push_back(costs_->time_s(state->k));
          polygon_.add(xy_of(grid_.mm(state->at)));
        }
      }
      if (is_last) {
        return std::move(polygon_);
      }
      if (taken < 2) {
        return {};  // one line is longer than a block
      }
      State<kModes> next = *way[taken - 1];
      next.parent = -1;
      from = next.k;
      begin = next;
    }
  }

 private:
  // The durations tried for a line from candidate k on, in candidates.
  void durations(std::size_t k, std::vector<std::size_t>& result) const {
    result.clear();
    const std::size_t most = std::min(longest_, last_ - k);
    const auto wanted = std::ranges::upper_bound(*wanted_, k);
    const std::size_t until = wanted == wanted_->end() ? most : std::min(most, *wanted - k);
    std::size_t m = shortest_;
    for (; m <= until; m += std::max<std::size_t>(m / 12, 1)) {
      result.push_back(m);
    }
    if (until >= shortest_ && result.back() != until) {
      result.push_back(until);
    }
    // Lines across the next wanted time have to be short.
    const std::size_t any_length =
        too_many_wanted(k) ? costs_->candidates(rules_->even_line_s()) : 0;
    for (m = std::max(shortest_, until + 1); m <= most; ++m) {
      if (m > std::max(2 * shortest_, any_length) &&
          (costs_->base_mm(k + m) - costs_->base_mm(k)).norm() > kAcross_mm) {
        break;
      }
      result.push_back(m);
    }
  }

  // Whether lines from k on that end at every wanted time would be more than a burst may have.
  [[nodiscard]] bool too_many_wanted(std::size_t k) const {
    constexpr std::ptrdiff_t kSome = 4;
    const auto next = std::ranges::upper_bound(*wanted_, k);
    return wanted_->end() - next >= kSome &&
           *(next + kSome - 1) < k + kSome * costs_->candidates(rules_->even_line_s());
  }

  // Searches the candidates from `from` to `until`. Returns the place in arena_ of the best state
  // at the end.
  std::optional<std::size_t> block(State<kModes> begin, std::size_t from, std::size_t until,
                                   bool is_last) {
    if (is_last && goes_on_) {
      to_go_.compute(from, std::min(until + kBeyond, costs_->size() - 1), false);
    } else {
      to_go_.compute(from, until, is_last);
    }
    arena_.clear();
    finished_.reset();
    ending_.assign(ending_.size(), {});
    begin.total = begin.spent + to_go_.at(from).at(begin.z);
    arena_.push_back(begin);
    spread(0, until);
    for (std::size_t k = from + 1; k <= until; ++k) {
      std::vector<Lines<kModes>*>& lines = ending_[k % ending_.size()];
      const std::size_t first = arena_.size();
      for (Lines<kModes>* each : lines) {
        each->fan.reach(k - each->k);
        each->duration_s = each->fan.duration_s();
        each->price = price(k - each->k);
      }
      if (is_last && (goes_on_ ? k == until : to_go_.may_rest(k))) {
        finish(lines, k);
      }
      if (!is_last || k < until) {
        extend(lines, k);
      }
      lines.clear();
      if (k < until && arena_.size() > first) {
        spread(first, until);
      }
    }
    if (is_last) {
      if (!finished_) {
        return std::nullopt;
      }
      arena_.push_back(*finished_);
      return arena_.size() - 1;
    }
    // The best of the states near the end of the block.
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i < arena_.size(); ++i) {
      if (arena_[i].k + kBeyond / 2 > until && (!best || arena_[i].total < arena_[*best].total)) {
        best = i;
      }
    }
    return best;
  }

  // Begins lines from all states in the arena from `first` on. They have the same candidate time.
  void spread(std::size_t first, std::size_t until) {
    const std::size_t k = arena_[first].k;
    Lines<kModes>& lines = lines_[k % lines_.size()];
    lines.k = k;
    lines.first = first;
    lines.count = arena_.size() - first;
    std::array<ZVector<kModes>, kKept> z;
    for (std::size_t lane = 0; lane < lines.count; ++lane) {
      z[lane] = arena_[first + lane].z;
      lines.earliest_s[lane] = earliest_end_s(first + lane);
    }
    lines.fan.begin(k, {z.data(), lines.count});
    durations(k, tried_);
    for (const std::size_t m : tried_) {
      if (k + m <= until) {
        ending_[(k + m) % ending_.size()].push_back(&lines);
      }
    }
  }

  // When a line that begins with state i may end at the earliest, so that no more than burst_lines
  // begin within any burst_s.
  [[nodiscard]] double earliest_end_s(std::size_t i) const {
    if (rules_->burst_lines <= 0) {
      return 0.0;
    }
    const bool near_end = costs_->time_s(arena_[i].k) + rules_->burst_s > costs_->time_s(last_);
    const int allowed = std::max(rules_->burst_lines - (near_end ? lines_after_ : 0), kFewest);
    auto ancestor = static_cast<std::int32_t>(i);
    int lines = 1;
    for (; lines < allowed && arena_[static_cast<std::size_t>(ancestor)].parent >= 0; ++lines) {
      ancestor = arena_[static_cast<std::size_t>(ancestor)].parent;
    }
    if (lines == allowed) {
      return rules_->burst_s + costs_->time_s(arena_[static_cast<std::size_t>(ancestor)].k);
    }
    // The last entry of begins_s_ is the oldest state of the block, which is counted already.
    const auto before = static_cast<std::size_t>(allowed - lines);
    return before < begins_s_.size() ? rules_->burst_s + begins_s_[begins_s_.size() - 1 - before]
                                     : 0.0;
  }

  // The fixed cost of a line over m candidates. Shorter lines cost more, since fewer lines can then
  // follow within burst_s.
  [[nodiscard]] double price(std::size_t m) const {
    const double pace = rules_->even_line_s() / (static_cast<double>(m) * costs_->dt_s());
    return line_worth_ * (1.0 + kHaste * std::max(pace * pace - 1.0, 0.0));
  }

  [[nodiscard]] double too_quick(const Eigen::Vector2d& change_mm_s, double both_s) const {
    const double allowed = rules_->max_accel_mm_s2 * 0.5 * both_s;
    const double excess = rules_->motors.largest_of_xy(xy_of(change_mm_s)) / allowed - 1.0;
    return excess > 0.0 ? kTooQuick * (1.0 + excess) : 0.0;
  }

  // The cost beyond J of a line that ends at candidate k. It does not depend on the place of its
  // end.
  [[nodiscard]] double fixed_cost(const Lines<kModes>& lines, std::size_t lane,
                                  std::size_t k) const {
    return lines.price + (costs_->time_s(k) < lines.earliest_s[lane] ? kTooMany : 0.0);
  }

  // The state after a line from another state to the place `to`.
  [[nodiscard]] State<kModes> after_line(const Lines<kModes>& lines, std::size_t lane,
                                         std::size_t k, const Place& to, double total) const {
    const State<kModes>& state = arena_[lines.first + lane];
    State<kModes> next;
    next.total = total;
    next.k = k;
    next.at = to;
    next.parent = static_cast<std::int32_t>(lines.first + lane);
    next.line_s = lines.duration_s;
    next.speed_mm_s = speed_to(state, to, next.line_s);
    next.z = lines.fan.after(lane, next.speed_mm_s);
    if (rules_->leads && state.line_s > 0.0) {
      const Eigen::Vector2d way =
          (grid_.mm(to) - start_mm(state)).cwiseQuotient(grid_.step_mm()).cwiseAbs();
      next.z += costs_->lead_kick(next.line_s, std::max(way.maxCoeff(), 1.0), next.speed_mm_s,
                                  state.speed_mm_s.norm());
    }
    next.spent = state.spent + lines.fan.cost(lane, next.speed_mm_s) + fixed_cost(lines, lane, k) +
                 too_quick(next.speed_mm_s - state.speed_mm_s, state.line_s + next.line_s);
    return next;
  }

  // Where the state is. The run's begin may lie between whole steps.
  [[nodiscard]] Eigen::Vector2d start_mm(const State<kModes>& state) const {
    return costs_->base_mm(state.k) +
           Eigen::Vector2d(state.z[place_of_o<kModes>(0)], state.z[place_of_o<kModes>(1)]);
  }
  [[nodiscard]] Eigen::Vector2d speed_to(const State<kModes>& state, const Place& to,
                                         double duration_s) const {
    return (grid_.mm(to) - start_mm(state)) / duration_s;
  }

  // Tries the last line, after which the machine rests or goes on with the next part.
  void finish(const std::vector<Lines<kModes>*>& all, std::size_t k) {
    for (const Lines<kModes>* lines : all) {
      const FanChoice choice = lines->fan.choice(goes_on_ ? to_go_.at(k) : to_go_.resting(k));
      const double duration_s = lines->duration_s;
      for (std::size_t lane = 0; lane < lines->count; ++lane) {
        const State<kModes>& state = arena_[lines->first + lane];
        const Eigen::Vector2d speed = speed_to(state, end_, duration_s);
        const double total = state.spent + choice.at(lane, speed) + fixed_cost(*lines, lane, k) +
                             too_quick(speed - state.speed_mm_s, state.line_s + duration_s) +
                             (goes_on_ ? 0.0 : too_quick(speed, duration_s));
        if ((!finished_ || total < finished_->total) &&
            Places{state.at, rules_->min_steps}.far_enough(end_)) {
          finished_ = after_line(*lines, lane, k, end_, total);
        }
      }
    }
  }

  // Tries lines that end at candidate k, the most promising ones first. Each goes to the places
  // that cost least around its best end.
  void extend(const std::vector<Lines<kModes>*>& all, std::size_t k) {
    options_.clear();
    for (Lines<kModes>* lines : all) {
      lines->choice = lines->fan.choice(to_go_.at(k));
      const Eigen::Vector2d per_step = grid_.step_mm() / lines->duration_s;
      lines->bowl = Bowl(lines->choice.xx * per_step[0] * per_step[0],
                         lines->choice.xy * per_step[0] * per_step[1],
                         lines->choice.yy * per_step[1] * per_step[1]);
      for (std::size_t lane = 0; lane < lines->count; ++lane) {
        const double least = arena_[lines->first + lane].spent +
                             lines->choice.least[static_cast<Eigen::Index>(lane)] +
                             fixed_cost(*lines, lane, k);
        options_.push_back({least, lines, lane});
      }
    }
    // Places stay within the travel, or where the base itself leaves it, no further out than the
    // base.
    const Eigen::Vector2d& base = costs_->base_mm(k);
    const Eigen::Vector2d& slack = grid_.step_mm();
    const Eigen::Vector2d least_mm = of_axes(rules_->reach, &Reach::min_mm);
    const Eigen::Vector2d most_mm = of_axes(rules_->reach, &Reach::max_mm);
    Places places{.min_steps = rules_->min_steps,
                  .least = grid_.steps(least_mm.cwiseMin(base - slack)),
                  .most = grid_.steps(most_mm.cwiseMax(base + slack))};
    // The best few come first, since they lower the cost that a line may have to be kept. The order
    // of the others does not matter.
    if (std::ssize(options_) > kFirst) {
      std::ranges::nth_element(options_, options_.begin() + kFirst, {}, &Option<kModes>::least);
    }
    kept_.clear();
    for (const Option<kModes>& option : options_) {
      if (option.least < most_to_keep()) {
        places.from = arena_[option.lines->first + option.lane].at;
        extend(option, places);
      }
    }
    for (const Choice<kModes>& line : kept_) {
      arena_.push_back(after_line(*line.lines, line.lane, k, line.to, line.total));
    }
  }

  void extend(const Option<kModes>& option, const Places& places) {
    const auto& [least, lines, lane] = option;
    const State<kModes>& state = arena_[lines->first + lane];
    const double duration_s = lines->duration_s;
    const Eigen::Vector2d best =
        grid_.steps(start_mm(state) + duration_s * lines->choice.best_mm_s(lane));
    for (const StepEnd& end : cheapest_ends(lines->bowl, best, places, most_to_keep() - least)) {
      const Eigen::Vector2d change = speed_to(state, end.at, duration_s) - state.speed_mm_s;
      keep({least + end.extra + too_quick(change, state.line_s + duration_s), end.at, lines, lane});
    }
  }

  // To be kept, a line to the candidate being searched must cost less than this.
  [[nodiscard]] double most_to_keep() const {
    return kept_.size() < kKept ? std::numeric_limits<double>::infinity() : kept_.back().total;
  }

  // Keeps the best kKept lines, one to each place, in order.
  void keep(const Choice<kModes>& line) {
    if (line.total >= most_to_keep()) {
      return;
    }
    const auto same = std::ranges::find_if(
        kept_, [&](const Choice<kModes>& kept) { return are_same(kept.to, line.to); });
    if (same != kept_.end()) {
      if (same->total <= line.total) {
        return;
      }
      kept_.erase(same);
    }
    const auto place = std::ranges::upper_bound(kept_, line.total, {}, &Choice<kModes>::total);
    kept_.insert(place, line);
    if (kept_.size() > kKept) {
      kept_.pop_back();
    }
  }

  const LineCosts<kModes>* costs_;
  State<kModes> begin_;
  bool goes_on_;
  int lines_after_;
  StepGrid grid_;
  const LineRules* rules_;
  std::size_t last_;      // the last candidate
  std::size_t shortest_;  // fewest candidates that a line takes
  std::size_t longest_;
  const std::vector<std::size_t>* wanted_;
  Place end_;
  double line_worth_ = 0.0;
  Polygon polygon_;               // from the blocks before
  std::vector<double> begins_s_;  // when its lines began, and those before the run
  // For the block being searched:
  CostToGo<kModes> to_go_;
  std::vector<State<kModes>> arena_;
  std::optional<State<kModes>> finished_;
  // Rings by candidate: the lines that begin there, and those that end there.
  std::vector<Lines<kModes>> lines_;
  std::vector<std::vector<Lines<kModes>*>> ending_;
  // For the candidate being searched:
  std::vector<std::size_t> tried_;
  std::vector<Option<kModes>> options_;
  std::vector<Choice<kModes>> kept_;
};

}  // namespace

template <int kModes>
Polygon search(const LineCosts<kModes>& costs, const std::vector<std::size_t>& wanted,
               const Stretch<kModes>& stretch, const StepGrid& grid, const LineRules& rules,
               const std::vector<double>& lines_before_s) {
  return Search<kModes>(costs, wanted, stretch, grid, rules).run(lines_before_s);
}

#define UNFLEX_FOR_MODES(kModes)                                                     \
  template Polygon search(const LineCosts<kModes>&, const std::vector<std::size_t>&, \
                          const Stretch<kModes>&, const StepGrid&, const LineRules&, \
                          const std::vector<double>&);

UNFLEX_FOR_MODES(1)
UNFLEX_FOR_MODES(2)
UNFLEX_FOR_MODES(3)
UNFLEX_FOR_MODES(4)
UNFLEX_FOR_MODES(6)

}  // namespace unflex::emit
