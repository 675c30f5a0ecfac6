#include "pressure_program.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numeric>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "unflex/nlp/ipopt_solver.hpp"

namespace unflex::emit {
namespace {

constexpr double kNoMost = std::numeric_limits<double>::infinity();
constexpr double kNoLeast = -kNoMost;

// Lines of a wall whose speed changes: the nozzle accelerates, goes evenly, and comes to rest.
std::vector<PressureLine> wall(std::size_t count, unsigned seed, double advance_s) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> of(0.5, 1.5);
  std::vector<PressureLine> lines(count);
  for (std::size_t i = 0; i < count; ++i) {
    PressureLine& line = lines[i];
    line.duration_s = 2e-3 * of(random);
    const double share =
        static_cast<double>(std::min(i, count - 1 - i)) / static_cast<double>(count);
    const double v_mm_s = 5.0 + 300.0 * std::min(share, 0.25);
    line.length_mm = v_mm_s * line.duration_s;
    line.wanted_mm = 0.04 * line.length_mm * (1.0 + 0.05 * (of(random) - 1.0));
    line.slope_s = advance_s;
    line.weight = 1.0 / (0.04 * 0.04 * std::max(line.length_mm, 0.03));
    line.most_step_mm_s = 1e3;
    line.least_mm = kNoLeast;
    line.most_mm = kNoMost;
  }
  return lines;
}

double total_wanted(const std::vector<PressureLine>& lines) {
  return std::accumulate(lines.begin(), lines.end(), 0.0,
                         [](double sum, const PressureLine& line) { return sum + line.wanted_mm; });
}

// The plant line by line, written down another way: the flow q goes to x/T.
struct Response {
  std::vector<double> error_mm;
  std::vector<double> end_error_mm;
  std::vector<double> step_mm_s;
  double pressed_mm = 0.0;  // at the end
};

Response response(const std::vector<PressureLine>& lines, std::span<const double> pushed,
                  double begin_mm = 0.0) {
  Response result;
  double flow = begin_mm / lines.front().slope_s;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const PressureLine& line = lines[k];
    const double rate = pushed[k] / line.duration_s;
    const double left = std::exp(-line.duration_s / line.slope_s);
    const double after = rate + (flow - rate) * left;
    result.error_mm.push_back(pushed[k] - line.slope_s * (after - flow) - line.wanted_mm);
    flow = after;
    if (k + 1 < lines.size()) {
      const PressureLine& next = lines[k + 1];
      const double wanted = (line.wanted_mm / line.duration_s * next.duration_s +
                             next.wanted_mm / next.duration_s * line.duration_s) /
                            (line.duration_s + next.duration_s);
      result.end_error_mm.push_back(std::min(line.duration_s, next.duration_s) * (flow - wanted));
      const double v = std::min(line.length_mm / line.duration_s, next.length_mm / next.duration_s);
      result.step_mm_s.push_back(v * (pushed[k + 1] / next.length_mm - pushed[k] / line.length_mm));
    }
  }
  result.pressed_mm = lines.back().slope_s * flow;
  return result;
}

double cost(const std::vector<PressureLine>& lines, const Response& response) {
  double sum = 0.0;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    sum += 0.5 * lines[k].weight * response.error_mm[k] * response.error_mm[k];
  }
  for (std::size_t k = 0; k + 1 < lines.size(); ++k) {
    sum += 0.5 * kAtEnds * lines[k].weight * response.end_error_mm[k] * response.end_error_mm[k] +
           0.5 * kSmoothness * response.step_mm_s[k] * response.step_mm_s[k];
  }
  return sum + 0.5 * lines.back().weight * response.pressed_mm * response.pressed_mm;
}

