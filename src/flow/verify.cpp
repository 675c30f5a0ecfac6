#include "unflex/verify/verify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <istream>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "printer_facts.hpp"
#include "report_rows.hpp"
#include "step_rates.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/planner/printer_shaper.hpp"
#include "unflex/platform/usage.hpp"
#include "unflex/run/own_output.hpp"
#include "unflex/run/verify_rules.hpp"
#include "unflex/temperature/temperature.hpp"

namespace unflex::flow {
namespace {

// Tells where the hotend may not melt what the output lays.
std::string too_much_text(const verify::TooMuchFlow& flow, double max_flow_mm3_s,
                          const std::string& output) {
  return to_string(Diagnostic{
      {output, flow.line},
      fmt::format("the hotend is asked for {:.1f} mm³/s here, {:.1f} as sliced, and "
                  "extruder.max_flow_mm3_s is {:.1f}; let it print slower, or raise that if the "
                  "hotend melts more",
                  flow.flow_mm3_s, flow.sliced_mm3_s, max_flow_mm3_s)});
}

report::Spread spread(const verify::Deviation& deviation) {
  return {deviation.extruding.contour_max_mm, deviation.extruding.contour_rms_mm};
}

}  // namespace

void add_performance(std::chrono::steady_clock::time_point begin, report::Report& report) {
  const double wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  report.performance = {wall_s, platform::processor_s(),
                        report.measured.uncompensated.time_s / wall_s, platform::peak_memory_mb()};
}

report::Report new_report(std::string command, const Job& job) {
  report::Report report;
  report.command = std::move(command);
  report.version = UNFLEX_VERSION;
  report.input = job.input_name;
  report.output = job.output_name;
  report.firmware = to_string(job.settings.printer.firmware);
  report.others.freq_error = job.settings.freq_error();
  report.max_flow_mm3_s = job.settings.extruder.max_flow_mm3_s;
  report.free_timing.tolerance_mm = job.settings.timing.tolerance_um * 1e-3;
  for (machine::SettingRow& setting : machine::rows(job.settings)) {
    report.printer.push_back(
        {std::move(setting.key), std::move(setting.value), std::move(setting.origin)});
  }
  report.facts = printer_facts(job.settings);
  add_step_limits(job.settings, report.step_rates);
  return report;
}

std::unique_ptr<record::Recorder> recorder_for(const Job& job, const verify::Rules& rules) {
  static constexpr std::array kOfSummary = {dynamics::ShaperKind::zv};
  record::Options options;
  // The shapers are for the tool with which a print begins.
  options.nozzle = !rules.tools.empty() && rules.tools.front().number == 0
                       ? rules.tools.front().nozzle
                       : rules.nozzle;
  std::optional<record::PrinterShaper> own = printer_shaper(rules);
  if (job.all_shapers) {
    if (own) {
      own->name = "printer's " + own->name;
    }
    options.printer_shaper = std::move(own);
  } else if (own) {
    // The printer's own shaper acts on the sliced file as it is played. The summary tells of no
    // other shaper.
    options.shapers = {};
  } else {
    options.shapers = kOfSummary;
  }
  return std::make_unique<record::Recorder>(options);
}

verify::Observation observation_of(record::Recorder& recorder, const verify::Rules& rules) {
  const auto with_plants = [](const verify::NozzleModel& nozzle,
                              const std::vector<verify::NozzleModel>& plants) {
    std::vector<verify::NozzleModel> others = verify::detuned(nozzle);
    others.insert(others.end(), plants.begin(), plants.end());
    return others;
  };
  verify::Observation observation{with_plants(rules.nozzle, rules.plants), &recorder.observer()};
  for (const verify::ToolModel& tool : rules.tools) {
    observation.detuned_by_tool.push_back(with_plants(tool.nozzle, tool.plants));
  }
  return observation;
}

void add_verification(const verify::VerifyReport& verified, record::Recorder& recorder,
                      report::Report& report) {
  report.recording = recorder.finish(verified);
  report.measured = verified.measured;
  constexpr std::size_t kErrors = verify::kFrequencyErrors.size();
  for (std::size_t i = 0; i < verified.detuned.size(); ++i) {
    const report::Spread before = spread(verified.detuned[i].uncompensated);
    const report::Spread after = spread(verified.detuned[i].compensated);
    if (i < kErrors) {
      report.others.sensitivity.push_back({verify::kFrequencyErrors[i], before, after});
    } else {
      report.others.plants.push_back({before, after});
    }
  }
  if (verified.too_much_flow && report.max_flow_mm3_s) {
    report.warnings.push_back(
        too_much_text(*verified.too_much_flow, *report.max_flow_mm3_s, report.output));
  }
  add_step_rates(verified.sliced_steps, &verified.emitted_steps, report.step_rates);
  warn_of_sliced_steps(verified.sliced_step_breaches, report.input, report.warnings);
  report.runs.compensated = verified.runs;
  report.violation_count = verified.violation_count;
  for (const verify::Violation& violation : verified.violations) {
    report.violations.push_back(
        to_string(Error{ErrorKind::input, violation.place, violation.message}));
  }
}

Status add_verification(const Job& job, Progress& progress, report::Report& report) {
  const std::unique_ptr<std::istream> input = job.input->read();
  const std::unique_ptr<std::istream> output = job.output->read();
  if (!*input) {
    return fail(ErrorKind::input, {job.input_name, 0}, "cannot read the file");
  }
  if (!*output) {
    return fail(ErrorKind::input, {job.output_name, 0}, "cannot read the file");
  }
  const Result<std::optional<std::size_t>> measured_with = run::own_line(*input, job.input_name);
  if (!measured_with) {
    return tl::unexpected(measured_with.error());
  }
  if (*measured_with) {
    // Compared with it, the output would look as good as sliced.
    return tl::unexpected(run::compensated_already(job.input_name, **measured_with));
  }
  const Result<std::optional<std::size_t>> own = run::own_line(*output, job.output_name);
  if (!own) {
    return tl::unexpected(own.error());
  }
  verify::Rules rules = run::verify_rules(job.settings);
  rules.approaches = own->has_value();
  const std::unique_ptr<record::Recorder> recorder = recorder_for(job, rules);
  const Result<verify::VerifyReport> result =
      verify::verify(*input, job.input_name, *output, job.output_name, rules, progress,
                     observation_of(*recorder, rules));
  if (!result) {
    return tl::unexpected(result.error());
  }
  add_verification(*result, *recorder, report);
  return {};
}

Result<report::Report> verify(const Job& job, Progress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  report::Report report = new_report("verify", job);
  const Status status = add_verification(job, progress, report).and_then([&] {
    return temperature::follow_temperature(job, temperature::OutputMay::stay, progress, report);
  });
  if (!status) {
    return tl::unexpected(status.error());
  }
  add_performance(begin, report);
  return report;
}

}  // namespace unflex::flow
