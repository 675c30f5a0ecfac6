#include "unflex/study/study_print.hpp"

#include <fmt/core.h>

#include "run_batches.hpp"
#include "unflex/machine/as_printer.hpp"
#include "unflex/run/setup.hpp"

namespace unflex::study {
namespace {

study::BenchSetup bench_setup(const machine::Settings& settings) {
  study::BenchSetup setup;
  setup.unflex = run::compensate_setup(settings);
  machine::Settings in_band = settings;
  in_band.dynamics_error.freq = study::kBandError;
  setup.unflex_band = run::compensate_setup(in_band);
  if (any_axis([](double freq_hz) { return freq_hz > 0.0; }, settings.second.freq_hz)) {
    setup.two_stage = machine::nozzle_axes(settings);
  }
  setup.plan_accel_mm_s2 = settings.limits.max_accel_mm_s2;
  setup.thesis_period_s = setup.unflex.period_s;
  setup.step_s = study::kPrintStep_s;
  setup.parts = study::kPrintParts;
  return setup;
}

std::string describe(const machine::Settings& settings) {
  std::string text;
  for_each_axis(
      [&](std::string_view letter, const machine::AxisDynamics& axis, double freq_hz,
          double damping_ratio) {
        text += fmt::format("{} {}", letter, axis.description());
        text += freq_hz > 0.0
                    ? fmt::format(", behind it {:.4g} Hz, ζ {:.3g}", freq_hz, damping_ratio)
                    : std::string{};
        text += "; ";
      },
      kAxisLetters, settings.dynamics, settings.second.freq_hz, settings.second.damping_ratio);
  return text + fmt::format("{} mm/s²", settings.limits.max_accel_mm_s2);
}

}  // namespace

Result<study::Outcome> study_print(const flow::Job& job, bool traces, Progress& progress) {
  if (Status built = flow::check_built(job.engine); !built) {
    return tl::unexpected(built.error());
  }
  const study::BenchSetup setup = bench_setup(job.settings);
  const study::Options options{.ipopt = job.engine == flow::EngineChoice::ipopt,
                               .workers = job.workers};
  study::Outcome outcome;
  outcome.input = job.input_name;
  outcome.engine = study::engine_name(options);
  study::CaseResult result{"print", describe(job.settings), 0.0, 0, {}};
  study::Run worst;
  double worst_mm = -1.0;
  Result<std::vector<Diagnostic>> warnings =
      for_each_batch(job, progress, [&](std::vector<study::Run>&& batch) {
        const std::size_t number = study::study_runs(batch, setup, options, result);
        // The largest error of all runs so far is now known.
        const double max_mm = result.methods.front().straying[0].max_mm;
        if (max_mm > worst_mm) {
          worst_mm = max_mm;
          worst = std::move(batch[number]);
        }
      });
  if (!warnings) {
    return tl::unexpected(warnings.error());
  }
  if (traces) {
    study::trace_worst_place(worst, setup, options, result);
  }
  outcome.cases.push_back(std::move(result));
  for (const Diagnostic& warning : *warnings) {
    outcome.warnings.push_back(to_string(warning));
  }
  return outcome;
}

}  // namespace unflex::study
