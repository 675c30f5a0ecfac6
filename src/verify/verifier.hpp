// Reads both files side by side.
#pragma once

#include <cstddef>
#include <deque>
#include <istream>
#include <optional>
#include <string>

#include "filament_ledger.hpp"
#include "flow_difference.hpp"
#include "flow_gauge.hpp"
#include "line_check.hpp"
#include "nozzles.hpp"
#include "output_moves.hpp"
#include "progress_timing.hpp"
#include "replay.hpp"
#include "run_check.hpp"
#include "section_rules.hpp"
#include "time_notes.hpp"
#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/verify/line_rate.hpp"
#include "unflex/verify/reference_path.hpp"
#include "unflex/verify/step_rates.hpp"
#include "unflex/verify/verify.hpp"
#include "violations.hpp"

namespace unflex::verify {

// Goes through both files section by section. `original_` is the nozzle if the sliced file were
// printed as it is, the printer's own shaper included, measured against the plan of the whole file,
// `path_`. `unshaped_` is that nozzle without the shaper. `emitted_` is the nozzle
// of the emitted file. In compensated runs, which begin and end at rest, it is measured against the
// plan of the run by itself, `run_path_`: where the sliced file passes from one section into the
// next at speed, that plan takes some ms longer. Where the timing of a run is free, `run_path_` is
// passed as the emitted file gets on (ProgressTiming).
// How long a file's machine has stood still for lines that switch its filters.
class Switching {
 public:
  // The stop that one more such line adds. Lines in a row are one stop.
  [[nodiscard]] double stop(double switching_s) {
    const double added_s = std::max(switching_s - since_motion_s_, 0.0);
    since_motion_s_ += added_s;
    return added_s;
  }
  void move() { since_motion_s_ = 0.0; }
  // What no motion has followed yet. At the end of a file nothing waits for it.
  [[nodiscard]] double since_motion_s() const { return since_motion_s_; }

 private:
  double since_motion_s_ = 0.0;
};

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
  bool next_reference_move(ReferenceMove& move);
  bool next_kept_move(planner::PlannedMove& move);
  bool next_sliced_move(std::deque<planner::PlannedMove>& own, planner::PlannedMove& move);
  bool take_output_move(OutputMove& move);
  bool next_output_move(OutputMove& move);
  bool next_output_move_ahead(planner::PlannedMove& laid);
  bool ends_here(const planner::PlannedMove& move, const Replay& file);
  void begin_section(bool compensated);
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
  [[nodiscard]] bool has_free_timing() const { return has_free_timing_; }
  // Whether the moves of the run as sliced take other times than those the emitted run follows: its
  // timing is free, or the firmware does not carry out moves as it plans them (Marlin).
  [[nodiscard]] bool has_own_clock() const { return kept_path_ == &resting_path_; }
  void let_original_follow_moves();
  [[nodiscard]] double end_of_passed_s(ReferencePath& path, std::size_t first) const;
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
  void report_progress();
  [[nodiscard]] VerifyReport report();

  Rules rules_;
  Progress* progress_;
  Observer* observer_;
  double output_bytes_;
  Violations violations_;
  Replay input_;
  Replay output_;
  LineCheck lines_;
  TimeNotes input_notes_;
  TimeNotes output_notes_;
  ReferencePath path_;
  ReferencePath run_path_;
  // In runs with a clock of their own: the plan of the run as sliced.
  ReferencePath resting_path_;
  double run_lead_in_s_ = 0.0;             // how long before run_path_ the emitted run starts
  ReferencePath* emitted_path_ = &path_;   // what emitted_ is measured against
  ReferencePath* kept_path_ = &run_path_;  // what kept_ is measured against
  bool has_free_timing_ = false;           // the present run, or the last one
  // Where the timing is free, the sliced moves come at the pace of the emitted ones. Both are read
  // ahead, and each sliced move is asked for by two paths.
  ProgressTiming progress_timing_;
  std::deque<OutputMove> output_ahead_;
  std::deque<planner::PlannedMove> sliced_for_timing_;
  std::deque<planner::PlannedMove> sliced_for_kept_;
  OutputFilament output_filament_;
  double run_pushed_mm_ = 0.0;   // filament that the run's moves push
  bool laying_checked_ = false;  // the section lays filament outside of a run, which was checked
  Nozzles original_;
  std::optional<Nozzles> unshaped_;  // from the first motion on that a shaper changes
  // The nozzle if the sliced moves of a compensated run were kept. It starts from the state of
  // emitted_ and is measured against the plan of the run by itself.
  Meter kept_;
  Nozzles emitted_;
  gcode::Shaper original_shaper_;  // shaper that acts on original_
  gcode::Shaper emitted_shaper_;   // shaper that acts on emitted_
  Switching input_switching_;
  Switching output_switching_;
  FilamentLedger filament_;
  FlowGauge input_flow_;
  FlowGauge output_flow_;
  FlowDifferenceGauge flow_difference_;  // of compensated runs in the timing as sliced
  StepGauge input_steps_;
  StepGauge output_steps_;
  StepGauge run_steps_;  // of the compensated run
  BaseCheck base_;
  SectionRules rules_of_run_;
  Excursion input_excursion_;
  Excursion output_excursion_;
  bool too_much_in_input_ = false;  // a sliced move of the section has too much filament
  std::size_t too_much_line_ = 0;   // first line of the output that has too much; 0: none
  LineRate rate_;
  double max_lines_per_s_ = 0.0;
  double since_kept_motion_s_ = 0.0;
  std::optional<Error> failure_;   // an endless move
  std::size_t section_first_ = 0;  // first piece of the path in this section
  std::size_t original_next_ = 0;  // piece that original_ plays next
  std::size_t kept_next_ = 0;      // piece of kept_path_ that kept_ plays next
  std::size_t kept_first_ = 0;     // the first of them in this section
  std::size_t run_first_ = 0;      // first piece of run_path_ in this section
  std::size_t run_next_ = 0;       // first piece of run_path_ that emitted_ has not passed
  std::size_t moves_ = 0;
  VerifyReport totals_;
};

}  // namespace unflex::verify
