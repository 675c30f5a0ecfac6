#include "compensate_pass.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "band_gain.hpp"
#include "gap_check.hpp"
#include "input_bytes.hpp"
#include "layer_times.hpp"
#include "nozzle_motion.hpp"
#include "piece_thread.hpp"
#include "report_rows.hpp"
#include "retime.hpp"
#include "rewrite_lines.hpp"
#include "run_progress.hpp"
#include "run_writer.hpp"
#include "stage_options.hpp"
#include "task_pool.hpp"
#include "unflex/core/threads.hpp"
#include "verify_thread.hpp"

namespace unflex::pipeline {
namespace {

// Per worker: nodes of runs that may be read and not yet written, and windows that solver processes
// are given ahead.
constexpr std::size_t kNodesAhead = 30'000;
constexpr std::size_t kWindowsAhead = 24;
// At most so many lines may wait in the queue. It bounds memory where moves are tiny.
constexpr std::size_t kLinesAhead = 200'000;
// Windows built at once.
constexpr std::size_t kWindowsAtOnce = 8;
// The trajectory of a run or part is held as a whole, 48 bytes per node. A run or part with more
// nodes is kept. Only a single move can make a part so long.
constexpr std::size_t kMaxRunNodes = 8'000'000;
// A plan may come out above a limit by rounding.
constexpr double kRounding = 1.0 + 1e-6;
constexpr std::chrono::milliseconds kPatience{100};
constexpr std::chrono::milliseconds kShortPatience{2};

double largest_motor_accel(const std::vector<planner::PlannedMove>& moves, const Motors& motors) {
  double largest = 0.0;
  for (const planner::PlannedMove& move : moves) {
    if (move.accel_s + move.decel_s > 0.0) {
      largest =
          std::max(largest, move.accel_mm_s2 * motors.largest_of_xy(move.direction[gcode::X],
                                                                    move.direction[gcode::Y],
                                                                    move.direction[gcode::Z]));
    }
  }
  return largest;
}

std::string text_of(const Piece& piece) {
  std::string text;
  for (const gcode::Event& event : piece.events) {
    if (!event.added) {
      text += event.line.text;
    }
  }
  return text;
}

std::size_t bytes_of(const Piece& piece) {
  std::size_t bytes = 0;
  for (const gcode::Event& event : piece.events) {
    bytes += event.added ? 0 : event.line.text.size();
  }
  return bytes;
}

machine::Settings as_sliced(machine::Settings settings) {
  settings.timing.tolerance_um = 0.0;
  return settings;
}

// A stream cannot be written again with a run kept, and no pass follows the last one. There a run
// may be worse by more before it counts as a violation.
verify::Rules rules_of_pass(const Job& job, bool last) {
  verify::Rules rules = verify_rules(job.settings);
  if (job.output_stream || last) {
    rules.leeway = {2.2, 5e-3, 30e-3, rules.leeway.chance_mm};
  }
  return rules;
}

// Reads pieces, has runs worked on, and writes them in order. All happens in the calling thread,
// except what the pools and the other threads do.
class Compensator {
 public:
  Compensator(const Job& job, const Engines& engines, const std::vector<verify::BlamedRun>& kept,
              const PassStreams& streams, Progress& progress, report::Report& report)
      : job_(job),
        kept_(kept),
        checks_(engines.threaded && engines.second),
        rules_{compensate_setup(job.settings), compensate_setup(as_sliced(job.settings)),
               emit_options(job.settings, UNFLEX_VERSION), rules_of_pass(job, streams.last)},
        processes_(&streams.processes),
        output_(&streams.output),
        progress_(&progress),
        slots_(&streams.slots),
        report_(&report),
        writer_(rules_, job.input_name, job.settings.max_lines_per_s(), report),
        nozzle_(rules_.verify.nozzle, rules_.verify.fixed,
                gcode::Interpreter(rules_.emit.interpreter).state().input_shaper()),
        band_gain_(job_.settings),
        layers_(job.settings.is_timing_free() ? job.settings.timing.min_layer_s : 0.0),
        input_bytes_(input_bytes(job)),
        engine_(engines.threaded ? engines.threaded() : nullptr),
        pieces_(
            streams.input, job.input_name, rules_.verify, streams.slots, [this] { wake(); },
            streams.stop_input),
        recorder_(recorder_for(job, rules_.verify)),
        verifier_(rules_.verify, observation_of(*recorder_, rules_.verify), job.input_name,
                  job.output_name, streams.slots),
        pool_(std::max(job.workers, 1U), streams.slots) {}

