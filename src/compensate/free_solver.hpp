// Solves one window without limits again and again, for one set of aims after the other. The
// program is factored once, since its matrix does not depend on the aims.
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "flat_form.hpp"
#include "stage_form.hpp"
#include "unflex/compensate/axis_window.hpp"

namespace unflex::compensate {

class FreeSolver {
 public:
  // window: must stay where it is. Its aims are read at each solve(), its limits never.
  explicit FreeSolver(const AxisWindow& window);
  // Forms point into this object.
  FreeSolver(const FreeSolver&) = delete;
  FreeSolver& operator=(const FreeSolver&) = delete;

  // Whether the program can be solved.
  [[nodiscard]] bool is_ready() const { return ready_; }
  // One step from where the last solve() ended, which is all but the optimum for today's aims.
  void solve();
  // The optimum for today's aims; nullopt if rounding keeps it away.
  [[nodiscard]] std::optional<AxisSolution> solution();
  // p of each model at the nodes, mm.
  [[nodiscard]] const std::vector<std::vector<double>>& nozzles_mm() const { return nozzles_mm_; }

 private:
  ScaledWindow scaled_;
  std::variant<StageForm, FlatForm> form_;
  bool ready_ = false;
  std::vector<std::vector<double>> nozzles_mm_;
};

}  // namespace unflex::compensate
