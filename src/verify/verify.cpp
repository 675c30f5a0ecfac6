#include "unflex/verify/verify.hpp"

#include "verifier.hpp"

namespace unflex::verify {
namespace {

Deviation deviation(const Meter& meter) { return {meter.extruding().stats(), meter.all().stats()}; }

}  // namespace

VerifyReport Verifier::report() {
  VerifyReport report = totals_;
  report.reference_time_s = input_.printing_s();
  report.emitted_time_s = output_.printing_s();
  report.input_extrusion_mm = input_.pushed_mm();
  report.output_extrusion_mm = output_.pushed_mm();
  report.uncompensated = deviation(original_.main());
  if (unshaped_) {
    report.unshaped = deviation(unshaped_->main());
  }
  report.compensated = deviation(emitted_.main());
  for (std::size_t i = 0; i < original_.detuned(); ++i) {
    report.detuned.push_back(
        {original_.deviation_of_detuned(i), std::nullopt, emitted_.deviation_of_detuned(i)});
    if (unshaped_ && i < unshaped_->detuned()) {
      report.detuned.back().unshaped = unshaped_->deviation_of_detuned(i);
    }
  }
  report.uncompensated_lag = original_.main().filament_lag();
  report.compensated_lag = emitted_.main().filament_lag();
  report.compensated_feed = emitted_.main().feed();
  report.uncompensated_corners = original_.main().corners();
  report.compensated_corners = emitted_.main().corners();
  for (Nozzles* const nozzles : {&original_, &emitted_}) {
    nozzles->main().line()->finish();
  }
  report.uncompensated_line = original_.main().line()->stats();
  report.compensated_line = emitted_.main().line()->stats();
  report.uncompensated_flow = input_.flow().stats();
  report.compensated_flow = output_.flow().stats();
  report.flow_difference = flow_difference_.stats();
  report.sliced_steps = input_.steps().largest();
  report.emitted_steps = output_.steps().largest();
  report.sliced_step_breaches = input_.steps().breaches();
  report.base_max_velocity_mm_s = base_.max_velocity_mm_s();
  report.base_max_accel_mm_s2 = base_.max_accel_mm_s2();
  report.base_max_step_mm_s = base_.max_step_mm_s();
  report.base_accel_limit_mm_s2 = base_.largest_accel_limit_mm_s2();
  report.worst_run_drift_s = emitted_.main().worst_lag_s();
  report.max_lines_per_s = rate_.largest_per_s();
  report.segment_ms_median = 1e3 * base_.median_duration_s();
  report.output_lines = output_.replay().lines_read();
  report.output_bytes = output_.replay().reader().bytes_read();
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
