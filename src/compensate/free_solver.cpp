#include "free_solver.hpp"

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
  // The second step takes back what the first one lost by rounding.
  constexpr int kSteps = 2;
  scaled_.set_aims();
  std::visit(
      [&](auto& form) {
        form.set_aims();
        for (int step = 0; step < kSteps; ++step) {
          form.evaluate({});
          form.solve({});
          form.advance(1.0);
        }
        form.write_nozzles(nozzles_mm_);
      },
      form_);
}

}  // namespace unflex::compensate
