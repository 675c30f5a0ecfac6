#include "cost_to_go.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::emit {
namespace {

// The last line ends at most this many candidates before the base does.
constexpr std::size_t kEarliest = 512;
// The cost to go assumes that a line takes at most this many times LineRules::even_line_s().
constexpr double kPatience = 2.5;

}  // namespace

// The duration that the cost to go assumes for a line from k on: the shortest that covers enough
// steps at an even pace or slower.
template <int kModes>
std::size_t CostToGo<kModes>::usual(std::size_t k) const {
  const std::size_t left = costs_->size() - 1 - k;
  std::size_t m = costs_->candidates(rules_->even_line_s());
  if (left < 2 * m) {
    return left;
  }
  const auto covers = [&](std::size_t candidates) {
    const Eigen::Vector2d way = costs_->base_mm(k + candidates) - costs_->base_mm(k);
    return way.cwiseQuotient(step_mm_).cwiseAbs().maxCoeff() >= rules_->min_steps;
  };
  // Where the base turns round, no line may ever cover enough steps.
  const std::size_t patience = costs_->candidates(kPatience * rules_->even_line_s());
  while (m < std::min(patience, left - m) && !covers(m)) {
    ++m;
  }
  return m;
}

// The cost after the last line: the machine rests at the run's end while the base still moves. Then
// o is given, so the cost is a quadratic of e alone.
template <int kModes>
void CostToGo<kModes>::compute_resting(std::size_t until) {
  rest_.assign(until - rest_from_ + 1, {});
  rest_.back() = costs_->ring_down();
  for (std::size_t k = until; k-- > rest_from_;) {
    const LineCost<kModes> line = costs_->line(k, 1);
    const Eigen::Vector2d o = end_mm_ - costs_->base_mm(k);
    const Eigen::Vector2d u = end_mm_ - costs_->base_mm(k + 1);
    const auto [all, slope, constant] = whole_cost(line, resting(k + 1));
    // w = e + fixed
    constexpr int kZ = kOfZ<kModes>;
    WVector<kModes> fixed = WVector<kModes>::Zero();
    fixed[place_of_o<kModes>(0)] = o[0];
    fixed[place_of_o<kModes>(1)] = o[1];
    fixed[kZ] = u[0];
    fixed[kZ + 1] = u[1];
    Quadratic<kModes>& here = rest_[k - rest_from_];
    here.matrix = all.template topLeftCorner<kZ, kZ>();
    here.slope = (slope + all * fixed).template head<kZ>();
    here.constant = constant + slope.dot(fixed) + 0.5 * fixed.dot(all * fixed);
    for (const Eigen::Index i : {place_of_o<kModes>(0), place_of_o<kModes>(1)}) {
      here.matrix.row(i).setZero();
      here.matrix.col(i).setZero();
      here.slope[i] = 0.0;
    }
  }
}

template <int kModes>
void CostToGo<kModes>::compute(std::size_t from, std::size_t until, bool is_last) {
  from_ = from;
  to_go_.assign(until - from + 1, {});
  rest_from_ = until + 1;
  if (is_last) {
    rest_from_ = std::max(from, until - std::min(until, kEarliest));
    compute_resting(until);
  }
  const Quadratic<kModes> at_end = costs_->ring_down();
  for (std::size_t k = until + 1; k-- > from;) {
    Quadratic<kModes>& here = to_go_[k - from];
    const std::size_t m = k < until ? usual(k) : 0;
    if (k == until || k + m > until) {
      here = is_last ? resting(k) : at_end;
    } else if (is_last && k + m == until) {
      here = ending_on_base(costs_->line(k, m), at(k + m));
    } else {
      here = best_end(costs_->line(k, m), at(k + m)).value;
    }
  }
}

template class CostToGo<1>;
template class CostToGo<2>;
template class CostToGo<3>;
template class CostToGo<4>;
template class CostToGo<6>;

}  // namespace unflex::emit
