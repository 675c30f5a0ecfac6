#include "smoothed_filament.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace unflex::emit {
namespace {

// Gauss–Legendre, on [0, 1].
constexpr std::array<double, 3> kPoints = {0.112701665379258, 0.5, 0.887298334620742};
constexpr std::array<double, 3> kWeights = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
// Where the nozzle stands, time still counts a little.
constexpr double kLeastSpeed_mm_s = 2.0;
// A line that would lay less than this share of what it shall lay is left as wanted.
constexpr double kLeastShare = 0.1;

double duration_s(const LinesInTime& lines, std::size_t i) {
  return lines.times_s[i + 1] - lines.times_s[i];
}

double speed_mm_s(const LinesInTime& lines, std::size_t i) {
  return lines.lengths_mm[i] / duration_s(lines, i);
}

// What S E at one moment depends on: knots from `first` on, each with its coefficient.
struct Sample {
  std::size_t first = 0;
  std::vector<double> of_knots;
};

class Smoother {
 public:
  Smoother(const LinesInTime& lines, double smooth_s)
      : lines_(lines), times_s_(lines.times_s), half_s_(0.5 * smooth_s) {}

  // At a moment within line i, the one between knots i and i + 1.
  void sample(std::size_t i, double at_s, Sample& out) const {
    // The first and the last knot have no change of Ė, since E is not known beyond them.
    std::size_t first = i + 1;
    while (first > 1 && at_s - times_s_[first - 1] < half_s_) {
      --first;
    }
    std::size_t last = i;
    while (last + 2 < times_s_.size() && times_s_[last + 1] - at_s < half_s_) {
      ++last;
    }
    out.first = std::min(first - 1, i);
    out.of_knots.assign(std::max(last + 1, i + 1) - out.first + 1, 0.0);
    const double share = (at_s - times_s_[i]) / duration_s(lines_, i);
    at(out, i) += 1.0 - share;
    at(out, i + 1) += share;
    for (std::size_t k = first; k <= last; ++k) {
      const double left_s = half_s_ - std::abs(at_s - times_s_[k]);
      if (left_s > 0.0) {
        const double g = left_s * left_s * left_s / (6.0 * half_s_ * half_s_);
        at(out, k - 1) += g / duration_s(lines_, k - 1);
        at(out, k) -= g / duration_s(lines_, k - 1) + g / duration_s(lines_, k);
        at(out, k + 1) += g / duration_s(lines_, k);
      }
    }
  }

 private:
  static double& at(Sample& out, std::size_t knot) { return out.of_knots[knot - out.first]; }

  const LinesInTime& lines_;
  const std::vector<double>& times_s_;
  double half_s_;
};

// The normal equations of a stretch of free knots.
class Fit {
 public:
  explicit Fit(std::size_t first, std::size_t count) : first_(first), rows_(count), right_(count) {}

  // Sample · e shall be `wanted_mm`. Knots that are not free are as given.
  void add(const Sample& sample, double weight, double wanted_mm,
           const std::vector<double>& given) {
    double left_mm = wanted_mm;
    for (std::size_t j = 0; j < sample.of_knots.size(); ++j) {
      if (!is_free(sample.first + j)) {
        left_mm -= sample.of_knots[j] * given[sample.first + j];
      }
    }
    for (std::size_t j = 0; j < sample.of_knots.size(); ++j) {
      if (!is_free(sample.first + j)) {
        continue;
      }
      const std::size_t row = sample.first + j - first_;
      right_[row] += weight * sample.of_knots[j] * left_mm;
      std::vector<double>& entries = rows_[row];
      entries.resize(std::max(entries.size(), sample.of_knots.size() - j), 0.0);
      for (std::size_t l = j; l < sample.of_knots.size() && is_free(sample.first + l); ++l) {
        entries[l - j] += weight * sample.of_knots[j] * sample.of_knots[l];
      }
    }
  }

  // Puts the knots where they fit best. They stay as they are if that is not decided.
  void solve(std::vector<double>& knots_mm) const {
    const auto count = static_cast<Eigen::Index>(rows_.size());
    std::size_t entries = 0;
    for (const std::vector<double>& row : rows_) {
      entries += row.size();
    }
    using Matrix = Eigen::SparseMatrix<double>;
    Matrix matrix(count, count);
    matrix.reserve(static_cast<Eigen::Index>(entries));
    Eigen::VectorXd right(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      // The upper half by rows is the lower half by columns.
      const std::vector<double>& row = rows_[static_cast<std::size_t>(k)];
      matrix.startVec(k);
      for (Eigen::Index j = 0; j < static_cast<Eigen::Index>(row.size()) && k + j < count; ++j) {
        matrix.insertBack(k + j, k) = row[static_cast<std::size_t>(j)];
      }
      right[k] = right_[static_cast<std::size_t>(k)];
    }
    matrix.finalize();
    const Eigen::SimplicialLDLT<Matrix, Eigen::Lower, Eigen::NaturalOrdering<int>> factors(matrix);
    if (factors.info() != Eigen::Success || !(factors.vectorD().minCoeff() > 0.0)) {
      return;
    }
    const Eigen::VectorXd solution = factors.solve(right);
    std::copy(solution.begin(), solution.end(),
              knots_mm.begin() + static_cast<std::ptrdiff_t>(first_));
  }

 private:
  [[nodiscard]] bool is_free(std::size_t knot) const {
    return knot >= first_ && knot < first_ + rows_.size();
  }

