#include "unflex/run/layer_times.hpp"

#include <algorithm>
#include <cstddef>

#include "unflex/gcode/layer_mark.hpp"

namespace unflex::run {
namespace {

double sliced_s(const RunJob& job) {
  double duration_s = planner::duration_s(job.piece.moves);
  for (const gcode::Event& event : job.piece.events) {
    duration_s += event.dwell_s;
  }
  return duration_s;
}

double timed_s(const RunJob& job) {
  return job.retimed ? planner::duration_s(job.retimed->moves) : sliced_s(job);
}

// For each job, whether its run is stretched: some part of it has a new timing and none is kept,
// so that all parts go on meeting each other at one speed.
std::vector<bool> stretched_of(const std::vector<std::shared_ptr<RunJob>>& jobs) {
  std::vector<bool> result(jobs.size(), false);
  for (std::size_t first = 0; first < jobs.size();) {
    std::size_t end = first + 1;
    while (jobs[first]->piece.is_run && end < jobs.size() && jobs[end]->piece.is_run &&
           !jobs[end]->piece.begins_run()) {
      ++end;
    }
    bool any_new = false;
    bool any_kept = false;
    for (std::size_t i = first; i < end; ++i) {
      any_new = any_new || jobs[i]->retimed;
      any_kept = any_kept || !jobs[i]->failure.empty();
    }
    std::fill(result.begin() + static_cast<std::ptrdiff_t>(first),
              result.begin() + static_cast<std::ptrdiff_t>(end), any_new && !any_kept);
    first = end;
  }
  return result;
}

bool begins_layer_in(const Piece& piece) {
  return std::ranges::any_of(piece.events, [](const gcode::Event& event) {
    return gcode::begins_layer(event.line.content());
  });
}

}  // namespace

void LayerTimes::add(const std::shared_ptr<RunJob>& job) {
  if (least_s_ <= 0.0) {
    job->stretch = 1.0;
    return;
  }
  const bool is_later_part = job->piece.is_run && !job->piece.begins_run();
  if (begins_ && !is_later_part) {
    end();
    layers_.emplace_back().is_settled = !in_layer_;
    begins_ = false;
  }
  if (layers_.back().is_settled) {
    job->stretch = 1.0;
  } else {
    layers_.back().jobs.push_back(job);
  }
  if (begins_layer_in(job->piece)) {
    in_layer_ = true;
    begins_ = true;
  }
}

void LayerTimes::end() {
  if (!layers_.empty()) {
    layers_.back().is_whole = true;
  }
}

void LayerTimes::settle() {
  for (Layer& layer : layers_) {
    if (!layer.is_settled && is_known(layer)) {
      set(layer);
    }
  }
  while (layers_.size() > 1 && layers_.front().is_settled) {
    layers_.pop_front();
  }
}

bool LayerTimes::can_settle() const {
  return std::ranges::any_of(
      layers_, [&](const Layer& layer) { return !layer.is_settled && is_known(layer); });
}

bool LayerTimes::needs_more() const {
  return !layers_.empty() && !layers_.back().is_settled && !layers_.back().is_whole &&
         is_timed(layers_.back()) && !is_known(layers_.back());
}

bool LayerTimes::is_timed(const Layer& layer) {
  return std::ranges::all_of(layer.jobs, [](const std::shared_ptr<RunJob>& job) {
    return job->has_come_to(Stage::timed);
  });
}

// A layer that lasts long enough as far as its timing is known does so as a whole.
bool LayerTimes::is_known(const Layer& layer) const {
  if (layer.is_whole && is_timed(layer)) {
    return true;
  }
  double known_s = 0.0;
  for (const std::shared_ptr<RunJob>& job : layer.jobs) {
    if (job->has_come_to(Stage::timed)) {
      known_s += timed_s(*job);
    }
  }
  return known_s >= least_s_;
}

void LayerTimes::set(Layer& layer) const {
  std::vector<bool> is_stretched(layer.jobs.size(), false);
  double factor = 1.0;
  if (is_timed(layer)) {
    is_stretched = stretched_of(layer.jobs);
    double as_sliced_s = 0.0;
    double all_s = 0.0;
    double runs_s = 0.0;
    for (std::size_t i = 0; i < layer.jobs.size(); ++i) {
      as_sliced_s += sliced_s(*layer.jobs[i]);
      all_s += timed_s(*layer.jobs[i]);
      runs_s += is_stretched[i] ? timed_s(*layer.jobs[i]) : 0.0;
    }
    const double missing_s = std::min(least_s_, as_sliced_s) - all_s;
    if (missing_s > 0.0 && runs_s > 0.0) {
      factor += missing_s / runs_s;
    }
  }
  for (std::size_t i = 0; i < layer.jobs.size(); ++i) {
    layer.jobs[i]->stretch = is_stretched[i] ? factor : 1.0;
  }
  layer.jobs.clear();
  layer.is_settled = true;
}

}  // namespace unflex::run
