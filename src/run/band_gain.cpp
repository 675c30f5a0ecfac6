#include "unflex/run/band_gain.hpp"

#include <cstddef>

#include "unflex/planner/planner.hpp"
#include "unflex/run/setup.hpp"

namespace unflex::run {
namespace {

constexpr double kNarrower = 0.5;
// The share of the motion that is sampled.
constexpr double kSampled = 0.06;
// Runs of fewer moves prime the nozzle, or are not typical.
constexpr std::size_t kFewest = 8;

}  // namespace

BandGain::BandGain(const machine::Settings& settings)
    : settings_(&settings), freq_error_(kNarrower * settings.freq_error()) {
  if (settings.is_timing_free() && freq_error_ > 0.0) {
    machine::Settings narrow = settings;
    narrow.dynamics_error.freq = freq_error_;
    setup_ = compensate_setup(narrow);
  }
}

void BandGain::choose(RunJob& job) {
  if (!setup_) {
    return;
  }
  const double sliced_s = planner::duration_s(job.piece.moves);
  offered_s_ += sliced_s;
  if (job.piece.moves.size() >= kFewest && chosen_s_ < kSampled * offered_s_) {
    chosen_s_ += sliced_s;
    job.search.narrow_setup = setup_for(*setup_, job.piece, job.nozzle, *settings_).setup;
  }
}

void BandGain::add(const RunJob& job) {
  const double timed_s = planner::duration_s(job.reference());
  timed_s_ += timed_s;
  if (job.search.narrow_s) {
    sampled_s_ += timed_s;
    narrow_s_ += *job.search.narrow_s;
  }
}

std::optional<report::NarrowerBand> BandGain::result() const {
  if (!(sampled_s_ > 0.0)) {
    return std::nullopt;
  }
  return report::NarrowerBand{freq_error_, timed_s_ * (1.0 - narrow_s_ / sampled_s_)};
}

}  // namespace unflex::run
