#include "smoothed_filament.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "unflex/quadratic/elastic_program.hpp"

namespace unflex::emit {
namespace {

// Number of neighbouring knots that smoothing may reach over: usually, and where lines are short.
constexpr int kMostly = 18;
constexpr int kShortLines = 40;

// Gauss–Legendre, on [0, 1].
constexpr std::array<double, 3> kPoints = {0.112701665379258, 0.5, 0.887298334620742};
constexpr std::array<double, 3> kWeights = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
// This speed is added in the weights of the error, so that time counts a little even where the
// nozzle stands.
constexpr double kLeastSpeed_mm_s = 2.0;
// A line lays at least this share of what it shall lay.
constexpr double kLeastShare = 0.1;
// The unknowns are how far knots are from where they are wanted, in this unit.
constexpr double kUnit_mm = 1e-3;
// Where lines are shorter than the smoothing, the flow might swing from line to line unseen.
constexpr double kCalm = 3e-3;  // s² mm
// Exceeding a limit by 100 % costs this many units² mm.
constexpr double kPrice = 1e3;
constexpr double kGap = 1e-4;
// A motor follows in about this time, so the mean of p̈ over this time is limited. It is taken at
// moments that are kApart_s apart.
constexpr double kFollows_s = 4e-3;
constexpr double kApart_s = 1e-3;
// A limit enters the program only where the best E without limits comes nearer to it than this
// share of it.
constexpr double kNear = 0.6;
// A limit counts as broken if it is exceeded by more than this share of it.
constexpr double kBroken = -1e-3;

// Σ factor e over W neighbouring knots.
template <int W>
struct Functional {
  std::size_t first = 0;
  std::array<double, W> factors{};

  void add(std::size_t knot, double factor) { factors[knot - first] += factor; }
};

// Lower ≤ the functional ≤ upper.
template <int W>
struct Limit {
  Functional<W> value;
  double lower = 0.0;
  double upper = 0.0;
};

template <int W>
Limit<W> within(Functional<W> value, double most) {
  for (double& factor : value.factors) {
    factor /= most;
  }
  return {value, -1.0, 1.0};
}

// Quantities that are linear in the knots.
template <int W>
class Smoother {
 public:
  Smoother(const LinesInTime& lines, const SmoothingExtruder& extruder)
      : lines_(lines),
        times_s_(lines.times_s),
        advance_s_(extruder.advance_s),
        half_s_(0.5 * extruder.smooth_s) {}

  [[nodiscard]] double duration_s(std::size_t i) const { return times_s_[i + 1] - times_s_[i]; }

  // Whether a functional holds all that smoothing sees from any moment of line i.
  [[nodiscard]] bool sees(std::size_t i) const {
    const double reach_s = half_s_ + 0.5 * kFollows_s;
    return line_at(times_s_[i + 1] + reach_s) + 2 - line_at(times_s_[i] - reach_s) <= W;
  }

  // S E
  [[nodiscard]] Functional<W> smoothed(double at_s) const {
    Functional<W> result = begin(at_s);
    add_filament(at_s, 1.0, result);
    // The first and the last knot have no change of Ė, since E is not known beyond them.
    const std::size_t last = std::min(line_at(at_s + half_s_), times_s_.size() - 2);
    for (std::size_t k = std::max<std::size_t>(line_at(at_s - half_s_) + 1, 1); k <= last; ++k) {
      const double left_s = half_s_ - std::abs(at_s - times_s_[k]);
      if (left_s > 0.0) {
        const double g = left_s * left_s * left_s / (6.0 * half_s_ * half_s_);
        result.add(k - 1, g / duration_s(k - 1));
        result.add(k, -g / duration_s(k - 1) - g / duration_s(k));
        result.add(k + 1, g / duration_s(k));
      }
    }
    return result;
  }

  // The mean of p̈ around a moment. What E itself adds is so little that its middle will do.
  [[nodiscard]] Functional<W> acceleration(double at_s) const {
    Functional<W> result = begin(at_s - 0.5 * kFollows_s);
    add_difference(at_s, 1.0, result);
    add_difference(at_s + 0.5 * kFollows_s, advance_s_ / kFollows_s, result);
    add_difference(at_s - 0.5 * kFollows_s, -advance_s_ / kFollows_s, result);
    return result;
  }

  // f at knot k
  [[nodiscard]] Functional<W> step(std::size_t k) const {
    const double slower_mm_s =
        std::min(length_mm(k - 1) / duration_s(k - 1), length_mm(k) / duration_s(k));
    const double before = slower_mm_s / length_mm(k - 1);
    const double after = slower_mm_s / length_mm(k);
    return {k - 1, {before, -before - after, after}};
  }

 private:
  // The line at this moment; before all lines and behind them the first and the last.
  [[nodiscard]] std::size_t line_at(double at_s) const {
    const auto after = std::upper_bound(times_s_.begin() + 1, times_s_.end() - 1, at_s);
    return static_cast<std::size_t>(after - times_s_.begin()) - 1;
  }
  [[nodiscard]] Functional<W> begin(double at_s) const { return {line_at(at_s - half_s_), {}}; }

