#include "unflex/verify/verify.hpp"

#include "verifier.hpp"

namespace unflex::verify {
namespace {

Deviation deviation(const Meter& meter) {
  return {meter.extruding().stats(), meter.all().stats(), meter.height()};
}

PlayedFile played(Meter& meter, const Track& track) {
  meter.line()->finish();
  return {deviation(meter),     meter.corners(),    meter.line()->stats(), meter.filament_lag(),
          track.flow().stats(), track.printing_s(), track.pushed_mm(),     meter.places()};
}

}  // namespace

VerifyReport Verifier::report() {
  VerifyReport report = totals_;
  Measured& measured = report.measured;
  measured.uncompensated = played(original_.main(), input_);
  measured.compensated = played(emitted_.main(), output_);
  if (unshaped_) {
    measured.unshaped = deviation(unshaped_->main());
  }
  for (std::size_t i = 0; i < original_.detuned(); ++i) {
    report.detuned.push_back(
        {original_.deviation_of_detuned(i), std::nullopt, emitted_.deviation_of_detuned(i)});
    if (unshaped_ && i < unshaped_->detuned()) {
      report.detuned.back().unshaped = unshaped_->deviation_of_detuned(i);
    }
  }
  measured.compensated_feed = emitted_.main().feed();
  measured.flow_difference = flow_difference_.stats();
  measured.base = {base_.max_velocity_mm_s(), base_.max_accel_mm_s2(), base_.max_step_mm_s(),
                   base_.largest_accel_limit_mm_s2()};
  measured.output = {output_.replay().lines_read(), output_.replay().reader().bytes_read(),
                     rate_.largest_per_s(), 1e3 * base_.median_duration_s()};
  measured.worst_run_drift_s = emitted_.main().worst_lag_s();
  report.sliced_steps = input_.steps().largest();
  report.emitted_steps = output_.steps().largest();
  report.sliced_step_breaches = input_.steps().breaches();
  report.violation_count = violations_.count();
  report.violations = violations_.take();
  report.blamed_runs = violations_.take_blamed();
  report.time_notes = time_notes(input_.notes(), output_.notes());
  return report;
}

Result<VerifyReport> verify(std::istream& input, const std::string& input_name,
                            std::istream& output, const std::string& output_name,
                            const Rules& rules, Progress& progress,
                            const Observation& observation) {
  return Verifier(input, input_name, output, output_name, rules, progress, observation).verify();
}

}  // namespace unflex::verify
