#include "command_checks.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "batch_shard.hpp"
#include "kinematics.hpp"

namespace unflex::app {
namespace {

tl::unexpected<Error> usage(std::string message) {
  return fail(ErrorKind::usage, std::move(message));
}

Status check_output(const RunConfig& config) {
  if (config.in_place && !config.output.empty()) {
    return usage("give either --in-place or -o, not both");
  }
  if (config.in_place && config.input == kStandardStream) {
    return usage("--in-place needs a file, not stdin; write to stdout with -o -");
  }
  if (!config.in_place && config.output.empty()) {
    return usage("where to write? give -o OUT, -o - for stdout, or --in-place");
  }
  return {};
}

// Refuses a name that is only an ending, since it would make a hidden file.
Status check_has_name(std::string_view option, const std::string& file,
                      std::initializer_list<std::string_view> endings) {
  if (std::ranges::find(endings, file) == endings.end()) {
    return {};
  }
  return usage(fmt::format("{} {}: is an ending without a name; give it one, as report{}", option,
                           file, file));
}

Status check_report(const RunConfig& config) {
  const std::string& name = *config.report;
  if (name == kStandardStream) {
    const bool taken = config.command == Command::compensate && config.output == kStandardStream;
    return taken ? Status(usage("the output and the report cannot both go to stdout")) : Status{};
  }
  const bool json_alone = config.command == Command::inspect || !config.study.accels_mm_s2.empty();
  if (json_alone && !name.ends_with(".json")) {
    return usage(fmt::format("--report {}: the name must end in .json", name));
  }
  if (!config.study.tolerances_um.empty() && name.ends_with(".svg")) {
    return check_has_name("--report", name, {".svg"});
  }
  if (!name.ends_with(".json") && !is_html(name)) {
    return usage(fmt::format("--report {}: the name must end in .json or .html", name));
  }
  // With compensate, an ending alone stands for the output's name with that ending.
  return config.command == Command::compensate
             ? Status{}
             : check_has_name("--report", name, {".json", ".html"});
}

Status check_study(const RunConfig& config) {
  const bool has_print = !config.input.empty();
  if (has_print && !config.study.cases.empty()) {
    return usage("--case is of the corner; a print has none");
  }
  if (!has_print && !config.study.machines.empty()) {
    return usage("--machines needs a print to judge them by");
  }
  if (!has_print && !config.study.tolerances_um.empty()) {
    return usage("--faster needs a print whose time it is");
  }
  if (!has_print && !config.study.accels_mm_s2.empty()) {
    return usage("--accel needs a print to compensate");
  }
  if (!has_print && config.study.map) {
    return usage("--map needs a print to measure at each place");
  }
  if (config.study.map && config.report && is_html(*config.report)) {
    return usage(fmt::format("--report {}: study --map writes JSON; give a name that ends in .json",
                             *config.report));
  }
  const int studies = (config.study.machines.empty() ? 0 : 1) + (config.study.map ? 1 : 0) +
                      (config.study.tolerances_um.empty() ? 0 : 1) +
                      (config.study.accels_mm_s2.empty() ? 0 : 1);
  if (studies > 1) {
    return usage("give one of --machines, --map, --faster and --accel");
  }
  if (config.study.accels_mm_s2.empty() && (config.study.scale_m204 || config.study.keep_rms_um)) {
    return usage("--scale-m204 and --keep-rms go with --accel");
  }
  if (config.study.at_all_times && config.study.tolerances_um.empty()) {
    return usage("--at-all-times says how strictly --faster is meant; give that too");
  }
  if (!has_print && (config.printer_file || !config.overrides.empty())) {
    return usage("--printer and --set are of a print; the corner's cases have their own settings");
  }
  return {};
}

Status check_test(const RunConfig& config) {
  if (!config.identify.records.empty() || config.identify.tower || config.identify.second) {
    return usage(
        "--make-test writes a test and takes no records; give them to identify --second "
        "once the printer has made them");
  }
  if (config.output.empty()) {
    return usage("where to write the test? give -o OUT, or -o - for stdout");
  }
  if (config.report) {
    return usage("--make-test writes no report; unflex verify makes one of its output");
  }
  return {};
}

Status check_records(const RunConfig& run_config) {
  const IdentifyConfig& config = run_config.identify;
  if (!run_config.output.empty()) {
    return usage("-o is where --make-test writes; records are answered on stdout");
  }
  if (!config.second && (run_config.printer_file || !run_config.overrides.empty())) {
    return usage("--printer and --set go with --second and --make-test");
  }
  if (config.second && config.tower) {
    return usage("--second needs recordings; a ringing tower shows one mode only");
  }
  if (config.records.empty() && !config.tower) {
    return usage("what to identify from? give records, or --wave-spacing-mm and --speed-mm-s");
  }
  if (config.tower && (config.tower->spacing_mm == 0.0 || config.tower->speed_mm_s == 0.0)) {
    return usage("a ringing tower needs both --wave-spacing-mm and --speed-mm-s");
  }
  if (config.tower && !config.axis) {
    return usage("say with --axis which of x and y the ringing tower's wall shows");
  }
  if (config.sweep.start_hz >= config.sweep.end_hz) {
    return usage("--freq-start must be below --freq-end");
  }
  return {};
}

Status check_tune(const RunConfig& config) {
  const TuneConfig& tune = config.tune;
  const bool has_zone = tune.zones[0] || tune.zones[1] || tune.pressure_zone;
  if (config.input.empty() && has_zone) {
    return usage("--read is of a tower that was printed; give its file too");
  }
  if (!config.input.empty() && !has_zone) {
    return usage(
        "what do its walls show? give --read x=FIRST..LAST, y=FIRST..LAST or "
        "pressure=FIRST..LAST");
  }
  if (config.input.empty() && config.output.empty()) {
    return usage("where to write the tower? give -o OUT, or -o - for stdout");
  }
  if (!config.input.empty() && tune.asks_for_pressure) {
    return usage("--pressure is for the first tower; TOWER tells what it tries");
  }
  if (config.input == kStandardStream) {
    return usage("the tower that was printed must be a file");
  }
  if (config.input.empty() && !tune.like && !tune.nozzle_temp_c) {
    return usage(
        "how does a print begin on this printer? give --like with a sliced print of yours, or "
        "--nozzle-temp and --bed-temp");
  }
  if (tune.like && (tune.nozzle_temp_c || tune.bed_temp_c > 0.0)) {
    return usage("--like brings its own temperatures; give either it or --nozzle-temp");
  }
  if (!config.input.empty() && (tune.like || tune.nozzle_temp_c || tune.bed_temp_c > 0.0)) {
    return usage(
        "the next tower begins and ends as TOWER did; --like and temperatures are for "
        "the first");
  }
  if (config.report && config.output.empty()) {
    return usage("--report is a page on the tower to write; give -o too");
  }
  if (config.report && !is_html(*config.report)) {
    return usage(fmt::format("--report {}: the name must end in .html", *config.report));
  }
  return config.report ? check_has_name("--report", *config.report, {".html"}) : Status{};
}

Status check_hotend(const RunConfig& config) {
  const HotendConfig& hotend = config.hotend;
  const bool has_log = !config.input.empty();
  const bool has_test = hotend.ultimate_gain || hotend.ultimate_period_s;
  const bool has_printer = config.printer_file || !config.overrides.empty();
  if (hotend.ultimate_gain.has_value() != hotend.ultimate_period_s.has_value()) {
    return usage("--ku and --pu are the gain and the period of one test; give both");
  }
  const int sources = (has_log ? 1 : 0) + (has_test ? 1 : 0) + (has_printer ? 1 : 0);
  if (sources == 0) {
    return usage(
        "what to tune by? give a log, --ku and --pu of a test, or --printer with a model in its "
        "[hotend]");
  }
  if (sources > 1) {
    return usage("give one of a log, --ku with --pu, and --printer or --set");
  }
  if (!has_log && (hotend.full_power || hotend.heater || hotend.ambient_c)) {
    return usage("--power, --heater and --ambient are of a log; give that too");
  }
  if (has_test && (hotend.target_c || hotend.flow_mm3_s || hotend.heater_w)) {
    return usage(
        "a test gives no model to simulate by; --target, --flow and --heater-watts need a log or "
        "--printer");
  }
  if (has_log && hotend.flow_mm3_s && !hotend.heater_w) {
    return usage("--flow takes heat; say with --heater-watts what the heater gives at full power");
  }
  return {};
}

Status check_batch(RunConfig& config) {
  if (!config.batch.shard_text.empty()) {
    const Result<Shard> shard = shard_of(config.batch.shard_text, environment_variable);
    if (!shard) {
      return tl::unexpected(shard.error());
    }
    config.batch.shard = *shard;
  }
  if (config.batch.watch && config.batch.summary) {
    return usage("--watch does not come to an end, so there is no --summary");
  }
  for (const std::string& folder : {config.input, config.output, config.report.value_or(".")}) {
    if (folder == kStandardStream) {
      return usage("batch works on folders, not on streams; a folder of that name is ./-");
    }
    if (folder.empty()) {
      return usage("the name of a folder is empty");
    }
  }
  if (config.batch.summary && !config.batch.summary->ends_with(".json") &&
      !config.batch.summary->ends_with(".xml")) {
    return usage(
        fmt::format("--summary {}: the name must end in .json or .xml", *config.batch.summary));
  }
  return config.batch.summary
             ? check_has_name("--summary", *config.batch.summary, {".json", ".xml"})
             : Status{};
}

}  // namespace

Status complete(RunConfig& config) {
  if (config.solve.check && config.solve.engine == flow::EngineChoice::ipopt) {
    return usage("--check-solver: it is Ipopt that checks; leave out --engine ipopt");
  }
  if (Status built =
          flow::check_built(config.solve.check ? flow::EngineChoice::ipopt : config.solve.engine);
      !built) {
    return built;
  }
  if (writes_print(config.command)) {
    if (Status checked = check_output(config); !checked) {
      return checked;
    }
    if (config.in_place) {
      config.output = config.input;
    }
  }
  if (config.command == Command::verify && config.input == kStandardStream &&
      config.output == kStandardStream) {
    return usage("only one of OUT and --against can be stdin");
  }
  if (config.command == Command::study) {
    if (Status checked = check_study(config); !checked) {
      return checked;
    }
  }
  if (config.command == Command::identify) {
    if (Status checked = config.identify.make_test ? check_test(config) : check_records(config);
        !checked) {
      return checked;
    }
  }
  if (config.command == Command::hotend) {
    if (Status checked = check_hotend(config); !checked) {
      return checked;
    }
  }
  if (config.command == Command::kinematics) {
    return check_kinematics(config);
  }
  if (config.command == Command::batch) {
    return check_batch(config);
  }
  if (config.command == Command::tune) {
    return check_tune(config);
  }
  return config.report ? check_report(config) : Status{};
}

}  // namespace unflex::app