  std::size_t first_;
  std::vector<std::vector<double>> rows_;  // each from its diagonal to the right
  std::vector<double> right_;
};

// Joins between lines, and which of them are drawn to the most that the flow may change there.
class Joins {
 public:
  Joins(const LinesInTime& lines, std::size_t first, std::size_t last, double most_mm_s)
      : lines_(lines), most_mm_s_(most_mm_s), first_(first), drawn_(last - first, 0.0) {}

  // Draws those that exceed it, and lets go of those that would be below by themselves. Whether
  // that has changed any.
  bool find(const std::vector<double>& knots_mm) {
    bool changed = false;
    for (std::size_t i = 0; i < drawn_.size(); ++i) {
      const double step_mm_s = step(first_ + i, knots_mm);
      const bool exceeds = std::abs(step_mm_s) > most_mm_s_;
      const double drawn_mm_s = exceeds ? std::copysign(most_mm_s_, step_mm_s) : 0.0;
      changed = changed || drawn_mm_s != drawn_[i];
      drawn_[i] = drawn_mm_s;
    }
    return changed;
  }

  void draw(Fit& fit, const std::vector<double>& given) const {
    constexpr double kWeight = 0.01;  // mm s²
    for (std::size_t i = 0; i < drawn_.size(); ++i) {
      if (drawn_[i] != 0.0) {
        fit.add(step_at(first_ + i), kWeight, drawn_[i], given);
      }
    }
  }

  // Where lines are shorter than the smoothing, the flow might swing from line to line unseen.
  void calm(Fit& fit, const std::vector<double>& given) const {
    constexpr double kWeight = 3e-9;  // mm s²: it decides only what S does not feel
    for (std::size_t i = 0; i < drawn_.size(); ++i) {
      fit.add(step_at(first_ + i), kWeight, 0.0, given);
    }
  }

 private:
  // min(v, v')/d of the lines before and behind knot k.
  [[nodiscard]] std::pair<double, double> per_mm(std::size_t k) const {
    const double slower_mm_s = std::min(speed_mm_s(lines_, k - 1), speed_mm_s(lines_, k));
    return {slower_mm_s / length_mm(k - 1), slower_mm_s / length_mm(k)};
  }
  // The change of the flow at knot k.
  [[nodiscard]] Sample step_at(std::size_t k) const {
    const auto [before, after] = per_mm(k);
    return {k - 1, {before, -before - after, after}};
  }
  [[nodiscard]] double step(std::size_t k, const std::vector<double>& knots_mm) const {
    const auto [before, after] = per_mm(k);
    return after * (knots_mm[k + 1] - knots_mm[k]) - before * (knots_mm[k] - knots_mm[k - 1]);
  }
  [[nodiscard]] double length_mm(std::size_t line) const {
    constexpr double kLeast_mm = 1e-6;
    return std::max(lines_.lengths_mm[line], kLeast_mm);
  }

  const LinesInTime& lines_;
  double most_mm_s_;
  std::size_t first_;          // knot
  std::vector<double> drawn_;  // to which change of the flow; 0: not drawn
};

// Lines that would lay too little, or draw filament back, get their ends as wanted.
void keep_laying(const std::vector<double>& wanted_mm, std::size_t first, std::size_t last,
                 std::vector<double>& knots_mm) {
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = first; i < last; ++i) {
      const bool is_as_wanted = knots_mm[i] == wanted_mm[i] && knots_mm[i + 1] == wanted_mm[i + 1];
      if (!is_as_wanted &&
          knots_mm[i + 1] - knots_mm[i] < kLeastShare * (wanted_mm[i + 1] - wanted_mm[i])) {
        knots_mm[i] = wanted_mm[i];
        knots_mm[i + 1] = wanted_mm[i + 1];
        changed = true;
      }
    }
  }
}

struct Problem {
  const LinesInTime& lines;
  double smooth_s;
  double most_step_mm_s;
  const std::vector<double>& wanted_at_knots_mm;
  const std::function<double(double)>& wanted_mm;
};

// The lines from `begin` to before `end`, which all lay.
void fit_stretch(const Problem& problem, std::size_t begin, std::size_t end,
                 std::vector<double>& knots_mm) {
  const LinesInTime& lines = problem.lines;
  const std::vector<double>& wanted = problem.wanted_at_knots_mm;
  const Smoother smoother(lines, problem.smooth_s);
  Fit fit(begin + 1, end - begin - 1);
  Sample sample;
  for (std::size_t i = begin; i < end; ++i) {
    const double way_mm = lines.lengths_mm[i] + kLeastSpeed_mm_s * duration_s(lines, i);
    for (std::size_t p = 0; p < kPoints.size(); ++p) {
      const double at_s = lines.times_s[i] + kPoints[p] * duration_s(lines, i);
      smoother.sample(i, at_s, sample);
      fit.add(sample, kWeights[p] * way_mm, problem.wanted_mm(at_s), wanted);
    }
  }
  Joins joins(lines, begin + 1, end, problem.most_step_mm_s);
  joins.calm(fit, wanted);
  fit.solve(knots_mm);
  constexpr int kMostRounds = 12;
  for (int round = 0; round < kMostRounds && joins.find(knots_mm); ++round) {
    Fit bounded = fit;
    joins.draw(bounded, wanted);
    bounded.solve(knots_mm);
  }
  keep_laying(wanted, begin, end, knots_mm);
}

}  // namespace

std::vector<double> filament_to_smooth(const LinesInTime& lines, double smooth_s,
                                       double most_step_mm_s,
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
      fit_stretch({lines, smooth_s, most_step_mm_s, wanted, wanted_mm}, begin, end, result);
    }
    begin = std::max(end, begin + 1);
  }
  return result;
}

}  // namespace unflex::emit
