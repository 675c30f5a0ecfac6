#include "unflex/run/machine_model.hpp"

#include <cmath>
#include <utility>

#include "unflex/core/math.hpp"
#include "unflex/machine/as_printer.hpp"

namespace unflex::run {
namespace {

// Rules are made for frequencies that are this far apart, as a difference of logarithms.
constexpr double kStep = 1e-3;

}  // namespace

MachineModel::MachineModel(const machine::Settings& settings,
                           std::function<RunRules(const machine::Settings&)> rules_for)
    : settings_(settings),
      rules_for_(std::move(rules_for)),
      given_(std::make_shared<RunRules>(rules_for_(settings))),
      present_(given_) {}

std::shared_ptr<const RunRules> MachineModel::at(const machine::MachineState& state) {
  if (!settings_.changes()) {
    return given_;
  }
  const auto step_of = [&](const machine::AxisDynamics& axis) {
    return static_cast<std::int64_t>(std::round(math::log(axis.frequency_share(state)) / kStep));
  };
  const auto steps = map_axes(step_of, settings_.dynamics);
  if (steps != steps_) {
    steps_ = steps;
    const auto share_of = [](std::int64_t step) {
      return math::exp(kStep * static_cast<double>(step));
    };
    const bool is_given = steps == on_all_axes<std::int64_t>(0);
    present_ = is_given ? given_
                        : std::make_shared<RunRules>(rules_for_(
                              machine::with_frequencies(settings_, map_axes(share_of, steps))));
  }
  return present_;
}

}  // namespace unflex::run
