#include "unflex/quadratic/elastic_program.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace unflex::quadratic {
namespace {

constexpr int kWidth = 18;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
using Program = ElasticProgram<kWidth>;
using Gradient = Program::Gradient;

// A program beside a dense copy of it.
class Dense {
 public:
  explicit Dense(std::size_t unknowns)
      : hessian(Eigen::MatrixXd::Zero(static_cast<long>(unknowns), static_cast<long>(unknowns))),
        linear(Eigen::VectorXd::Zero(static_cast<long>(unknowns))) {
    program.reset(unknowns);
  }

  void add_square(std::size_t first, const Gradient& g, double v, double weight) {
    program.add_square(first, g, v, weight);
    const Eigen::VectorXd wide = widened(first, g);
    hessian += weight * wide * wide.transpose();
    linear += weight * v * wide;
  }
  void add_damping(double weight) {
    program.add_damping(weight);
    hessian.diagonal().array() += weight;
  }
  void add_linear(std::size_t unknown, double slope) {
    program.add_linear(unknown, slope);
    linear[static_cast<long>(unknown)] += slope;
  }
  void add_row(std::size_t first, const Gradient& g, double v, double lower, double upper,
               double price) {
    program.add_row(first, g, v, lower, upper, price);
    rows.push_back({widened(first, g), v, lower, upper, price});
  }

  [[nodiscard]] double cost(const Eigen::VectorXd& delta) const {
    double sum = 0.5 * delta.dot(hessian * delta) + linear.dot(delta);
    for (const Row& row : rows) {
      const double value = row.g.dot(delta) + row.v;
      sum += row.price * std::max({0.0, value - row.upper, row.lower - value});
    }
    return sum;
  }

  // What no δ costs less than: the dual, climbed one multiplier y after the other.
  //   max −½ (q + Gᵀy)ᵀ H⁻¹ (q + Gᵀy) + Σ y v − u max(y, 0) + l max(−y, 0),   |y| ≤ ρ
  [[nodiscard]] double bound_of_cost() const {
    constexpr int kSweeps = 3000;
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(hessian);
    Eigen::VectorXd delta = -ldlt.solve(linear);
    std::vector<double> y(rows.size(), 0.0);
    std::vector<Eigen::VectorXd> answers;
    for (const Row& row : rows) {
      answers.emplace_back(ldlt.solve(row.g));
    }
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const double softness = rows[i].g.dot(answers[i]);
        const double value = rows[i].g.dot(delta) + rows[i].v;
        const double at_upper = y[i] + (value - rows[i].upper) / softness;
        const double at_lower = y[i] + (value - rows[i].lower) / softness;
        const double best = std::clamp(std::max(at_upper, 0.0) + std::min(at_lower, 0.0),
                                       -rows[i].price, rows[i].price);
        delta -= (best - y[i]) * answers[i];
        y[i] = best;
      }
    }
    double sum = -0.5 * delta.dot(hessian * delta);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      sum += y[i] * rows[i].v;
      sum -= y[i] > 0.0 ? y[i] * rows[i].upper : y[i] < 0.0 ? y[i] * rows[i].lower : 0.0;
    }
    return sum;
  }

  struct Row {
    Eigen::VectorXd g;
    double v = 0.0;
    double lower = 0.0;
    double upper = 0.0;
    double price = 0.0;
  };
  Program program;
  Eigen::MatrixXd hessian;
  Eigen::VectorXd linear;
  std::vector<Row> rows;

 private:
  [[nodiscard]] Eigen::VectorXd widened(std::size_t first, const Gradient& g) const {
    Eigen::VectorXd wide = Eigen::VectorXd::Zero(linear.size());
    wide.segment(static_cast<long>(first), kWidth) = g;
    return wide;
  }
};

class RandomGradients {
 public:
  explicit RandomGradients(unsigned seed) : generator_(seed) {}

  double uniform(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(generator_);
  }
  Gradient gradient() {
    Gradient g;
    for (double& value : g) {
      value = uniform(-1.0, 1.0);
    }
    return g;
  }
  Eigen::VectorXd direction(long size) {
    Eigen::VectorXd d(size);
    for (double& value : d) {
      value = uniform(-1.0, 1.0);
    }
    return d;
  }

 private:
  std::mt19937_64 generator_;
};

