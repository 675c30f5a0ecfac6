// Planned moves in the order of the file, with marks between sections.
#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "unflex/planner/planner.hpp"

namespace unflex::verify {

class PlanQueue {
 public:
  // Whether moves are handed out as the firmware plans them or as it carries them out.
  enum class Motion { planned, played };

  PlanQueue(const planner::Limits& limits, const planner::FirmwareConfig& fixed, Motion motion)
      : motion_(motion), planner_(planner::make_planner(limits, fixed)) {}

  void apply(const gcode::Event& event) { planner_->apply(event); }
  [[nodiscard]] const planner::Limits& limits() const { return planner_->limits(); }
  void add(const std::vector<gcode::Segment>& segments);
  void stop();
  // All moves that are added from now on belong to the next section.
  void end_section() { items_.push_back(Item::section_end); }

  // Whether a finished move of the current section is at hand.
  [[nodiscard]] bool has_move() const;
  // Whether the current section has no more moves, as far as is known.
  [[nodiscard]] bool at_section_end() const {
    return !items_.empty() && items_.front() == Item::section_end;
  }
  // The move that take() would give. has_move() must hold.
  [[nodiscard]] const planner::PlannedMove& front() const { return planned_[used_]; }
  // has_move() must hold.
  [[nodiscard]] planner::PlannedMove take();
  // Drops the finished moves of the current section.
  void skip();
  // Drops the rest of the current section, all of whose moves must be finished.
  void next_section();

 private:
  enum class Item { move, section_end };

  void take_planned();

  Motion motion_;
  std::unique_ptr<planner::Planner> planner_;
  std::deque<Item> items_;  // what comes next, in the order of the file
  std::vector<planner::PlannedMove> planned_;
  std::size_t used_ = 0;
  std::size_t untaken_ = 0;  // moves queued since the planner was last asked for finished ones
};

}  // namespace unflex::verify
