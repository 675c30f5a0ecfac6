// The pieces that have been read and are not written yet, in the order of the file.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <memory>
#include <utility>

#include "unflex/run/run_job.hpp"
#include "unflex/run/run_progress.hpp"
#include "unflex/verify/line_rate.hpp"

namespace unflex::flow {

class RunQueue {
 public:
  struct Queued {
    std::shared_ptr<run::RunJob> job;
    std::size_t nodes = 0;      // to be solved, as sliced
    std::size_t bytes = 0;      // of its lines
    std::size_t submitted = 0;  // windows given to the solvers
  };

  // whole_steps: the firmware counts steps, so that the lines of a run depend on those behind it.
  RunQueue(unsigned workers, bool whole_steps) : workers_(workers), whole_steps_(whole_steps) {}

  void push(std::shared_ptr<run::RunJob> job) {
    const run::Piece& piece = job->piece;
    if (whole_steps_ && !pieces_.empty()) {
      // The lines of a run must leave room for those that follow. The run before is held back, so
      // it may still be changed.
      pieces_.back().job->lines_after = verify::LineRate::first_lines(piece.moves);
    }
    Queued queued;
    queued.nodes = job->has_come_to(run::Stage::lined) ? 0 : job->grid.count;
    for (const gcode::Event& event : piece.events) {
      queued.bytes += event.added ? 0 : event.line.text.size();
    }
    nodes_ += queued.nodes;
    lines_ += piece.events.size();
    queued.job = std::move(job);
    pieces_.push_back(std::move(queued));
  }
  void pop() {
    nodes_ -= pieces_.front().nodes;
    lines_ -= pieces_.front().job->piece.events.size();
    pieces_.pop_front();
  }
  // No more pieces come.
  void end() { is_ended_ = true; }

  [[nodiscard]] std::size_t size() const { return pieces_.size(); }
  [[nodiscard]] bool is_ended() const { return is_ended_; }
  [[nodiscard]] bool is_done() const { return is_ended_ && pieces_.empty(); }
  [[nodiscard]] Queued& operator[](std::size_t number) { return pieces_[number]; }
  [[nodiscard]] const Queued& operator[](std::size_t number) const { return pieces_[number]; }
  // Whether what follows a piece is known, as far as it counts.
  [[nodiscard]] bool is_followed(std::size_t number) const {
    return is_ended_ || number + 1 < pieces_.size() || !whole_steps_;
  }
  // Whether another piece may come. If only one run waits, there is always room: what follows it
  // must be known, however long the run is.
  [[nodiscard]] bool has_room() const {
    return pieces_.size() <= 1 ||
           (nodes_ <= kNodesAhead * std::max(workers_, 1U) && lines_ <= kLinesAhead);
  }
  // How much of the pieces is worked off.
  [[nodiscard]] double done_bytes() const {
    double bytes = 0.0;
    for (const Queued& queued : pieces_) {
      bytes += run::share_done(*queued.job) * static_cast<double>(queued.bytes);
    }
    return bytes;
  }

 private:
  // Per worker: nodes of runs that may be read and not yet written.
  static constexpr std::size_t kNodesAhead = 30'000;
  // The most lines that may wait. It bounds memory where moves are tiny.
  static constexpr std::size_t kLinesAhead = 200'000;

  unsigned workers_;
  bool whole_steps_;
  std::deque<Queued> pieces_;
  std::size_t nodes_ = 0;
  std::size_t lines_ = 0;
  bool is_ended_ = false;
};

}  // namespace unflex::flow
