#include "interior_point.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "unflex/core/math.hpp"

namespace unflex::compensate {
namespace {

// Stands for a missing bound: 10 m for positions, and the same number for the other kinds.
constexpr double kFar = 1e6;
// Bounds closer to each other than this leave no interior. They are moved apart to this.
constexpr double kNarrowest = 2e-7;
// The first sλ, in mean half costs of a node, and the power by which it grows with the excess of
// the start. It is small if the start nearly keeps its bounds, and large if it is far off.
// Otherwise the first steps would run into the bounds and 200 iterations would not be enough.
constexpr double kBarrierShare = 30.0;
constexpr double kBarrierPower = 2.0;
// No slack begins smaller than this share of how far the start is beyond its bounds.
constexpr double kLeastSlackShare = 0.3;
// A step goes this share of the way to the nearest bound.
constexpr double kShareOfWay = 0.995;

using Row = Eigen::Map<const Eigen::ArrayXd>;

Interval apart(Interval bounds) {
  bounds.lower = std::max(bounds.lower, -kFar);
  bounds.upper = std::min(bounds.upper, kFar);
  const double missing = 0.5 * (kNarrowest - (bounds.upper - bounds.lower));
  if (missing > 0.0) {
    bounds.lower -= missing;
    bounds.upper += missing;
  }
  return bounds;
}

double size_of(double bound) { return std::abs(bound) < kFar ? std::abs(bound) : 0.0; }

}  // namespace

void InteriorPoint::start(const PerKind<std::optional<RowBounds>>& bounds,
                          const PerKind<const double*>& values, std::size_t nodes,
                          double half_cost_per_node) {
  sides_ = 0;
  double excess = 0.0;  // the largest of all kinds, divided by their scales
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    Rows& rows = rows_[i];
    if (!rows.active) {
      continue;
    }
    const RowKind kind = kRowKinds[i];
    rows.count = row_count(kind, nodes);
    sides_ += 2 * rows.count;
    rows.weight.resize(rows.count);
    rows.force.resize(rows.count);
    const Interval inner = apart(bounds[i]->inner);
    rows.scale =
        kind == RowKind::position ? 1.0 : std::max(size_of(inner.lower), size_of(inner.upper));
    rows.scale = rows.scale > 0.0 ? std::min(rows.scale, 1.0) : 1.0;
    const std::vector<Interval>& each = bounds[i]->each;
    const auto bounds_at = [&](std::size_t k) { return apart(bounds[i]->at(k, nodes)); };
    const Row value(values[i], static_cast<Eigen::Index>(rows.count));
    double beyond =
        std::max({(inner.lower - value).maxCoeff(), (value - inner.upper).maxCoeff(), 0.0});
    double narrowest = inner.upper - inner.lower;
    for (std::size_t k = 0; k < each.size(); ++k) {
      const Interval at = bounds_at(k);
      const double there = values[i][k];
      beyond = std::max({beyond, at.lower - there, there - at.upper});
      narrowest = std::min(narrowest, at.upper - at.lower);
    }
    const double least = std::min(kLeastSlackShare * beyond + 1e-3 * rows.scale, 0.25 * narrowest);
    for (Side* side : {&rows.lower, &rows.upper}) {
      for (Padded* array :
           {&side->bound, &side->slack, &side->multiplier, &side->inverse_slack, &side->residual,
            &side->relative, &side->target, &side->relative_multiplier}) {
        array->resize(rows.count);
      }
      side->sign = side == &rows.lower ? 1.0 : -1.0;
      const auto d = [&](const Interval& at) { return side->sign > 0.0 ? -at.lower : at.upper; };
      as_array(side->bound).setConstant(d(inner));
      for (std::size_t k = 0; k < each.size(); ++k) {
        side->bound[k] = d(bounds_at(k));
      }
      side->bound[0] = d(bounds_at(0));
      side->bound[rows.count - 1] = d(bounds_at(rows.count - 1));
      as_array(side->slack) = (side->sign * value + as_array(side->bound)).max(least);
    }
    excess = std::max(excess, beyond / rows.scale);
  }
  const double barrier =
      kBarrierShare * math::pow(1.0 + excess, kBarrierPower) * half_cost_per_node;
  for (Rows& rows : rows_) {
    for (Side* side : {&rows.lower, &rows.upper}) {
      if (rows.active) {
        as_array(side->multiplier) = barrier / as_array(side->slack);
      }
    }
  }
}

