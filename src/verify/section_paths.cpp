#include "section_paths.hpp"

#include <algorithm>
#include <utility>

namespace unflex::verify {
namespace {

// A rest before each run, so long that the path of the last run does not count as near.
constexpr double kApart_s = 10.0;

}  // namespace

SectionPaths::SectionPaths(Sources sources)
    : sources_(std::move(sources)),
      sliced_([this](ReferenceMove& next) { return sources_.sliced(next.move); }),
      run_([this](ReferenceMove& next) { return next_of_run(next); }),
      resting_([this](ReferenceMove& next) { return next_of_kept(next.move); }),
      progress_timing_([this](planner::PlannedMove& move) { return next_resting(for_run_, move); },
                       [this](planner::PlannedMove& move) { return next_output_ahead(move); }) {}

void SectionPaths::begin_kept() {
  timing_ = Timing::kept;
  sliced_.begin_section();
  sliced_at_ = at_end(sliced_);
}

void SectionPaths::begin_run(Timing timing, double lead_in_s, double owed_mm) {
  timing_ = timing;
  lead_in_s_ = lead_in_s;
  sliced_.begin_section();
  sliced_at_ = at_end(sliced_);
  run_.rest(kApart_s);
  run_.begin_section(lead_in_s);
  run_at_ = at_end(run_);
  if (has_own_clock()) {
    for_run_.clear();
    for_kept_.clear();
    resting_.rest(kApart_s);
    resting_.begin_section();
  }
  if (is_free()) {
    progress_timing_.begin(owed_mm);
    output_ahead_.clear();
  }
  kept_at_ = at_end(kept());
}

bool SectionPaths::next_of_run(ReferenceMove& move) {
  if (is_free()) {
    return progress_timing_.next(move);
  }
  if (!(has_own_clock() ? next_resting(for_run_, move.move) : sources_.resting(move.move))) {
    return false;
  }
  sources_.on_planned(move.move);
  return true;
}

bool SectionPaths::next_of_kept(planner::PlannedMove& move) {
  if (!next_resting(for_kept_, move)) {
    return false;
  }
  move = planner::as_played(std::move(move));
  return true;
}

// The next sliced move of a run with its own clock, for one of the two paths that ask for it.
bool SectionPaths::next_resting(std::deque<planner::PlannedMove>& own, planner::PlannedMove& move) {
  if (own.empty()) {
    if (!sources_.resting(move)) {
      return false;
    }
    for_run_.push_back(move);
    for_kept_.push_back(std::move(move));
  }
  move = std::move(own.front());
  own.pop_front();
  return true;
}

// Reads an output move for progress_timing_, before the move is played.
bool SectionPaths::next_output_ahead(planner::PlannedMove& laid) {
  OutputMove move;
  if (!sources_.output(move)) {
    return false;
  }
  laid = move.laid;
  output_ahead_.push_back(std::move(move));
  return true;
}

bool SectionPaths::next_output(OutputMove& move) {
  if (output_ahead_.empty()) {
    return sources_.output(move);
  }
  move = std::move(output_ahead_.front());
  output_ahead_.pop_front();
  return true;
}

// Returns a copy, because playing a move makes the path grow, which moves its pieces.
std::optional<planner::PlannedMove> SectionPaths::next(ReferencePath& path, Cursor& at,
                                                       double until_s) {
  if (at.next >= path.end() || path[at.next].end_s > until_s) {
    return std::nullopt;
  }
  return path[at.next++].move;
}

double SectionPaths::sliced_until_s(double emitted_s) {
  if (has_own_clock()) {
    pass_until(emitted_s);
    return end_of_passed_s(sliced_, sliced_at_.first);
  }
  const double until_s = sliced_.section_start_s() + (emitted_s - emitted().section_start_s());
  sliced_.extend_to(until_s);
  return until_s;
}

double SectionPaths::kept_until_s(double emitted_s) {
  return has_own_clock() ? end_of_passed_s(resting_, kept_at_.first) : emitted_s;
}

void SectionPaths::complete_kept() {
  while (!kept().section_complete()) {
    kept().extend_to(kept().end_s());
  }
}

void SectionPaths::pass_until(double emitted_s) {
  while (run_at_.next < run_.end() && run_[run_at_.next].end_s <= emitted_s) {
    ++run_at_.next;
  }
}

// The end time of the last move that the emitted nozzle has passed, on another path of the section.
// `first`: the section's first piece on that path.
double SectionPaths::end_of_passed_s(ReferencePath& path, std::size_t first) const {
  const std::size_t passed = run_at_.next - run_at_.first;
  while (path.end() - first < passed && !path.section_complete()) {
    path.extend_to(path.end_s());
  }
  const std::size_t known = std::min(path.end() - first, passed);
  return known > 0 ? path[first + known - 1].end_s : path.section_start_s();
}

void SectionPaths::discard_before(double sliced_s, double emitted_s, double kept_s) {
  sliced_.discard_before(sliced_s);
  if (!is_run()) {
    return;
  }
  run_.discard_before(has_own_clock() ? emitted_s : std::min(emitted_s, kept_s));
  if (has_own_clock()) {
    resting_.discard_before(kept_s);
  }
}

}  // namespace unflex::verify
