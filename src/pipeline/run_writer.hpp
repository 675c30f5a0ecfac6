// Writes runs and the lines between them in the order of the input, and watches that no run gets
// worse by it.
#pragma once

#include <optional>
#include <string>

#include "emission_cost.hpp"
#include "run_job.hpp"
#include "unflex/emit/emitter.hpp"
#include "unflex/report/report.hpp"
#include "unflex/verify/line_rate.hpp"

namespace unflex::pipeline {

class RunWriter {
 public:
  // Both must outlive the writer. max_lines_per_s: the budget.
  RunWriter(const RunRules& rules, double max_lines_per_s, report::Report& report);

  // The piece as text. Of a run, prepare() has been called.
  [[nodiscard]] std::string write(const RunJob& job);
  // What follows the last piece.
  [[nodiscard]] std::string finish();

  // How much longer what has been written takes than it would have.
  [[nodiscard]] double time_factor() const {
    return sliced_s_ > 0.0 ? written_s_ / sliced_s_ : 1.0;
  }

 private:
  void keep_motion(const Piece& piece);
  void note_lines_above_budget(const Piece& piece);
  std::optional<std::string> write_run(const RunJob& job, std::string& text);
  std::optional<std::string> try_run(const RunJob& job, const emit::RunPlan& plan,
                                     std::string& text);
  void note_fallback(const RunJob& job, std::string reason);

  const RunRules* rules_;
  double max_lines_per_s_;
  report::Report* report_;
  emit::Emitter emitter_;
  dynamics::NozzleXY nozzle_;    // as it really swings after what has been written
  verify::RunDeviation before_;  // of the run at hand, if it were left as it is
  verify::LineRate line_rate_;   // of what has been written
  EmissionCost cost_;
  double sliced_s_ = 0.0;   // time that what has been written took …
  double written_s_ = 0.0;  // … and takes
};

}  // namespace unflex::pipeline
