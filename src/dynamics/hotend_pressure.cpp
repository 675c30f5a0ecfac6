#include "unflex/dynamics/hotend_pressure.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/core/math.hpp"

namespace unflex::dynamics {

double HotendPressure::pressed_mm(double flow_mm_s) const {
  const double q = std::abs(flow_mm_s);
  double pressed = advance_s * q;
  switch (shape) {
    case PressureShape::linear:
      break;
    case PressureShape::two_slopes:
      pressed =
          advance_s * std::min(q, knee_mm_s) + second_advance_s * std::max(q - knee_mm_s, 0.0);
      break;
    case PressureShape::tanh:
      pressed += offset_mm * math::tanh(q / knee_mm_s);
      break;
    case PressureShape::reciprocal:
      pressed += offset_mm * (1.0 - 1.0 / (1.0 + q / knee_mm_s));
      break;
  }
  return std::copysign(pressed, flow_mm_s);
}

double HotendPressure::slope_s(double flow_mm_s) const {
  const double q = std::abs(flow_mm_s);
  switch (shape) {
    case PressureShape::linear:
      break;
    case PressureShape::two_slopes:
      return q > knee_mm_s ? second_advance_s : advance_s;
    case PressureShape::tanh: {
      const double bend = math::tanh(q / knee_mm_s);
      return advance_s + offset_mm / knee_mm_s * (1.0 - bend * bend);
    }
    case PressureShape::reciprocal: {
      const double bend = 1.0 + q / knee_mm_s;
      return advance_s + offset_mm / (knee_mm_s * bend * bend);
    }
  }
  return advance_s;
}

HotendPressure HotendPressure::scaled(double times) const {
  HotendPressure result = *this;
  result.advance_s *= times;
  result.offset_mm *= times;
  result.second_advance_s *= times;
  return result;
}

}  // namespace unflex::dynamics
