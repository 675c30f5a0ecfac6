// A controller of temperature as firmwares have it. Control in closed_loop.hpp describes it;
// rules.hpp has the notation of its gains.
#pragma once

#include <algorithm>

#include "unflex/hotend/closed_loop.hpp"

namespace unflex::hotend {

class Controller {
 public:
  // Powers are in counts, full_power is the most. held: the power that the integral gives at first.
  // The sum K_i ∫e is kept as a power, so that a loop without integral can hold what it starts
  // with.
  Controller(const Control& control, double sample_s, double full_power, double held)
      : control_(control), sample_s_(sample_s), full_power_(full_power), held_(held) {}

  // The power from this sample on, 0 … full_power. error_c: target minus temperature. To be called
  // once every sample_s.
  double power(double error_c) {
    const double slope_c_s = is_first_ ? 0.0 : (error_c - last_c_) / sample_s_;
    is_first_ = false;
    last_c_ = error_c;
    const double held = held_ + control_.gains.i * error_c * sample_s_;
    const double wanted = control_.gains.p * error_c + held + control_.gains.d * slope_c_s;
    const double given = std::clamp(wanted, 0.0, full_power_);
    if (given == wanted || !control_.conditional_integration) {
      held_ = held;
    }
    return given;
  }

 private:
  Control control_;
  double sample_s_;
  double full_power_;
  double held_;
  bool is_first_ = true;
  double last_c_ = 0.0;  // error of the last sample
};

}  // namespace unflex::hotend
