#include "unflex/run/machine_model.hpp"

#include <cmath>
#include <utility>

#include "unflex/core/math.hpp"
#include "unflex/machine/as_printer.hpp"

namespace unflex::run {
namespace {

// Rules are made for frequencies that are this far apart, as a difference of logarithms.
constexpr double kStep = 1e-3;

std::int64_t step_of(double share) {
  return static_cast<std::int64_t>(std::round(math::log(share) / kStep));
}

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
  const auto steps_of = [&](const machine::AxisDynamics& axis) {
    const double by_place = axis.share_at(state.place_mm);
    return Steps{step_of(axis.frequency_share(state) / by_place), step_of(by_place)};
  };
  const Axes<Steps> steps = map_axes(steps_of, settings_.dynamics);
  if (steps != steps_) {
    steps_ = steps;
    const auto share_of = [](const Steps& of_axis) {
      return machine::FrequencyShare{math::exp(kStep * static_cast<double>(of_axis.by_print)),
                                     math::exp(kStep * static_cast<double>(of_axis.by_place))};
    };
    present_ = steps == Axes<Steps>{}
                   ? given_
                   : std::make_shared<RunRules>(rules_for_(
                         machine::with_frequencies(settings_, map_axes(share_of, steps))));
  }
  return present_;
}

}  // namespace unflex::run
