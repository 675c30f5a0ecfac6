#include "unflex/rivals/s_curve.hpp"

namespace unflex::rivals {
namespace {

// Parabolas per ramp. At 64 they are off by less than 1e-8 of the ramp's length.
constexpr int kParts = 64;

// At fraction u of the ramp: the share of the change of speed that is done, and its integral.
double share(double u) { return u < 0.5 ? 2.0 * u * u : 1.0 - 2.0 * (1.0 - u) * (1.0 - u); }
double covered(double u) {
  return u < 0.5 ? 2.0 / 3.0 * u * u * u : u - 0.5 + 2.0 / 3.0 * (1.0 - u) * (1.0 - u) * (1.0 - u);
}

class Builder {
 public:
  Builder(const planner::PlannedMove& move, gcode::Axis axis, double start_s)
      : along_(move.direction[axis]),
        start_mm_(move.segment.start_mm[axis]),
        move_(&move),
        start_s_(start_s) {}

  void cruise(AxisPath& path, double velocity, double duration_s) {
    if (duration_s > 0.0) {
      append(path, 0.0, move_->distance_mm(elapsed_s_), velocity, 0.0);
      elapsed_s_ += duration_s;
    }
  }

  void ramp(AxisPath& path, double from, double to, double duration_s) {
    const double distance = move_->distance_mm(elapsed_s_);
    for (int i = 0; i < kParts && duration_s > 0.0; ++i) {
      const double u = static_cast<double>(i) / kParts;
      const double next = static_cast<double>(i + 1) / kParts;
      append(path, u * duration_s, distance + duration_s * (from * u + (to - from) * covered(u)),
             from + (to - from) * share(u),
             (to - from) * (share(next) - share(u)) * kParts / duration_s);
    }
    elapsed_s_ += duration_s;
  }

 private:
  void append(AxisPath& path, double offset_s, double distance, double velocity,
              double acceleration) const {
    path.push_back({start_s_ + elapsed_s_ + offset_s,
                    {start_mm_ + along_ * distance, along_ * velocity, along_ * acceleration}});
  }

  double along_;
  double start_mm_;
  const planner::PlannedMove* move_;
  double start_s_;
  double elapsed_s_ = 0.0;
};

}  // namespace

AxisPath s_curve(const std::vector<planner::PlannedMove>& moves, gcode::Axis axis) {
  AxisPath path;
  double start_s = 0.0;
  for (const planner::PlannedMove& move : moves) {
    Builder builder(move, axis, start_s);
    builder.cruise(path, move.start_v_mm_s, move.lead_s);
    builder.ramp(path, move.start_v_mm_s, move.cruise_v_mm_s, move.accel_s);
    builder.cruise(path, move.cruise_v_mm_s, move.cruise_s);
    builder.ramp(path, move.cruise_v_mm_s, move.end_v_mm_s, move.decel_s);
    start_s += move.duration_s();
  }
  path.push_back({start_s, {moves.back().segment.end_mm[axis], 0.0, 0.0}});
  return path;
}

}  // namespace unflex::rivals
