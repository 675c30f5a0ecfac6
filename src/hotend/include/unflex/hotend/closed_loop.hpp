// The response of a plant with a controller to a step of the target, and to a load.
#pragma once

#include <optional>
#include <vector>

#include "unflex/hotend/plant.hpp"
#include "unflex/hotend/rules.hpp"

namespace unflex::hotend {

// A controller as firmwares have it: the power is bounded to 0 … full, the derivative is a backward
// difference of the error, and 0 at first.
struct Control {
  Gains gains = {};
  // Time between two samples. The power is held between them, which adds half of it to the dead
  // time.
  double sample_s = kUsualSample_s;
  // A sample whose power leaves the bounds is not kept in ∫e. Without this the integral winds up
  // while the hotend heats at full power.
  bool conditional_integration = true;
};

struct Response {
  double step_s = 0.0;
  std::vector<double> temperature_c;  // at 0, step, 2 step, …
  std::vector<double> power;          // from there on, counts
  double peak_c = 0.0;
  // Time from which on the temperature stays within 1 % of the target in °C. None if it does not by
  // the end.
  std::optional<double> settled_s;
  // The largest distance from the target.
  double worst_c = 0.0;
};

struct Span {
  double duration_s = 1200.0;
  double step_s = 0.05;  // of what is recorded; sample_s is rounded to a multiple of it
};

// The plant rests at start_c, with the power that holds it, and the target leaps. worst_c counts
// from where the temperature first reaches the target, and is 0 if it never does. The plant must
// pass check(), steps must be above 0.
[[nodiscard]] Response step_response(const Plant& plant, const Control& control, double start_c,
                                     double target_c, const Span& span = {});

// The plant rests at the target, held by the integral, and a load begins. load is in counts, see
// load_in_counts().
[[nodiscard]] Response load_response(const Plant& plant, const Control& control, double target_c,
                                     double load, const Span& span = {});

}  // namespace unflex::hotend
