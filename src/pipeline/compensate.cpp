#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <optional>
#include <utility>

#include "compensate_with.hpp"
#include "gap_check.hpp"
#include "nozzle_motion.hpp"
#include "report_rows.hpp"
#include "retime.hpp"
#include "run_writer.hpp"
#include "stage_options.hpp"
#include "task_pool.hpp"
#include "unflex/pipeline/pipeline.hpp"
#include "verify_thread.hpp"
#include "worker_pool.hpp"

namespace unflex::pipeline {
namespace {

// Nodes of runs that have been read and not yet been written, per worker, and windows that solver
// processes are given ahead.
constexpr std::size_t kNodesAhead = 200'000;
constexpr std::size_t kWindowsAhead = 24;
// Windows built at once.
constexpr std::size_t kWindowsAtOnce = 8;
// A run's trajectory is held as a whole, 48 bytes per node; longer ones are left as they are.
constexpr std::size_t kMaxRunNodes = 8'000'000;
// Of the time of the whole job, for the progress bar, where the output is verified afterwards.
constexpr double kShareOfCompensation = 0.9;
constexpr std::chrono::milliseconds kPatience{100};
constexpr std::chrono::milliseconds kShortPatience{2};

double largest_axis_accel(const std::vector<planner::PlannedMove>& moves) {
  double largest = 0.0;
  for (const planner::PlannedMove& move : moves) {
    if (move.accel_s + move.decel_s > 0.0) {
      largest = std::max(largest, move.accel_mm_s2 * std::max(std::abs(move.direction[gcode::X]),
                                                              std::abs(move.direction[gcode::Y])));
    }
  }
  return largest;
}

std::string text_of(const Piece& piece) {
  std::string text;
  for (const gcode::Event& event : piece.events) {
    text += event.line.text;
  }
  return text;
}

tl::unexpected<Error> disk_full(const Job& job) {
  return fail(ErrorKind::internal, {job.output_name, 0},
              "cannot write the output; is the disk full?");
}

// Reads pieces, has runs worked on, and writes them in order. All of it in the calling thread but
// for what is in the pools.
class Compensator {
 public:
  Compensator(const Job& job, Engines engines, WorkerPool& processes, std::istream& input,
              std::ostream& output, Progress& progress, report::Report& report)
      : job_(job),
        engines_(std::move(engines)),
        rules_{compensate_setup(job.settings), emit_options(job.settings, UNFLEX_VERSION),
               verify_rules(job.settings)},
        reader_(input, job.input_name, rules_.verify.interpreter, rules_.verify.limits,
                rules_.verify.fixed),
        processes_(&processes),
        output_(&output),
        progress_(&progress),
        report_(&report),
        writer_(rules_, job.settings.max_lines_per_s(), report),
        input_bytes_(static_cast<double>(std::filesystem::file_size(job.input))),
        slots_(job.workers) {
    if (engines_.threaded) {
      engine_ = engines_.threaded();
      verifier_.emplace(rules_.verify, job.input_name, job.output_name, progress, slots_);
      pool_.emplace(std::max(job.workers, 1U), slots_);
    } else {
      pool_.emplace(0U, slots_);
    }
  }

  Status work() {
    const CpuSlot slot(slots_);
    for (;;) {
      auto job = std::make_shared<RunJob>();
      const Result<bool> more = reader_.next(job->piece);
      if (!more) {
        return tl::unexpected(more.error());
      }
      if (!*more) {
        break;
      }
      admit(std::move(job));
      if (Status status = drain(kNodesAhead * std::max(job_.workers, 1U)); !status) {
        return status;
      }
    }
    all_read_ = true;
    if (Status status = drain(0); !status) {
      return status;
    }
    put({}, writer_.finish());
    for (const Diagnostic& warning : reader_.warnings()) {
      report_->warnings.push_back(to_string(warning));
    }
    if (Status status = check_engine(); !status) {
      return status;
    }
    return finish_verification();
  }

 private:
  // Queues the piece.
  void admit(std::shared_ptr<RunJob> job) {
    const Piece& piece = job->piece;
    if (piece.is_run) {
      ++report_->runs_total;
      job->nozzle = nozzle_;
      nozzle_ = at_rest(piece.moves.back().segment.end_mm);
      job->setup = setup_for(rules_.setup, piece.moves, job_.settings);
      const std::size_t nodes = compensate::node_count(piece.moves, rules_.setup);
      const double accel = largest_axis_accel(piece.moves);
      if (accel > rules_.verify.base_max_accel_mm_s2) {
        job->failure = fmt::format(
            "the plan itself accelerates an axis by {:.0f} mm/s², more than base.max_accel_mm_s2",
            accel);
      } else if (nodes <= kMaxRunNodes) {
        job->spans = compensate::cut(nodes, rules_.setup);
      } else {
        job->failure = fmt::format("{:.0f} s of motion without a stop are too long to be handled",
                                   static_cast<double>(nodes) * rules_.setup.period_s);
      }
      job->results.resize(job->spans.size());
      job->missing = 2 * job->spans.size();
      job->prepared = job->spans.empty();
      report_->windows_total += job->spans.size();
      nodes_queued_ += nodes_of(*job);
      if (engine_ && engines_.second) {
        gaps_.choose(*job);
      }
    } else {
      nozzle_ = after_motion(piece, nozzle_, rules_.verify.nozzle);
      for (const gcode::Event& event : piece.events) {
        count_kept_moves(event, rules_.verify.fixed.firmware, report_->kept_moves);
      }
      job->prepared = true;
    }
    if (!queue_.empty()) {
      // The lines of a run where they are counted have to fit those after it.
      queue_.back()->lines_after = verify::LineRate::first_lines(piece.moves);
    }
    queue_.push_back(std::move(job));
    feed();
  }