  void add_filament(double at_s, double factor, Functional<W>& out) const {
    const std::size_t i = line_at(at_s);
    const double share = std::clamp((at_s - times_s_[i]) / duration_s(i), 0.0, 1.0);
    out.add(i, factor * (1.0 - share));
    out.add(i + 1, factor * share);
  }
  // (E(τ + h) − 2 E(τ) + E(τ − h))/h²
  void add_difference(double at_s, double factor, Functional<W>& out) const {
    const double each = factor / (half_s_ * half_s_);
    add_filament(at_s - half_s_, each, out);
    add_filament(at_s, -2.0 * each, out);
    add_filament(at_s + half_s_, each, out);
  }
  [[nodiscard]] double length_mm(std::size_t line) const {
    constexpr double kLeast_mm = 1e-6;
    return std::max(lines_.lengths_mm[line], kLeast_mm);
  }

  const LinesInTime& lines_;
  const std::vector<double>& times_s_;
  double advance_s_;
  double half_s_;
};

// Lines that would lay too little, or draw filament back, get their ends as wanted.
void keep_laying(const std::vector<double>& wanted_mm, std::size_t first, std::size_t last,
                 std::vector<double>& knots_mm) {
  constexpr double kRounding = 0.9;
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = first; i < last; ++i) {
      const bool is_as_wanted = knots_mm[i] == wanted_mm[i] && knots_mm[i + 1] == wanted_mm[i + 1];
      if (!is_as_wanted && knots_mm[i + 1] - knots_mm[i] <
                               kRounding * kLeastShare * (wanted_mm[i + 1] - wanted_mm[i])) {
        knots_mm[i] = wanted_mm[i];
        knots_mm[i + 1] = wanted_mm[i + 1];
        changed = true;
      }
    }
  }
}

// The lines from `begin` to before `end`, which all lay. Knots from begin + 1 to end − 1 are free.
template <int W>
class Stretch {
 public:
  Stretch(const LinesInTime& lines, const SmoothingExtruder& extruder, std::size_t begin,
          std::size_t end, const std::vector<double>& wanted_at_knots_mm,
          const std::function<double(double)>& wanted_mm)
      : lines_(lines),
        extruder_(extruder),
        smoother_(lines, extruder),
        begin_(begin),
        end_(end),
        wanted_at_knots_mm_(wanted_at_knots_mm),
        wanted_mm_(wanted_mm) {}

  // false: smoothing reaches over more knots than this.
  [[nodiscard]] bool fit(std::vector<double>& knots_mm) {
    for (std::size_t i = begin_; i < end_; ++i) {
      if (!smoother_.sees(i)) {
        return false;
      }
    }
    add_squares();
    Steps best = solve();
    std::vector<Limit<W>> near = all_limits();
    const auto behind = std::stable_partition(near.begin(), near.end(), [&](const Limit<W>& limit) {
      return !best || is_near(limit, kNear, *best);
    });
    const std::vector<Limit<W>> far(behind, near.end());
    near.erase(behind, near.end());
    const auto is_broken = [&](const Limit<W>& limit) {
      return !best || is_near(limit, kBroken, *best);
    };
    if (std::ranges::any_of(near, is_broken)) {
      add_rows(near);
      best = solve();
      if (std::ranges::any_of(far, is_broken)) {
        add_rows(far);
        best = solve();
      }
    }
    if (best) {
      for (std::size_t k = begin_ + 1; k < end_; ++k) {
        knots_mm[k] = wanted_at_knots_mm_[k] + kUnit_mm * (*best)[k - begin_ - 1];
      }
      keep_laying(wanted_at_knots_mm_, begin_, end_, knots_mm);
    }
    return true;
  }

 private:
  using Program = quadratic::ElasticProgram<W>;
  using Steps = std::optional<std::span<const double>>;

  [[nodiscard]] std::size_t unknowns() const { return std::max<std::size_t>(end_ - begin_ - 1, W); }
  [[nodiscard]] bool is_free(std::size_t knot) const { return knot > begin_ && knot < end_; }

  // The functional's value if all knots are as wanted.
  [[nodiscard]] double value_as_wanted(const Functional<W>& of_knots) const {
    double sum = 0.0;
    for (std::size_t j = 0; j < W; ++j) {
      if (of_knots.factors[j] != 0.0) {
        sum += of_knots.factors[j] * wanted_at_knots_mm_[of_knots.first + j];
      }
    }
    return sum;
  }
  [[nodiscard]] double value_of(const Functional<W>& of_knots,
                                std::span<const double> steps) const {
    double sum = value_as_wanted(of_knots);
    for (std::size_t j = 0; j < W; ++j) {
      if (of_knots.factors[j] != 0.0 && is_free(of_knots.first + j)) {
        sum += of_knots.factors[j] * kUnit_mm * steps[of_knots.first + j - begin_ - 1];
      }
    }
    return sum;
  }

