#include "banded_engine.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "axis_chain.hpp"
#include "flat_form.hpp"
#include "free_steps.hpp"
#include "interior_point.hpp"
#include "limits.hpp"
#include "stage_form.hpp"
#include "stretches.hpp"
#include "unflex/core/threads.hpp"

namespace unflex::compensate {
namespace {

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

// Takes the form from the saved optimum without limits to the optimum within them.
InteriorPoint::Outcome solve_where_limits_count(FlatForm& form, InteriorPoint& interior_point,
                                                const ScaledWindow& scaled,
                                                const PerKind<std::optional<RowBounds>>& bounds,
                                                bool strict, const Precision& precision,
                                                Stretches& /*stretches*/) {
  form.restore();
  return interior_point.solve(form, scaled.nodes, bounds, strict, precision);
}

// Takes the form from the saved optimum without limits to the optimum within them. Rows bound the
// base in stretches alone. If the base breaks a limit elsewhere, the stretches grow and the form is
// solved again.
InteriorPoint::Outcome solve_where_limits_count(StageForm& form, InteriorPoint& interior_point,
                                                const ScaledWindow& scaled,
                                                const PerKind<std::optional<RowBounds>>& bounds,
                                                bool strict, const Precision& precision,
                                                Stretches& stretches) {
  // First guess of the distance from a broken limit within which the base has to change.
  constexpr double kReach_s = 0.01;
  auto reach = static_cast<std::size_t>(kReach_s / scaled.window->period_s) + 1;
  PerKind<bool> kinds{};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    kinds[i] = bounds[i].has_value();
  }
  const auto add = [&] {
    form.evaluate(kinds);
    PerKind<const double*> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = kinds[i] ? form.rows(kRowKinds[i]) : nullptr;
    }
    return add_broken(values, bounds, scaled.nodes, reach, stretches);
  };
  int iterations = 0;
  form.restore();
  add();
  while (true) {
    form.restore();
    form.focus(stretches);
    InteriorPoint::Outcome outcome = interior_point.solve(
        form, scaled.nodes, bounds_within(bounds, scaled.nodes, stretches), strict, precision);
    iterations += outcome.iterations;
    outcome.iterations = iterations;
    if (!outcome.converged) {
      break;
    }
    if (!add()) {
      return outcome;
    }
    reach *= 2;
  }
  // Steps that are not quite Newton's may fail to converge. The whole window is solved then.
  form.restore();
  form.focus({});
  InteriorPoint::Outcome outcome =
      interior_point.solve(form, scaled.nodes, bounds, strict, precision);
  outcome.iterations += iterations;
  return outcome;
}

template <class Form>
Result<AxisSolution> solve_by(Form& form, InteriorPoint& interior_point, const ScaledWindow& scaled,
                              bool strict, const Precision& precision) {
  form.assign(scaled);
  if (!form.factor({}) || !step_without_limits(form, scaled.nodes)) {
    return fail(ErrorKind::internal, "the window's program cannot be solved even without limits");
  }
  form.save();
  const AxisWindow& window = *scaled.window;
  Stretches stretches;
  return solve_within_limits(window, [&](const ActiveLimits& active) -> Result<AxisSolution> {
    int iterations = 1;
    if (active != ActiveLimits{}) {
      const InteriorPoint::Outcome outcome = solve_where_limits_count(
          form, interior_point, scaled, row_bounds(scaled, active), strict, precision, stretches);
      iterations = outcome.iterations;
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
    AxisSolution solution = solution_of(form, scaled);
    solution.iterations = iterations;
    return solution;
  });
}

// The memory that one window is solved in. It is kept from window to window, as allocating would
// take longer than solving.
struct Workspace {
  ScaledWindow scaled;
  InteriorPoint interior_point;
  FlatForm flat;
  StageForm stages;
};

// There are as many workspaces as windows were ever solved at once. They do not belong to threads:
// the C library must remember to destroy what belongs to a thread, and aborts the process if it has
// no memory for that.
class Workspaces {
 public:
  std::unique_ptr<Workspace> take() {
    {
      const Lock lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<Workspace> workspace = std::move(idle_.back());
        idle_.pop_back();
        return workspace;
      }
    }
    return std::make_unique<Workspace>();
  }

  void give_back(std::unique_ptr<Workspace> workspace) {
    const Lock lock(mutex_);
    idle_.push_back(std::move(workspace));
  }

 private:
  Mutex mutex_;
  std::vector<std::unique_ptr<Workspace>> idle_;
};

class BandedEngine final : public Engine {
 public:
  explicit BandedEngine(BandedForm form, Precision precision = {})
      : form_(form), precision_(precision) {}

  Result<AxisSolution> solve(const AxisWindow& window) const override {
    std::unique_ptr<Workspace> workspace = workspaces_.take();
    Result<AxisSolution> solution = solve_in(*workspace, window);
    workspaces_.give_back(std::move(workspace));
    return solution;
  }

  std::string name() const override { return "banded"; }

 private:
  Result<AxisSolution> solve_in(Workspace& work, const AxisWindow& window) const {
    ScaledWindow& scaled = work.scaled;
    scaled.assign(window);
    const bool is_flat =
        form_ == BandedForm::flat || (form_ == BandedForm::fitting && FlatForm::suits(scaled));
    if (is_flat && FlatForm::takes(window)) {
      // If the flat form runs out of digits, the stage form has some left.
      Result<AxisSolution> solution =
          solve_by(work.flat, work.interior_point, scaled, true, precision_);
      if (solution || form_ == BandedForm::flat) {
        return solution;
      }
    }
    return solve_by(work.stages, work.interior_point, scaled, false, precision_);
  }

  BandedForm form_;
  Precision precision_;
  mutable Workspaces workspaces_;
};

}  // namespace

std::unique_ptr<Engine> make_banded_engine(BandedForm form) {
  return std::make_unique<BandedEngine>(form);
}

std::unique_ptr<Engine> make_banded_engine() { return make_banded_engine(BandedForm::fitting); }

std::unique_ptr<Engine> make_rough_engine() {
  return std::make_unique<BandedEngine>(BandedForm::fitting, kRough);
}

}  // namespace unflex::compensate
