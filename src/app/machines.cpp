#include "machines.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>

#include "identification.hpp"
#include "inspection.hpp"
#include "machine_records.hpp"
#include "outputs.hpp"
#include "results.hpp"
#include "unflex/identify/axis_model.hpp"
#include "unflex/pipeline/study_machines.hpp"
#include "unflex/study/truth.hpp"
#include "workspace.hpp"

namespace unflex::app {
namespace {

using identify::Axis;
using identify::DataSet;

// The densities of a record: of the column with the most motion, and the sum of all three.
struct Densities {
  double step_hz = 0.0;
  std::vector<double> column;
  std::vector<double> sum;
};

Densities densities_of(const DataSet& set) {
  constexpr double kFrom_hz = 15.0;
  constexpr double kTo_hz = 128.0;
  const identify::Spectrum spectrum = spectrum_of(set);
  Densities result{spectrum.step_hz, {}, spectrum.density[0]};
  double most = -1.0;
  for (const std::vector<double>& column : spectrum.density) {
    double energy = 0.0;
    for (std::size_t k = 0; k < column.size(); ++k) {
      const double freq_hz = static_cast<double>(k) * spectrum.step_hz;
      energy += freq_hz > kFrom_hz && freq_hz < kTo_hz ? column[k] : 0.0;
    }
    if (energy > most) {
      most = energy;
      result.column = column;
    }
  }
  for (std::size_t c = 1; c < 3; ++c) {
    for (std::size_t k = 0; k < std::min(result.sum.size(), spectrum.density[c].size()); ++k) {
      result.sum[k] += spectrum.density[c][k];
    }
  }
  return result;
}

// An axis as one record tells of it.
struct KnownAxis {
  std::string name;
  std::optional<identify::AxisModel> model;  // missing if the record carries none
  std::optional<rivals::KlipperCalibration> shapers;
  Densities densities;
  std::string refusal;
};

KnownAxis known_axis(const DataSet& set, Axis axis, const identify::Sweep& sweep) {
  KnownAxis known;
  known.name = std::filesystem::path(set.name).filename().string();
  const Result<identify::RecordFit> fitted = fit(set, axis, sweep);
  if (fitted && fitted->is_trusted()) {
    known.model = fitted->model;
  }
  known.refusal = fitted ? fitted->refusal : fitted.error().message;
  known.densities = densities_of(set);
  known.shapers = rivals::klipper_calibration(known.densities.step_hz, known.densities.sum);
  return known;
}

// The records of an axis that stand for what is known and for the machine as it is.
struct Pair {
  const KnownAxis* known = nullptr;
  const KnownAxis* machine = nullptr;
  std::vector<dynamics::Mode> truth;
};

std::optional<Pair> paired(const KnownAxis& known, const KnownAxis& machine) {
  if (!known.model || !known.shapers) {
    return std::nullopt;
  }
  std::optional<std::vector<dynamics::Mode>> truth =
      study::fitted_truth(machine.densities.step_hz, machine.densities.column);
  return truth ? std::optional(Pair{&known, &machine, std::move(*truth)}) : std::nullopt;
}

// The last record with a model, on the machine that an independent fit to it tells of.
std::optional<Pair> alone(const std::vector<KnownAxis>& records) {
  for (auto record = records.rbegin(); record != records.rend(); ++record) {
    if (std::optional<Pair> pair = paired(*record, *record)) {
      return pair;
    }
  }
  return std::nullopt;
}

// The last two records: the first is known, and the other one tells of the machine.
std::optional<Pair> across(const std::vector<KnownAxis>& records) {
  for (std::size_t i = records.size(); i > 1; --i) {
    if (std::optional<Pair> pair = paired(records[i - 2], records[i - 1])) {
      return pair;
    }
  }
  return std::nullopt;
}

study::MachineAxis machine_axis(const Pair& pair) {
  return {pair.known->name, pair.machine->name, pair.truth, *pair.known->shapers};
}

// A machine on the bench; its settings are still to be read.
struct Candidate {
  std::string name;
  Pair x;
  Pair y;

  [[nodiscard]] std::vector<std::string> overrides() const {
    Identification found;
    found.axes[Axis::x] = *x.known->model;
    found.axes[Axis::y] = *y.known->model;
    return dynamics_overrides(found);
  }
};

using KnownAxes = std::array<std::vector<KnownAxis>, 2>;

std::vector<Candidate> candidates(const std::string& name, const KnownAxes& axes) {
  std::vector<Candidate> result;
  const std::optional<Pair> x = alone(axes[0]);
  const std::optional<Pair> y = alone(axes[1]);
  if (!x || !y) {
    return result;
  }
  result.push_back({name, *x, *y});
  const std::optional<Pair> other_x = across(axes[0]);
  const std::optional<Pair> other_y = across(axes[1]);
  if (other_x || other_y) {
    result.push_back({name + ", next record", other_x.value_or(*x), other_y.value_or(*y)});
  }
  return result;
}

Result<machine::Settings> settings_of(const RunConfig& config, const Candidate& candidate,
                                      Input& input) {
  RunConfig with = config;
  const std::vector<std::string> overrides = candidate.overrides();
  with.overrides.insert(with.overrides.end(), overrides.begin(), overrides.end());
  return load_settings(with, input);
}

}  // namespace

Result<ExitCode> run_machines(const RunConfig& config, Console& console) {
  const Result<std::vector<MachineRecords>> machines = read_machines(config.machines);
  if (!machines) {
    return tl::unexpected(machines.error());
  }
  std::vector<std::string> warnings;
  std::vector<KnownAxes> axes(machines->size());
  std::vector<Candidate> all;
  for (std::size_t i = 0; i < machines->size(); ++i) {
    const MachineRecords& records = (*machines)[i];
    for (std::size_t axis = 0; axis < 2; ++axis) {
      for (const DataSet& set : records.axes[axis]) {
        axes[i][axis].push_back(
            known_axis(set, axis == 0 ? Axis::x : Axis::y, config.identify.sweep));
        if (!axes[i][axis].back().model) {
          warnings.push_back(
              fmt::format("{}: warning: is left out: {}", set.name, axes[i][axis].back().refusal));
        }
      }
    }
    std::ranges::move(candidates(records.name, axes[i]), std::back_inserter(all));
  }
  if (all.empty()) {
    console.warnings(warnings);
    return fail(ErrorKind::input, {config.machines, 0},
                "holds no machine whose records carry a model of both axes");
  }
  RunConfig first = config;
  const std::vector<std::string> overrides = all.front().overrides();
  first.overrides.insert(first.overrides.end(), overrides.begin(), overrides.end());
  Result<Workspace> space = open_workspace(first);
  if (!space) {
    return tl::unexpected(space.error());
  }
  std::vector<pipeline::KnownMachine> known;
  for (const Candidate& candidate : all) {
    Result<machine::Settings> settings = settings_of(config, candidate, space->input);
    if (!settings) {
      return tl::unexpected(settings.error());
    }
    known.push_back({candidate.name, std::move(*settings), machine_axis(candidate.x),
                     machine_axis(candidate.y)});
  }
  const Result<pipeline::Job> job = job_of(config, *space);
  if (!job) {
    return tl::unexpected(job.error());
  }
  Result<study::MachinesOutcome> outcome = with_progress(
      config, [&](Progress& progress) { return pipeline::study_machines(*job, known, progress); });
  if (const Status unchanged = check_inputs(*space); !unchanged) {
    return tl::unexpected(unchanged.error());
  }
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
