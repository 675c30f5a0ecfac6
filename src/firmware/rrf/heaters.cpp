#include <optional>

#include "rrf_heaters.hpp"
#include "unflex/core/number.hpp"
#include "unflex/hotend/firmware_words.hpp"

namespace unflex::machine {
namespace {

// Losses follow a power law. The linear model has the same loss at this temperature above the
// ambient one, which is usual in prints.
constexpr double kWorking_c = 185.0;

}  // namespace

void RrfHeaters::read(const gcode::Command& command, const SourcePlace& place) {
  if (command.is('M', 563) && command.value('P') == 0.0 && command.value('H')) {
    heater_ = to_int(*command.value('H'));
  }
  const std::optional<double> dead_time_s = command.value('D');
  if (!command.is('M', 307) || !command.value('H') || !(dead_time_s.value_or(0.0) > 0.0)) {
    return;
  }
  double rate_c_s = command.value('R').value_or(0.0);
  double time_constant_s = command.value('C').value_or(0.0);
  if (const double cooling_c_s = command.value('K').value_or(0.0); cooling_c_s > 0.0) {
    time_constant_s = hotend::time_constant_s(cooling_c_s, kWorking_c,
                                              command.value('E').value_or(hotend::kRrfExponent));
  } else if (rate_c_s <= 0.0 && time_constant_s > 0.0) {
    rate_c_s = command.value('A').value_or(0.0) / time_constant_s;  // until version 3.1
  }
  const double gain_c = rate_c_s * time_constant_s / hotend::kFullPower;
  if (gain_c > 0.0 && time_constant_s > 0.0) {
    models_[to_int(*command.value('H'))] = {gain_c, time_constant_s, *dead_time_s, place};
  }
}

void RrfHeaters::add_to(Reading& reading) const {
  const auto model = models_.find(heater_);
  if (model == models_.end()) {
    return;
  }
  const auto& [gain_c, time_constant_s, dead_time_s, place] = model->second;
  reading.add("hotend.gain_c", gain_c, place);
  reading.add("hotend.time_constant_s", time_constant_s, place);
  reading.add("hotend.dead_time_s", dead_time_s, place);
}

}  // namespace unflex::machine