void add_squares(Dense& dense, std::size_t unknowns, RandomGradients& random) {
  dense.add_damping(0.1);
  for (std::size_t first = 0; first + kWidth <= unknowns; first += 3) {
    for (int i = 0; i < 4; ++i) {
      dense.add_square(first, random.gradient(), random.uniform(-1.0, 1.0),
                       random.uniform(0.0, 2.0));
    }
  }
  for (std::size_t i = 0; i < unknowns; ++i) {
    dense.add_linear(i, random.uniform(-1.0, 1.0));
  }
}

// Some rows hold easily, some are broken, some have one bound alone.
void add_rows(Dense& dense, std::size_t unknowns, RandomGradients& random) {
  for (std::size_t first = 0; first + kWidth <= unknowns; first += 3) {
    for (int i = 0; i < 5; ++i) {
      const double lower = random.uniform(-1.5, 0.5);
      const double upper = lower + random.uniform(0.0, 1.5);
      dense.add_row(first, random.gradient(), random.uniform(-1.0, 1.0),
                    i == 1 ? -kInfinity : lower, i == 2 ? kInfinity : upper,
                    random.uniform(0.01, 3.0));
    }
  }
}

Eigen::VectorXd solved(Program& program, double gap) {
  int iterations = 0;
  const auto solution = program.solve(gap, iterations);
  EXPECT_TRUE(solution.has_value());
  EXPECT_GT(iterations, 0);
  if (!solution) {
    return {};
  }
  return Eigen::Map<const Eigen::VectorXd>(solution->data(), static_cast<long>(solution->size()));
}

// The unknown of number 0 alone, at weight 1 towards 3, in a program as small as can be.
void begin_with_three(Program& program) {
  program.reset(kWidth);
  program.add_damping(1.0);
  program.add_linear(0, -3.0);
}

Gradient first_unknown() { return Gradient::Unit(0); }

TEST(ElasticProgram, WithoutRowsIsALinearSystem) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    RandomGradients random(seed);
    constexpr std::size_t kUnknowns = 60;
    Dense dense(kUnknowns);
    add_squares(dense, kUnknowns, random);
    const Eigen::VectorXd expected = dense.hessian.ldlt().solve(-dense.linear);
    const Eigen::VectorXd got = solved(dense.program, 1e-9);
    ASSERT_EQ(got.size(), expected.size());
    EXPECT_LT((got - expected).lpNorm<Eigen::Infinity>(), 1e-9) << seed;
  }
}

TEST(ElasticProgram, KeepsABoundWhoseMultiplierIsBelowItsPrice) {
  Program program;
  begin_with_three(program);
  // To stay at 1 costs 2 a step.
  program.add_row(0, first_unknown(), 0.0, -kInfinity, 1.0, 2.5);
  EXPECT_NEAR(solved(program, 1e-9)[0], 1.0, 1e-6);
}

TEST(ElasticProgram, BreaksABoundWhoseMultiplierIsAboveItsPrice) {
  Program program;
  begin_with_three(program);
  program.add_row(0, first_unknown(), 0.0, -kInfinity, 1.0, 0.5);
  EXPECT_NEAR(solved(program, 1e-9)[0], 2.5, 1e-6);
}

TEST(ElasticProgram, TakesNoNoticeOfABoundFarAway) {
  Program program;
  begin_with_three(program);
  program.add_row(0, first_unknown(), 0.0, -100.0, 100.0, 0.5);
  EXPECT_NEAR(solved(program, 1e-9)[0], 3.0, 1e-4);
}

TEST(ElasticProgram, CountsALowerBoundFromTheValueOfItsRow) {
  Program program;
  begin_with_three(program);
  // 2 δ − 5 ≥ 4
  program.add_row(0, 2.0 * first_unknown(), -5.0, 4.0, kInfinity, 10.0);
  EXPECT_NEAR(solved(program, 1e-9)[0], 4.5, 1e-6);
}

TEST(ElasticProgram, LeavesFixedUnknownsAtNothing) {
  RandomGradients random(7);
  constexpr std::size_t kUnknowns = 60;
  Dense dense(kUnknowns);
  add_squares(dense, kUnknowns, random);
  add_rows(dense, kUnknowns, random);
  const Eigen::VectorXd free = solved(dense.program, 1e-8);
  for (const long i : {0L, 17L, 18L, 59L}) {
    EXPECT_GT(std::abs(free[i]), 1e-3) << i;
    dense.program.fix(static_cast<std::size_t>(i));
  }
  const Eigen::VectorXd held = solved(dense.program, 1e-8);
  for (const long i : {0L, 17L, 18L, 59L}) {
    EXPECT_NEAR(held[i], 0.0, 1e-9) << i;
  }
  // The others fit themselves to it.
  EXPECT_GT((held - free).segment(1, 16).norm(), 1e-3);
}

