#include "time_derivatives.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <type_traits>

namespace unflex::timing {
namespace {

template <typename Count>
class TimeDerivativesOf : public ::testing::Test {
 protected:
  static constexpr int kCount = Count::value;

  Derivatives<kCount> random(double most) {
    std::uniform_real_distribution<double> uniform(-most, most);
    Derivatives<kCount> values{};
    for (double& value : values) {
      value = uniform(generator_);
    }
    return values;
  }

  // Time has to go on.
  Derivatives<kCount> random_time() {
    Derivatives<kCount> time = random(0.5);
    time[1] += 1.0;
    return time;
  }

  // Σ_k a_k y_k.
  static double sum(const Derivatives<kCount>& a, const Derivatives<kCount>& function,
                    const Derivatives<kCount>& time) {
    const Derivatives<kCount> y = TimeDerivatives<kCount>(time).by_time(function);
    double result = 0.0;
    for (int k = 0; k < kCount; ++k) {
      result += a[k] * y[k];
    }
    return result;
  }

 private:
  std::mt19937_64 generator_{1};
};

using Counts = ::testing::Types<std::integral_constant<int, 5>, std::integral_constant<int, 7>>;
TYPED_TEST_SUITE(TimeDerivativesOf, Counts, );

TYPED_TEST(TimeDerivativesOf, ACubeAreThoseOfACubeInAClockThatGrows) {
  constexpr int K = TestFixture::kCount;
  for (const double u : {-1.0, 0.0, 0.6}) {
    // T = e^u, X = T³
    const double t = std::exp(u);
    Derivatives<K> time{};
    Derivatives<K> function{};
    for (int j = 0; j < K; ++j) {
      time[j] = t;
      function[j] = std::pow(3.0, j) * t * t * t;
    }
    const Derivatives<K> y = TimeDerivatives<K>(time).by_time(function);
    const double expected[] = {t * t * t, 3.0 * t * t, 6.0 * t, 6.0};
    for (int k = 0; k < K; ++k) {
      EXPECT_NEAR(y[k], k < 4 ? expected[k] : 0.0, 1e-8) << u << ' ' << k;
    }
  }
}

TYPED_TEST(TimeDerivativesOf, TimeItselfAreOneAndNothing) {
  constexpr int K = TestFixture::kCount;
  for (int trial = 0; trial < 10; ++trial) {
    const Derivatives<K> time = this->random_time();
    const Derivatives<K> y = TimeDerivatives<K>(time).by_time(time);
    EXPECT_EQ(y[0], time[0]);
    for (int k = 1; k < K; ++k) {
      EXPECT_NEAR(y[k], k == 1 ? 1.0 : 0.0, 1e-8 * std::pow(1.0 / time[1], 2 * k)) << k;
    }
  }
}

TYPED_TEST(TimeDerivativesOf, AFunctionHaveTheGradientThatDifferencesHave) {
  constexpr int K = TestFixture::kCount;
  constexpr double kStep = 1e-2;  // the sum is linear in the function
  for (int trial = 0; trial < 20; ++trial) {
    const Derivatives<K> time = this->random_time();
    const Derivatives<K> function = this->random(1.0);
    const Derivatives<K> a = this->random(1.0);
    const Derivatives<K> gradient = TimeDerivatives<K>(time).by_function(a);
    for (int j = 0; j < K; ++j) {
      Derivatives<K> more = function;
      Derivatives<K> less = function;
      more[j] += kStep;
      less[j] -= kStep;
      const double slope = (this->sum(a, more, time) - this->sum(a, less, time)) / (2.0 * kStep);
      EXPECT_NEAR(gradient[j], slope, 1e-8 * (1.0 + std::abs(this->sum(a, function, time))))
          << trial << ' ' << j;
    }
  }
}

TYPED_TEST(TimeDerivativesOf, AClockHaveTheGradientThatDifferencesHave) {
  constexpr int K = TestFixture::kCount;
  for (int trial = 0; trial < 20; ++trial) {
    const Derivatives<K> time = this->random_time();
    const Derivatives<K> function = this->random(1.0);
    const Derivatives<K> a = this->random(1.0);
    const TimeDerivatives<K> derivatives(time);
    const Derivatives<K> gradient = derivatives.by_clock(a, derivatives.by_time(function));
    double largest = 1.0;
    for (const double value : gradient) {
      largest = std::max(largest, std::abs(value));
    }
    const double step = 1e-5 * time[1];
    for (int j = 0; j < K; ++j) {
      Derivatives<K> later = time;
      Derivatives<K> sooner = time;
      later[j] += step;
      sooner[j] -= step;
      const double slope =
          (this->sum(a, function, later) - this->sum(a, function, sooner)) / (2.0 * step);
      EXPECT_NEAR(gradient[j], slope, 1e-6 * largest) << trial << ' ' << j;
    }
  }
}

}  // namespace
}  // namespace unflex::timing
