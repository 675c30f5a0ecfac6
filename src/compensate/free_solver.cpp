#include "free_solver.hpp"

#include "free_steps.hpp"

namespace unflex::compensate {

FreeSolver::FreeSolver(const AxisWindow& window) {
  scaled_.assign(window);
  if (FlatForm::suits(scaled_) && FlatForm::takes(window)) {
    form_.emplace<FlatForm>();
  }
  ready_ = std::visit(
      [&](auto& form) {
        form.assign(scaled_);
        return form.factor({});
      },
      form_);
}

void FreeSolver::solve() {
  scaled_.set_aims();
  std::visit(
      [&](auto& form) {
        form.set_aims();
        // What a step loses by rounding the next one, for other aims, takes back.
        form.evaluate({});
        form.solve({});
        form.advance(1.0);
        form.write_nozzles(nozzles_mm_);
      },
      form_);
}

std::optional<AxisSolution> FreeSolver::solution() {
  scaled_.set_aims();
  return std::visit(
      [&](auto& form) -> std::optional<AxisSolution> {
        form.set_aims();
        return step_without_limits(form, scaled_.nodes) ? std::optional(solution_of(form, scaled_))
                                                        : std::nullopt;
      },
      form_);
}

}  // namespace unflex::compensate
