// The chain and the flat form are equivalent to the transcribed program: their results satisfy its
// defect equations.
#include "flat_form.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "axis_problem.hpp"
#include "unflex/collocation/hargraves_paris.hpp"

namespace unflex::compensate {
namespace {

struct Axis {
  double omega_h;
  double zeta;
};

const std::vector<Axis> kAxes = {{0.283, 0.06}, {0.283, 0.0}, {0.05, 0.06}, {0.0126, 0.06},
                                 {1.0, 0.3},    {0.5, 1.0},   {0.3, 3.0},   {2.5, 0.1}};

AxisWindow window_of(const Axis& axis, std::size_t nodes) {
  AxisWindow window;
  window.axis = {axis.omega_h * 1000.0, axis.zeta};
  window.reference_mm.assign(2 * nodes - 1, 0.0);
  window.weight.assign(2 * nodes - 1, 1.0);
  return window;
}

// Largest defect of the transcribed program at these states.
double largest_defect(const AxisWindow& window, const std::vector<ChainVector>& states) {
  const AxisProblem problem(window, {});
  std::vector<double> times;
  std::vector<double> x;
  for (std::size_t k = 0; k < states.size(); ++k) {
    times.push_back(static_cast<double>(k));
    x.insert(x.end(), states[k].data(), states[k].data() + 5);
  }
  const auto program = collocation::transcribe(problem, times);
  std::vector<double> defects(program->constraint_bounds().lower.size());
  program->constraints(x, defects);
  double largest = 0.0;
  for (const double defect : defects) {
    largest = std::max(largest, std::abs(defect));
  }
  return largest;
}

TEST(AxisChain, KeepsTheDefectsOfHargravesAndParis) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const Axis& axis : kAxes) {
    const AxisChain chain(axis.omega_h, axis.zeta);
    std::vector<ChainVector> states = {ChainVector::Random()};
    for (int k = 0; k < 5; ++k) {
      const ChainVector& z = states.back();
      states.push_back(z + chain.growth * z + chain.input * uniform(random));
    }
    EXPECT_LT(largest_defect(window_of(axis, states.size()), states), 1e-13) << axis.omega_h;
    states[2](0) += 1e-6;
    EXPECT_GT(largest_defect(window_of(axis, states.size()), states), 1e-7);
  }
}

TEST(FlatStencils, MakeStatesThatKeepTheDefects) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const Axis& axis : kAxes) {
    const FlatStencils stencils(AxisChain(axis.omega_h, axis.zeta));
    std::vector<double> c(12);
    for (double& value : c) {
      value = uniform(random);
    }
    std::vector<ChainVector> states;
    double size = 0.0;
    for (std::size_t k = 0; k + 5 <= c.size(); ++k) {
      ChainVector z = ChainVector::Zero();
      for (std::size_t component = 0; component < 5; ++component) {
        for (std::size_t i = 0; i < 5; ++i) {
          z(static_cast<Eigen::Index>(component)) += stencils.state[component][i] * c[k + i];
        }
      }
      size = std::max(size, z.lpNorm<Eigen::Infinity>());
      states.push_back(z);
    }
    EXPECT_LT(largest_defect(window_of(axis, states.size()), states), 1e-13 * size);
    for (std::size_t k = 0; k + 1 < states.size(); ++k) {
      double jerk = 0.0;
      double middle = 0.0;
      for (std::size_t i = 0; i <= 5; ++i) {
        jerk += stencils.jerk[i] * c[k + i];
        middle += stencils.middle[i] * c[k + i];
      }
      EXPECT_NEAR(jerk, states[k + 1](4) - states[k](4), 1e-13 * size);
      EXPECT_NEAR(
          middle,
          0.5 * (states[k](0) + states[k + 1](0)) + 0.125 * (states[k](1) - states[k + 1](1)),
          1e-13 * size);
    }
  }
}

TEST(FlatStencils, RestWhereTheCoefficientsAreAllTheSame) {
  for (const Axis& axis : kAxes) {
    const FlatStencils stencils(AxisChain(axis.omega_h, axis.zeta));
    const double largest = std::abs(stencils.state[4][2]);
    for (std::size_t component = 0; component < 5; ++component) {
      double sum = 0.0;
      for (const double coefficient : stencils.state[component]) {
        sum += coefficient;
      }
      EXPECT_NEAR(sum, component == 0 || component == 2 ? 1.0 : 0.0, 1e-15 * largest + 1e-14);
    }
  }
}

}  // namespace
}  // namespace unflex::compensate