  static std::size_t nodes_of(const RunJob& job) {
    return job.spans.empty() ? 0 : job.spans.back().last + 1;
  }

  // Gives the solvers what they can take, in the order of the file.
  void feed() {
    for (std::size_t piece = 0; piece < queue_.size(); ++piece) {
      // A run is known in full when it is known what follows.
      if (!all_read_ && piece + 1 == queue_.size() && rules_.emit.lines.burst_lines > 0) {
        return;
      }
      RunJob& job = *queue_[piece];
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
    pool_->submit([this, job, first, count] {
      solve_windows(*job, first, count, *engine_);
      if (job->missing.fetch_sub(2 * count) == 2 * count) {
        prepare(*job, rules_);
        const std::lock_guard lock(mutex_);
        ready_.notify_one();
      }
    });
  }

  void solve_in_process(const std::shared_ptr<RunJob>& job, std::size_t first, std::size_t count) {
    const std::vector<compensate::RunWindow> windows = windows_of(*job, first, count);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t axis = 0; axis < 2; ++axis) {
        tickets_.push_back({job, first + i, axis});
        processes_->submit(first_ticket_ + tickets_.size() - 1,
                           axis == 0 ? windows[i].x : windows[i].y);
      }
    }
  }

  // Writes pieces that are complete until runs of at most `ahead` nodes are queued; for 0 until
  // everything is written.
  Status drain(std::size_t ahead) {
    for (;;) {
      feed();
      while (can_write()) {
        write(*queue_.front());
        queue_.pop_front();
      }
      if (progress_->cancelled()) {
        return fail(ErrorKind::internal, "cancelled, nothing was written");
      }
      if (!*output_) {
        return disk_full(job_);
      }
      // However long the only run is, what follows it must be known.
      const bool few = ahead > 0 ? nodes_queued_ <= ahead || queue_.size() <= 1 : queue_.empty();
      if (few && !(verifier_ && verifier_->is_behind())) {
        return {};
      }
      wait();
    }
  }

  void wait() {
    if (!engine_) {
      if (std::optional<WorkerPool::Done> done =
              processes_->take(static_cast<int>(kPatience.count()))) {
        place(std::move(*done));
      }
      return;
    }
    const CpuSlot::Without without(slots_);
    std::unique_lock lock(mutex_);
    ready_.wait_for(lock, verifier_->is_behind() ? kShortPatience : kPatience,
                    [this] { return can_write(); });
  }

  // Where lines are counted, it must be known what follows a run.
  [[nodiscard]] bool can_write() const {
    return !queue_.empty() && queue_.front()->prepared &&
           (queue_.size() > 1 || all_read_ || rules_.emit.lines.burst_lines == 0);
  }

  void place(WorkerPool::Done done) {
    const Ticket& ticket = tickets_[done.ticket - first_ticket_];
    RunJob& job = *ticket.job;
    job.results[ticket.window][ticket.axis] = axis_result(std::move(done.solution));
    if (--job.missing == 0) {
      prepare(job, rules_);
    }
  }

  void write(RunJob& job) {
    const Piece& piece = job.piece;
    put(text_of(piece), writer_.write(job));
    report_->solver_iterations += job.iterations;
    nodes_queued_ -= nodes_of(job);
    gaps_.take(job);
    if (!engine_) {
      const std::size_t tickets = 2 * job.spans.size();
      tickets_.erase(tickets_.begin(), tickets_.begin() + static_cast<std::ptrdiff_t>(tickets));
      first_ticket_ += tickets;
    }
    progress_->update("compensating", (engine_ ? 1.0 : kShareOfCompensation) *
                                          static_cast<double>(bytes_written_) / input_bytes_);
  }

  void put(std::string input, std::string output) {
    bytes_written_ += input.size();
    *output_ << output;
    if (verifier_) {
      verifier_->push(std::move(input), std::move(output));
    }
  }

