#include "unflex/run/machine_model.hpp"

#include <algorithm>
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

// The number of the printer's own tool, for tools that it does not tell of.
constexpr int kOwn = -1;

}  // namespace

MachineModel::MachineModel(const machine::Settings& settings,
                           std::function<RunRules(const machine::Settings&)> rules_for)
    : settings_(settings),
      rules_for_(std::move(rules_for)),
      given_(std::make_shared<RunRules>(rules_for_(settings))),
      tools_{{kOwn, {settings, given_, given_, {}}}} {}

MachineModel::OneTool& MachineModel::with_tool(int number) {
  const bool is_told =
      std::ranges::count(settings_.tools, number, &machine::ToolSettings::number) > 0;
  const auto [entry, is_new] = tools_.try_emplace(is_told ? number : kOwn);
  OneTool& tool = entry->second;
  if (is_new) {
    tool.settings = machine::with_tool(settings_, number);
    tool.given = std::make_shared<RunRules>(rules_for_(tool.settings));
    tool.present = tool.given;
  }
  return tool;
}

std::shared_ptr<const RunRules> MachineModel::at(const machine::MachineState& state) {
  OneTool& tool = with_tool(state.tool);
  if (!tool.settings.changes()) {
    return tool.given;
  }
  const auto steps_of = [&](const machine::AxisDynamics& axis) {
    const double by_place = axis.share_at(state.place_mm);
    return Steps{step_of(axis.frequency_share(state) / by_place), step_of(by_place)};
  };
  const Axes<Steps> steps = map_axes(steps_of, tool.settings.dynamics);
  if (steps != tool.steps) {
    tool.steps = steps;
    const auto share_of = [](const Steps& of_axis) {
      return machine::FrequencyShare{math::exp(kStep * static_cast<double>(of_axis.by_print)),
                                     math::exp(kStep * static_cast<double>(of_axis.by_place))};
    };
    tool.present = steps == Axes<Steps>{}
                       ? tool.given
                       : std::make_shared<RunRules>(rules_for_(
                             machine::with_frequencies(tool.settings, map_axes(share_of, steps))));
  }
  return tool.present;
}

}  // namespace unflex::run
