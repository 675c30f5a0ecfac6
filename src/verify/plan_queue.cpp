#include "plan_queue.hpp"

#include <utility>

namespace unflex::verify {
namespace {

// Asking the planner for finished moves costs a little. So it is asked only once for this many
// moves.
constexpr std::size_t kTakeEvery = 32;

}  // namespace

void PlanQueue::add(const std::vector<gcode::Segment>& segments) {
  for (const gcode::Segment& segment : segments) {
    if (planner_->add(segment)) {
      items_.push_back(Item::move);
      ++untaken_;
    }
  }
  if (untaken_ >= kTakeEvery) {
    take_planned();
  }
}

void PlanQueue::stop() {
  planner_->stop();
  take_planned();
}

void PlanQueue::take_planned() {
  if (motion_ == Motion::played) {
    planner_->take_played(planned_);
  } else {
    planner_->take(planned_);
  }
  untaken_ = 0;
}

bool PlanQueue::has_move() const {
  return !items_.empty() && items_.front() == Item::move && used_ < planned_.size();
}

planner::PlannedMove PlanQueue::take() {
  items_.pop_front();
  planner::PlannedMove move = std::move(planned_[used_++]);
  if (used_ == planned_.size()) {
    planned_.clear();
    used_ = 0;
  }
  return move;
}

void PlanQueue::skip() {
  while (has_move()) {
    static_cast<void>(take());
  }
}

void PlanQueue::next_section() {
  skip();
  items_.pop_front();
}

}  // namespace unflex::verify
