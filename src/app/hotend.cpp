#include "hotend.hpp"

#include <fmt/core.h>

#include <array>
#include <string>
#include <utility>

#include "hotend_tuning.hpp"
#include "inputs.hpp"
#include "outputs.hpp"
#include "results.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/temperature/temperature.hpp"

namespace unflex::app {
namespace {

using hotend::Rule;

constexpr std::array kRules = {Rule::simc_pid, Rule::simc_pi,    Rule::zn_pid,
                               Rule::zn_pi,    Rule::cohen_coon, Rule::tyreus_luyben};

// The rule for a test. Skogestad's rule cannot be had from a test. This one overshoots least of the
// others.
constexpr Rule kRuleOfTest = Rule::tyreus_luyben;
constexpr double kUsualTarget_c = 210.0;
constexpr double kUsualFlow_mm3_s = 10.0;

// An error of the library, at the file whose contents it is about.
tl::unexpected<Error> at_file(Error error, const std::string& file) {
  if (error.place.file.empty()) {
    error.place.file = file;
  }
  return tl::unexpected(std::move(error));
}

void warn(HotendTuning& tuning, const std::string& name, std::string message) {
  Diagnostic warning;
  warning.place.file = name;
  warning.message = std::move(message);
  tuning.warnings.push_back(to_string(warning));
}

std::string refusal_of(const hotend::PlantFit& fit) {
  return fit.is_explained()
             ? std::string{}
             : fmt::format(
                   "is not this model: {:.0f} % of the temperature's changes stay "
                   "unexplained; log a heating from the cold to a temperature that holds, "
                   "with the fan as it is and without filament, and check that power and "
                   "temperature are of the same heater",
                   100.0 * fit.unexplained);
}

Status read_log(const RunConfig& config, HotendTuning& tuning) {
  Result<Input> input = Input::open(config.input);
  if (!input) {
    return tl::unexpected(input.error());
  }
  const Result<std::string> text = input->read_all();
  if (!text) {
    return tl::unexpected(text.error());
  }
  const std::string& name = input->name();
  Result<hotend::Log> log = hotend::parse_log(
      *text, name, {.full_power = config.hotend.full_power, .heater = tuning.heater});
  if (!log) {
    return at_file(log.error(), name);
  }
  Result<hotend::PlantFit> fit = fit_plant(*log, {.ambient_c = config.hotend.ambient_c});
  if (!fit) {
    return at_file(fit.error(), name);
  }
  tuning.log = HotendLog{name, std::move(*log), std::move(*fit), {}};
  tuning.log->refusal = refusal_of(tuning.log->fit);
  if (tuning.log->refusal.empty()) {
    tuning.plant = tuning.log->fit.plant;
  }
  return {};
}

// Reads the model from the printer file, which need not have a resonance.
Status read_printer(const RunConfig& config, HotendTuning& tuning) {
  const Result<machine::Settings> settings = machine::load(config.printer_file, config.overrides);
  if (!settings) {
    return tl::unexpected(settings.error());
  }
  const machine::HotendSettings& model = settings->hotend;
  for (const auto& [key, value] :
       {std::pair("gain_c", model.gain_c), std::pair("time_constant_s", model.time_constant_s),
        std::pair("dead_time_s", model.dead_time_s)}) {
    if (!value) {
      return fail(ErrorKind::usage, {config.printer_file.value_or(""), 0},
                  fmt::format("hotend.{} is missing; unflex hotend with a log of a heating writes "
                              "the [hotend] to put there",
                              key));
    }
  }
  tuning.plant = temperature::hotend_plant(model);
  if (!tuning.heater_w) {
    tuning.heater_w = model.heater_w;
  }
  return {};
}

// Sets the target and the load of the filament there. An error if the heater cannot reach the
// target.
Status set_target(const RunConfig& config, HotendTuning& tuning) {
  const hotend::Plant& plant = *tuning.plant;
  tuning.target_c = config.hotend.target_c.value_or(kUsualTarget_c);
  const double hottest_c = plant.ambient_c + plant.gain_c * plant.full_power;
  if (tuning.target_c <= plant.ambient_c || tuning.target_c >= hottest_c) {
    return fail(ErrorKind::usage,
                fmt::format("a step to {:.0f} °C cannot be: without power it is {:.0f} °C, at full "
                            "power {:.0f}; give a --target between",
                            tuning.target_c, plant.ambient_c, hottest_c));
  }
  if (!tuning.heater_w) {
    return config.hotend.flow_mm3_s
               ? Status(fail(ErrorKind::usage,
                             "--flow takes heat; say with --heater-watts or hotend.heater_w what "
                             "the heater gives at full power"))
               : Status{};
  }
  HotendLoad load{.flow_mm3_s = config.hotend.flow_mm3_s.value_or(kUsualFlow_mm3_s)};
  load.power_w = hotend::melting_power_w(load.flow_mm3_s, tuning.target_c - plant.ambient_c);
  load.counts = hotend::load_in_counts(plant, load.power_w, *tuning.heater_w);
  tuning.load = load;
  if (plant.holding_power(tuning.target_c) + load.counts > plant.full_power) {
    warn(tuning, tuning.log ? tuning.log->name : "unflex",
         fmt::format("the heater cannot hold {:.0f} °C while {:g} mm³/s melt; print slower or "
                     "colder",
                     tuning.target_c, load.flow_mm3_s));
  }
  return {};
}

// Computes the gains of all rules and their simulated responses. A rule that cannot be had is an
// error only if it is the chosen one.
Status tune_by_rules(HotendTuning& tuning) {
  for (const Rule rule : kRules) {
    const Result<hotend::Gains> gains =
        tuning.plant ? hotend::gains(rule, *tuning.plant) : hotend::gains(rule, *tuning.ultimate);
    if (!gains) {
      if (rule == tuning.rule) {
        return tuning.log ? Status(at_file(gains.error(), tuning.log->name))
                          : Status(tl::unexpected(gains.error()));
      }
      continue;
    }
    RuleOutcome outcome{rule, *gains, {}, {}};
    if (tuning.plant) {
      const hotend::Control control{.gains = *gains};
      outcome.step =
          step_response(*tuning.plant, control, tuning.plant->ambient_c, tuning.target_c);
      if (tuning.load) {
        outcome.load = load_response(*tuning.plant, control, tuning.target_c, tuning.load->counts);
      }
    }
    tuning.rules.push_back(std::move(outcome));
  }
  return {};
}

Result<HotendTuning> tune(const RunConfig& config) {
  HotendTuning tuning;
  const HotendConfig& asked = config.hotend;
  tuning.heater = asked.heater.value_or(tuning.heater);
  tuning.heater_w = asked.heater_w;
  tuning.rule = asked.rule.value_or(asked.ultimate_gain ? kRuleOfTest : hotend::kDefaultRule);
  if (asked.ultimate_gain) {
    tuning.ultimate = hotend::Ultimate{*asked.ultimate_gain, *asked.ultimate_period_s};
  } else if (Status read =
                 config.input.empty() ? read_printer(config, tuning) : read_log(config, tuning);
             !read) {
    return tl::unexpected(read.error());
  }
  if (tuning.plant) {
    if (Status set = set_target(config, tuning); !set) {
      return tl::unexpected(set.error());
    }
    if (const Result<hotend::Ultimate> found = hotend::ultimate(*tuning.plant)) {
      tuning.ultimate = *found;
    }
  }
  if (tuning.plant || tuning.ultimate) {
    if (Status tuned = tune_by_rules(tuning); !tuned) {
      return tl::unexpected(tuned.error());
    }
  }
  return tuning;
}

std::string quiet_text(const HotendTuning& tuning) {
  const std::string model = model_snippet(tuning);
  return model.empty() ? words_text(tuning) : model;
}

}  // namespace

Result<ExitCode> run_hotend(const RunConfig& config, Console& console) {
  const Result<HotendTuning> tuning = tune(config);
  if (!tuning) {
    return tl::unexpected(tuning.error());
  }
  console.warnings(tuning->warnings);
  if (config.report) {
    Result<Output> report = Output::open(*config.report);
    if (!report) {
      return tl::unexpected(report.error());
    }
    const Status written =
        report->write(is_html(*config.report) ? tuning_html(*tuning) : tuning_json(*tuning))
            .and_then([&] { return report->commit(); });
    if (!written) {
      return tl::unexpected(written.error());
    }
  }
  const bool is_refused = tuning->log && !tuning->log->refusal.empty();
  if (is_refused) {
    console.line(fmt::format("{}: {}", tuning->log->name, tuning->log->refusal));
  }
  const Status written =
      config.report == kStandardStream
          ? Status{}
          : write_last(config.quiet ? quiet_text(*tuning) : tuning_text(*tuning));
  return written.map([&] { return is_refused ? ExitCode::input : ExitCode::done; });
}

}  // namespace unflex::app
