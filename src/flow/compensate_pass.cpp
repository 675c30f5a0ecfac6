#include "compensate_pass.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "piece_thread.hpp"
#include "process_solver.hpp"
#include "report_rows.hpp"
#include "retime.hpp"
#include "run_queue.hpp"
#include "task_pool.hpp"
#include "unflex/core/rewrite_lines.hpp"
#include "unflex/core/threads.hpp"
#include "unflex/flow/input_bytes.hpp"
#include "unflex/run/admission.hpp"
#include "unflex/run/band_gain.hpp"
#include "unflex/run/emit_options.hpp"
#include "unflex/run/judge.hpp"
#include "unflex/run/layer_times.hpp"
#include "unflex/run/machine_model.hpp"
#include "unflex/run/move_bounds.hpp"
#include "unflex/run/nominal_sample.hpp"
#include "unflex/run/run_writer.hpp"
#include "unflex/run/setup.hpp"
#include "unflex/run/verify_rules.hpp"
#include "verify_thread.hpp"

namespace unflex::flow {
namespace {

// Per worker: windows that solver processes are given ahead.
constexpr std::size_t kWindowsAhead = 24;
// Windows built at once.
constexpr std::size_t kWindowsAtOnce = 8;
constexpr std::chrono::milliseconds kPatience{100};
constexpr std::chrono::milliseconds kShortPatience{2};

std::string text_of(const run::Piece& piece) {
  std::string text;
  for (const gcode::Event& event : piece.events) {
    if (!event.added) {
      text += event.line.text;
    }
  }
  return text;
}

machine::Settings as_sliced(machine::Settings settings) {
  settings.timing.tolerance_um = 0.0;
  return settings;
}

// A stream cannot be written again with a run kept, and no pass follows the last one. In both cases
// a run may be worse by more before it counts as a violation.
verify::Rules rules_of_pass(const Job& job, const machine::Settings& settings, bool last) {
  verify::Rules rules = run::verify_rules(settings);
  if (job.output_stream || last) {
    rules.leeway = {.times = run::kLeewayTimes,
                    .rms_mm = run::kLeewayRms_mm,
                    .max_mm = run::kLeeway_mm,
                    .chance_mm = rules.leeway.chance_mm};
  }
  return rules;
}

// The share of the input that is done.
class PassProgress {
 public:
  PassProgress(const Job& job, Progress& progress)
      : progress_(&progress), input_bytes_(input_bytes(job)) {}

  void write(std::size_t bytes) { written_bytes_ += bytes; }
  // Runs that are being worked on count with the share that is done.
  void tell(const RunQueue& queue) {
    most_bytes_ = std::max(most_bytes_, static_cast<double>(written_bytes_) + queue.done_bytes());
    progress_->update("compensating", share_of_input(most_bytes_, input_bytes_));
  }
  [[nodiscard]] bool cancelled() const { return progress_->cancelled(); }

 private:
  Progress* progress_;
  double input_bytes_;             // 0: not known
  std::size_t written_bytes_ = 0;  // of the input
  double most_bytes_ = 0.0;  // written_bytes_, and the finished share of the runs in the queue
};

// Tells a waiting thread that there is something to do.
class Bell {
 public:
  void ring() {
    const Lock lock(mutex_);
    news_.notify_one();
  }
  // Waits for news, at most for `patience`.
  template <class HasNews>
  void wait(std::chrono::milliseconds patience, HasNews has_news) {
    Lock lock(mutex_);
    news_.wait_for(lock, patience, has_news);
  }

 private:
  Mutex mutex_;
  Condition news_;
};

// Reads pieces, has runs worked on, and writes them in order. All happens in the calling thread,
// except what the pools and the other threads do.
class Compensator {
 public:
  Compensator(const Job& job, const Engines& engines, const std::vector<verify::BlamedRun>& kept,
              const PassStreams& streams, Progress& progress, report::Report& report)
      : job_(job),
        machine_(job.settings,
                 [this, last = streams.last](const machine::Settings& settings) {
                   return run::RunRules{settings, run::compensate_setup(settings),
                                        run::compensate_setup(as_sliced(settings)),
                                        run::emit_options(settings, UNFLEX_VERSION),
                                        rules_of_pass(job_, settings, last)};
                 }),
        processes_(streams.processes),
        output_(&streams.output),
        progress_(job, progress),
        slots_(&streams.slots),
        report_(&report),
        admission_(machine_, job.input_name, kept, report),
        band_gain_(job_.settings),
        layers_(job.settings.is_timing_free() ? job.settings.timing.min_layer_s : 0.0),
        queue_(job.workers, machine_.as_given().emit.lines.burst_lines > 0),
        writer_(machine_.as_given(), job.input_name, job.settings.max_lines_per_s(), report),
        engine_(engines.threaded ? engines.threaded() : nullptr),
        pieces_(
            streams.input, job.input_name, machine_.as_given().verify, streams.slots,
            [this] { bell_.ring(); }, streams.stop_input),
        recorder_(recorder_for(job, machine_.as_given().verify)),
        verifier_(machine_.as_given().verify,
                  observation_of(*recorder_, machine_.as_given().verify), job.input_name,
                  job.output_name, streams.slots),
        pool_(std::max(job.workers, 1U), streams.slots) {
    if (engines.threaded && engines.second) {
      gaps_.emplace();
    }
  }

