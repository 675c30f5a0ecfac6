// Writes runs and the lines between them in the order of the input, and watches that no run gets
// worse by it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "emission_cost.hpp"
#include "extruded_path.hpp"
#include "nozzle_motion.hpp"
#include "run_job.hpp"
#include "unflex/core/error.hpp"
#include "unflex/emit/emitter.hpp"
#include "unflex/report/report.hpp"
#include "unflex/verify/line_rate.hpp"

namespace unflex::pipeline {

class RunWriter {
 public:
  // Rules and report must outlive the writer. input_name: in errors. max_lines_per_s: the budget.
  RunWriter(const RunRules& rules, std::string input_name, double max_lines_per_s,
            report::Report& report);

  // The piece as text. Of a run, make_lines() has been called. An error where a run of which parts
  // have been written cannot go on.
  [[nodiscard]] Result<std::string> write(const RunJob& job);
  // What follows the last piece.
  [[nodiscard]] std::string finish();

  // The run whose parts could not be gone on with, so far.
  [[nodiscard]] const std::optional<verify::BlamedRun>& blocked() const { return blocked_; }

  // How much longer what has been written takes than it would have.
  [[nodiscard]] double time_factor() const {
    return sliced_s_ > 0.0 ? written_s_ / sliced_s_ : 1.0;
  }

 private:
  void keep_motion(const Piece& piece);
  void note_lines_above_budget(const Piece& piece);
  [[nodiscard]] emit::RunPlan plan(const RunJob& job, double tolerance_share,
                                   double limits_share) const;
  [[nodiscard]] emit::RunPlan in_time(const RunJob& job) const;
  [[nodiscard]] bool fits(const RunJob& job) const;
  std::optional<std::string> write_run(const RunJob& job, std::string& text);
  std::optional<std::string> insist(const RunJob& job, std::string& text);
  std::optional<std::string> try_run(const RunJob& job, const emit::RunPlan& plan,
                                     bool may_be_worse, std::string& text);
  void note_fallback(const RunJob& job, std::string reason);

  const RunRules* rules_;
  std::string input_name_;
  double max_lines_per_s_;
  report::Report* report_;
  emit::Emitter emitter_;
  // The last lines that were kept, where the printer passes from them into what follows.
  std::vector<gcode::Segment> kept_lines_;
  std::optional<gcode::Position> machine_mm_;  // where the last move led that the firmware made
  NozzleFollower nozzle_;                      // as it really swings after what has been written
  dynamics::NozzleXY run_nozzle_;              // … and where the run or part at hand begins
  double switching_s_ = 0.0;                   // how long that run waits for the shaper to be off
  verify::RunDeviation before_;                // of the run at hand, if it were left as it is
  verify::LineRate line_rate_;                 // of what has been written
  std::vector<gcode::Segment> last_lines_;     // of the part before, of a run in parts
  double late_s_ = 0.0;                        // by how much it ended late
  bool run_stands_ = false;                    // the first part of the run at hand stands as it is
  std::size_t run_line_ = 0;                   // where it begins
  std::optional<verify::BlamedRun> blocked_;
  ExtrudedPath path_;
  EmissionCost cost_;
  PathError robust_;
  PathError nominal_;
  double sliced_s_ = 0.0;   // time that what has been written took …
  double written_s_ = 0.0;  // … and takes
};

}  // namespace unflex::pipeline
