#include "lag_estimate.hpp"

#include <algorithm>

#include "unflex/core/math.hpp"

namespace unflex::verify {
namespace {

constexpr double kMemory_s = 0.1;
constexpr double kLeastMemory_s = 0.05;
constexpr double kLeastSpeed_mm_s = 5.0;

}  // namespace

void LagEstimate::add(double error_dot_velocity, double velocity2, double h) {
  if (h != last_h_) {
    last_h_ = h;
    keep_ = math::exp(-h / kMemory_s);
  }
  error_dot_velocity_ = keep_ * error_dot_velocity_ + h * error_dot_velocity;
  velocity2_ = keep_ * velocity2_ + h * velocity2;
  weight_s_ = keep_ * weight_s_ + h;
  if (weight_s_ >= kLeastMemory_s &&
      velocity2_ >= kLeastSpeed_mm_s * kLeastSpeed_mm_s * weight_s_) {
    worst_s_ = std::max(worst_s_, std::abs(error_dot_velocity_) / velocity2_);
  }
}

void LagEstimate::restart() {
  error_dot_velocity_ = 0.0;
  velocity2_ = 0.0;
  weight_s_ = 0.0;
}

}  // namespace unflex::verify