  PassOutcome work() {
    PassOutcome outcome;
    outcome.status = go_through();
    if (writer_.blocked()) {
      blamed_.push_back(*writer_.blocked());
    }
    outcome.blamed = std::move(blamed_);
    outcome.time_notes = std::move(time_notes_);
    return outcome;
  }

 private:
  Status go_through() {
    const CpuSlot slot(*slots_);
    while (!is_done()) {
      feed();
      while (can_write()) {
        if (Status status = write(*queue_.front()); !status) {
          return status;
        }
        queue_.pop_front();
        tell_progress();
      }
      tell_progress();
      if (progress_->cancelled()) {
        return fail(ErrorKind::internal, "cancelled");
      }
      if (!*output_) {
        return output_failed(job_.output_name);
      }
      // Once all is written there is nothing to wait for.
      if (!is_done() && !(has_room() && take_piece())) {
        wait();
      }
    }
    if (progress_->cancelled()) {
      // A cancelled stream ends early, so perhaps not all of the print was read.
      return fail(ErrorKind::internal, "cancelled");
    }
    if (pieces_.error()) {
      return tl::unexpected(*pieces_.error());
    }
    put({}, writer_.finish());
    report_->free_timing.narrower = band_gain_.result();
    for (const Diagnostic& warning : pieces_.warnings()) {
      report_->warnings.push_back(to_string(warning));
    }
    verifier_.end();
    return check_engine().and_then([&] { return finish_verification(); });
  }

  void wake() {
    const Lock lock(mutex_);
    news_.notify_one();
  }

  [[nodiscard]] bool is_done() const { return all_read_ && queue_.empty(); }

  // Whether more should be read. If only one run waits, there is always room: what follows it must
  // be known, however long the run is. So it must where a layer may be too short.
  [[nodiscard]] bool has_room() {
    const bool is_little =
        nodes_queued_ <= kNodesAhead * std::max(job_.workers, 1U) && lines_queued_ <= kLinesAhead;
    return (is_little || queue_.size() <= 1 || layers_.needs_more()) && !verifier_.is_behind();
  }

  // Takes the next piece, or notes the end of the input. False if neither has come.
  bool take_piece() {
    if (std::unique_ptr<Piece> piece = pieces_.take()) {
      auto job = std::make_shared<RunJob>();
      job->piece = std::move(*piece);
      admit(std::move(job));
      return true;
    }
    if (!all_read_ && pieces_.at_end()) {
      all_read_ = true;
      layers_.end();
      return true;
    }
    return false;
  }

  // Prepares the work on the piece and queues it.
  void admit(std::shared_ptr<RunJob> job) {
    const Piece& piece = job->piece;
    if (piece.is_run) {
      report_->runs_total += piece.begins_run() ? 1 : 0;
      static_cast<void>(nozzle_.begin_run(piece));
      job->nozzle = nozzle_.nozzle();
      const planner::PlannedMove& last = piece.moves.back();
      nozzle_.set(piece.ends_run() ? at_rest(last.segment.end_mm, rules_.verify.nozzle)
                                   : at_end_of(last, rules_.verify.nozzle),
                  last.segment.end_mm);
      RunSetup setup = setup_for(rules_.setup, piece, job->nozzle, job_.settings);
      warn_if_capped(setup, piece);
      job->setup = std::move(setup.setup);
      job->accel = setup.accel;
      job->first_stage = first_stage(*job, rules_.verify.nozzle);
      job->grid = compensate::node_grid(job->course(), job->setup);
      const std::size_t nodes = job->grid.count;
      job->is_timed = true;
      const double accel = largest_motor_accel(piece.moves, rules_.verify.fixed.motors());
      const std::vector<std::string> reasons = blamed_before(piece);
      // A run of free timing gets another chance in the timing as sliced.
      const std::size_t chances = job_.settings.is_timing_free() ? 2 : 1;
      if (reasons.size() >= chances) {
        job->failure = reasons.back();
      } else if (piece.cut_off) {
        job->failure = "too many lines without motion stand in a row in the middle of the motion";
      } else if (accel > kRounding * job_.settings.base_max_accel_mm_s2(setup.asked_accel_mm_s2)) {
        job->failure = fmt::format(
            "the plan itself accelerates a motor by {:.0f} mm/s², more than base.max_accel_mm_s2, "
            "{:.0f}; raise that if the motors can",
            accel, job_.settings.base_max_accel_mm_s2(setup.asked_accel_mm_s2));
      } else if (nodes <= kMaxRunNodes) {
        job->is_timed = !job_.settings.is_timing_free();
        if (job_.settings.is_timing_free() && piece.begins_run() && piece.ends_run()) {
          job->sliced_setup =
              setup_for(rules_.sliced_setup, piece, job->nozzle, job_.settings).setup;
        }
        if (!reasons.empty()) {
          keep_timing(*job, reasons.back());
        }
      } else {
        job->failure = fmt::format("{:.0f} s of motion without a stop are too long to be handled",
                                   static_cast<double>(nodes) * job->setup.period_s);
      }
      job->prepared = !job->failure.empty();
      job->queued_nodes = job->prepared ? 0 : nodes;
      nodes_queued_ += job->queued_nodes;
      if (!job->prepared && job->is_timed) {
        lay_out(job);
      } else if (!job->prepared) {
        time_in_thread(job);
      }
    } else {
      static_cast<void>(nozzle_.follow(piece));
      for (const gcode::Event& event : piece.events) {
        count_kept_moves(event, rules_.verify.fixed.firmware, report_->kept_moves);
      }
      job->prepared = true;
    }
    if (!queue_.empty() && rules_.emit.lines.burst_lines > 0) {
      // If lines are counted, those of a run must leave room for the lines that follow. If they are
      // not counted, the run is being worked on already and must not be changed.
      queue_.back()->lines_after = verify::LineRate::first_lines(piece.moves);
    }
    layers_.add(job);
    lines_queued_ += job->piece.events.size();
    job->bytes = bytes_of(job->piece);
    queue_.push_back(std::move(job));
  }

