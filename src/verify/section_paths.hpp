// The paths that the nozzles of a section are measured against.
//
// The sliced file's plan goes through the whole file. A compensated run begins and ends at rest, so
// it is measured against its own plan: where the sliced file passes from one section into the next
// at speed, that plan takes some ms longer. Where the sliced moves of the run take other times than
// the emitted ones, they have a third path, on a clock of their own.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <optional>

#include "output_moves.hpp"
#include "progress_timing.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

// How long a section's emitted moves take, compared with its sliced moves.
enum class Timing {
  kept,       // no compensated run: both files have the same moves
  planned,    // the run lasts as long as the sliced moves do
  unplanned,  // the run lasts as long as planned; Marlin plays the sliced moves in other times
  free,       // the run lasts longer or shorter; the reference moves on as the emitted file does
};

class SectionPaths {
 public:
  // Each hands out the next move of the present section; false at its end.
  struct Sources {
    std::function<bool(planner::PlannedMove&)> sliced;   // as the sliced file is carried out
    std::function<bool(planner::PlannedMove&)> resting;  // the same, planned run by run
    std::function<bool(OutputMove&)> output;             // of the emitted file
    // Is told each move of the path of a run that is not free.
    std::function<void(const planner::PlannedMove&)> on_planned;
  };

  explicit SectionPaths(Sources sources);

  SectionPaths(const SectionPaths&) = delete;
  SectionPaths& operator=(const SectionPaths&) = delete;

  // A section begins that is no run.
  void begin_kept();
  // A run begins. Its base begins lead_in_s before its plan. owed_mm: how much the filament of a
  // free run may be off in the end.
  void begin_run(Timing timing, double lead_in_s, double owed_mm);

  [[nodiscard]] bool is_run() const { return timing_ != Timing::kept; }
  [[nodiscard]] bool is_free() const { return timing_ == Timing::free; }
  // Whether the sliced moves of the run have a clock of their own.
  [[nodiscard]] bool has_own_clock() const { return is_free() || timing_ == Timing::unplanned; }

  // How long before the first kept move the emitted run begins, on kept().
  [[nodiscard]] double kept_lead_in_s() const { return has_own_clock() ? 0.0 : lead_in_s_; }

  // The plan of the whole sliced file.
  [[nodiscard]] ReferencePath& sliced() { return sliced_; }
  // The path that the emitted file's nozzle is measured against.
  [[nodiscard]] ReferencePath& emitted() { return is_run() ? run_ : sliced_; }
  // The path of the nozzle that would follow the run's sliced moves.
  [[nodiscard]] ReferencePath& kept() { return has_own_clock() ? resting_ : run_; }

  // The next move of the emitted file; false at the section's end.
  bool next_output(OutputMove& move);
  // The next move of sliced() or kept() that ends by this time and has not been handed out.
  [[nodiscard]] std::optional<planner::PlannedMove> next_sliced(double until_s) {
    return next(sliced_, sliced_at_, until_s);
  }
  [[nodiscard]] std::optional<planner::PlannedMove> next_kept(double until_s) {
    return next(kept(), kept_at_, until_s);
  }
  // The emitted nozzle has come to emitted_s. Returns how far the sliced file's nozzle has come by
  // then: as far in its section as the emitted nozzle has in its own, or to the end of the last
  // move that the emitted nozzle has passed.
  [[nodiscard]] double sliced_until_s(double emitted_s);
  // How far the nozzle of the kept moves has come by emitted_s.
  [[nodiscard]] double kept_until_s(double emitted_s);
  // Reads all moves of kept().
  void complete_kept();
  // Whether the sliced file has any move in this section so far.
  [[nodiscard]] bool has_sliced_moves() const { return sliced_.end() > sliced_at_.first; }
  // Forgets what comes before these times on sliced(), emitted() and kept().
  void discard_before(double sliced_s, double emitted_s, double kept_s);

 private:
  // How far a reader of a path has come.
  struct Cursor {
    std::size_t first = 0;  // first piece of the section
    std::size_t next = 0;   // first piece that is not passed
  };

  static Cursor at_end(const ReferencePath& path) { return {path.end(), path.end()}; }
  static std::optional<planner::PlannedMove> next(ReferencePath& path, Cursor& at, double until_s);
  bool next_of_run(ReferenceMove& move);
  bool next_of_kept(planner::PlannedMove& move);
  bool next_resting(std::deque<planner::PlannedMove>& own, planner::PlannedMove& move);
  bool next_output_ahead(planner::PlannedMove& laid);
  void pass_until(double emitted_s);
  [[nodiscard]] double end_of_passed_s(ReferencePath& path, std::size_t first) const;

  Sources sources_;
  Timing timing_ = Timing::kept;
  double lead_in_s_ = 0.0;
  ReferencePath sliced_;
  ReferencePath run_;      // of the plan of the run by itself
  ReferencePath resting_;  // of the sliced moves of a run with a clock of their own
  Cursor sliced_at_;       // pieces that the sliced file's nozzle has played
  Cursor kept_at_;         // pieces of kept() that its nozzle has played
  Cursor run_at_;          // pieces of run_ that the emitted nozzle has passed
  // In a free run the sliced moves come at the pace of the emitted ones, so both are read ahead.
  ProgressTiming progress_timing_;
  std::deque<OutputMove> output_ahead_;
  // Each sliced move of a run with its own clock is asked for by two paths.
  std::deque<planner::PlannedMove> for_run_;
  std::deque<planner::PlannedMove> for_kept_;
};

}  // namespace unflex::verify
