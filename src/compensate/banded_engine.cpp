#include "banded_engine.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "axis_chain.hpp"
#include "flat_form.hpp"
#include "interior_point.hpp"
#include "limits.hpp"
#include "stage_form.hpp"

namespace unflex::compensate {
namespace {

constexpr int kMostFreeSteps = 4;

const char* name_of(RowKind kind) {
  switch (kind) {
    case RowKind::position:
      return "base position";
    case RowKind::velocity:
      return "base velocity";
    case RowKind::accel:
      return "base acceleration";
    default:
      return "base jerk";
  }
}

// Steps the form to the optimum without limits: by one step, but for rounding.
template <class Form>
bool solve_without_limits(Form& form, std::size_t nodes) {
  if (!form.factor({})) {
    return false;
  }
  form.evaluate({});
  for (int step = 0; step < kMostFreeSteps; ++step) {
    form.solve({});
    const double cost = std::max(form.half_cost(), kIdleHalfCost * static_cast<double>(nodes));
    form.advance(1.0);
    if (form.decrement() <= kGapShare * cost) {
      return true;
    }
    form.evaluate({});
  }
  return false;
}

template <class Form>
Result<AxisSolution> solve_by(Form& form, InteriorPoint& interior_point, const ScaledWindow& scaled,
                              bool strict) {
  form.assign(scaled);
  if (!solve_without_limits(form, scaled.nodes)) {
    return fail(ErrorKind::internal, "the window's program cannot be solved even without limits");
  }
  form.save();
  const AxisWindow& window = *scaled.window;
  return solve_within_limits(window, [&](const ActiveLimits& active) -> Result<AxisSolution> {
    AxisSolution solution;
    solution.iterations = 1;
    if (active != ActiveLimits{}) {
      form.restore();
      const InteriorPoint::Outcome outcome =
          interior_point.solve(form, scaled.nodes, row_bounds(scaled, active), strict);
      solution.iterations = outcome.iterations;
      if (!outcome.converged) {
        return fail(
            ErrorKind::internal,
            fmt::format("no solution within the limits after {} iterations, worst violation "
                        "{:.3g} in {}, node {}",
                        outcome.iterations,
                        outcome.worst_excess * scaled.unit[index_of(outcome.worst_kind)],
                        name_of(outcome.worst_kind), outcome.worst_row));
      }
    }
    solution.objective = 2.0 * form.half_cost() * scaled.unit[0] * scaled.unit[0] * window.period_s;
    form.write(solution.base);
    return solution;
  });
}

class BandedEngine final : public Engine {
 public:
  explicit BandedEngine(BandedForm form) : form_(form) {}

  Result<AxisSolution> solve(const AxisWindow& window) const override {
    // Kept from window to window, as allocating would take longer than solving.
    thread_local ScaledWindow scaled;
    thread_local InteriorPoint interior_point;
    thread_local FlatForm flat;
    thread_local StageForm<1> stages;
    thread_local StageForm<3> stages_of_three;
    thread_local StageForm<5> stages_of_five;
    scaled.assign(window);
    if (window.models() > 3) {
      return solve_by(stages_of_five, interior_point, scaled, false);
    }
    if (window.models() > 1) {
      return solve_by(stages_of_three, interior_point, scaled, false);
    }
    if (form_ == BandedForm::flat || (form_ == BandedForm::fitting && FlatForm::suits(scaled))) {
      // Where it runs out of digits, stages have some left.
      Result<AxisSolution> solution =
          solve_by(flat, interior_point, scaled, form_ == BandedForm::fitting);
      if (solution || form_ == BandedForm::flat) {
        return solution;
      }
    }
    return solve_by(stages, interior_point, scaled, false);
  }

  std::string name() const override { return "banded"; }

 private:
  BandedForm form_;
};

}  // namespace

std::unique_ptr<Engine> make_banded_engine(BandedForm form) {
  return std::make_unique<BandedEngine>(form);
}

std::unique_ptr<Engine> make_banded_engine() { return make_banded_engine(BandedForm::fitting); }

}  // namespace unflex::compensate
