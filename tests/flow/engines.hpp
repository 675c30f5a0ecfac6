// Engines for tests of the code around them; the window decides how they behave.
#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "unflex/compensate/axis_window.hpp"

namespace unflex::flow::testing {

using Solve = std::function<Result<compensate::AxisSolution>(const compensate::AxisWindow&)>;

class TestEngine final : public compensate::Engine {
 public:
  explicit TestEngine(Solve solve) : solve_(std::move(solve)) {}
  [[nodiscard]] Result<compensate::AxisSolution> solve(
      const compensate::AxisWindow& window) const override {
    return solve_(window);
  }
  [[nodiscard]] std::string name() const override { return "test engine"; }

 private:
  Solve solve_;
};

inline std::function<std::unique_ptr<compensate::Engine>()> factory(Solve solve) {
  return [solve = std::move(solve)] { return std::make_unique<TestEngine>(solve); };
}

// A solution that improves nothing: the base follows the plan.
inline compensate::AxisSolution plain_solution(const compensate::AxisWindow& window) {
  const std::size_t n = window.nodes();
  const double h = window.period_s;
  const auto position = [&](std::size_t k) { return window.reference_mm[2 * std::min(k, n - 1)]; };
  compensate::AxisSolution solution;
  for (std::size_t k = 0; k < n; ++k) {
    const double before = position(k > 0 ? k - 1 : 0);
    const double after = position(k + 1);
    solution.base.position_mm.push_back(position(k));
    solution.base.velocity_mm_s.push_back((after - before) / (2.0 * h));
    solution.base.accel_mm_s2.push_back((after - 2.0 * position(k) + before) / (h * h));
  }
  solution.iterations = 1;
  return solution;
}

}  // namespace unflex::flow::testing
