#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <fstream>
#include <optional>
#include <utility>

#include "compensate_with.hpp"
#include "emission_cost.hpp"
#include "judge.hpp"
#include "nozzle_motion.hpp"
#include "piece_reader.hpp"
#include "report_rows.hpp"
#include "retime.hpp"
#include "stage_options.hpp"
#include "unflex/pipeline/pipeline.hpp"
#include "unflex/verify/verify.hpp"
#include "worker_pool.hpp"

namespace unflex::pipeline {
namespace {

constexpr std::size_t kMaxFallbacksListed = 1000;
// Windows the reader may be ahead of the solvers, per worker, and those built at once.
constexpr std::size_t kWindowsAhead = 24;
constexpr std::size_t kWindowsAtOnce = 8;
// A run's trajectory is held as a whole, 48 bytes per node; longer ones are left as they are.
constexpr std::size_t kMaxRunNodes = 8'000'000;
// Of the tolerance, for a run that the whole of it spoils.
constexpr double kFineTolerance = 0.05;
// Of the time of the whole job, for the progress bar.
constexpr double kShareOfCompensation = 0.9;

// A piece on its way: a run waits for its windows.
struct Pending {
  Piece piece;
  std::vector<compensate::WindowSpan> spans;
  std::vector<dynamics::AxisTrajectory> x;  // solutions, one per span
  std::vector<dynamics::AxisTrajectory> y;
  std::size_t submitted = 0;  // windows given to the solvers
  std::size_t missing = 0;    // solutions not yet here, two per window
  std::string failure;        // why there is no solution
  dynamics::NozzleXY nozzle;  // when the run begins, if every run before is compensated
};

// Which solution a ticket of the pool stands for.
struct Ticket {
  std::size_t piece;
  std::size_t window;
  bool is_y;
};

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

class Compensator {
 public:
  Compensator(const Job& job, WorkerPool pool, std::istream& input, std::ostream& output,
              Progress& progress)
      : job_(job),
        setup_(compensate_setup(job.settings)),
        rules_(verify_rules(job.settings)),
        pool_(std::move(pool)),
        reader_(input, job.input_name, rules_.interpreter, rules_.limits, rules_.fixed),
        emitter_(emit_options(job.settings, UNFLEX_VERSION)),
        output_(output),
        progress_(progress),
        input_bytes_(static_cast<double>(std::filesystem::file_size(job.input))) {}

  Status work(report::Report& report) {
    report_ = &report;
    const std::size_t ahead = 2 * kWindowsAhead * std::max(job_.workers, 1U);
    for (;;) {
      Pending pending;
      const Result<bool> more = reader_.next(pending.piece);
      if (!more) {
        return tl::unexpected(more.error());
      }
      if (!*more) {
        break;
      }
      admit(std::move(pending));
      if (Status status = drain(ahead); !status) {
        return status;
      }
    }
    all_read_ = true;
    if (Status status = drain(0); !status) {
      return status;
    }
    std::string text;
    emitter_.finish(text);
    output_ << text;
    report.line_budget.max_lines_per_s = job_.settings.max_lines_per_s();
    report.line_budget.cost_rms_mm = emission_cost_.rms_mm();
    report.line_budget.cost_max_mm = emission_cost_.max_mm();
    for (const Diagnostic& warning : reader_.warnings()) {
      report.warnings.push_back(to_string(warning));
    }
    return {};
  }

 private:
  // Queues the piece.
  void admit(Pending pending) {
    const Piece& piece = pending.piece;
    if (piece.is_run) {
      ++report_->runs_total;
      pending.nozzle = nozzle_;
      nozzle_ = at_rest(piece.moves.back().segment.end_mm);
      const std::size_t nodes = compensate::node_count(piece.moves, setup_);
      const double accel = largest_axis_accel(piece.moves);
      if (accel > rules_.base_max_accel_mm_s2) {
        pending.failure = fmt::format(
            "the plan itself accelerates an axis by {:.0f} mm/s², more than base.max_accel_mm_s2",
            accel);
      } else if (nodes <= kMaxRunNodes) {
        pending.spans = compensate::cut(nodes, setup_);
      } else {
        pending.failure =
            fmt::format("{:.0f} s of motion without a stop are too long to be handled",
                        static_cast<double>(nodes) * setup_.period_s);
      }
      pending.x.resize(pending.spans.size());
      pending.y.resize(pending.spans.size());
      pending.missing = 2 * pending.spans.size();
      outstanding_ += pending.missing;
      report_->windows_total += pending.spans.size();
    } else {
      nozzle_ = after_motion(piece, nozzle_, rules_.nozzle);
      for (const gcode::Event& event : piece.events) {
        count_kept_moves(event, rules_.fixed.firmware, report_->kept_moves);
      }
    }
    queue_.push_back(std::move(pending));
  }

