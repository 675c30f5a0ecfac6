#include "unflex/record/recorder.hpp"

#include <algorithm>
#include <span>

#include "gatherer.hpp"

namespace unflex::record {
namespace {

// Number of negative frequency errors, which come first.
constexpr std::ptrdiff_t kBelow =
    std::ranges::count_if(verify::kFrequencyErrors, [](double error) { return error < 0.0; });

report::Spread spread(const verify::Deviation& deviation) {
  return {deviation.extruding.contour_max_mm, deviation.extruding.contour_rms_mm};
}

// All values by rising frequency error: `main` goes after the kBelow first ones.
template <class Value>
std::vector<Value> in_order(const Value& main, const std::vector<Value>& others) {
  std::vector<Value> result = others;
  result.insert(result.begin() + kBelow, main);
  return result;
}

std::optional<double> rms_of(const verify::CornerStats& corners) {
  return corners.count > 0 ? std::optional(corners.rms_mm) : std::nullopt;
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
  const std::span<const verify::Detuned> detuned =
      std::span(verified.detuned).first(verify::kFrequencyErrors.size());
  const auto spreads = [&](const verify::Deviation& main, const auto& of_other) {
    std::vector<report::Spread> others;
    for (const verify::Detuned& other : detuned) {
      others.push_back(spread(of_other(other)));
    }
    return in_order(spread(main), others);
  };
  report::Contender played{"as sliced",
                           spreads(verified.measured.uncompensated,
                                   [](const auto& other) { return other.uncompensated; }),
                           true, rms_of(verified.measured.uncompensated.corners)};
  const bool has_unshaped = verified.measured.unshaped && gatherer_->asks_for_unshaped();
  std::vector<report::Contender> contenders = {
      has_unshaped ? report::Contender{"as sliced",
                                       spreads(*verified.measured.unshaped,
                                               [](const auto& other) { return *other.unshaped; }),
                                       true, std::nullopt}
                   : played,
      {"unflex",
       spreads(verified.measured.compensated, [](const auto& other) { return other.compensated; }),
       true, rms_of(verified.measured.compensated.corners)}};
  for (report::Contender& shaper : recording.contenders) {
    if (!shaper.spreads.empty()) {
      shaper.spreads =
          in_order(shaper.spreads.front(), {shaper.spreads.begin() + 1, shaper.spreads.end()});
    }
    contenders.push_back(std::move(shaper));
  }
  if (has_unshaped) {
    // Where the printer's own shaper is known, its curve is there already.
    played.name = "as sliced, shaper on";
    played.drawn = !options_.printer_shaper;
    contenders.push_back(std::move(played));
  }
  recording.contenders = std::move(contenders);
  return recording;
}

}  // namespace unflex::record
