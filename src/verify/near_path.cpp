#include "unflex/verify/near_path.hpp"

#include <algorithm>
#include <numbers>

namespace unflex::verify {
namespace {

// The nozzle lags by less than half a period of its slower axis. This constant is added for a base
// whose clock is off.
constexpr double kClockReach_s = 0.02;

}  // namespace

double reach_s(const NozzleModel& model) {
  return kClockReach_s + std::numbers::pi / dynamics::slowest_rad_s(model);
}

void NearPath::begin(const ReferencePath& path) {
  first_cut_ = last_cut_ = Cut{};
  first_ = path.first();
  end_ = path.first();
  spans_.clear();
  dropped_ = 0;
}

void NearPath::add_span(const PathPiece& piece) {
  // Memory moves up now and then, so that it does not grow.
  constexpr std::size_t kMany = 256;
  if (dropped_ >= kMany && dropped_ >= spans_.size() / 2) {
    spans_.erase(spans_.begin(), spans_.begin() + static_cast<std::ptrdiff_t>(dropped_));
    dropped_ = 0;
  }
  spans_.push_back(
      {piece.start_mm, piece.direction, piece.length_xy_mm, piece.start_s, piece.end_s});
  ++end_;
}

void NearPath::drop_span() {
  ++first_;
  if (end_ < first_) {
    end_ = first_;
  } else {
    ++dropped_;
  }
}

double NearPath::begin_bound_mm(const ReferencePath& path) {
  return first_cut_.at(path[first_], first_, time_s_ - reach_s_, kCutKept_s);
}

double NearPath::begin_mm(const ReferencePath& path) const {
  return path[first_].covered_xy_mm(time_s_ - reach_s_);
}

double NearPath::end_bound_mm(const ReferencePath& path) {
  return last_cut_.at(path[end_ - 1], end_ - 1, time_s_ + reach_s_, 0.0);
}

double NearPath::end_mm(const ReferencePath& path) const {
  return path[end_ - 1].covered_xy_mm(time_s_ + reach_s_);
}

}  // namespace unflex::verify