  // Gives the solvers the next windows, in the order of the file, as long as they are not busy for
  // some time already.
  void feed() {
    for (std::size_t piece = 0; piece < queue_.size(); ++piece) {
      Pending& pending = queue_[piece];
      while (pending.submitted < pending.spans.size()) {
        if (pool_.under_way() >= kWindowsAhead * std::max(job_.workers, 1U)) {
          return;
        }
        const std::size_t count =
            std::min(kWindowsAtOnce, pending.spans.size() - pending.submitted);
        const auto windows = compensate::windows(
            pending.piece.moves, pending.spans, pending.submitted, count, pending.nozzle,
            setup_for(setup_, pending.piece.moves, job_.settings));
        for (std::size_t i = 0; i < count; ++i) {
          submit({first_index_ + piece, pending.submitted + i, false}, windows[i].x);
          submit({first_index_ + piece, pending.submitted + i, true}, windows[i].y);
        }
        pending.submitted += count;
      }
    }
  }

  void submit(Ticket ticket, const compensate::AxisWindow& window) {
    tickets_.push_back(ticket);
    pool_.submit(first_ticket_ + tickets_.size() - 1, window);
  }

  // Takes solutions and writes pieces that are complete until at most `ahead` solutions are
  // missing; for 0 until everything is written.
  Status drain(std::size_t ahead) {
    for (;;) {
      feed();
      write_complete();
      if (progress_.cancelled()) {
        return fail(ErrorKind::internal, "cancelled, nothing was written");
      }
      if (!output_) {
        return fail(ErrorKind::internal, {job_.output_name, 0},
                    "cannot write the output; is the disk full?");
      }
      if (outstanding_ <= ahead && (ahead > 0 || queue_.empty())) {
        return {};
      }
      if (std::optional<WorkerPool::Done> done = pool_.take(100)) {
        place(std::move(*done));
      }
    }
  }

  void place(WorkerPool::Done done) {
    const Ticket ticket = tickets_[done.ticket - first_ticket_];
    Pending& pending = queue_[ticket.piece - first_index_];
    --pending.missing;
    --outstanding_;
    if (done.solution) {
      report_->solver_iterations += static_cast<std::size_t>(done.solution->iterations);
      (ticket.is_y ? pending.y : pending.x)[ticket.window] = std::move(done.solution->base);
    } else if (pending.failure.empty()) {
      pending.failure =
          fmt::format("the solver failed on axis {}, window {}: {}", ticket.is_y ? 'y' : 'x',
                      ticket.window + 1, done.solution.error().message);
    }
  }

  void write_complete() {
    // A run is written when it is known what follows.
    while (!queue_.empty() && queue_.front().missing == 0 && (queue_.size() > 1 || all_read_)) {
      write(queue_.front());
      const std::size_t tickets = 2 * queue_.front().spans.size();
      tickets_.erase(tickets_.begin(), tickets_.begin() + static_cast<std::ptrdiff_t>(tickets));
      first_ticket_ += tickets;
      queue_.pop_front();
      ++first_index_;
      progress_.update("compensating",
                       kShareOfCompensation * static_cast<double>(bytes_written_) / input_bytes_);
    }
  }

  void write(Pending& pending) {
    const Piece& piece = pending.piece;
    std::string text;
    if (!piece.is_run) {
      for (const gcode::Event& event : piece.events) {
        emitter_.line(event, text);
      }
      keep_motion(piece);
    } else if (std::optional<std::string> failure = write_run(pending, text)) {
      emitter_.keep(piece.events, text);
      keep_motion(piece);
      note_fallback(pending, std::move(*failure));
    }
    for (const gcode::Event& event : piece.events) {
      bytes_written_ += event.line.text.size();
    }
    output_ << text;
  }

  // The printer moves as the input has it.
  void keep_motion(const Piece& piece) {
    true_nozzle_ = after_motion(piece, true_nozzle_, rules_.nozzle);
    line_rate_.change_text();
    line_rate_.forget();
    for (const planner::PlannedMove& move : piece.moves) {
      line_rate_.add(move);
    }
    note_lines_above_budget(piece);
  }

