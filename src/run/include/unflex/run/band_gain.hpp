// The gain of a print with free timing if its frequencies were known better. Some of its runs are
// timed once more, for half the band.
#pragma once

#include <optional>

#include "unflex/compensate/run.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/report/report.hpp"
#include "unflex/run/run_job.hpp"

namespace unflex::run {

class BandGain {
 public:
  explicit BandGain(const machine::Settings& settings);

  // Sets RunJob::narrow_setup if the run belongs to the sample. Runs come in the order of the file.
  void choose(RunJob& job);
  // A run that has been timed, in the same order.
  void add(const RunJob& job);
  // Unset if there is no band, or if nothing was sampled.
  [[nodiscard]] std::optional<report::NarrowerBand> result() const;

 private:
  const machine::Settings* settings_;
  double freq_error_;                       // of the narrower band
  std::optional<compensate::Setup> setup_;  // for the narrower band
  double offered_s_ = 0.0;                  // of all runs, as sliced
  double chosen_s_ = 0.0;                   // of the sample's runs, as sliced
  double timed_s_ = 0.0;                    // of all runs, as timed
  double sampled_s_ = 0.0;                  // of the sample's runs, as timed
  double narrow_s_ = 0.0;                   // of the sample's runs, as timed for the narrower band
};

}  // namespace unflex::run
