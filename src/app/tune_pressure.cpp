// Towers for the pressure advance and the dead time of the hotend.
#include <fmt/core.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tune.hpp"
#include "tune_page.hpp"
#include "tune_parts.hpp"

namespace unflex::app {
namespace {

// Relative error that a given advance may have.
constexpr double kErrorOfGiven = 0.3;
// Rings are slow, and there are many bands.
constexpr std::size_t kLayersPerBand = 5;

struct Printer {
  TowerSite site;
  tune::PressureKnowledge known;
};

Result<machine::Settings> load_settings(const RunConfig& config, const machine::PrintText* print) {
  return machine::load(
      {.print = print, .printer_file = config.printer_file, .overrides = config.overrides});
}

// The settings' knowledge of the hotend. An advance of the firmware was found without a dead time,
// so it stands for the sum.
tune::PressureKnowledge knowledge_of(const machine::Settings& settings) {
  tune::PressureKnowledge known;
  if (settings.pressure.advance_s) {
    known.dead_time_s = 1e-3 * settings.pressure.dead_time_ms;
    known.sum_s = *settings.pressure.advance_s + known.dead_time_s;
  } else {
    known.sum_s = settings.extruder.pressure_advance_s;
  }
  known.sum_error_s = kErrorOfGiven * known.sum_s;
  return known;
}

std::string known_text(const tune::PressureKnowledge& known) {
  return fmt::format(
      "pressure advance {:.4f} s, dead time {:.1f} ms; their sum {:.4f} s ± {:.1f} "
      "ms",
      known.advance_s(), 1e3 * known.dead_time_s, known.sum_s, 1e3 * known.sum_error_s);
}

std::vector<machine::TomlEdit> edits_of(const tune::PressureKnowledge& known) {
  return {{"pressure.advance_s", fmt::format("{:.5f}", known.advance_s()),
           fmt::format("± {:.1f} ms with the dead time, by unflex tune", 1e3 * known.sum_error_s)},
          {"pressure.dead_time_ms", fmt::format("{:.2f}", std::max(0.0, 1e3 * known.dead_time_s)),
           fmt::format("± {:.1f} ms, by unflex tune", 1e3 * known.dead_time_error_s)}};
}

std::string edge_text(const tune::PressureTrial& trial, const tune::Zone& zone) {
  const bool at_lowest = zone.first == 1;
  const bool at_highest = zone.last == trial.bands;
  if (at_lowest && at_highest) {
    return "   careful: all bands are even, so nothing is known; the tower may be too slow to show "
           "anything: try --accel\n";
  }
  return at_lowest || at_highest
             ? fmt::format(
                   "   careful: the {} band is even, so the value may lie beyond it; the "
                   "next tower tries around here\n",
                   at_lowest ? "lowest" : "highest")
             : std::string{};
}

Result<Printer> first_printer(const RunConfig& config) {
  return first_site(config, load_settings).map([](TowerSite site) {
    const tune::PressureKnowledge known = knowledge_of(site.settings);
    return Printer{std::move(site), known};
  });
}

Result<Printer> read_tower(const RunConfig& config, const std::string& text, std::string& summary) {
  const Result<tune::PressureTowerRecord> record = tune::pressure_record_of(text, config.input);
  if (!record) {
    return tl::unexpected(record.error());
  }
  if (!config.tune.pressure_zone) {
    return fail(ErrorKind::usage,
                fmt::format("{} tries the pressure; give the bands whose walls are even as --read "
                            "pressure=FIRST..LAST",
                            config.input));
  }
  const Result<tune::PressureKnowledge> known =
      tune::read(record->trial, *config.tune.pressure_zone);
  if (!known) {
    return tl::unexpected(known.error());
  }
  summary += known_text(*known) + "\n" + edge_text(record->trial, *config.tune.pressure_zone);
  return later_site(config, load_settings, record->codes).map([&](TowerSite site) {
    return Printer{std::move(site), *known};
  });
}

std::string trial_text(const tune::PressureTrial& trial) {
  const bool is_sum = trial.parameter == tune::PressureParameter::sum;
  return fmt::format("bands 1 to {} try {} {:.4g} to {:.4g} {}\n", trial.bands,
                     is_sum ? "pressure advances" : "dead times",
                     is_sum ? trial.advance_s(1) : 1e3 * trial.dead_time_s(1),
                     is_sum ? trial.advance_s(trial.bands) : 1e3 * trial.dead_time_s(trial.bands),
                     is_sum ? "s" : "ms");
}

Status write_next(const RunConfig& config, const Printer& printer, std::string& summary) {
  tune::PressureTowerSettings wanted;
  static_cast<tune::TowerPrinter&>(wanted) = tower_printer(printer.site);
  wanted.max_flow_mm3_s = printer.site.settings.extruder.max_flow_mm3_s;
  wanted.own_advance_s = printer.site.settings.extruder.pressure_advance_s;
  wanted.layers_per_band = kLayersPerBand;
  wanted.trial = tune::next_trial(printer.known);
  lower_accel(
      printer.site,
      tune::followed_accel_mm_s2(wanted, printer.site.settings.pressure.max_extruder_accel_mm_s2),
      wanted);
  const tune::Tower tower = tune::tower(wanted);
  const std::size_t middle = (wanted.trial.bands + 1) / 2;
  const tune::TrueHotend hotend{wanted.trial.advance_s(middle),
                                std::max(0.0, wanted.trial.dead_time_s(middle))};
  const auto page = [&](const std::vector<tune::Band>& bands, Progress& progress) {
    return tune::print_bands(bands, hotend, progress)
        .map([&](const std::vector<tune::RingWidths>& printed) {
          return pressure_page(wanted, tower, printed, hotend);
        });
  };
  summary += trial_text(wanted.trial);
  summary += fmt::format(
      "{}: print it; then look at its walls where the speed changes, count from the bed, and run\n"
      "unflex tune {} --read pressure=FIRST..LAST{} -o NEXT\n",
      config.output, config.output, further_options(config));
  return write_tower(config, printer.site, tower,
                     tune::settings_of_bands(wanted, printer.site.settings), page);
}

}  // namespace

Result<ExitCode> tune_pressure(const RunConfig& config, const std::optional<std::string>& printed,
                               Console& console) {
  std::string summary;
  const Result<Printer> printer =
      printed ? read_tower(config, *printed, summary) : first_printer(config);
  if (!printer) {
    return tl::unexpected(printer.error());
  }
  return finish_tune(
      config, console, printer->site.settings,
      printed ? std::optional(edits_of(printer->known)) : std::nullopt,
      [&](std::string& text) { return write_next(config, *printer, text); }, std::move(summary));
}

}  // namespace unflex::app