  // The timing of a run is known, so its windows are.
  void lay_out(const std::shared_ptr<RunJob>& job) {
    pipeline::lay_out(*job);
    report_->windows_total += compensate::windows_to_solve(job->spans);
    if (checks_) {
      gaps_.choose(*job);
    }
    choose_comparison(*job);
  }

  // A base for the nominal axes alone is found for an eighth of the print, or its beginning: it
  // takes as long as the other one, and only shows what suiting a band costs.
  void choose_comparison(RunJob& job) {
    constexpr double kShare = 8.0;
    constexpr double kAlways_s = 120.0;
    const double duration_s = planner::duration_s(job.reference());
    job.compares_nominal = job.setup.is_robust() &&
                           compared_s_ + duration_s <= std::max(laid_out_s_ / kShare, kAlways_s);
    laid_out_s_ += duration_s;
    compared_s_ += job.compares_nominal ? duration_s : 0.0;
  }

  void time_in_thread(const std::shared_ptr<RunJob>& job) {
    job->bounds = move_bounds(job->piece, job_.settings);
    job->extruder = extruder_of(job->piece, rules_.emit, job_.settings.timing);
    band_gain_.choose(*job);
    pool_.submit([this, job] {
      choose_timing(*job, {job_.settings.timing.is_optimal(), timer_.get()});
      wake();
    });
  }

  // Tells once that the base cannot follow what the print asks as well as the motors could.
  void warn_if_capped(const RunSetup& setup, const Piece& piece) {
    // Below this many times the plan's acceleration the error grows.
    constexpr double kEnough = 2.0;
    const double wanted_mm_s2 =
        std::min(kEnough * setup.asked_accel_mm_s2,
                 job_.settings.base_max_accel_mm_s2(setup.asked_accel_mm_s2));
    if (told_of_cap_ || wanted_mm_s2 <= setup.accel_by_lines_mm_s2) {
      return;
    }
    told_of_cap_ = true;
    report_->warnings.push_back(to_string(Diagnostic{
        {job_.input_name, piece.events.front().line.number},
        fmt::format("the print asks for {:.0f} mm/s² here, and emit.max_speed_step_mm_s and "
                    "emit.max_lines_per_s allow the motors no more than {:.0f}; raise the first "
                    "if the motors can do more",
                    setup.asked_accel_mm_s2, setup.accel_by_lines_mm_s2)}));
  }

  // What earlier passes blamed the run for.
  [[nodiscard]] std::vector<std::string> blamed_before(const Piece& piece) const {
    const std::size_t first = piece.moves.front().segment.line;
    const std::size_t last = piece.moves.back().segment.line;
    std::vector<std::string> reasons;
    for (const verify::BlamedRun& run : kept_) {
      if (run.first_line <= last && first <= run.last_line) {
        reasons.push_back(run.reason);
      }
    }
    return reasons;
  }

