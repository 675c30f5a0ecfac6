// Towers for the frequencies and damping ratios of the axes.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tune.hpp"
#include "tune_page.hpp"
#include "tune_parts.hpp"

namespace unflex::app {
namespace {

using Known = std::array<tune::Knowledge, 2>;

constexpr std::array kLetters = {'x', 'y'};

// The relative error that a frequency may have if it is given by hand or taken from the printer's
// own shaper.
constexpr double kErrorOfGiven = 0.15;
constexpr double kDampingErrorOfGiven = 0.05;

struct Printer {
  TowerSite site;
  Known known;
};

// The settings' knowledge of an axis. Several modes are an error, since a tower shows only one.
Result<tune::Knowledge> knowledge_of(const machine::Settings& settings, std::size_t axis) {
  const machine::AxisDynamics& dynamics = settings.dynamics[axis];
  const std::string section = fmt::format("dynamics.{}.", kLetters[axis]);
  if (!dynamics.modes.empty()) {
    return fail(ErrorKind::usage,
                fmt::format("{}mode gives several modes, and a tower shows one; unflex identify "
                            "finds several from an accelerometer's records",
                            section));
  }
  tune::Knowledge known;
  if (is_given(settings, section + "freq_hz")) {
    known.freq_hz = dynamics.freq_hz;
    known.freq_error = kErrorOfGiven;
  }
  if (is_given(settings, section + "damping_ratio")) {
    known.damping_ratio = dynamics.damping_ratio;
    known.damping_error = kDampingErrorOfGiven;
  }
  return known;
}

// The settings. They need not give a frequency.
Result<machine::Settings> load_settings(const RunConfig& config, const machine::PrintText* print) {
  machine::Sources sources{
      .print = print, .printer_file = config.printer_file, .overrides = config.overrides};
  Result<machine::Settings> settings = machine::load(sources);
  if (!settings) {
    return settings;
  }
  const std::vector<std::pair<std::string, std::string>> origins = settings->origins;
  for (std::size_t axis = 0; axis < kLetters.size(); ++axis) {
    const std::string key = fmt::format("dynamics.{}.freq_hz", kLetters[axis]);
    if (!is_given(*settings, key) && settings->dynamics[axis].modes.empty()) {
      sources.overrides.push_back(fmt::format("{}={}", key, machine::AxisDynamics{}.freq_hz));
    }
  }
  return machine::load(sources).and_then(without_guess).map([&](machine::Settings all) {
    all.origins = origins;
    return all;
  });
}

Result<Printer> first_printer(const RunConfig& config) {
  Result<TowerSite> site = first_site(config, load_settings);
  if (!site) {
    return tl::unexpected(site.error());
  }
  Printer printer{.site = std::move(*site), .known = {}};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const Result<tune::Knowledge> known = knowledge_of(printer.site.settings, axis);
    if (!known) {
      return tl::unexpected(known.error());
    }
    printer.known[axis] = *known;
  }
  return printer;
}

std::string known_text(const tune::Knowledge& known) {
  return fmt::format("{:.2f} Hz ± {:.1f} %, damping ratio {:.3f} ± {:.3f}", known.freq_hz,
                     100.0 * known.freq_error, known.damping_ratio, known.damping_error);
}

std::vector<machine::TomlEdit> edits_of(const std::array<std::optional<tune::Zone>, 2>& zones,
                                        const Known& known) {
  std::vector<machine::TomlEdit> edits;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (!zones[axis]) {
      continue;
    }
    const std::string section = fmt::format("dynamics.{}.", kLetters[axis]);
    edits.push_back({section + "freq_hz", fmt::format("{:.3f}", known[axis].freq_hz),
                     fmt::format("± {:.1f} %, by unflex tune", 100.0 * known[axis].freq_error)});
    edits.push_back({section + "damping_ratio", fmt::format("{:.4f}", known[axis].damping_ratio),
                     fmt::format("± {:.3f}, by unflex tune", known[axis].damping_error)});
  }
  return edits;
}

// A zone that reaches an end of the bands may go on beyond it.
std::string edge_text(std::size_t axis, const tune::Trial& trial, const tune::Zone& zone) {
  const bool at_lowest = zone.first == 1;
  const bool at_highest = zone.last == trial.bands;
  if (at_lowest && at_highest) {
    return fmt::format(
        "   careful: no band shows waves, so nothing is known of {}; the tower may "
        "be too slow to show any: try --accel\n",
        kLetters[axis]);
  }
  return at_lowest || at_highest
             ? fmt::format(
                   "   careful: the {} band shows no waves, so {} may lie beyond it; the "
                   "next tower tries around here\n",
                   at_lowest ? "lowest" : "highest", kLetters[axis])
             : std::string{};
}

