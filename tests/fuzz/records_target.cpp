// Recordings of accelerometers, and the modes that are fitted to them.
#include <array>
#include <cmath>
#include <string>

#include "bytes.hpp"
#include "text_checks.hpp"
#include "unflex/identify/mode.hpp"

namespace unflex::fuzz {
namespace {

void check_estimate(const identify::Estimate& estimate) {
  require(std::isfinite(estimate.value) && estimate.value > 0.0, "an estimate of no value");
  require(estimate.low <= estimate.value && estimate.value <= estimate.high,
          "an estimate outside its interval");
}

void check_mode(const identify::Mode& mode) {
  check_estimate(mode.freq_hz);
  check_estimate(mode.damping_ratio);
  require(mode.damping_ratio.value < 1.0, "a mode that does not ring");
  require(mode.unexplained >= 0.0 && mode.unexplained <= 1.0, "a share beyond 0 to 1");
  require(mode.curve.measured.size() == mode.curve.x.size() &&
              mode.curve.fitted.size() == mode.curve.x.size(),
          "a curve in parts of different lengths");
  for (const std::string& warning : mode.warnings) {
    require_one_line(warning);
  }
}

}  // namespace

void records(std::string_view bytes) {
  constexpr std::array<const char*, 4> kNames = {"raw_data_x_1.csv", "resonances_y_2.csv",
                                                 "raw_data_axis=1.000,-1.000_b.csv", "0.csv"};
  Bytes source(bytes);
  const std::string name = kNames[source.variant(kNames.size())];
  const Result<std::vector<identify::DataSet>> sets = identify::parse_csv(source.rest(), name);
  if (!sets) {
    return require_fault_of_input(sets.error());
  }
  std::vector<identify::Mode> modes;
  for (const identify::DataSet& set : *sets) {
    for (const std::string& note : set.notes) {
      require_one_line(note);
    }
    const Result<identify::Mode> mode =
        identify::fit(set, set.axis.value_or(identify::dominant_axis(set)), {});
    if (!mode) {
      require_fault_of_input(mode.error());
      continue;
    }
    check_mode(*mode);
    modes.push_back(*mode);
  }
  if (modes.size() > 1) {
    check_mode(identify::combine(modes));
  }
}

}  // namespace unflex::fuzz