// That problem in the filament pushed, dense, for Ipopt. All of it is linear or quadratic, so
// that its derivatives follow from values at unit vectors.
class Dense : public nlp::Problem {
 public:
  explicit Dense(const std::vector<PressureLine>& lines) : lines_(lines) {
    const std::size_t n = lines.size();
    for (const PressureLine& line : lines) {
      variables_.lower.push_back(std::max(line.least_mm, -nlp::kNoBound));
      variables_.upper.push_back(std::min(line.most_mm, nlp::kNoBound));
      start_.push_back(line.wanted_mm);
    }
    for (std::size_t k = 0; k + 1 < n; ++k) {
      constraints_.lower.push_back(-lines[k].most_step_mm_s);
      constraints_.upper.push_back(lines[k].most_step_mm_s);
    }
    constraints_.lower.push_back(total_wanted(lines));
    constraints_.upper.push_back(total_wanted(lines));
    const std::vector<double> zero(n, 0.0);
    const std::vector<double> g0 = rows(zero);
    const std::vector<double> r0 = residuals(zero);
    for (std::size_t j = 0; j < n; ++j) {
      std::vector<double> unit(n, 0.0);
      unit[j] = 1.0;
      const std::vector<double> g = rows(unit);
      const std::vector<double> r = residuals(unit);
      jacobian_of_g_.emplace_back();
      jacobian_of_r_.emplace_back();
      for (std::size_t i = 0; i < g.size(); ++i) {
        jacobian_of_g_[j].push_back(g[i] - g0[i]);
      }
      for (std::size_t i = 0; i < r.size(); ++i) {
        jacobian_of_r_[j].push_back(r[i] - r0[i]);
      }
    }
    for (std::size_t i = 0; i < g0.size(); ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        jacobian_.row.push_back(static_cast<int>(i));
        jacobian_.column.push_back(static_cast<int>(j));
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        hessian_.row.push_back(static_cast<int>(i));
        hessian_.column.push_back(static_cast<int>(j));
      }
    }
  }

  const nlp::Bounds& variable_bounds() const override { return variables_; }
  const nlp::Bounds& constraint_bounds() const override { return constraints_; }
  const std::vector<double>& start() const override { return start_; }
  bool linear_constraints() const override { return true; }
  bool quadratic_objective() const override { return true; }
  double objective(std::span<const double> x) const override {
    const std::vector<double> r = residuals(x);
    return 0.5 * std::inner_product(r.begin(), r.end(), r.begin(), 0.0);
  }
  void gradient(std::span<const double> x, std::span<double> gradient) const override {
    const std::vector<double> r = residuals(x);
    for (std::size_t j = 0; j < x.size(); ++j) {
      gradient[j] = std::inner_product(r.begin(), r.end(), jacobian_of_r_[j].begin(), 0.0);
    }
  }
  void constraints(std::span<const double> x, std::span<double> g) const override {
    const std::vector<double> values = rows(x);
    std::copy(values.begin(), values.end(), g.begin());
  }
  const nlp::Sparsity& jacobian_sparsity() const override { return jacobian_; }
  void jacobian(std::span<const double>, std::span<double> values) const override {
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = jacobian_of_g_[static_cast<std::size_t>(jacobian_.column[i])]
                                [static_cast<std::size_t>(jacobian_.row[i])];
    }
  }
  const nlp::Sparsity& hessian_sparsity() const override { return hessian_; }
  void hessian(std::span<const double>, double sigma, std::span<const double>,
               std::span<double> values) const override {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto& a = jacobian_of_r_[static_cast<std::size_t>(hessian_.row[i])];
      const auto& b = jacobian_of_r_[static_cast<std::size_t>(hessian_.column[i])];
      values[i] = sigma * std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
    }
  }
  std::string variable_name(int) const override { return "filament"; }
  std::string constraint_name(int) const override { return "step"; }

 private:
  std::vector<double> rows(std::span<const double> x) const {
    const Response at = response(lines_, x);
    std::vector<double> g = at.step_mm_s;
    g.push_back(std::accumulate(x.begin(), x.end(), 0.0));
    return g;
  }
  std::vector<double> residuals(std::span<const double> x) const {
    const Response at = response(lines_, x);
    std::vector<double> r;
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      r.push_back(std::sqrt(lines_[k].weight) * at.error_mm[k]);
    }
    for (std::size_t k = 0; k + 1 < lines_.size(); ++k) {
      r.push_back(std::sqrt(kAtEnds * lines_[k].weight) * at.end_error_mm[k]);
      r.push_back(std::sqrt(kSmoothness) * at.step_mm_s[k]);
    }
    r.push_back(std::sqrt(lines_.back().weight) * at.pressed_mm);
    return r;
  }

  std::vector<PressureLine> lines_;
  nlp::Bounds variables_;
  nlp::Bounds constraints_;
  std::vector<double> start_;
  nlp::Sparsity jacobian_;
  nlp::Sparsity hessian_;
  std::vector<std::vector<double>> jacobian_of_g_;  // by unknown
  std::vector<std::vector<double>> jacobian_of_r_;
};

