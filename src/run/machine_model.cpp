// Notation:
//   m   mass of the print      m₀   the least mass of an axis that carries it
//   c   ln(f₀ / f) = ½ ln(1 + m / m₀), which a run's rules are made for in steps of kStep
#include "unflex/run/machine_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "unflex/core/math.hpp"
#include "unflex/machine/as_printer.hpp"

namespace unflex::run {
namespace {

constexpr double kStep = 1e-3;

double least_mass_g(const machine::Settings& settings) {
  return least_of_axes(
      [](const machine::AxisDynamics& axis) {
        return axis.moving_mass_g > 0.0 ? axis.moving_mass_g
                                        : std::numeric_limits<double>::infinity();
      },
      settings.dynamics);
}

}  // namespace

MachineModel::MachineModel(const machine::Settings& settings,
                           std::function<RunRules(const machine::Settings&)> rules_for)
    : settings_(settings),
      rules_for_(std::move(rules_for)),
      empty_(std::make_shared<RunRules>(rules_for_(settings))),
      present_(empty_) {}

std::shared_ptr<const RunRules> MachineModel::at(double printed_mm) {
  if (!settings_.carries_print()) {
    return empty_;
  }
  const double mass_g = std::max(printed_mm, 0.0) * settings_.filament_g_per_mm();
  const double least_g = least_mass_g(settings_);
  const auto step =
      static_cast<std::int64_t>(std::round(0.5 * math::log(1.0 + mass_g / least_g) / kStep));
  if (step != step_) {
    step_ = step;
    const double share = math::exp(2.0 * kStep * static_cast<double>(step));
    present_ = step == 0 ? empty_
                         : std::make_shared<RunRules>(
                               rules_for_(machine::with_print(settings_, least_g * (share - 1.0))));
  }
  return present_;
}

}  // namespace unflex::run