  // Gives the solvers what they can take, in the order of the file.
  void feed() {
    layers_.settle();
    for (std::size_t piece = 0; piece < queue_.size(); ++piece) {
      // If lines are counted, the last run in the queue waits until what follows is known.
      if (!all_read_ && piece + 1 == queue_.size() && rules_.emit.lines.burst_lines > 0) {
        return;
      }
      RunJob& job = *queue_[piece];
      if (!job.prepared && (!job.is_timed || !job.stretch)) {
        return;
      }
      if (!job.is_laid_out && !job.prepared) {
        stretch(job);
        lay_out(queue_[piece]);
        if (job.has_base()) {
          make_lines_in_thread(queue_[piece]);
        }
      }
      while (job.submitted < job.spans.size()) {
        const std::size_t count = std::min(kWindowsAtOnce, job.spans.size() - job.submitted);
        if (engine_) {
          solve_in_thread(queue_[piece], job.submitted, count);
        } else if (processes_->under_way() < kWindowsAhead * std::max(job_.workers, 1U)) {
          solve_in_process(queue_[piece], job.submitted, count);
        } else {
          return;
        }
        job.submitted += count;
      }
    }
  }

  void solve_in_thread(const std::shared_ptr<RunJob>& job, std::size_t first, std::size_t count) {
    pool_.submit([this, job, first, count] {
      solve_windows(*job, first, count, *engine_);
      if (job->missing.fetch_sub(2 * count) == 2 * count) {
        make_lines(*job, rules_);
        wake();
      }
    });
  }

  void solve_in_process(const std::shared_ptr<RunJob>& job, std::size_t first, std::size_t count) {
    std::vector<compensate::RunWindow> windows = windows_of(*job, first, count);
    for (std::size_t i = 0; i < count; ++i) {
      compensate::prepare(*divider_, job->spans[first + i], windows[i]);
      for (std::size_t axis = 0; axis < 2; ++axis) {
        tickets_.push_back({job, first + i, axis});
        const compensate::AxisWindow& window = axis == 0 ? windows[i].x : windows[i].y;
        if (job->spans[first + i].cruise) {
          // A cruise is never a run's last window. So `missing` gets to 0 only in place(), which
          // then prepares the run.
          job->results[first + i][axis] = axis_result(compensate::along(window));
          --job->missing;
        } else {
          processes_->submit(first_ticket_ + tickets_.size() - 1, window);
        }
      }
    }
  }

  // Waits for something to do.
  void wait() {
    if (processes_->under_way() > 0) {
      const CpuSlot::Without without(*slots_);
      if (std::optional<WorkerPool::Done> done = processes_->take(kShortPatience.count())) {
        place(std::move(*done));
      }
      return;
    }
    const CpuSlot::Without without(*slots_);
    Lock lock(mutex_);
    // The verifier does not tell when it has caught up, so look again soon.
    news_.wait_for(lock, verifier_.is_behind() ? kShortPatience : kPatience, [this] {
      return can_write() || can_feed() || (has_room() && !all_read_ && pieces_.has_news());
    });
  }

  // Whether the first piece can be written. If lines are counted, what follows must be known.
  [[nodiscard]] bool can_write() const {
    return !queue_.empty() && queue_.front()->prepared &&
           (queue_.size() > 1 || all_read_ || rules_.emit.lines.burst_lines == 0);
  }

  // Whether the timing of a run is known whose windows are not laid out yet.
  [[nodiscard]] bool can_feed() const {
    for (const std::shared_ptr<RunJob>& job : queue_) {
      if (!job->prepared && !job->is_laid_out) {
        return job->is_timed && (job->stretch || layers_.can_settle());
      }
    }
    return false;
  }

  void place(WorkerPool::Done done) {
    const Ticket& ticket = tickets_[done.ticket - first_ticket_];
    RunJob& job = *ticket.job;
    job.results[ticket.window][ticket.axis] = axis_result(std::move(done.solution));
    if (--job.missing == 0) {
      make_lines_in_thread(ticket.job);
    }
  }

  void make_lines_in_thread(const std::shared_ptr<RunJob>& job) {
    pool_.submit([this, job] {
      make_lines(*job, rules_);
      wake();
    });
  }

  Status write(RunJob& job) {
    Result<std::string> text = writer_.write(job);
    if (!text) {
      return tl::unexpected(text.error());
    }
    put(text_of(job.piece), std::move(*text));
    if (job.piece.is_run) {
      band_gain_.add(job);
    }
    report_->solver_iterations += job.iterations;
    nodes_queued_ -= job.queued_nodes;
    lines_queued_ -= job.piece.events.size();
    gaps_.take(job);
    if (!engine_) {
      const std::size_t tickets = 2 * job.spans.size();
      tickets_.erase(tickets_.begin(), tickets_.begin() + static_cast<std::ptrdiff_t>(tickets));
      first_ticket_ += tickets;
    }
    return {};
  }

