// The cost of all lines that are still to come. This is the value function that guides the search.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "line_cost.hpp"

namespace unflex::emit {

// The cost of the best lines to come if places were real numbers and times fixed. It is the cost of
// a linear-quadratic regulator (Anderson & Moore, Optimal Control: Linear Quadratic Methods, § 2.4
// and 4.1).
template <int kModes>
class CostToGo {
 public:
  // The machine comes to rest at `end_mm`, on a grid of `step_mm`.
  CostToGo(const LineCosts<kModes>& costs, const LineRules& rules, const Eigen::Vector2d& step_mm,
           const Eigen::Vector2d& end_mm)
      : costs_(&costs), rules_(&rules), step_mm_(step_mm), end_mm_(end_mm) {}

  // Computes the costs for the candidates from `from` to `until`. is_last: the last line ends
  // there.
  void compute(std::size_t from, std::size_t until, bool is_last);

  [[nodiscard]] const Quadratic<kModes>& at(std::size_t k) const { return to_go_[k - from_]; }
  // Whether the last line may end at candidate k, and the cost if the machine rests from there on.
  [[nodiscard]] bool may_rest(std::size_t k) const { return k >= rest_from_; }
  [[nodiscard]] const Quadratic<kModes>& resting(std::size_t k) const {
    return rest_[k - rest_from_];
  }

 private:
  [[nodiscard]] std::size_t usual(std::size_t k) const;
  void compute_resting(std::size_t until);

  const LineCosts<kModes>* costs_;
  const LineRules* rules_;
  Eigen::Vector2d step_mm_;
  Eigen::Vector2d end_mm_;
  std::size_t from_ = 0;
  std::size_t rest_from_ = 0;
  std::vector<Quadratic<kModes>> to_go_;
  std::vector<Quadratic<kModes>> rest_;
};

extern template class CostToGo<1>;
extern template class CostToGo<2>;
extern template class CostToGo<3>;
extern template class CostToGo<4>;
extern template class CostToGo<6>;

}  // namespace unflex::emit