  // Whether the value comes nearer to an end of its limit than by `margin`, or is beyond.
  [[nodiscard]] bool is_near(const Limit<W>& limit, double margin,
                             std::span<const double> steps) const {
    const double value = value_of(limit.value, steps);
    return value < limit.lower + margin || value > limit.upper - margin;
  }

  struct Place {
    std::size_t first = 0;
    typename Program::Gradient gradient;
  };
  // The derivative by the unknowns, in this unit.
  [[nodiscard]] Place by_unknowns(const Functional<W>& of_knots, double unit) const {
    const std::size_t from = std::max(of_knots.first, begin_ + 1) - begin_ - 1;
    Place place{std::min(from, unknowns() - W), Program::Gradient::Zero()};
    for (std::size_t j = 0; j < W; ++j) {
      const std::size_t knot = of_knots.first + j;
      if (of_knots.factors[j] != 0.0 && is_free(knot)) {
        place.gradient[static_cast<Eigen::Index>(knot - begin_ - 1 - place.first)] =
            of_knots.factors[j] * kUnit_mm / unit;
      }
    }
    return place;
  }

  void add_square(const Functional<W>& of_knots, double less, double unit, double weight) {
    const Place place = by_unknowns(of_knots, unit);
    program_.add_square(place.first, place.gradient, (value_as_wanted(of_knots) - less) / unit,
                        weight);
  }

  [[nodiscard]] std::vector<Limit<W>> all_limits() const {
    std::vector<Limit<W>> result;
    if (std::isfinite(extruder_.most_step_mm_s)) {
      for (std::size_t k = begin_ + 1; k < end_; ++k) {
        result.push_back(within(smoother_.step(k), extruder_.most_step_mm_s));
      }
    }
    for (std::size_t i = begin_; i < end_; ++i) {
      const double all_mm = wanted_at_knots_mm_[i + 1] - wanted_at_knots_mm_[i];
      result.push_back({{i, {-1.0 / all_mm, 1.0 / all_mm}},
                        kLeastShare,
                        std::numeric_limits<double>::infinity()});
    }
    if (std::isfinite(extruder_.most_accel_mm_s2)) {
      const double from_s = lines_.times_s[begin_];
      const double length_s = lines_.times_s[end_] - from_s;
      for (std::size_t i = 0; static_cast<double>(i) * kApart_s <= length_s; ++i) {
        result.push_back(within(smoother_.acceleration(from_s + static_cast<double>(i) * kApart_s),
                                extruder_.most_accel_mm_s2));
      }
    }
    return result;
  }

  void add_squares() {
    program_.reset(unknowns());
    for (std::size_t i = end_ - begin_ - 1; i < unknowns(); ++i) {
      program_.fix(i);
    }
    for (std::size_t i = begin_; i < end_; ++i) {
      const double duration_s = smoother_.duration_s(i);
      const double way_mm = lines_.lengths_mm[i] + kLeastSpeed_mm_s * duration_s;
      for (std::size_t p = 0; p < kPoints.size(); ++p) {
        const double at_s = lines_.times_s[i] + kPoints[p] * duration_s;
        add_square(smoother_.smoothed(at_s), wanted_mm_(at_s), kUnit_mm, kWeights[p] * way_mm);
      }
    }
    for (std::size_t k = begin_ + 1; k < end_; ++k) {
      add_square(smoother_.step(k), 0.0, 1.0, kCalm);
    }
  }

  void add_rows(const std::vector<Limit<W>>& limits) {
    for (const Limit<W>& limit : limits) {
      const Place place = by_unknowns(limit.value, 1.0);
      program_.add_row(place.first, place.gradient, value_as_wanted(limit.value), limit.lower,
                       limit.upper, kPrice);
    }
  }

  // The best steps within the rows so far. They hold until the next call.
  [[nodiscard]] Steps solve() {
    int iterations = 0;
    return program_.solve(kGap, iterations);
  }

  const LinesInTime& lines_;
  const SmoothingExtruder& extruder_;
  Smoother<W> smoother_;
  std::size_t begin_;
  std::size_t end_;
  const std::vector<double>& wanted_at_knots_mm_;
  const std::function<double(double)>& wanted_mm_;
  Program program_;
};

}  // namespace

std::vector<double> filament_to_smooth(const LinesInTime& lines, const SmoothingExtruder& extruder,
                                       const std::function<double(double)>& wanted_mm) {
  std::vector<double> wanted;
  wanted.reserve(lines.times_s.size());
  for (const double t : lines.times_s) {
    wanted.push_back(wanted_mm(t));
  }
  std::vector<double> result = wanted;
  const std::size_t count = lines.lengths_mm.size();
  for (std::size_t begin = 0; begin < count;) {
    std::size_t end = begin;
    while (end < count && wanted[end + 1] > wanted[end]) {
      ++end;
    }
    if (end >= begin + 2) {
      static_cast<void>(
          Stretch<kMostly>(lines, extruder, begin, end, wanted, wanted_mm).fit(result) ||
          Stretch<kShortLines>(lines, extruder, begin, end, wanted, wanted_mm).fit(result));
    }
    begin = std::max(end, begin + 1);
  }
  return result;
}

}  // namespace unflex::emit
