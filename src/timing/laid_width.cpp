#include "laid_width.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "unflex/quadratic/elastic_program.hpp"

namespace unflex::timing {
namespace {

constexpr int kWidth = 5;
using Program = quadratic::ElasticProgram<kWidth>;

constexpr double kKnot_s = 2e-3;
// This speed is added in the weights, so that time counts a little even where the nozzle stands.
constexpr double kLeastSpeed_mm_s = 2.0;
// The unknowns are in this unit.
constexpr double kUnit_mm = 1e-3;
// Exceeding a limit by 100 % costs this many units² mm.
constexpr double kPrice = 1e3;
constexpr double kGap = 1e-4;
// The width is taken over kBin_mm of way, but not within kEnds_mm of where laying begins or ends.
constexpr double kBin_mm = 0.4;
constexpr double kEnds_mm = 1.0;

// Interpolates values at moments that are period_s apart to the knots.
std::vector<double> at_knots(std::span<const double> values, double period_s) {
  const double last = static_cast<double>(values.size() - 1);
  const auto count = static_cast<std::size_t>(std::ceil(last * period_s / kKnot_s)) + 1;
  std::vector<double> result;
  result.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double at = std::min(static_cast<double>(k) * kKnot_s / period_s, last);
    const auto i = std::min(static_cast<std::size_t>(at), values.size() - 2);
    const double share = at - static_cast<double>(i);
    result.push_back((1.0 - share) * values[i] + share * values[i + 1]);
  }
  return result;
}

// The mean of p̈ over four knot periods as a function of five neighbouring y, 1/s²: the change of
// ṗ, by central differences.
Program::Gradient mean_accel(double slope_before_s, double slope_behind_s) {
  constexpr double kTwo = 2.0 * kKnot_s;
  const auto speed_at = [](Eigen::Index middle, double slope_s) {
    Program::Gradient result = Program::Gradient::Zero();
    const double bend = slope_s / (kKnot_s * kKnot_s);
    result[middle - 1] = bend - 1.0 / kTwo;
    result[middle] = -2.0 * bend;
    result[middle + 1] = bend + 1.0 / kTwo;
    return result;
  };
  return (speed_at(3, slope_behind_s) - speed_at(1, slope_before_s)) / kTwo;
}

// x at the knots. moves: where it may differ from 0.
std::optional<std::vector<double>> laid_too_much(const std::vector<double>& asked_mm,
                                                 const std::vector<double>& way_mm,
                                                 const std::vector<bool>& moves,
                                                 const std::vector<double>& slope_s,
                                                 double most_mm_s2) {
  const std::size_t count = asked_mm.size();
  Program program;
  program.reset(count);
  for (std::size_t k = 0; k < count; ++k) {
    if (!moves[k]) {
      program.fix(k);
    }
    const std::size_t first = std::min(k, count - kWidth);
    Program::Gradient own = Program::Gradient::Zero();
    own[static_cast<Eigen::Index>(k - first)] = 1.0;
    const double step_mm = k > 0 ? way_mm[k] - way_mm[k - 1] : 0.0;
    program.add_square(first, own, 0.0, step_mm + kLeastSpeed_mm_s * kKnot_s);
  }
  bool is_limited = false;
  for (std::size_t k = 0; k + kWidth <= count; ++k) {
    const Program::Gradient row = mean_accel(slope_s[k + 1], slope_s[k + 3]) / most_mm_s2;
    double value = 0.0;
    for (std::size_t j = 0; j < kWidth; ++j) {
      value += row[static_cast<Eigen::Index>(j)] * (asked_mm[k + j] - asked_mm[k]);
    }
    program.add_row(k, row * kUnit_mm, value, -1.0, 1.0, kPrice);
    is_limited = is_limited || std::abs(value) > 1.0;
  }
  std::vector<double> result(count, 0.0);
  if (is_limited) {
    int iterations = 0;
    const auto best = program.solve(kGap, iterations);
    if (!best) {
      return std::nullopt;
    }
    std::ranges::transform(*best, result.begin(), [](double x) { return kUnit_mm * x; });
  }
  return result;
}

// Notes the errors at the knots from `begin` to before `end`, between which filament is laid
// without a stop.
void note_errors(const std::vector<double>& laid_mm, const std::vector<double>& way_mm,
                 const std::vector<double>& x_mm, std::size_t begin, std::size_t end,
                 std::vector<double>& errors) {
  std::size_t from = begin;
  std::size_t to = begin;
  for (std::size_t k = begin; k < end; ++k) {
    const double before_mm = way_mm[k] - 0.5 * kBin_mm;
    const double behind_mm = way_mm[k] + 0.5 * kBin_mm;
    while (from + 1 < k && way_mm[from + 1] <= before_mm) {
      ++from;
    }
    while (to + 1 < end && way_mm[to] < behind_mm) {
      ++to;
    }
    if (way_mm[k] - way_mm[begin] > kEnds_mm && way_mm[end - 1] - way_mm[k] > kEnds_mm) {
      errors[k] = std::abs(x_mm[to] - x_mm[from]) / (laid_mm[to] - laid_mm[from]);
    }
  }
}

}  // namespace

std::vector<double> width_errors(std::span<const double> laid_mm, std::span<const double> way_mm,
                                 double period_s, const Extruder& extruder) {
  std::vector<double> result(laid_mm.size(), 0.0);
  if (laid_mm.size() < 2) {
    return result;
  }
  const std::vector<double> laid = at_knots(laid_mm, period_s);
  const std::vector<double> way = at_knots(way_mm, period_s);
  const std::size_t count = laid.size();
  if (count < kWidth) {
    return result;
  }
  std::vector<double> slope_s(count, extruder.hotend.slope_s(0.0));
  std::vector<bool> moves(count, false);
  for (std::size_t k = 1; k + 1 < count; ++k) {
    const double flow_mm_s = (laid[k + 1] - laid[k - 1]) / (2.0 * kKnot_s);
    moves[k] = flow_mm_s > 0.0;
    slope_s[k] = extruder.hotend.slope_s(flow_mm_s);
  }
  const std::optional<std::vector<double>> x_mm =
      laid_too_much(laid, way, moves, slope_s, extruder.max_accel_mm_s2);
  if (!x_mm) {
    return result;
  }
  std::vector<double> errors(count, 0.0);
  for (std::size_t begin = 0; begin < count;) {
    std::size_t end = begin;
    while (end < count && moves[end]) {
      ++end;
    }
    note_errors(laid, way, *x_mm, begin, end, errors);
    begin = end + 1;
  }
  for (std::size_t i = 0; i < result.size(); ++i) {
    const auto k =
        std::min(static_cast<std::size_t>(static_cast<double>(i) * period_s / kKnot_s), count - 2);
    result[i] = std::max(errors[k], errors[k + 1]);
  }
  return result;
}

}  // namespace unflex::timing
