// Steps of a form of a window (FlatForm, StageForm) to its optimum without limits.
#pragma once

#include <algorithm>
#include <cstddef>

#include "interior_point.hpp"

namespace unflex::compensate {

inline constexpr int kMostFreeSteps = 4;

// Steps a factored form to the optimum. Without rounding one step would do. False if rounding keeps
// it away.
template <class Form>
[[nodiscard]] bool step_without_limits(Form& form, std::size_t nodes) {
  form.evaluate({});
  for (int step = 0; step < kMostFreeSteps; ++step) {
    form.solve({});
    const double cost = std::max(form.half_cost(), kIdleHalfCost * static_cast<double>(nodes));
    form.advance(1.0);
    if (form.decrement() <= Precision{}.gap_share * cost) {
      return true;
    }
    form.evaluate({});
  }
  return false;
}

// The base that a form has come to. `scaled` is what the form was made of.
template <class Form>
[[nodiscard]] AxisSolution solution_of(Form& form, const ScaledWindow& scaled) {
  AxisSolution solution;
  solution.iterations = 1;
  solution.objective =
      2.0 * form.half_cost() * scaled.unit[0] * scaled.unit[0] * scaled.window->period_s;
  solution.size = form.size();
  form.write(solution.base);
  return solution;
}

}  // namespace unflex::compensate
