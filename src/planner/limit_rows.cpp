#include "unflex/planner/limit_rows.hpp"

namespace unflex::planner {
namespace {

using Change = gcode::LimitChange;

constexpr double kMsPerSecond = 1e3;

constexpr LimitRow kRows[] = {
    {SharedLimit{&Limits::max_velocity_mm_s, &Change::max_velocity_mm_s},
     "limits.max_velocity_mm_s", "maximum velocity"},
    {SharedLimit{&Limits::max_accel_mm_s2, &Change::max_accel_mm_s2}, "limits.max_accel_mm_s2",
     "maximum acceleration"},
    {SharedLimit{&Limits::square_corner_velocity_mm_s, &Change::square_corner_velocity_mm_s},
     "limits.square_corner_velocity_mm_s", "square corner velocity"},
    {SharedLimit{&Limits::minimum_cruise_ratio, &Change::minimum_cruise_ratio},
     "limits.minimum_cruise_ratio", "minimum cruise ratio"},
    {SharedLimit{&Limits::accel_to_decel_mm_s2, &Change::accel_to_decel_mm_s2}, "",
     "acceleration to deceleration"},
    {AxisLimit{&Limits::axis_max_velocity_mm_s, &Change::axis_max_velocity_mm_s},
     "limits.max_{}_velocity_mm_s", "maximum velocity of {}"},
    {AxisLimit{&Limits::axis_max_accel_mm_s2, &Change::axis_max_accel_mm_s2},
     "limits.max_{}_accel_mm_s2", "maximum acceleration of {}"},
    {AxisLimit{&Limits::axis_jerk_mm_s, &Change::axis_jerk_mm_s}, "limits.jerk_{}_mm_s",
     "jerk of {}"},
    {AxisLimit{&Limits::axis_max_jerk_mm_s, &Change::axis_max_jerk_mm_s}, "", "most jerk of {}"},
    {SharedLimit{&Limits::print_accel_mm_s2, &Change::print_accel_mm_s2},
     "limits.print_accel_mm_s2", "acceleration of prints"},
    {SharedLimit{&Limits::travel_accel_mm_s2, &Change::travel_accel_mm_s2},
     "limits.travel_accel_mm_s2", "acceleration of travel"},
    {SharedLimit{&Limits::retract_accel_mm_s2, &Change::retract_accel_mm_s2},
     "limits.retract_accel_mm_s2", "acceleration of retraction"},
    {SharedLimit{&Limits::junction_deviation_mm, &Change::junction_deviation_mm},
     "limits.junction_deviation_mm", "junction deviation"},
    {SharedLimit{&Limits::min_velocity_mm_s, &Change::min_velocity_mm_s},
     "limits.min_velocity_mm_s", "minimum velocity"},
    {SharedLimit{&Limits::min_travel_velocity_mm_s, &Change::min_travel_velocity_mm_s},
     "limits.min_travel_velocity_mm_s", "minimum velocity of travel"},
    {SharedLimit{&Limits::min_segment_time_s, &Change::min_segment_time_s},
     "limits.min_segment_time_ms", "minimum segment time", kMsPerSecond},
    {SharedLimit{&Limits::min_movement_velocity_mm_s, &Change::min_movement_velocity_mm_s},
     "limits.min_movement_velocity_mm_s", "minimum speed of movement"},
    {ChoiceLimit{&Limits::jerk_policy, &Change::jerk_policy}, "limits.jerk_policy", "jerk policy"}};

}  // namespace

std::span<const LimitRow> limit_rows() { return kRows; }

}  // namespace unflex::planner
