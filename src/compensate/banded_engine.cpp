#include "banded_engine.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "axis_chain.hpp"
#include "flat_form.hpp"
#include "free_steps.hpp"
#include "interior_point.hpp"
#include "limits.hpp"
#include "stage_form.hpp"

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

template <class Form>
Result<AxisSolution> solve_by(Form& form, InteriorPoint& interior_point, const ScaledWindow& scaled,
                              bool strict, const Precision& precision) {
  form.assign(scaled);
  if (!form.factor({}) || !step_without_limits(form, scaled.nodes)) {
    return fail(ErrorKind::internal, "the window's program cannot be solved even without limits");
  }
  form.save();
  const AxisWindow& window = *scaled.window;
  return solve_within_limits(window, [&](const ActiveLimits& active) -> Result<AxisSolution> {
    int iterations = 1;
    if (active != ActiveLimits{}) {
      form.restore();
      const InteriorPoint::Outcome outcome =
          interior_point.solve(form, scaled.nodes, row_bounds(scaled, active), strict, precision);
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
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<Workspace> workspace = std::move(idle_.back());
        idle_.pop_back();
        return workspace;
      }
    }
    return std::make_unique<Workspace>();
  }

  void give_back(std::unique_ptr<Workspace> workspace) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(workspace));
  }

 private:
  std::mutex mutex_;
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
      Result<AxisSolution> solution = solve_by(work.flat, work.interior_point, scaled,
                                               form_ == BandedForm::fitting, precision_);
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
