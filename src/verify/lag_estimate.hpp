// By how much the nozzle lags behind the reference.
#pragma once

#include <cmath>

namespace unflex::verify {

// Estimates by how much the nozzle lags behind the reference, by regression of the tracking error
// on the reference's velocity with a fading memory: lag = Σ (r − p)·ṙ / Σ |ṙ|². Errors across the
// path and errors that change sign with the curve of the path cancel; a late clock does not.
class LagEstimate {
 public:
  void add(double error_dot_velocity, double velocity2, double h);
  // Starts afresh, keeping the largest lag found.
  void restart();
  [[nodiscard]] double worst_s() const { return worst_s_; }
  // The present lag; 0 while the reference rests.
  [[nodiscard]] double present_s() const {
    return velocity2_ > 0.0 ? std::abs(error_dot_velocity_) / velocity2_ : 0.0;
  }

 private:
  double error_dot_velocity_ = 0.0;
  double velocity2_ = 0.0;
  double weight_s_ = 0.0;
  double worst_s_ = 0.0;
  double last_h_ = 0.0;  // h of the last sample
  double keep_ = 1.0;    // share of the memory that stays after last_h_
};

}  // namespace unflex::verify
