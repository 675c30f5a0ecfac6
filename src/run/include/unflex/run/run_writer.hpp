// Writes runs and the lines between them in the order of the input, and makes sure that
// compensation makes no run worse.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/emit/emitter.hpp"
#include "unflex/report/report.hpp"
#include "unflex/run/extruded_path.hpp"
#include "unflex/run/nozzle_motion.hpp"
#include "unflex/run/path_error.hpp"
#include "unflex/run/run_job.hpp"
#include "unflex/run/run_tries.hpp"
#include "unflex/verify/line_rate.hpp"

namespace unflex::run {

class RunWriter {
 public:
  // rules: of the file; each run has its own. The report must outlive the writer. input_name: for
  // messages. max_lines_per_s: the budget.
  RunWriter(const RunRules& rules, std::string input_name, double max_lines_per_s,
            report::Report& report);

  // The result for a piece: its text, or a try that has to be made with the run first.
  using Written = std::variant<std::string, Try>;

  // The piece must be lined. `tried` is the run of the try that was asked for last, lined, too. An
  // error if parts of a run have been written and the next one cannot be.
  [[nodiscard]] Result<Written> write(const RunJob& job, const RunJob* tried = nullptr);
  // What follows the last piece.
  [[nodiscard]] std::string finish();

  // The run in which a part could not be written, if there is one so far.
  [[nodiscard]] const std::optional<verify::BlamedRun>& blocked() const { return blocked_; }

  // The duration of what has been written, relative to its duration as sliced.
  [[nodiscard]] double time_factor() const {
    return sliced_s_ > 0.0 ? written_s_ / sliced_s_ : 1.0;
  }

 private:
  void keep_motion(const Piece& piece);
  void note_lines_above_budget(const Piece& piece);
  [[nodiscard]] emit::RunPlan plan(const RunJob& job, double tolerance_share,
                                   double limits_share) const;
  [[nodiscard]] emit::RunPlan in_time(const RunJob& job) const;
  [[nodiscard]] std::optional<gcode::Segment> kept_before(const RunJob& job) const;
  [[nodiscard]] bool fits(const RunJob& job) const;
  void begin(const RunJob& job);
  std::string keep_lines(const Piece& piece);
  Result<std::string> write_as_sliced(const RunJob& job, std::string failure);
  void note_timing(const RunJob& job);
  std::optional<std::string> write_present(const RunJob& job, const RunJob* tried,
                                           std::string& text);
  std::optional<Try> next_try(const RunJob& job, std::string& objection);
  std::optional<std::string> write_run(const RunJob& job, std::string& text);
  std::optional<std::string> insist(const RunJob& job, std::string& text);
  std::optional<std::string> try_run(const RunJob& job, const emit::RunPlan& plan,
                                     bool may_be_worse, std::string& text);
  // Notes that the timing of the run is not the optimal one, or that it is the slicer's.
  void note_scaled(const RunJob& job, std::string reason);
  void note_slow(const RunJob& job, std::string reason);
  static void note_stretch(const RunJob& job, std::string reason, std::size_t& count,
                           std::vector<report::Fallback>& list);
  void note_fallback(const RunJob& job, std::string reason);

  bool is_robust_;  // the base is to suit more models than one
  std::string input_name_;
  double max_lines_per_s_;
  report::Report* report_;
  emit::Emitter emitter_;
  // The last lines that were kept, if the printer passes from them into what follows.
  std::vector<gcode::Segment> kept_lines_;
  std::optional<gcode::Position> machine_mm_;  // end of the last move that the firmware made
  NozzleFollower nozzle_;                      // true nozzle after what has been written
  dynamics::NozzleXY run_nozzle_;              // true nozzle where the run or part at hand begins
  double switching_s_ = 0.0;                   // how long the run waits for the shaper to be off
  verify::RunDeviation before_;                // deviation of the run at hand if it were kept
  verify::LineRate line_rate_;                 // rate of the lines that have been written
  std::vector<gcode::Segment> last_lines_;     // last lines of the previous part of the run
  double late_s_ = 0.0;                        // how late the previous part ended
  std::optional<Tries> tries_;                 // of the run at hand, once it cannot be written
  bool run_stands_ = false;                    // the first part of the run at hand was kept
  std::size_t run_line_ = 0;                   // first line of the run at hand
  std::optional<verify::BlamedRun> blocked_;
  ExtrudedPath path_;
  PathError emission_;
  PathError robust_;
  PathError nominal_;
  double sliced_s_ = 0.0;   // sliced duration of what has been written
  double written_s_ = 0.0;  // true duration of what has been written
};

}  // namespace unflex::run
