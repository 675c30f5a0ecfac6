// A primal-dual interior point for windows with limits, over any form of the window that can step
// (FlatForm, StageForm).
//
//   min f(y)   subject to   l ≤ G y ≤ u,    slacks s > 0, multipliers λ > 0 per side of each row
//
// Mehrotra's predictor and corrector (S. J. Wright, "Primal-Dual Interior-Point Methods", SIAM
// 1997, chapter 10), from a start that need not keep the limits. With σ = ±1 for the lower and the
// upper side of a row and d = −l or u, a side is s = σ g + d and its residual r = σ g + d − s.
// Eliminating Δs = σ GΔy + r and Δλ = (τ − e)/s − λ − (λ/s) Δs from the Newton system leaves
//
//   (∇²f + Gᵀ (λ/s) G) Δy = −∇f + Gᵀ σ ((τ − e)/s − (λ/s) r)
//
// with τ the target of sλ and e the predictor's Δs Δλ.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>

#include "axis_chain.hpp"
#include "padded.hpp"

namespace unflex::compensate {

// The precision at which a solution counts as found.
struct Precision {
  // The largest sλ summed over all sides, and the largest decrement left, as shares of the cost.
  double gap_share = 1e-8;
  // A narrower limit of both, scaled, if rounding allows it within kMostPolish more iterations:
  // where the cost is large, even a small share of it can move a base that hardly moves the nozzle.
  double gap = 1e-7;
  // The largest residual, as a share of the kind's scale.
  double feasibility = 1e-8;
};

// The precision for callers that solve many windows as intermediate steps.
inline constexpr Precision kRough{1e-4, 1e30, 1e-4};

class InteriorPoint {
 public:
  struct Outcome {
    bool converged = false;
    int iterations = 0;
    // If not converged: the row that is farthest beyond its bound.
    RowKind worst_kind = RowKind::position;
    std::size_t worst_row = 0;
    double worst_excess = 0.0;  // scaled
  };

  // Steps the form from the optimum without limits to the optimum within the bounds. strict: a
  // solution that misses the narrower of the two tolerances counts as not converged.
  template <class Form>
  [[nodiscard]] Outcome solve(Form& form, std::size_t nodes,
                              const PerKind<std::optional<RowBounds>>& bounds, bool strict,
                              const Precision& precision);

 private:
  // One side of all rows of a kind.
  struct Side {
    double sign = 1.0;           // σ
    Padded bound;                // d
    Padded slack;                // s
    Padded multiplier;           // λ
    Padded inverse_slack;        // 1/s
    Padded residual;             // r
    Padded relative;             // Δs/s of the predictor, then of the step
    Padded target;               // τ − e
    Padded relative_multiplier;  // Δλ/λ of the step
  };
  struct Rows {
    bool active = false;
    std::size_t count = 0;
    double scale = 1.0;
    Side lower;
    Side upper;
    Padded weight;  // λ/s, both sides
    Padded force;
  };

  void start(const PerKind<std::optional<RowBounds>>& bounds, const PerKind<const double*>& values,
             std::size_t nodes, double half_cost_per_node);
  void linearise(const PerKind<const double*>& values);
  [[nodiscard]] double predict(const PerKind<const double*>& steps);
  void correct(double target);
  [[nodiscard]] double longest(const PerKind<const double*>& steps);
  void advance(double length);
  void pull();
  [[nodiscard]] Outcome worst(const PerKind<const double*>& values) const;

  template <class Form>
  [[nodiscard]] PerKind<const double*> values_of(const Form& form) const;
  template <class Form>
  [[nodiscard]] PerKind<const double*> steps_of(const Form& form) const;
  [[nodiscard]] PerKind<const double*> forces() const;
  [[nodiscard]] PerKind<const double*> weights() const;

  PerKind<Rows> rows_;
  double gap_ = 0.0;       // Σ s λ
  double residual_ = 0.0;  // largest |r|, divided by the kind's scale
  std::size_t sides_ = 0;  // number of s
};

inline constexpr int kMostPolish = 2;
// A half cost per node below this is of no interest.
inline constexpr double kIdleHalfCost = 1e-8;
inline constexpr int kMaxIterations = 200;

template <class Form>
InteriorPoint::Outcome InteriorPoint::solve(Form& form, std::size_t nodes,
                                            const PerKind<std::optional<RowBounds>>& bounds,
                                            bool strict, const Precision& precision) {
  PerKind<bool> kinds{};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    kinds[i] = rows_[i].active = bounds[i].has_value();
  }
  const auto count = static_cast<double>(nodes);
  form.evaluate(kinds);
  start(bounds, values_of(form), nodes, std::max(form.half_cost() / count, kIdleHalfCost));
  int iterations = 0;
  int polished = 0;
  for (;; ++iterations) {
    linearise(values_of(form));
    const double cost = std::max(form.half_cost(), kIdleHalfCost * count);
    bool good = gap_ <= precision.gap_share * cost && residual_ <= precision.feasibility;
    if (good) {
      // The gradient of the Lagrangian, measured by what a step could still gain.
      pull();
      form.solve(forces());
      good = form.decrement() <= precision.gap_share * cost;
      if (good && (std::max(gap_, form.decrement()) <= precision.gap ||
                   (!strict && polished++ == kMostPolish))) {
        return {true, iterations};
      }
      linearise(values_of(form));
    }
    if (iterations >= kMaxIterations || !form.factor(weights())) {
      if (good && !strict) {
        return {true, iterations};
      }
      break;
    }
    form.solve(forces());
    correct(predict(steps_of(form)));
    form.solve(forces());
    const double length = longest(steps_of(form));
    form.advance(length);
    advance(length);
    form.evaluate(kinds);
  }
  Outcome outcome = worst(values_of(form));
  outcome.iterations = iterations;
  return outcome;
}

template <class Form>
PerKind<const double*> InteriorPoint::values_of(const Form& form) const {
  PerKind<const double*> result{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = rows_[i].active ? form.rows(kRowKinds[i]) : nullptr;
  }
  return result;
}

template <class Form>
PerKind<const double*> InteriorPoint::steps_of(const Form& form) const {
  PerKind<const double*> result{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = rows_[i].active ? form.row_steps(kRowKinds[i]) : nullptr;
  }
  return result;
}

}  // namespace unflex::compensate