struct Limits {
  double most_step_mm_s;
  double least_mm;
  double most_mm = kNoMost;
};

class AgainstIpopt : public ::testing::TestWithParam<Limits> {};

TEST_P(AgainstIpopt, FindsTheSameOptimum) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    std::vector<PressureLine> lines = wall(40, seed, 0.04);
    for (PressureLine& line : lines) {
      line.most_step_mm_s = GetParam().most_step_mm_s;
      line.least_mm = GetParam().least_mm;
      line.most_mm = GetParam().most_mm;
    }
    const std::vector<double> pushed = pushed_filament(lines, {});
    const Dense problem(lines);
    const auto judge = nlp::solve(problem, {.tolerance = 1e-10});
    ASSERT_TRUE(judge);
    ASSERT_EQ(judge->outcome, nlp::Outcome::solved) << judge->message;
    const double found = cost(lines, response(lines, pushed));
    EXPECT_NEAR(found, judge->objective, 1e-5 * judge->objective + 1e-10);
    for (std::size_t k = 0; k < lines.size(); ++k) {
      EXPECT_NEAR(pushed[k], judge->x[k], 2e-5);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Limits, AgainstIpopt,
                         ::testing::Values(Limits{1e3, kNoLeast}, Limits{1.0, kNoLeast},
                                           Limits{1e3, -0.002}, Limits{0.5, -0.001},
                                           Limits{0.2, 0.0}, Limits{1.0, -0.003, 0.012}));

TEST(PressureProgram, KeepsItsLimitsAndAllFilament) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::vector<PressureLine> lines = wall(100 + 20 * seed, seed, 0.01 * seed);
    for (PressureLine& line : lines) {
      line.most_step_mm_s = 0.9;
      line.least_mm = -0.003;
    }
    const std::vector<double> pushed = pushed_filament(lines, {});
    const Response at = response(lines, pushed);
    EXPECT_NEAR(std::accumulate(pushed.begin(), pushed.end(), 0.0), total_wanted(lines), 1e-8);
    for (const double step_mm_s : at.step_mm_s) {
      EXPECT_LE(std::abs(step_mm_s), 0.9 + 1e-5);
    }
    for (const double mm : pushed) {
      EXPECT_GE(mm, -0.003 - 1e-7);
    }
  }
}

// Without limits what comes out is what is wanted.
TEST(PressureProgram, InvertsTheHotend) {
  const std::vector<PressureLine> lines = wall(200, 7, 0.04);
  const Response at = response(lines, pushed_filament(lines, {}));
  for (std::size_t k = 2; k + 2 < lines.size(); ++k) {
    EXPECT_NEAR(at.error_mm[k], 0.0, 0.04 * lines[k].wanted_mm);
  }
}

TEST(PressureProgram, GoesOnWithThePressureOfTheNeighbours) {
  std::vector<PressureLine> lines = wall(60, 3, 0.04);
  for (PressureLine& line : lines) {
    line.length_mm = 100.0 * line.duration_s;
    line.wanted_mm = 4.0 * line.duration_s;
  }
  const std::vector<double> pushed = pushed_filament(lines, {0.16, 0.16});
  for (std::size_t k = 0; k < lines.size(); ++k) {
    EXPECT_NEAR(pushed[k], lines[k].wanted_mm, 1e-9);
  }
}

TEST(PressureProgram, LeavesASingleLineAsItIs) {
  EXPECT_EQ(pushed_filament(wall(1, 1, 0.04), {}).size(), 1U);
}

}  // namespace
}  // namespace unflex::emit