// The printer with the values that its tower shows.
Result<Printer> read_tower(const RunConfig& config, const std::string& text, std::string& summary) {
  const Result<tune::TowerRecord> record = tune::record_of(text, config.input);
  if (!record) {
    return tl::unexpected(record.error());
  }
  if (config.tune.pressure_zone) {
    return fail(ErrorKind::usage,
                fmt::format("{} tries the axes; give the bands without waves as --read "
                            "x=FIRST..LAST or y=FIRST..LAST",
                            config.input));
  }
  Result<TowerSite> site = later_site(config, load_settings, record->codes);
  if (!site) {
    return tl::unexpected(site.error());
  }
  Printer printer{.site = std::move(*site), .known = {}};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const tune::Trial& trial = record->trials[axis];
    printer.known[axis] = trial.known;
    if (!config.tune.zones[axis]) {
      continue;
    }
    const Result<tune::Knowledge> known = tune::read(trial, *config.tune.zones[axis]);
    if (!known) {
      return tl::unexpected(known.error());
    }
    printer.known[axis] = *known;
    summary += fmt::format("{}: {}\n", kLetters[axis], known_text(*known));
    summary += edge_text(axis, trial, *config.tune.zones[axis]);
  }
  return printer;
}

std::string trial_text(std::size_t axis, const tune::Trial& trial) {
  const bool is_freq = trial.parameter == tune::Parameter::freq_hz;
  return fmt::format("{}: bands 1 to {} try {} {:.4g} to {:.4g}{}\n", kLetters[axis], trial.bands,
                     is_freq ? "frequencies" : "damping ratios", trial.value(1),
                     trial.value(trial.bands), is_freq ? " Hz" : "");
}

Status write_next(const RunConfig& config, const Printer& printer, std::string& summary) {
  tune::TowerSettings wanted;
  static_cast<tune::TowerPrinter&>(wanted) = tower_printer(printer.site);
  tune::TrueAxes middle;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    wanted.trials[axis] = tune::next_trial(printer.known[axis], wanted.accel_mm_s2);
    const tune::Trial& trial = wanted.trials[axis];
    if (const double needed = tune::needed_accel_mm_s2(trial, wanted.accel_mm_s2); needed > 0.0) {
      return fail(
          ErrorKind::usage,
          fmt::format("{0}: at {1:.0f} mm/s² no waves can be seen in the walls; the tower "
                      "needs {2:.0f} mm/s²: give --accel {2:.0f} if the machine can do that",
                      kLetters[axis], wanted.accel_mm_s2, std::ceil(needed / 50.0) * 50.0));
    }
    middle.freq_hz[axis] = trial.freq_hz((trial.bands + 1) / 2);
    middle.damping_ratio[axis] = trial.damping_ratio((trial.bands + 1) / 2);
  }
  const tune::Tower tower = tune::tower(wanted);
  const auto page = [&](const std::vector<tune::Band>& bands, Progress& progress) {
    return tune::print_bands(bands, tower, middle, progress)
        .map([&](const std::vector<std::vector<tune::Relief>>& printed) {
          return tune_page(wanted, tower, printed, middle);
        });
  };
  for (std::size_t axis = 0; axis < 2; ++axis) {
    summary += trial_text(axis, wanted.trials[axis]);
  }
  summary += fmt::format(
      "{}: print it; then look at the right wall for x and at the front wall for y, count from the "
      "bed, and run\nunflex tune {} --read x=FIRST..LAST --read y=FIRST..LAST{} -o NEXT\n",
      config.output, config.output, further_options(config));
  return write_tower(config, printer.site, tower,
                     tune::settings_of_bands(wanted, printer.site.settings), page);
}

}  // namespace

Result<ExitCode> tune_axes(const RunConfig& config, const std::optional<std::string>& printed,
                           Console& console) {
  std::string summary;
  const Result<Printer> printer =
      printed ? read_tower(config, *printed, summary) : first_printer(config);
  if (!printer) {
    return tl::unexpected(printer.error());
  }
  return finish_tune(
      config, console, printer->site.settings,
      printed ? std::optional(edits_of(config.tune.zones, printer->known)) : std::nullopt,
      [&](std::string& text) { return write_next(config, *printer, text); }, std::move(summary));
}

}  // namespace unflex::app
