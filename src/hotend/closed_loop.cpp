// Notation of rules.hpp.
#include "unflex/hotend/closed_loop.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "controller.hpp"

namespace unflex::hotend {
namespace {

struct Task {
  double start_c = 0.0;
  double target_c = 0.0;
  double held = 0.0;  // by the integral at first
  double load = 0.0;
};

Response run(const Plant& plant, const Control& control, const Task& task, const Span& span) {
  const auto count = static_cast<std::size_t>(std::max(1.0, span.duration_s / span.step_s));
  const auto every =
      static_cast<std::size_t>(std::max(1.0, std::round(control.sample_s / span.step_s)));
  Controller controller(control, static_cast<double>(every) * span.step_s, plant.full_power,
                        task.held);
  Simulation simulation(plant, task.start_c);
  Response response;
  response.step_s = span.step_s;
  double power = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    const double temperature_c = simulation.temperature_c();
    if (k % every == 0) {
      power = controller.power(task.target_c - temperature_c);
    }
    response.temperature_c.push_back(temperature_c);
    response.power.push_back(power);
    simulation.advance(power, span.step_s, task.load);
  }
  return response;
}

void judge(Response& response, double target_c) {
  constexpr double kBand = 0.01;
  const std::vector<double>& all_c = response.temperature_c;
  response.peak_c = *std::ranges::max_element(all_c);
  const auto last_outside = std::find_if(all_c.rbegin(), all_c.rend(), [&](double value_c) {
    return std::abs(value_c - target_c) > kBand * target_c;
  });
  if (last_outside != all_c.rbegin()) {
    response.settled_s = response.step_s * static_cast<double>(all_c.rend() - last_outside);
  }
}

double worst_from(const std::vector<double>& all_c, std::size_t first, double target_c) {
  double worst_c = 0.0;
  for (std::size_t k = first; k < all_c.size(); ++k) {
    worst_c = std::max(worst_c, std::abs(all_c[k] - target_c));
  }
  return worst_c;
}

}  // namespace

Response step_response(const Plant& plant, const Control& control, double start_c, double target_c,
                       const Span& span) {
  // A cold hotend's integral is empty.
  const Task task{.start_c = start_c,
                  .target_c = target_c,
                  .held = std::max(0.0, plant.holding_power(start_c)),
                  .load = 0.0};
  Response response = run(plant, control, task, span);
  judge(response, target_c);
  const bool rises = start_c < target_c;
  const auto reached = std::ranges::find_if(response.temperature_c, [&](double value_c) {
    return rises ? value_c >= target_c : value_c <= target_c;
  });
  response.worst_c =
      worst_from(response.temperature_c,
                 static_cast<std::size_t>(reached - response.temperature_c.begin()), target_c);
  return response;
}

Response load_response(const Plant& plant, const Control& control, double target_c, double load,
                       const Span& span) {
  const Task task{.start_c = target_c,
                  .target_c = target_c,
                  .held = plant.holding_power(target_c),
                  .load = load};
  Response response = run(plant, control, task, span);
  judge(response, target_c);
  response.worst_c = worst_from(response.temperature_c, 0, target_c);
  return response;
}

}  // namespace unflex::hotend