  void note_lines_above_budget(const Piece& piece) {
    if (line_rate_.max_per_s() <= job_.settings.max_lines_per_s()) {
      return;
    }
    ++report_->line_budget.places_above;
    if (report_->line_budget.above.size() < kMaxFallbacksListed) {
      report_->line_budget.above.push_back({piece.events.front().line.number,
                                            piece.events.back().line.number,
                                            line_rate_.max_per_s()});
    }
  }

  // The run as compensated text, or why its original lines must stand.
  std::optional<std::string> write_run(const Pending& pending, std::string& text) {
    if (!pending.failure.empty()) {
      return pending.failure;
    }
    const dynamics::BaseTrajectory base{setup_.period_s, compensate::join(pending.spans, pending.x),
                                        compensate::join(pending.spans, pending.y)};
    const Piece& piece = pending.piece;
    // Where long lines break a limit or cost too much, short ones may do.
    const int lines_after =
        queue_.size() > 1 ? verify::LineRate::first_lines(queue_[1].piece.moves) : 0;
    std::string objection;
    for (const double share : {1.0, kFineTolerance}) {
      emit::Emitter trial = emitter_;
      text.clear();
      if (!trial.run({&piece.events, &piece.move_counts, &piece.moves, &base, setup_.lead_in_s,
                      share, line_rate_.last_begins_s(), lines_after},
                     text)) {
        return "the motion is too small to be written";
      }
      Verdict verdict = judge(piece.moves, text, emitter_.printer(), emitter_.printer_limits(),
                              true_nozzle_, rules_, line_rate_, job_.settings.max_lines_per_s());
      if (!verdict.objection) {
        emission_cost_.add(piece.moves, setup_.lead_in_s, base, verdict.replayed, true_nozzle_,
                           rules_.nozzle);
        true_nozzle_ = verdict.nozzle;
        line_rate_ = std::move(verdict.rate);
        note_lines_above_budget(piece);
        emitter_ = std::move(trial);
        ++report_->runs_compensated;
        report_->windows_solved += pending.spans.size();
        return std::nullopt;
      }
      objection = std::move(*verdict.objection);
    }
    text.clear();
    return objection;
  }

  void note_fallback(const Pending& pending, std::string reason) {
    ++report_->runs_fallback;
    report_->windows_fallback += pending.spans.size();
    if (report_->fallbacks.size() < kMaxFallbacksListed) {
      report_->fallbacks.push_back({pending.piece.events.front().line.number,
                                    pending.piece.events.back().line.number, std::move(reason)});
    }
  }

  const Job& job_;
  compensate::Setup setup_;
  verify::Rules rules_;
  WorkerPool pool_;
  PieceReader reader_;
  emit::Emitter emitter_;
  std::ostream& output_;
  Progress& progress_;
  double input_bytes_;
  report::Report* report_ = nullptr;
  // The nozzle where the reader is, if every run before was compensated: what motion left as it is
  // has set ringing, the next run starts with.
  dynamics::NozzleXY nozzle_;
  dynamics::NozzleXY true_nozzle_;  // where the writer is
  verify::LineRate line_rate_;      // of what is written
  EmissionCost emission_cost_;
  std::deque<Pending> queue_;
  std::size_t first_index_ = 0;   // of queue_'s front among all pieces
  std::deque<Ticket> tickets_;    // of the windows of queue_
  std::size_t first_ticket_ = 0;  // number of tickets_' front
  std::size_t outstanding_ = 0;   // solutions missing in queue_, in all
  std::size_t bytes_written_ = 0;
  bool all_read_ = false;
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

}  // namespace

Result<report::Report> compensate(const Job& job, Progress& progress) {
  return compensate_with(job, compensate::make_ipopt_engine, progress);
}

Result<report::Report> compensate_with(const Job& job, const WorkerPool::EngineFactory& engine,
                                       Progress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  report::Report report = new_report("compensate", job);
  report.solver_engine = engine()->name();
  {
    Result<WorkerPool> pool = WorkerPool::start(job.workers, engine);
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
    Compensator compensator(job, std::move(*pool), input, output, progress);
    if (Status status = compensator.work(report); !status) {
      return tl::unexpected(status.error());
    }
    output.flush();
    if (!output) {
      return fail(ErrorKind::internal, {job.output_name, 0},
                  "cannot write the output; is the disk full?");
    }
  }
  Remaining remaining(progress, kShareOfCompensation);
  if (Status status = add_verification(job, remaining, report); !status) {
    return tl::unexpected(status.error());
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
