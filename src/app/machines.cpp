#include "machines.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <optional>

#include "identification.hpp"
#include "inspection.hpp"
#include "machine_records.hpp"
#include "outputs.hpp"
#include "print_work.hpp"
#include "record_densities.hpp"
#include "unflex/core/axes.hpp"
#include "unflex/identify/axis_model.hpp"
#include "unflex/platform/names.hpp"
#include "unflex/study/study_machines.hpp"
#include "unflex/study/truth.hpp"

namespace unflex::app {
namespace {

using identify::Axis;
using identify::DataSet;

// An axis as one record describes it.
struct KnownAxis {
  std::string name;
  std::optional<identify::AxisModel> model;  // missing if the record carries none
  Densities densities;
  std::string refusal;
};

KnownAxis known_axis(const DataSet& set, Axis axis, const identify::Sweep& sweep) {
  KnownAxis known;
  known.name = platform::last_part(set.name);
  const Result<identify::RecordFit> fitted = fit(set, axis, sweep);
  if (fitted && fitted->is_trusted()) {
    known.model = fitted->model;
  }
  known.refusal = fitted ? fitted->refusal : fitted.error().message;
  known.densities = densities_of(set);
  return known;
}

// Two records of an axis: the one that is known, and the one that shows the machine as it is.
struct Pair {
  const KnownAxis* known = nullptr;
  const KnownAxis* machine = nullptr;
  rivals::KlipperCalibration shapers;
  std::vector<dynamics::Mode> truth;
};

// truth: a fit to the machine's record if it is at hand, since the fit takes seconds.
std::optional<Pair> paired(const KnownAxis& known, const KnownAxis& machine,
                           std::optional<std::vector<dynamics::Mode>> truth = std::nullopt) {
  if (!known.model) {
    return std::nullopt;
  }
  auto shapers = rivals::klipper_calibration(known.densities.step_hz, known.densities.sum);
  if (shapers && !truth) {
    truth = study::fitted_truth(machine.densities.step_hz, machine.densities.column);
  }
  return truth && shapers
             ? std::optional(Pair{&known, &machine, std::move(*shapers), std::move(*truth)})
             : std::nullopt;
}

// The last record with a model. The machine is an independent fit to the same record.
std::optional<Pair> alone(const std::vector<KnownAxis>& records) {
  for (auto record = records.rbegin(); record != records.rend(); ++record) {
    if (std::optional<Pair> pair = paired(*record, *record)) {
      return pair;
    }
  }
  return std::nullopt;
}

// The last two records. The first is the known one, the second shows the machine. `own` is the
// result of alone().
std::optional<Pair> across(const std::vector<KnownAxis>& records, const Pair& own) {
  for (std::size_t i = records.size(); i > 1; --i) {
    const KnownAxis& machine = records[i - 1];
    auto truth = &machine == own.machine ? std::optional(own.truth) : std::nullopt;
    if (std::optional<Pair> pair = paired(records[i - 2], machine, std::move(truth))) {
      return pair;
    }
  }
  return std::nullopt;
}

study::MachineAxis machine_axis(const Pair& pair) {
  return {pair.known->name, pair.machine->name, pair.truth, pair.shapers};
}

constexpr Axes<Axis> kAxes{Axis::x, Axis::y};

// A machine on the bench; its settings are still to be read.
struct Candidate {
  std::string name;
  Axes<Pair> axes;

  [[nodiscard]] std::vector<std::string> overrides() const {
    Identification found;
    for_each_axis([&](Axis axis, const Pair& pair) { found.axes[axis] = *pair.known->model; },
                  kAxes, axes);
    return dynamics_overrides(found);
  }
};

using KnownAxes = Axes<std::vector<KnownAxis>>;

std::vector<Candidate> candidates(const std::string& name, const KnownAxes& axes) {
  std::vector<Candidate> result;
  const auto is_found = [](const std::optional<Pair>& pair) { return pair.has_value(); };
  const auto found = map_axes(alone, axes);
  if (!all_axes(is_found, found)) {
    return result;
  }
  const Axes<Pair> own = map_axes([](const std::optional<Pair>& pair) { return *pair; }, found);
  result.push_back({name, own});
  const auto others = map_axes(across, axes, own);
  if (any_axis(is_found, others)) {
    result.push_back(
        {name + ", next record", map_axes([](const std::optional<Pair>& other,
                                             const Pair& pair) { return other.value_or(pair); },
                                          others, own)});
  }
  return result;
}

// The configuration with the axes as they are known.
RunConfig with_axes(RunConfig config, const Candidate& candidate) {
  const std::vector<std::string> overrides = candidate.overrides();
  config.overrides.insert(config.overrides.end(), overrides.begin(), overrides.end());
  return config;
}

// Fits all records of a machine. Those without a model bring a warning.
KnownAxes known_axes(const MachineRecords& records, const identify::Sweep& sweep,
                     std::vector<std::string>& warnings) {
  KnownAxes axes;
  for (std::size_t i = 0; i < axes.kCount; ++i) {
    for (const DataSet& set : records.axes[i]) {
      const KnownAxis& known = axes[i].emplace_back(known_axis(set, kAxes[i], sweep));
      if (!known.model) {
        warnings.push_back(fmt::format("{}: warning: is left out: {}", set.name, known.refusal));
      }
    }
  }
  return axes;
}

}  // namespace

Result<ExitCode> run_machines(const RunConfig& config, Console& console) {
  const Result<std::vector<MachineRecords>> machines = read_machines(config.study.machines);
  if (!machines) {
    return tl::unexpected(machines.error());
  }
  std::vector<std::string> warnings;
  // Candidates point into it.
  std::vector<KnownAxes> axes;
  axes.reserve(machines->size());
  std::vector<Candidate> all;
  for (const MachineRecords& records : *machines) {
    axes.push_back(known_axes(records, config.identify.sweep, warnings));
    std::ranges::move(candidates(records.name, axes.back()), std::back_inserter(all));
  }
  if (all.empty()) {
    console.warnings(warnings);
    return fail(ErrorKind::input, {config.study.machines, 0},
                "holds no machine whose records carry a model of both axes");
  }
  Result<Workspace> space = open_workspace(with_axes(config, all.front()));
  if (!space) {
    return tl::unexpected(space.error());
  }
  std::vector<study::KnownMachine> known;
  for (const Candidate& candidate : all) {
    Result<machine::Settings> settings = load_settings(with_axes(config, candidate), space->input);
    if (!settings) {
      return tl::unexpected(settings.error());
    }
    known.push_back({candidate.name, std::move(*settings), map_axes(machine_axis, candidate.axes)});
  }
  Result<study::MachinesOutcome> outcome =
      work_on_print(config, *space, [&](const flow::Job& job, Progress& progress) {
        return study::study_machines(job, known, progress);
      });
  if (!outcome) {
    return tl::unexpected(outcome.error());
  }
  outcome->version = version();
  outcome->printer = settings_in_force(space->settings);
  add_setting_warnings(space->settings, outcome->warnings);
  outcome->warnings.insert(outcome->warnings.end(), warnings.begin(), warnings.end());
  console.warnings(outcome->warnings);
  const bool html = config.report && is_html(*config.report);
  return write_report(space->report, html ? study::to_html(*outcome) : study::to_json(*outcome))
      .and_then([&] { return print_summary(config, study::to_text(*outcome), console); })
      .map([] { return ExitCode::done; });
}

}  // namespace unflex::app
