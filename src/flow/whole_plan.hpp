// The plan of a whole file as the firmware has it. Unlike the plan of the pieces, it goes through
// lifts without a stop.
#pragma once

#include <memory>
#include <vector>

#include "unflex/gcode/interpreter.hpp"
#include "unflex/machine/as_printer.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::flow {

class WholePlan {
 public:
  explicit WholePlan(const machine::Settings& settings)
      : planner_(planner::make_planner(machine::planner_limits(settings),
                                       machine::firmware_config(settings))) {}

  // take(move): called for each move whose plan is settled now.
  template <class Take>
  void add(const gcode::Event& event, const Take& take) {
    if (event.kind != gcode::EventKind::move) {
      planner_->apply(event);
    }
    for (const gcode::Segment& segment : event.segments) {
      planner_->add(segment);
    }
    if (event.kind == gcode::EventKind::barrier) {
      planner_->stop();
    }
    planned_.clear();
    planner_->take_played(planned_);
    for (const planner::PlannedMove& move : planned_) {
      take(move);
    }
  }

  // At the end of the file.
  template <class Take>
  void finish(const Take& take) {
    gcode::Event end;
    end.kind = gcode::EventKind::barrier;
    add(end, take);
  }

 private:
  std::unique_ptr<planner::Planner> planner_;
  std::vector<planner::PlannedMove> planned_;
};

}  // namespace unflex::flow
