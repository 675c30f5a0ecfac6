// Reads both files side by side.
#pragma once

#include <cstddef>
#include <istream>
#include <optional>
#include <string>

#include "filament_ledger.hpp"
#include "flow_difference.hpp"
#include "line_check.hpp"
#include "nozzles.hpp"
#include "output_moves.hpp"
#include "run_check.hpp"
#include "section_paths.hpp"
#include "section_rules.hpp"
#include "tools_in_use.hpp"
#include "track.hpp"
#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/verify/line_rate.hpp"
#include "unflex/verify/reference_path.hpp"
#include "unflex/verify/step_rates.hpp"
#include "unflex/verify/verify.hpp"
#include "violations.hpp"

namespace unflex::verify {

// Tells how far the emitted file has been read.
class ReadingProgress {
 public:
  ReadingProgress(Progress& progress, std::istream& output);

  // A move has been read. Returns whether it is time to tell.
  [[nodiscard]] bool count_move();
  void tell(double bytes_read);
  [[nodiscard]] bool cancelled() const { return progress_->cancelled(); }

 private:
  Progress* progress_;
  double bytes_;  // of the file; 0: not known
  std::size_t moves_ = 0;
};

// Goes through both files section by section. `original_` is the nozzle if the sliced file were
// printed as it is, the printer's own shaper included, measured against the plan of the whole file.
// `unshaped_` is that nozzle without the shaper. `emitted_` is the nozzle of the emitted file.
class Verifier {
 public:
  // The streams, the progress and the observer must outlive the Verifier.
  Verifier(std::istream& input, const std::string& input_name, std::istream& output,
           const std::string& output_name, const Rules& rules, Progress& progress,
           const Observation& observation);

  Verifier(const Verifier&) = delete;
  Verifier& operator=(const Verifier&) = delete;

  Result<VerifyReport> verify();

 private:
  bool next_input_move(planner::PlannedMove& move);
  bool next_resting_move(planner::PlannedMove& move);
  bool next_output_move(OutputMove& move);
  bool ends_here(const planner::PlannedMove& move, const Track& file);
  void follow_tool();
  template <class Hung>
  void change_machine(const planner::PlannedMove& move, Hung& nozzles) const;
  void begin_section(bool compensated);
  void begin_paths(bool compensated);
  void play_run();
  void skip_added_barriers();
  void join_over_barrier();
  void shape_sliced();
  void shape_emitted();
  [[nodiscard]] dynamics::HotendPressure hotend() const;
  [[nodiscard]] planner::FirmwareAdvance advance_of(const Section& section) const;
  void set_pressure(Nozzles& nozzles, const Section& section) const;
  void follow_pressure(bool compensated);
  // Calls action with the nozzles on the sliced file's plan.
  template <class Action>
  void for_sliced(Action action) {
    action(original_);
    if (unshaped_) {
      action(*unshaped_);
    }
  }
  void play_run_moves(bool compensated);
  void play(const OutputMove& move);
  void end_section();
  void let_original_follow(double until_s);
  void let_kept_follow(double until_s);
  void finish_reference();
  [[nodiscard]] double filament_tolerance_mm() const;
  [[nodiscard]] double owed_filament_mm() const;
  void check_run(bool compensated);
  void check_flow();
  void check_advance(bool with_smooth_time, std::size_t line);
  bool sections_agree();
  void check_regime(const Section& input, const Section& output);
  void play_kept_line();
  void hold();
  void compare_lines(bool complete);
  [[nodiscard]] VerifyReport report();

  Rules rules_;  // nozzle and change are those of the tool in use
  ToolsInUse tools_;
  ReadingProgress progress_;
  Observer* observer_;
  Violations violations_;
  Track input_;
  Track output_;
  LineCheck lines_;
  SectionPaths paths_;
  OutputFilament output_filament_;
  Nozzles original_;
  std::optional<Nozzles> unshaped_;  // from the first motion on that a shaper changes
  // The nozzle if the sliced moves of a compensated run were kept. It starts from the state of
  // emitted_ and is measured against the plan of the run by itself.
  Meter kept_;
  Nozzles emitted_;
  FilamentLedger filament_;
  FlowDifferenceGauge flow_difference_;  // of compensated runs in the timing as sliced
  StepGauge run_steps_;                  // of the compensated run
  BaseCheck base_;
  SectionRules rules_of_run_;
  LineRate rate_;
  double since_kept_motion_s_ = 0.0;
  bool laying_checked_ = false;   // the section lays filament outside of a run, which was checked
  std::optional<Error> failure_;  // an endless move
  VerifyReport totals_;
};

}  // namespace unflex::verify
