#include "unflex/flow/joint_use.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "read_print.hpp"
#include "unflex/kinematics/machine.hpp"
#include "unflex/machine/kinematic_machine.hpp"
#include "whole_plan.hpp"

namespace unflex::flow {
namespace {

using kinematics::Joints;
using kinematics::Point;

// A leg may be too short in the middle of a move whose ends it reaches. It is looked at this often.
constexpr double kLook_mm = 5.0;
constexpr double kMostLooks = 1000.0;

void raise(Largest& largest, double value, std::size_t line) {
  if (value > largest.value) {
    largest = {value, line};
  }
}

Point place_on(const gcode::Segment& segment, double share) {
  Point p{};
  for (std::size_t i = 0; i < p.size(); ++i) {
    const double start = segment.start_mm[i];
    p[i] = share == 1.0 ? segment.end_mm[i] : start + share * (segment.end_mm[i] - start);
  }
  return p;
}

class JointGauge {
 public:
  JointGauge(const machine::Settings& settings, PrintInJoints& result)
      : machine_(machine::kinematic_machine(settings)), result_(&result) {
    const auto names = joint_names(machine_);
    for (std::size_t i = 0; i < names.size(); ++i) {
      JointUse& joint = result_->joints[i];
      joint.name = names[i];
      joint.min_mm = std::numeric_limits<double>::infinity();
      joint.max_mm = -joint.min_mm;
      joint.range_mm = settings.kinematics.range_mm[i];
      result_->has_reach = result_->has_reach || joint.range_mm;
    }
    result_->has_reach = result_->has_reach || settings.kinematics.bars_mm;
    if (is_uniform(machine_)) {
      result_->condition = kinematics::condition(jacobian(machine_, {}));
    }
  }

  void add(const planner::PlannedMove& move) {
    if (!move.kinematic) {
      return;
    }
    if (!move.segment.start_known) {
      ++result_->unknown_moves;
      return;
    }
    ++result_->moves;
    const double looks = std::clamp(std::ceil(move.length_mm / kLook_mm), 1.0, kMostLooks);
    bool is_missed = false;
    for (double look = 0.0; look <= looks; ++look) {
      const Point p = place_on(move.segment, look / looks);
      is_missed = is_missed || misses(p, move.segment.line);
      follow(p, move);
    }
  }

  void finish() {
    if (result_->moves == 0) {
      for (JointUse& joint : result_->joints) {
        joint.min_mm = joint.max_mm = 0.0;
      }
    }
  }

 private:
  // Whether the tool cannot be there. This is told once for each line.
  bool misses(const Point& p, std::size_t line) {
    const std::optional<std::string> why = fault(machine_, p);
    if (!why) {
      return false;
    }
    ++result_->missed_moves;
    if (line == missed_line_) {
      return true;
    }
    missed_line_ = line;
    ++result_->missed_lines;
    if (result_->misses.size() < kMostMisses) {
      result_->misses.push_back(
          {line, fmt::format("the tool cannot be at X{:.6g} Y{:.6g} Z{:.6g}: {}", p[0], p[1], p[2],
                             *why)});
    }
    return true;
  }

  void follow(const Point& p, const planner::PlannedMove& move) {
    const Result<Joints> q = to_joints(machine_, p);
    if (!q) {
      return;
    }
    if (!is_uniform(machine_)) {
      result_->condition =
          std::max(result_->condition, kinematics::condition(jacobian(machine_, p)));
    }
    const double speed = std::max({move.start_v_mm_s, move.cruise_v_mm_s, move.end_v_mm_s});
    const auto along = [&](double size) {
      return Point{size * move.direction[0], size * move.direction[1], size * move.direction[2]};
    };
    const Joints velocity = joint_velocity(machine_, p, along(speed));
    const auto accel_by = [&](double accel) {
      return joint_acceleration(machine_, p, along(speed), along(accel));
    };
    const Joints up = accel_by(move.accel_s > 0.0 ? move.ramp_up_mm_s2() : 0.0);
    const Joints down = accel_by(move.decel_s > 0.0 ? -move.ramp_down_mm_s2() : 0.0);
    for (std::size_t i = 0; i < q->size(); ++i) {
      JointUse& joint = result_->joints[i];
      joint.min_mm = std::min(joint.min_mm, (*q)[i]);
      joint.max_mm = std::max(joint.max_mm, (*q)[i]);
      raise(joint.speed_mm_s, std::abs(velocity[i]), move.segment.line);
      raise(joint.accel_mm_s2, std::max(std::abs(up[i]), std::abs(down[i])), move.segment.line);
    }
  }

  kinematics::Machine machine_;
  PrintInJoints* result_;
  std::size_t missed_line_ = 0;  // the last of them
};

}  // namespace

Result<PrintInJoints> print_in_joints(const Job& job, Progress& progress) {
  PrintInJoints result;
  JointGauge gauge(job.settings, result);
  WholePlan plan(job.settings);
  const auto take = [&](const planner::PlannedMove& move) { gauge.add(move); };
  const auto follow = [&](const run::Piece& piece) {
    for (const gcode::Event& event : piece.events) {
      plan.add(event, take);
    }
  };
  return read_print(job, progress, follow).map([&](std::vector<std::string>&& warnings) {
    plan.finish(take);
    gauge.finish();
    result.warnings = std::move(warnings);
    return std::move(result);
  });
}

}  // namespace unflex::flow
