#include "identify.hpp"

#include <fmt/core.h>

#include <string>
#include <vector>

#include "console.hpp"
#include "files.hpp"
#include "identification.hpp"
#include "inputs.hpp"
#include "outputs.hpp"
#include "print_run.hpp"
#include "record_densities.hpp"
#include "results.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/machine/ring_test.hpp"
#include "workspace.hpp"

namespace unflex::app {
namespace {

void warn(Identification& all, const std::string& name, const std::string& message) {
  Diagnostic warning;
  warning.place.file = name;
  warning.message = message;
  all.warnings.push_back(to_string(warning));
}

Result<std::string> read_record(const std::string& name) {
  Result<Input> input = Input::open(name);
  return input ? input->read_all() : Result<std::string>(tl::unexpected(input.error()));
}

// The axis of a record. Its name tells the axis, or the user gives it. Otherwise it is the axis
// with more motion.
Result<identify::Axis> axis_of(const IdentifyConfig& config, const identify::DataSet& set,
                               Identification& all) {
  if (set.axis) {
    return *set.axis;
  }
  if (config.axis) {
    return *config.axis;
  }
  if (set.is_diagonal) {
    return fail(ErrorKind::input, {set.name, 0},
                "is a test along a diagonal, of a belt; unflex needs one along X or Y, or --axis");
  }
  const identify::Axis axis = dominant_axis(set);
  warn(all, set.name,
       fmt::format("its name does not tell the axis; taken for {}, along which it moved the most; "
                   "--axis says otherwise",
                   letter(axis)));
  return axis;
}

Status add_set(const IdentifyConfig& config, const identify::DataSet& set, Identification& all) {
  for (const std::string& note : set.notes) {
    warn(all, set.name, note);
  }
  const Result<identify::Axis> axis = axis_of(config, set, all);
  if (!axis) {
    return tl::unexpected(axis.error());
  }
  Result<identify::RecordFit> fitted =
      config.second ? fit_second(set, *axis, config.known.at(*axis == identify::Axis::x ? 0 : 1))
                    : fit(set, *axis, config.sweep);
  if (!fitted) {
    return tl::unexpected(fitted.error());
  }
  for (const std::string& warning : fitted->warnings) {
    warn(all, set.name, warning);
  }
  std::optional<rivals::FittedShaper> shaper;
  if (!config.second && fitted->curve.is_spectrum) {
    const Densities densities = densities_of(set);
    if (const auto found = rivals::klipper_calibration(densities.step_hz, densities.sum)) {
      shaper = found->recommended;
    }
  }
  all.records.push_back({set.name, *axis, std::move(*fitted), set.place_mm, shaper});
  return {};
}

Status add_file(const IdentifyConfig& config, const std::string& name, Identification& all) {
  const Result<std::string> text = read_record(name);
  if (!text) {
    return tl::unexpected(text.error());
  }
  const Result<std::vector<identify::DataSet>> sets = identify::parse_records(*text, name);
  if (!sets) {
    return tl::unexpected(sets.error());
  }
  for (const identify::DataSet& set : *sets) {
    if (Status added = add_set(config, set, all); !added) {
      return added;
    }
  }
  return {};
}

Status add_tower(const IdentifyConfig& config, Identification& all) {
  constexpr std::string_view kName = "ringing tower";
  Result<identify::RecordFit> fitted = fit_tower(*config.tower);
  if (!fitted) {
    return tl::unexpected(fitted.error());
  }
  for (const std::string& warning : fitted->warnings) {
    warn(all, std::string(kName), warning);
  }
  all.records.push_back(
      {std::string(kName), config.axis.value_or(identify::Axis::x), std::move(*fitted), {}, {}});
  return {};
}

void warn_of_disagreement(identify::Axis axis, Identification& all) {
  warn(all, {},
       fmt::format("the records along {} disagree by more than 5 %, as if they were of different "
                   "machines; leave out those that are not of today's",
                   letter(axis)));
}

// The trusted models of an axis with their places, if these are several. Otherwise nothing. A
// record without a place among them could only blur the map.
Result<std::vector<identify::PlacedModel>> placed_models(const Identification& all,
                                                         identify::Axis axis) {
  std::vector<identify::PlacedModel> models;
  const IdentifiedRecord* without = nullptr;
  for (const IdentifiedRecord& record : all.records) {
    if (record.axis != axis || !record.fit.is_trusted()) {
      continue;
    }
    if (record.place_mm) {
      models.push_back({record.name, *record.place_mm, record.fit.model});
    } else {
      without = &record;
    }
  }
  if (identify::count_places(models) < 2) {
    return std::vector<identify::PlacedModel>{};
  }
  if (without != nullptr) {
    return fail(ErrorKind::input, {without->name, 0},
                fmt::format("its name tells no place, but that of {} does, and those along {} are "
                            "of several places; name it like that one, or as "
                            "raw_data_{}_at_100_50_20.csv, or leave it out",
                            models.front().name, letter(axis), letter(axis)));
  }
  return models;
}

Status combine_placed(identify::Axis axis, const std::vector<identify::PlacedModel>& models,
                      Identification& all) {
  Result<identify::AxisOverPlaces> found = combine_over_places(models);
  if (!found) {
    return tl::unexpected(found.error());
  }
  for (const std::string& warning : found->warnings) {
    warn(all, {}, fmt::format("along {}, {}", letter(axis), warning));
  }
  if (!found->agrees) {
    warn_of_disagreement(axis, all);
  }
  all.axes[axis] = found->model;
  all.over_places[axis] = std::move(*found);
  return {};
}

// Makes one model for each axis. A record without a model is left out if other records have one.
// A second mode has no maps.
Status combine_records(Identification& all) {
  std::map<identify::Axis, std::vector<identify::AxisModel>> by_axis;
  for (const IdentifiedRecord& record : all.records) {
    if (record.fit.is_trusted()) {
      by_axis[record.axis].push_back(record.fit.model);
    }
  }
  for (const auto& [axis, models] : by_axis) {
    const Result<std::vector<identify::PlacedModel>> placed =
        all.is_second ? std::vector<identify::PlacedModel>{} : placed_models(all, axis);
    if (!placed) {
      return tl::unexpected(placed.error());
    }
    if (!placed->empty()) {
      if (Status combined = combine_placed(axis, *placed, all); !combined) {
        return combined;
      }
      continue;
    }
    all.axes[axis] = combine(models);
    if (!agree(models)) {
      warn_of_disagreement(axis, all);
    }
  }
  for (const IdentifiedRecord& record : all.records) {
    if (record.fit.is_trusted()) {
      continue;
    }
    if (all.axes.contains(record.axis)) {
      warn(all, record.name, "is left out: " + record.fit.refusal);
    } else {
      all.refusals.push_back(fmt::format("{}: {}", record.name, record.fit.refusal));
    }
  }
  return {};
}

}  // namespace

Result<Identification> identify_records(const IdentifyConfig& config) {
  Identification all;
  all.is_second = config.second;
  for (const std::string& name : config.records) {
    if (Status added = add_file(config, name, all); !added) {
      return tl::unexpected(added.error());
    }
  }
  if (config.tower) {
    if (Status added = add_tower(config, all); !added) {
      return tl::unexpected(added.error());
    }
  }
  if (Status combined = combine_records(all); !combined) {
    return tl::unexpected(combined.error());
  }
  return all;
}

namespace {

Status write_report(const std::string& name, const Identification& all) {
  Result<Output> output = Output::open(name);
  if (!output) {
    return tl::unexpected(output.error());
  }
  return output
      ->write(name.ends_with(".html") ? identification_html(all) : identification_json(all))
      .and_then([&] { return output->commit(); });
}

// The modes that the axes are compensated for.
std::vector<identify::ModeOfAxis> modes_of(const machine::AxisDynamics& dynamics) {
  if (dynamics.modes.empty()) {
    return {{dynamics.freq_hz, dynamics.damping_ratio, 1.0}};
  }
  std::vector<identify::ModeOfAxis> modes;
  for (const machine::ModeSettings& mode : dynamics.modes) {
    modes.push_back({mode.freq_hz, mode.damping_ratio, mode.gain});
  }
  return modes;
}

// The settings for work that needs the axes. Settings that rest on a guess are refused.
Result<machine::Settings> settings_of(const RunConfig& config) {
  return machine::load(config.printer_file, config.overrides).and_then(without_guess);
}

// Writes the test as a print that nobody keeps, and compensates it by the first stage alone.
Result<ExitCode> make_test(const RunConfig& config, Console& console) {
  RunConfig print = config;
  print.command = Command::compensate;
  print.print_name = "the test";
  print.overrides.emplace_back("second.shaper=none");
  // A base that suits several models leaves more of the known modes behind.
  print.overrides.emplace_back("dynamics.freq_error=0");
  print.overrides.emplace_back("solve.along_weight=1");
  const Result<machine::Settings> settings = settings_of(print);
  if (!settings) {
    return tl::unexpected(settings.error());
  }
  const Result<std::string> text = ring_test(*settings, letter(*config.identify.make_test));
  if (!text) {
    return tl::unexpected(text.error());
  }
  print.input = print.print_name;
  print.input_text = *text;
  const Result<PrintOutcome> outcome = work_on_print(print, console);
  if (!outcome) {
    return tl::unexpected(outcome.error());
  }
  const bool says = !config.quiet && config.output != kStandardStream;
  return (says ? write_last(fmt::format("{}: stops along {}, to be printed; then unflex identify "
                                        "--second with the records\n",
                                        config.output, letter(*config.identify.make_test)))
               : Status{})
      .map([&] { return outcome->verdict; });
}

// The configuration of the records, with the known modes from the printer file.
Result<IdentifyConfig> with_known(const RunConfig& config) {
  IdentifyConfig result = config.identify;
  if (result.second) {
    const Result<machine::Settings> settings = settings_of(config);
    if (!settings) {
      return tl::unexpected(settings.error());
    }
    result.known = {modes_of(settings->dynamics.x), modes_of(settings->dynamics.y)};
  }
  return result;
}

}  // namespace

Result<ExitCode> run_identify(const RunConfig& config, Console& console) {
  if (config.identify.make_test) {
    return make_test(config, console);
  }
  const Result<Identification> all = with_known(config).and_then(identify_records);
  if (!all) {
    return tl::unexpected(all.error());
  }
  console.warnings(all->warnings);
  if (config.report) {
    if (Status written = write_report(*config.report, *all); !written) {
      return tl::unexpected(written.error());
    }
  }
  console.lines(all->refusals, all->refusals.size(), "refusals; --report lists them");
  const ExitCode code = all->refusals.empty() ? ExitCode::done : ExitCode::input;
  // If quiet, only the lines to paste are left, without figures and drawings.
  const Status written = config.report == kStandardStream
                             ? Status{}
                             : write_last(config.quiet ? snippet(*all) : identification_text(*all));
  return written.map([&] { return code; });
}

}  // namespace unflex::app