TEST(ElasticProgram, CostsNoMoreThanTheLeastAndTheGap) {
  constexpr double kGap = 1e-6;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    RandomGradients random(100 + seed);
    const std::size_t unknowns = 57 + seed;
    Dense dense(unknowns);
    add_squares(dense, unknowns, random);
    add_rows(dense, unknowns, random);
    const Eigen::VectorXd delta = solved(dense.program, kGap);
    ASSERT_EQ(static_cast<std::size_t>(delta.size()), unknowns);
    const double allowed = kGap * static_cast<double>(unknowns);
    const double cost = dense.cost(delta);
    EXPECT_LT(cost - dense.bound_of_cost(), allowed) << seed;
    for (const double size : {1e-4, 1e-3, 1e-2}) {
      for (int trial = 0; trial < 50; ++trial) {
        const Eigen::VectorXd other = delta + size * random.direction(delta.size());
        EXPECT_GT(dense.cost(other), cost - allowed) << seed << ' ' << size;
      }
      for (long i = 0; i < delta.size(); ++i) {
        for (const double change : {-size, size}) {
          const Eigen::VectorXd other = delta + change * Eigen::VectorXd::Unit(delta.size(), i);
          EXPECT_GT(dense.cost(other), cost - allowed) << seed << ' ' << i << ' ' << change;
        }
      }
    }
  }
}

TEST(ElasticProgram, TellsTheValuesOfItsRows) {
  RandomGradients random(5);
  constexpr std::size_t kUnknowns = 60;
  Dense dense(kUnknowns);
  add_squares(dense, kUnknowns, random);
  add_rows(dense, kUnknowns, random);
  const Eigen::VectorXd delta = solved(dense.program, 1e-6);
  ASSERT_EQ(dense.program.rows(), dense.rows.size());
  for (std::size_t i = 0; i < dense.rows.size(); ++i) {
    EXPECT_NEAR(dense.program.value_at_solution(i), dense.rows[i].g.dot(delta) + dense.rows[i].v,
                1e-12);
  }
}

TEST(ElasticProgram, ForgetsTheProgramBefore) {
  Program program;
  begin_with_three(program);
  program.fix(0);
  program.add_row(0, first_unknown(), 0.0, -kInfinity, 1.0, 2.5);
  EXPECT_NEAR(solved(program, 1e-9)[0], 0.0, 1e-9);
  begin_with_three(program);
  EXPECT_EQ(program.rows(), 0U);
  EXPECT_NEAR(solved(program, 1e-9)[0], 3.0, 1e-12);
}

// The steps of rows that reach over five unknowns, in a band of this width.
template <int W>
std::vector<double> in_a_band_of() {
  constexpr std::size_t kUnknowns = 60;
  constexpr std::size_t kReach = 5;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  ElasticProgram<W> program;
  program.reset(kUnknowns);
  program.add_damping(1.0);
  for (std::size_t i = 0; i + kReach <= kUnknowns; ++i) {
    const std::size_t first = std::min(i, kUnknowns - W);
    typename ElasticProgram<W>::Gradient g = ElasticProgram<W>::Gradient::Zero();
    for (std::size_t j = 0; j < kReach; ++j) {
      g[static_cast<long>(i - first + j)] = any(random);
    }
    program.add_square(first, g, any(random), 2.0);
    program.add_row(first, g, 2.0 * any(random), -0.5, 0.5, 10.0);
  }
  int iterations = 0;
  const auto found = program.solve(1e-9, iterations);
  EXPECT_TRUE(found);
  return {found->begin(), found->end()};
}

// So all widths that there are solve one program alike.
TEST(ElasticProgram, DoesNotDependOnTheWidthOfTheBand) {
  const std::vector<double> narrow = in_a_band_of<5>();
  for (const std::vector<double>& wide :
       {in_a_band_of<18>(), in_a_band_of<24>(), in_a_band_of<40>()}) {
    ASSERT_EQ(wide.size(), narrow.size());
    for (std::size_t i = 0; i < narrow.size(); ++i) {
      EXPECT_NEAR(wide[i], narrow[i], 1e-5);
    }
  }
}

}  // namespace
}  // namespace unflex::quadratic
