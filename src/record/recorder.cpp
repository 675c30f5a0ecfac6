#include "unflex/record/recorder.hpp"

#include <array>

#include "gatherer.hpp"

namespace unflex::record {
namespace {

// By how much true frequencies are off; in between they are as set.
constexpr std::array<double, 4> kErrors = {-0.10, -0.05, 0.05, 0.10};
constexpr std::size_t kBelow = 2;
// The nozzle is a smooth function of time: for a tenth of the steps the maxima are the same within
// one percent.
constexpr double kCoarseStep_s = 1e-3;

verify::NozzleModel detuned(const verify::NozzleModel& model, double error) {
  verify::NozzleModel result = model;
  result.x.omega_rad_s *= 1.0 + error;
  result.y.omega_rad_s *= 1.0 + error;
  result.step_s = std::max(model.step_s, kCoarseStep_s);
  return result;
}

report::Spread spread(const verify::Deviation& deviation) {
  return {deviation.extruding.contour_max_mm, deviation.extruding.contour_rms_mm};
}

// The main value, which comes first, goes between those below and those above.
template <class Value>
std::vector<Value> in_order(const Value& main, const std::vector<Value>& others) {
  std::vector<Value> result = others;
  result.insert(result.begin() + static_cast<std::ptrdiff_t>(kBelow), main);
  return result;
}

}  // namespace

Recorder::Recorder(const Options& options)
    : options_(options), gatherer_(std::make_unique<Gatherer>(options, kErrors.size() + 1)) {}

Recorder::~Recorder() = default;

verify::Observation Recorder::observation() {
  verify::Observation observation;
  for (const double error : kErrors) {
    observation.detuned.push_back(detuned(options_.nozzle, error));
  }
  observation.observer = gatherer_.get();
  return observation;
}

report::Recording Recorder::finish(const verify::VerifyReport& verified) {
  report::Recording recording = gatherer_->finish();
  recording.frequency_errors = in_order(0.0, {kErrors.begin(), kErrors.end()});
  std::vector<report::Spread> before;
  std::vector<report::Spread> after;
  for (const verify::Detuned& other : verified.detuned) {
    before.push_back(spread(other.uncompensated));
    after.push_back(spread(other.compensated));
  }
  std::vector<report::Contender> contenders = {
      {"uncompensated", in_order(spread(verified.uncompensated), before)},
      {"unflex", in_order(spread(verified.compensated), after)}};
  for (report::Contender& shaper : recording.contenders) {
    if (!shaper.spreads.empty()) {
      shaper.spreads =
          in_order(shaper.spreads.front(), {shaper.spreads.begin() + 1, shaper.spreads.end()});
    }
    contenders.push_back(std::move(shaper));
  }
  recording.contenders = std::move(contenders);
  return recording;
}

}  // namespace unflex::record