  // Has the probes solved by the second engine.
  Status check_engine() {
    for (std::size_t i = 0; i < gaps_.probes().size(); ++i) {
      // Windows of runs that failed have none.
      if (!gaps_.probes()[i].solution.base.position_mm.empty()) {
        processes_->submit(i, gaps_.probes()[i].problem);
      }
    }
    if (verifier_) {
      verifier_->end();
    }
    const CpuSlot::Without without(slots_);
    while (processes_->under_way() > 0) {
      if (std::optional<WorkerPool::Done> done =
              processes_->take(static_cast<int>(kPatience.count()))) {
        if (done->solution) {
          GapCheck::compare(gaps_.probes()[done->ticket], *done->solution, report_->solver_check);
        }
      }
      if (progress_->cancelled()) {
        return fail(ErrorKind::internal, "cancelled, nothing was written");
      }
    }
    return {};
  }

  Status finish_verification() {
    if (!verifier_) {
      return {};
    }
    const CpuSlot::Without without(slots_);
    Result<verify::VerifyReport> verified = verifier_->result();
    if (!verified) {
      return tl::unexpected(verified.error());
    }
    add_verification(*verified, *report_);
    return {};
  }

  // Which solution a number given to the processes stands for.
  struct Ticket {
    std::shared_ptr<RunJob> job;
    std::size_t window;
    std::size_t axis;
  };

  const Job& job_;
  Engines engines_;
  RunRules rules_;
  PieceReader reader_;
  WorkerPool* processes_;
  std::ostream* output_;
  Progress* progress_;
  report::Report* report_;
  RunWriter writer_;
  GapCheck gaps_;
  double input_bytes_;
  // The nozzle where the reader is, if every run before was compensated: what motion left as it is
  // has set ringing, the next run starts with.
  dynamics::NozzleXY nozzle_;
  std::deque<std::shared_ptr<RunJob>> queue_;
  std::size_t nodes_queued_ = 0;
  std::deque<Ticket> tickets_;    // of the windows of queue_
  std::size_t first_ticket_ = 0;  // number of tickets_' front
  std::size_t bytes_written_ = 0;
  bool all_read_ = false;
  std::mutex mutex_;
  std::condition_variable ready_;  // a run has been prepared
  CpuSlots slots_;
  std::unique_ptr<compensate::Engine> engine_;
  // Last, so that threads end before what they use.
  std::optional<VerifyThread> verifier_;
  std::optional<TaskPool> pool_;
};

// The second part of a job's progress.
class Remaining final : public Progress {
 public:
  Remaining(Progress& whole, double done) : whole_(&whole), done_(done) {}
  void update(std::string_view stage, double fraction) override {
    whole_->update(stage, fraction < 0.0 ? fraction : done_ + (1.0 - done_) * fraction);
  }
  [[nodiscard]] bool cancelled() const override { return whole_->cancelled(); }

 private:
  Progress* whole_;
  double done_;
};

Engines engines_of(EngineChoice choice) {
  switch (choice) {
    case EngineChoice::ipopt:
      return {nullptr, compensate::make_ipopt_engine};
    case EngineChoice::banded:
      return {compensate::make_banded_engine, nullptr};
    case EngineChoice::automatic:
      break;
  }
  return {compensate::make_banded_engine, compensate::make_ipopt_engine};
}

std::string name_of(const Engines& engines) {
  if (!engines.threaded) {
    return engines.second()->name();
  }
  const std::string name = engines.threaded()->name();
  return engines.second ? fmt::format("{}, checked by {}", name, engines.second()->name()) : name;
}

}  // namespace

Result<report::Report> compensate(const Job& job, Progress& progress) {
  return compensate_with(job, engines_of(job.engine), progress);
}

Result<report::Report> compensate_with(const Job& job, const Engines& engines, Progress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  report::Report report = new_report("compensate", job);
  report.solver_engine = name_of(engines);
  {
    // Before there is any thread.
    Result<WorkerPool> pool = WorkerPool::start(
        engines.threaded ? (engines.second ? 1 : 0) : job.workers, engines.second);
    if (!pool) {
      return tl::unexpected(pool.error());
    }
    std::ifstream input(job.input, std::ios::binary);
    std::ofstream output(job.output, std::ios::binary | std::ios::trunc);
    if (!input) {
      return fail(ErrorKind::input, {job.input_name, 0}, "cannot read the file");
    }
    if (!output) {
      return fail(ErrorKind::internal, {job.output_name, 0}, "cannot write the output");
    }
    Compensator compensator(job, engines, *pool, input, output, progress, report);
    if (Status status = compensator.work(); !status) {
      return tl::unexpected(status.error());
    }
    output.flush();
    if (!output) {
      return disk_full(job);
    }
  }
  if (!engines.threaded) {
    Remaining remaining(progress, kShareOfCompensation);
    if (Status status = add_verification(job, remaining, report); !status) {
      return tl::unexpected(status.error());
    }
  }
  if (report.reference_time_s > 0.0) {
    const double factor = report.emitted_time_s / report.reference_time_s;
    if (Status status = retime(job.output, job.output_name, factor); !status) {
      return tl::unexpected(status.error());
    }
    report.output_bytes = std::filesystem::file_size(job.output);
  }
  add_performance(begin, report);
  return report;
}

}  // namespace unflex::pipeline
