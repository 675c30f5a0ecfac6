// Klipper's planner.
//
// Notation: klippy/toolhead.py, "Move" and "LookAheadQueue".
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "unflex/planner/planner.hpp"

namespace unflex::planner {

// Klipper's planner: junction speeds by square-corner velocity, approximated centripetal speed and
// the extruder's instantaneous corner velocity; forward and backward pass; minimum cruise ratio.
class KlipperPlanner final : public Planner {
 public:
  KlipperPlanner(const Limits& limits, const FirmwareConfig& config);

  bool add(const gcode::Segment& segment) override;
  void stop() override;
  std::size_t take(std::vector<PlannedMove>& out) override;
  [[nodiscard]] std::size_t pending() const override;

 private:
  // Data of a queued move in the lookahead. Speeds are squared, mm²/s², because v² changes linearly
  // along a ramp. "Smooth" is the same motion at the lower acceleration that minimum_cruise_ratio
  // leaves, (1 − ratio)·a.
  struct Junction {
    double max_start_v2 = 0.0;         // at the start: the junction's limit, or what is reachable
    double max_smooth_start_v2 = 0.0;  // max_start_v2 with smooth acceleration
    double max_cruise_v2 = 0.0;
    double delta_v2 = 0.0;  // 2aL: the most by which v² can change within the move
    double smooth_delta_v2 = 0.0;
    double junction_deviation_mm = 0.0;
    // Written by the backward pass. Without cruise_v2 the cruise speed of the move before is
    // carried over.
    double start_v2 = 0.0;
    double end_v2 = 0.0;
    std::optional<double> cruise_v2;
  };

  void limit_speed(double velocity_mm_s, double accel_mm_s2);
  void limit_by_axes();
  void join_to_previous();
  std::size_t backward_pass(bool lazy);
  void forward_pass(std::size_t count);
  void plan(bool lazy);

  FirmwareConfig config_;
  std::vector<PlannedMove> moves_;   // final ones first, then those in lookahead_
  std::vector<Junction> lookahead_;  // one for each of the last entries of moves_
  double until_plan_s_;  // shortest time of moves still to be queued before the next lazy planning
};

}  // namespace unflex::planner