  PassOutcome work() {
    outcome_.status = go_through();
    if (writer_.blocked()) {
      outcome_.blamed.push_back(*writer_.blocked());
    }
    return std::move(outcome_);
  }

 private:
  Status go_through() {
    const CpuSlot slot(*slots_);
    while (!queue_.is_done()) {
      feed();
      while (can_write()) {
        if (Status status = write_first(); !status) {
          return status;
        }
        progress_.tell(queue_);
      }
      progress_.tell(queue_);
      if (progress_.cancelled()) {
        return fail(ErrorKind::internal, "cancelled");
      }
      if (!*output_) {
        return output_failed(job_.output_name);
      }
      // Once all is written there is nothing to wait for.
      if (!queue_.is_done() && !(has_room() && take_piece())) {
        wait();
      }
    }
    if (progress_.cancelled()) {
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

  // Whether to read more. There is always room while a layer may be too short, since the following
  // lines must be known then.
  [[nodiscard]] bool has_room() {
    return (queue_.has_room() || layers_.needs_more()) && !verifier_.is_behind();
  }

  // Takes the next piece, or notes the end of the input. False if neither has come.
  bool take_piece() {
    if (std::unique_ptr<run::Piece> piece = pieces_.take()) {
      auto job = std::make_shared<run::RunJob>();
      job->piece = std::move(*piece);
      admission_.admit(*job);
      if (!job->has_come_to(run::Stage::timed)) {
        time_in_thread(job);
      }
      layers_.add(job);
      queue_.push(std::move(job));
      return true;
    }
    if (!queue_.is_ended() && pieces_.at_end()) {
      queue_.end();
      layers_.end();
      return true;
    }
    return false;
  }

  void time_in_thread(const std::shared_ptr<run::RunJob>& job) {
    job->search.bounds = run::move_bounds(job->piece, job_.settings);
    job->search.extruder = run::extruder_of(job->piece, job->rules->emit, job_.settings.timing);
    band_gain_.choose(*job);
    pool_.submit([this, job] {
      run::choose_timing(*job, {job_.settings.timing.is_optimal(), timer_.get()});
      bell_.ring();
    });
  }

  // Gives the solvers as many windows as they can take, in the order of the file.
  void feed() {
    layers_.settle();
    for (std::size_t piece = 0; piece < queue_.size(); ++piece) {
      RunQueue::Queued& queued = queue_[piece];
      if (!queue_.is_followed(piece)) {
        return;
      }
      if (!queued.job->has_come_to(run::Stage::laid_out)) {
        if (!queued.job->has_come_to(run::Stage::timed) || !queued.job->stretch) {
          return;
        }
        lay_out(queued.job);
      }
      if (!feed_windows(queued)) {
        return;
      }
    }
  }

  // Gives the solvers the windows of a run. Returns whether they could take all.
  bool feed_windows(RunQueue::Queued& queued) {
    const std::size_t windows = queued.job->windows.spans.size();
    while (queued.submitted < windows) {
      const std::size_t count = std::min(kWindowsAtOnce, windows - queued.submitted);
      if (engine_) {
        solve_in_thread(queued.job, queued.submitted, count);
      } else if (processes_.under_way() < kWindowsAhead * std::max(job_.workers, 1U)) {
        processes_.submit(queued.job, queued.submitted, count);
      } else {
        return false;
      }
      queued.submitted += count;
    }
    return true;
  }

  // Lays out the windows of a run whose timing is known.
  void lay_out(const std::shared_ptr<run::RunJob>& job) {
    run::stretch(*job);
    run::lay_out(*job);
    report_->runs.windows_total += compensate::windows_to_solve(job->windows.spans);
    if (gaps_) {
      gaps_->choose(*job);
    }
    nominal_sample_.choose(*job);
    if (job->has_come_to(run::Stage::solved)) {
      make_lines_in_thread(job);
    }
  }

  void solve_in_thread(const std::shared_ptr<run::RunJob>& job, std::size_t first,
                       std::size_t count) {
    pool_.submit([this, job, first, count] {
      if (run::solve_windows(*job, first, count, *engine_)) {
        run::make_lines(*job);
        bell_.ring();
      }
    });
  }

  void make_lines_in_thread(const std::shared_ptr<run::RunJob>& job) {
    pool_.submit([this, job] {
      run::make_lines(*job);
      bell_.ring();
    });
  }

  // Waits for something to do.
  void wait() {
    const CpuSlot::Without without(*slots_);
    if (processes_.under_way() > 0) {
      if (const std::shared_ptr<run::RunJob> job = processes_.take(kShortPatience.count())) {
        make_lines_in_thread(job);
      }
      return;
    }
    // The verifier does not report when it has caught up, so this looks again soon.
    bell_.wait(verifier_.is_behind() ? kShortPatience : kPatience, [this] {
      return can_write() || can_feed() || (has_room() && !queue_.is_ended() && pieces_.has_news());
    });
  }

  // Whether the first piece can be written, or judged once more.
  [[nodiscard]] bool can_write() const {
    return queue_.size() > 0 && queue_[0].job->has_come_to(run::Stage::lined) &&
           queue_.is_followed(0) && (!tried_ || tried_->has_come_to(run::Stage::lined));
  }

  // Whether the timing of a run is known whose windows are not laid out yet.
  [[nodiscard]] bool can_feed() const {
    for (std::size_t piece = 0; piece < queue_.size(); ++piece) {
      const run::RunJob& job = *queue_[piece].job;
      if (!job.has_come_to(run::Stage::laid_out)) {
        return queue_.is_followed(piece) && job.has_come_to(run::Stage::timed) &&
               (job.stretch || layers_.can_settle());
      }
    }
    return false;
  }

  // Writes the first piece, or has the next try with its run worked out.
  Status write_first() {
    run::RunJob& job = *queue_[0].job;
    Result<run::RunWriter::Written> written = writer_.write(job, tried_.get());
    if (!written) {
      return tl::unexpected(written.error());
    }
    if (const run::Try* const next = std::get_if<run::Try>(&*written)) {
      tried_ = run::once_more(job, *next);
      pool_.submit([this, run = tried_, remedy = next->remedy] {
        run::work_out(*run, remedy);
        bell_.ring();
      });
      return {};
    }
    tried_.reset();
    put(text_of(job.piece), std::get<std::string>(std::move(*written)));
    if (job.piece.is_run) {
      band_gain_.add(job);
    }
    report_->solver.iterations += job.iterations;
    if (gaps_) {
      gaps_->take(job);
    }
    if (!engine_) {
      processes_.forget(job);
    }
    queue_.pop();
    return {};
  }

  void put(std::string input, std::string output) {
    progress_.write(input.size());
    if (job_.output_stream) {
      // A stream cannot be corrected at its end, so its durations are scaled by the factor so far.
      output = scaled_lines(output, writer_.time_factor());
    }
    *output_ << output;
    verifier_.push(std::move(input), std::move(output));
  }

  // Has the probes solved by the second engine.
  Status check_engine() {
    if (!gaps_) {
      return {};
    }
    processes_.submit(*gaps_);
    const CpuSlot::Without without(*slots_);
    while (processes_.under_way() > 0) {
      processes_.take(*gaps_, static_cast<int>(kPatience.count()), report_->solver.check);
      if (progress_.cancelled()) {
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
    outcome_.blamed = std::move(verified->blamed_runs);
    outcome_.time_notes = std::move(verified->time_notes);
    for (verify::BlamedRun& run : outcome_.blamed) {
      run.reason = fmt::format("when it was verified: {}", run.reason);
    }
    return {};
  }

  const Job& job_;
  PassOutcome outcome_;
  run::MachineModel machine_;
  ProcessSolver processes_;
  std::ostream* output_;
  PassProgress progress_;
  CpuSlots* slots_;
  report::Report* report_;
  run::Admission admission_;
  run::BandGain band_gain_;
  run::NominalSample nominal_sample_;
  run::LayerTimes layers_;
  RunQueue queue_;
  std::shared_ptr<run::RunJob> tried_;  // the present try with the first run of the queue
  run::RunWriter writer_;
  std::optional<GapCheck> gaps_;
  Bell bell_;                                   // a piece has been read, or a run been worked on
  std::unique_ptr<compensate::Engine> engine_;  // used in threads; null: the processes solve
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

}  // namespace unflex::flow