  // Runs that are being worked on count for what is done of them.
  void tell_progress() {
    double done_bytes = static_cast<double>(bytes_written_);
    for (const std::shared_ptr<RunJob>& job : queue_) {
      done_bytes += share_done(*job) * static_cast<double>(job->bytes);
    }
    done_bytes = most_done_bytes_ = std::max(most_done_bytes_, done_bytes);
    progress_->update("compensating", share_of_input(done_bytes, input_bytes_));
  }

  void put(std::string input, std::string output) {
    bytes_written_ += input.size();
    if (job_.output_stream) {
      // A stream cannot be corrected at its end, so its durations are scaled by the factor so far.
      output = scaled_lines(output, writer_.time_factor());
    }
    *output_ << output;
    verifier_.push(std::move(input), std::move(output));
  }

  // Has the probes solved by the second engine.
  Status check_engine() {
    for (std::size_t i = 0; i < gaps_.probes().size(); ++i) {
      // Probes of runs that failed have no solution.
      if (!gaps_.probes()[i].solution.base.position_mm.empty()) {
        processes_->submit(i, gaps_.probes()[i].problem);
      }
    }
    const CpuSlot::Without without(*slots_);
    while (processes_->under_way() > 0) {
      if (std::optional<WorkerPool::Done> done =
              processes_->take(static_cast<int>(kPatience.count()))) {
        if (done->solution) {
          GapCheck::compare(gaps_.probes()[done->ticket], *done->solution, report_->solver_check);
        }
      }
      if (progress_->cancelled()) {
        return fail(ErrorKind::internal, "cancelled");
      }
    }
    return {};
  }

  Status finish_verification() {
    const CpuSlot::Without without(*slots_);
    Result<verify::VerifyReport> verified = verifier_.result();
    if (!verified) {
      return tl::unexpected(verified.error());
    }
    add_verification(*verified, *recorder_, *report_);
    blamed_ = std::move(verified->blamed_runs);
    time_notes_ = std::move(verified->time_notes);
    for (verify::BlamedRun& run : blamed_) {
      run.reason = fmt::format("when it was verified: {}", run.reason);
    }
    return {};
  }

  // The solution that a number given to the processes stands for.
  struct Ticket {
    std::shared_ptr<RunJob> job;
    std::size_t window;
    std::size_t axis;
  };

  const Job& job_;
  const std::vector<verify::BlamedRun>& kept_;
  std::vector<verify::BlamedRun> blamed_;
  std::vector<verify::TimeNote> time_notes_;
  bool checks_;
  RunRules rules_;
  WorkerPool* processes_;
  std::ostream* output_;
  Progress* progress_;
  CpuSlots* slots_;
  report::Report* report_;
  RunWriter writer_;
  GapCheck gaps_;
  double laid_out_s_ = 0.0;  // how long all runs so far take
  double compared_s_ = 0.0;  // and those that compare the nominal base
  // The nozzle after the last piece read, as if every run so far were compensated. Kept motion
  // leaves a swing, with which the next run starts.
  NozzleFollower nozzle_;
  BandGain band_gain_;
  LayerTimes layers_;
  std::deque<std::shared_ptr<RunJob>> queue_;
  std::size_t nodes_queued_ = 0;
  std::size_t lines_queued_ = 0;
  std::deque<Ticket> tickets_;     // for the windows in queue_
  std::size_t first_ticket_ = 0;   // number of the first ticket in tickets_
  double input_bytes_;             // 0: not known
  std::size_t bytes_written_ = 0;  // of the input
  double most_done_bytes_ = 0.0;   // with what is done of the runs in the queue
  bool told_of_cap_ = false;
  bool all_read_ = false;
  Mutex mutex_;
  Condition news_;                              // a piece has been read or a run been prepared
  std::unique_ptr<compensate::Engine> engine_;  // used in threads; null: the processes solve
  std::unique_ptr<compensate::Engine> divider_ =
      compensate::make_banded_engine();  // for solve_in_process()
  // For TimingChoice.
  std::unique_ptr<compensate::Engine> timer_ = compensate::make_rough_engine();
  // Last, so that threads end before what they use.
  PieceThread pieces_;
  std::unique_ptr<record::Recorder> recorder_;
  VerifyThread verifier_;
  TaskPool pool_;
};

}  // namespace

PassOutcome compensate_pass(const Job& job, const Engines& engines,
                            const std::vector<verify::BlamedRun>& kept, const PassStreams& streams,
                            Progress& progress, report::Report& report) {
  return Compensator(job, engines, kept, streams, progress, report).work();
}

}  // namespace unflex::pipeline
