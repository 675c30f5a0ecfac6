#include "unflex/core/levenberg_marquardt.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace unflex {
namespace {

using ::testing::ElementsAre;

constexpr Damping kDamping = {.first = 1e-3, .down = 0.1, .up = 10.0, .most = 1e12};

// exp(a t) at t = 1, 2, 3 is fitted to exp(0.7 t), which only a = 0.7 meets.
TEST(Descend, FindsTheOneParameterThatMeetsTheData) {
  double a = -1.0;
  const auto residual = [](double at, double t) { return std::exp(0.7 * t) - std::exp(at * t); };
  const auto sum = [&](double at) {
    double squares = 0.0;
    for (const double t : {1.0, 2.0, 3.0}) {
      squares += residual(at, t) * residual(at, t);
    }
    return squares;
  };
  double normal = 0.0;
  double gradient = 0.0;
  descend(
      kDamping, 100,
      [&] {
        normal = gradient = 0.0;
        for (const double t : {1.0, 2.0, 3.0}) {
          const double slope = t * std::exp(a * t);
          normal += slope * slope;
          gradient += slope * residual(a, t);
        }
      },
      [&](double lambda) -> DampedStep {
        const double candidate = a + gradient / (normal * (1.0 + lambda));
        if (!(sum(candidate) < sum(a))) {
          return {};
        }
        a = candidate;
        return {.helped = true};
      });
  EXPECT_NEAR(a, 0.7, 1e-9);
}

TEST(Descend, DampsMoreUntilAStepHelpsAndLessAfterIt) {
  std::vector<double> lambdas;
  int linearised = 0;
  descend(
      {.first = 1.0, .down = 0.5, .up = 4.0, .most = 1e3}, 2, [&] { ++linearised; },
      [&](double lambda) -> DampedStep {
        lambdas.push_back(lambda);
        return {.helped = lambdas.size() != 1};
      });
  EXPECT_THAT(lambdas, ElementsAre(1.0, 4.0, 2.0));
  EXPECT_EQ(linearised, 2);
}

TEST(Descend, StopsWhereNoDampingHelps) {
  int linearised = 0;
  int tried = 0;
  descend(
      {.first = 1.0, .down = 0.5, .up = 10.0, .most = 1e3}, 50, [&] { ++linearised; },
      [&](double) -> DampedStep {
        ++tried;
        return {};
      });
  EXPECT_EQ(linearised, 1);
  EXPECT_EQ(tried, 3);
}

TEST(Descend, StopsWhereAStepSaysSo) {
  int tried = 0;
  descend(
      kDamping, 50, [] {},
      [&](double) -> DampedStep {
        ++tried;
        return {.helped = tried < 3, .ended = tried == 3};
      });
  EXPECT_EQ(tried, 3);
}

}  // namespace
}  // namespace unflex
