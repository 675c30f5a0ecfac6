#include "unflex/record/recorder.hpp"

#include <array>
#include <span>

#include "gatherer.hpp"

namespace unflex::record {
namespace {

// Number of negative frequency errors, which come first.
constexpr std::size_t kBelow = 2;

report::Spread spread(const verify::Deviation& deviation) {
  return {deviation.extruding.contour_max_mm, deviation.extruding.contour_rms_mm};
}

// All values by rising frequency error: `main` goes after the kBelow first ones.
template <class Value>
std::vector<Value> in_order(const Value& main, const std::vector<Value>& others) {
  std::vector<Value> result = others;
  result.insert(result.begin() + static_cast<std::ptrdiff_t>(kBelow), main);
  return result;
}

}  // namespace

Recorder::Recorder(const Options& options)
    : options_(options),
      gatherer_(std::make_unique<Gatherer>(options, verify::kFrequencyErrors.size() + 1)) {}

Recorder::~Recorder() = default;

verify::Observer& Recorder::observer() { return *gatherer_; }

report::Recording Recorder::finish(const verify::VerifyReport& verified) {
  report::Recording recording = gatherer_->finish();
  recording.frequency_errors =
      in_order(0.0, {verify::kFrequencyErrors.begin(), verify::kFrequencyErrors.end()});
  std::vector<report::Spread> before;
  std::vector<report::Spread> after;
  const std::span<const verify::Detuned> detuned =
      std::span(verified.detuned).first(verify::kFrequencyErrors.size());
  for (const verify::Detuned& other : detuned) {
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
  if (verified.unshaped) {
    std::vector<report::Spread> unshaped;
    for (const verify::Detuned& other : detuned) {
      unshaped.push_back(spread(*other.unshaped));
    }
    contenders.push_back(
        {"without the printer's shaper", in_order(spread(*verified.unshaped), unshaped)});
  }
  recording.contenders = std::move(contenders);
  return recording;
}

}  // namespace unflex::record