void InteriorPoint::linearise(const PerKind<const double*>& values) {
  gap_ = 0.0;
  residual_ = 0.0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    Rows& rows = rows_[i];
    if (!rows.active) {
      continue;
    }
    const Row value(values[i], static_cast<Eigen::Index>(rows.count));
    as_array(rows.weight).setZero();
    as_array(rows.force).setZero();
    for (Side* side : {&rows.lower, &rows.upper}) {
      auto inverse = as_array(side->inverse_slack);
      auto residual = as_array(side->residual);
      residual = side->sign * value + as_array(side->bound) - as_array(side->slack);
      inverse = as_array(side->slack).inverse();
      const auto weight = as_array(side->multiplier) * inverse;
      as_array(rows.weight) += weight;
      as_array(rows.force) -= side->sign * weight * residual;
      gap_ += (as_array(side->slack) * as_array(side->multiplier)).sum();
      residual_ = std::max(residual_, residual.abs().maxCoeff() / rows.scale);
    }
  }
}

// The target of sλ, from how far the predictor's step gets.
double InteriorPoint::predict(const PerKind<const double*>& steps) {
  // Δλ/λ = −1 − Δs/s.
  double steepest = 1.0;
  double first = 0.0;
  double second = 0.0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    Rows& rows = rows_[i];
    if (!rows.active) {
      continue;
    }
    const Row step(steps[i], static_cast<Eigen::Index>(rows.count));
    for (Side* side : {&rows.lower, &rows.upper}) {
      auto relative = as_array(side->relative);
      relative = (side->sign * step + as_array(side->residual)) * as_array(side->inverse_slack);
      steepest = std::max(steepest, (-relative).max(1.0 + relative).maxCoeff());
      const auto product = as_array(side->slack) * as_array(side->multiplier) * relative;
      first += product.sum();
      second += (product * relative).sum();
    }
  }
  const double length = 1.0 / steepest;
  const double left = (1.0 - length) * gap_ - length * length * (first + second);
  return math::power(std::max(left, 0.0) / gap_, 3) * gap_ / static_cast<double>(sides_);
}

void InteriorPoint::correct(double target) {
  for (Rows& rows : rows_) {
    if (!rows.active) {
      continue;
    }
    as_array(rows.force).setZero();
    for (Side* side : {&rows.lower, &rows.upper}) {
      const auto product = as_array(side->slack) * as_array(side->multiplier);
      const auto relative = as_array(side->relative);
      as_array(side->target) = target + product * relative * (1.0 + relative);
      as_array(rows.force) +=
          side->sign *
          (as_array(side->target) - as_array(side->multiplier) * as_array(side->residual)) *
          as_array(side->inverse_slack);
    }
  }
}

// The longest step that leaves all slacks and multipliers positive, shortened by kShareOfWay.
double InteriorPoint::longest(const PerKind<const double*>& steps) {
  double steepest = kShareOfWay;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    Rows& rows = rows_[i];
    if (!rows.active) {
      continue;
    }
    const Row step(steps[i], static_cast<Eigen::Index>(rows.count));
    for (Side* side : {&rows.lower, &rows.upper}) {
      auto relative = as_array(side->relative);
      auto multiplier = as_array(side->relative_multiplier);
      relative = (side->sign * step + as_array(side->residual)) * as_array(side->inverse_slack);
      multiplier = as_array(side->target) / (as_array(side->slack) * as_array(side->multiplier)) -
                   1.0 - relative;
      steepest = std::max(steepest, (-relative).max(-multiplier).maxCoeff());
    }
  }
  return kShareOfWay / steepest;
}

void InteriorPoint::advance(double length) {
  for (Rows& rows : rows_) {
    if (!rows.active) {
      continue;
    }
    for (Side* side : {&rows.lower, &rows.upper}) {
      as_array(side->slack) *= 1.0 + length * as_array(side->relative);
      as_array(side->multiplier) *= 1.0 + length * as_array(side->relative_multiplier);
    }
  }
}

// Sets the forces of the present multipliers.
void InteriorPoint::pull() {
  for (Rows& rows : rows_) {
    if (rows.active) {
      as_array(rows.force) = as_array(rows.lower.multiplier) - as_array(rows.upper.multiplier);
    }
  }
}

InteriorPoint::Outcome InteriorPoint::worst(const PerKind<const double*>& values) const {
  Outcome outcome;
  double largest = 0.0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Rows& rows = rows_[i];
    for (std::size_t k = 0; rows.active && k < rows.count; ++k) {
      const double excess =
          std::max(-(values[i][k] + rows.lower.bound[k]), values[i][k] - rows.upper.bound[k]);
      if (!(excess / rows.scale <= largest)) {
        largest = excess / rows.scale;
        outcome.worst_kind = kRowKinds[i];
        outcome.worst_row = k;
        outcome.worst_excess = excess;
      }
    }
  }
  return outcome;
}

PerKind<const double*> InteriorPoint::forces() const {
  PerKind<const double*> result{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = rows_[i].active ? rows_[i].force.data() : nullptr;
  }
  return result;
}

PerKind<const double*> InteriorPoint::weights() const {
  PerKind<const double*> result{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = rows_[i].active ? rows_[i].weight.data() : nullptr;
  }
  return result;
}

}  // namespace unflex::compensate
