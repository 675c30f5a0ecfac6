#include "tune.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "inputs.hpp"
#include "outputs.hpp"
#include "results.hpp"
#include "tune_page.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/machine/toml_edit.hpp"
#include "unflex/pipeline/tune.hpp"

namespace unflex::app {
namespace {

using Known = std::array<tune::Knowledge, 2>;

constexpr std::array kLetters = {'x', 'y'};

// A frequency that is given by hand, or taken from the printer's own shaper, may be so much off.
constexpr double kErrorOfGiven = 0.15;
constexpr double kDampingErrorOfGiven = 0.05;

// A printer of which the towers are made, and the codes of its prints.
struct Printer {
  machine::Settings settings;
  std::optional<tune::AccelLimits> own = {};  // with --accel
  Known known;
  tune::Codes codes;
};

// The whole text of an input that can be read twice.
Result<std::string> read_text(const Input& input) {
  std::ifstream file(input.path(), std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) {
    return fail(ErrorKind::input, {input.name(), 0}, "cannot read the file");
  }
  return text.str();
}

bool is_given(const machine::Settings& settings, const std::string& key) {
  const auto found =
      std::ranges::find(settings.origins, key, &std::pair<std::string, std::string>::first);
  return found != settings.origins.end() && found->second != machine::kDefaultOrigin;
}

// What the settings say of an axis. Several modes are more than a tower shows.
Result<tune::Knowledge> knowledge_of(const machine::Settings& settings, std::size_t axis) {
  const machine::AxisDynamics& dynamics = axis == 0 ? settings.dynamics_x : settings.dynamics_y;
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

// The settings, for which nobody need know a frequency.
Result<machine::Settings> load_settings(const RunConfig& config, const machine::PrintText* print) {
  machine::Sources sources{
      .print = print, .printer_file = config.printer_file, .overrides = config.overrides};
  Result<machine::Settings> settings = machine::load(sources);
  if (!settings) {
    return settings;
  }
  const std::vector<std::pair<std::string, std::string>> origins = settings->origins;
  for (const char letter : kLetters) {
    const std::string key = fmt::format("dynamics.{}.freq_hz", letter);
    if (!is_given(*settings, key) &&
        (letter == 'x' ? settings->dynamics_x : settings->dynamics_y).modes.empty()) {
      sources.overrides.push_back(fmt::format("{}={}", key, machine::AxisDynamics{}.freq_hz));
    }
  }
  return machine::load(sources).and_then(without_guess).map([&](machine::Settings all) {
    all.origins = origins;
    return all;
  });
}

// The limits of the printer that a tower of another acceleration goes beyond.
tune::AccelLimits own_limits(const machine::Settings& settings) {
  const std::array<double, 4> axes = settings.axis_max_accel_mm_s2();
  return {axes[0], axes[1], settings.print_accel_mm_s2(), settings.travel_accel_mm_s2()};
}

// The settings of the printer with the acceleration of --accel, and its own limits.
Status raise_accel(const RunConfig& config, const machine::PrintText* print, Printer& printer) {
  if (!config.tune.accel_mm_s2) {
    return {};
  }
  printer.own = own_limits(printer.settings);
  RunConfig raised = config;
  for (const char* const key :
       {"limits.max_accel_mm_s2", "limits.print_accel_mm_s2", "limits.travel_accel_mm_s2",
        "limits.max_x_accel_mm_s2", "limits.max_y_accel_mm_s2"}) {
    raised.overrides.push_back(fmt::format("{}={}", key, *config.tune.accel_mm_s2));
  }
  Result<machine::Settings> settings = load_settings(raised, print);
  if (!settings) {
    return tl::unexpected(settings.error());
  }
  printer.settings = std::move(*settings);
  return {};
}

double accel_mm_s2(const machine::Settings& settings) {
  if (settings.printer.firmware == Firmware::klipper) {
    return settings.limits.max_accel_mm_s2;
  }
  const std::array<double, 4> axes = settings.axis_max_accel_mm_s2();
  return std::min({settings.print_accel_mm_s2(), axes[0], axes[1]});
}

// The middle of the bed, if its size is known.
void center_on_bed(const machine::Settings& settings, tune::Codes& codes) {
  constexpr double kSmallBed_mm = 100.0;
  const auto middle = [](const std::optional<machine::Range>& travel) {
    return travel ? 0.5 * (travel->min + travel->max) : 0.5 * kSmallBed_mm;
  };
  codes.center_x_mm = middle(settings.printer.travel_x_mm);
  codes.center_y_mm = middle(settings.printer.travel_y_mm);
}

Result<Printer> first_printer(const RunConfig& config) {
  Printer printer;
  std::optional<machine::PrintText> print;
  std::optional<std::string> text;
  if (config.tune.like) {
    Result<Input> input = Input::open(*config.tune.like);
    if (!input) {
      return tl::unexpected(input.error());
    }
    if (Status copied = input->make_seekable(); !copied) {
      return tl::unexpected(copied.error());
    }
    Result<machine::PrintText> looked = input->look();
    Result<std::string> all = read_text(*input);
    if (!looked || !all) {
      return tl::unexpected(looked ? all.error() : looked.error());
    }
    print = std::move(*looked);
    text = std::move(*all);
  }
  Result<machine::Settings> settings = load_settings(config, print ? &*print : nullptr);
  if (!settings) {
    return tl::unexpected(settings.error());
  }
  printer.settings = std::move(*settings);
  if (Status raised = raise_accel(config, print ? &*print : nullptr, printer); !raised) {
    return tl::unexpected(raised.error());
  }
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const Result<tune::Knowledge> known = knowledge_of(printer.settings, axis);
    if (!known) {
      return tl::unexpected(known.error());
    }
    printer.known[axis] = *known;
  }
  if (text) {
    Result<tune::Codes> codes =
        tune::codes_of(*text, *config.tune.like, printer.settings.printer.firmware);
    if (!codes) {
      return tl::unexpected(codes.error());
    }
    printer.codes = std::move(*codes);
  } else {
    printer.codes = tune::plain_codes(*config.tune.nozzle_temp_c, config.tune.bed_temp_c);
  }
  if (!text || (printer.settings.printer.travel_x_mm && printer.settings.printer.travel_y_mm)) {
    center_on_bed(printer.settings, printer.codes);
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

Status write_file(const std::string& name, const std::string& text) {
  Result<Output> output = Output::open(name);
  if (!output) {
    return tl::unexpected(output.error());
  }
  return output->write(text).and_then([&] { return output->commit(); });
}

// The printer file with what was read; empty if there is none, and then the user gets the lines.
Result<std::string> new_printer_file(const RunConfig& config, const Known& known,
                                     std::string& summary) {
  const std::vector<machine::TomlEdit> edits = edits_of(config.tune.zones, known);
  if (!config.printer_file) {
    summary += "for the printer file:\n";
    for (const machine::TomlEdit& edit : edits) {
      summary += fmt::format("{} = {}  # {}\n", edit.key, edit.value, edit.remark);
    }
    return std::string{};
  }
  return Input::open(*config.printer_file)
      .and_then([](Input input) { return input.read_all(); })
      .and_then([&](const std::string& text) {
        return machine::with_values(text, *config.printer_file, edits);
      });
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

// The printer after what its tower tells.
Result<Printer> read_tower(const RunConfig& config, std::string& summary) {
  Result<Input> input = Input::open(config.input);
  if (!input) {
    return tl::unexpected(input.error());
  }
  Result<tune::TowerRecord> record =
      input->make_seekable()
          .and_then([&] { return read_text(*input); })
          .and_then([&](std::string text) { return tune::record_of(text, config.input); });
  if (!record) {
    return tl::unexpected(record.error());
  }
  Result<machine::Settings> settings = load_settings(config, nullptr);
  if (!settings) {
    return tl::unexpected(settings.error());
  }
  Printer printer{.settings = std::move(*settings), .known = {}, .codes = std::move(record->codes)};
  if (Status raised = raise_accel(config, nullptr, printer); !raised) {
    return tl::unexpected(raised.error());
  }
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

// Whether the tower and its brim are on the bed.
Status check_place(const machine::Settings& settings, const tune::Tower& tower,
                   const tune::Codes& codes) {
  const double half_mm = 0.5 * tower.side_mm + tower.brim_mm;
  for (const auto& [key, travel, center_mm] :
       {std::tuple("printer.travel_x_mm", settings.printer.travel_x_mm, codes.center_x_mm),
        std::tuple("printer.travel_y_mm", settings.printer.travel_y_mm, codes.center_y_mm)}) {
    // Where the tool may be is not known of every printer. The user's own print was there.
    if (travel && (center_mm - half_mm < travel->min || center_mm + half_mm > travel->max)) {
      return fail(ErrorKind::usage,
                  fmt::format("the tower needs {:.0f} mm around {:.0f} mm, which {} does not "
                              "leave; it says where the tool may be",
                              2.0 * half_mm, center_mm, key));
    }
  }
  return {};
}

std::string trial_text(std::size_t axis, const tune::Trial& trial) {
  const bool is_freq = trial.parameter == tune::Parameter::freq_hz;
  return fmt::format("{}: bands 1 to {} try {} {:.4g} to {:.4g}{}\n", kLetters[axis], trial.bands,
                     is_freq ? "frequencies" : "damping ratios", trial.value(1),
                     trial.value(trial.bands), is_freq ? " Hz" : "");
}

Status write_tower(const RunConfig& config, const Printer& printer, std::string& summary) {
  tune::TowerSettings wanted;
  wanted.firmware = printer.settings.printer.firmware;
  wanted.codes = printer.codes;
  wanted.accel_mm_s2 = accel_mm_s2(printer.settings);
  wanted.own = printer.own;
  wanted.max_velocity_mm_s = printer.settings.limits.max_velocity_mm_s;
  wanted.nozzle_diameter_mm = printer.settings.extruder.nozzle_diameter_mm;
  wanted.filament_diameter_mm = printer.settings.extruder.filament_diameter_mm;
  pipeline::TrueAxes middle;
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
  if (Status placed = check_place(printer.settings, tower, wanted.codes); !placed) {
    return placed;
  }
  // Both are opened first, so that nothing is computed in vain.
  Result<Output> output = Output::open(config.output);
  std::optional<Output> page;
  if (!output) {
    return tl::unexpected(output.error());
  }
  if (config.report) {
    Result<Output> opened = Output::open(*config.report);
    if (!opened) {
      return tl::unexpected(opened.error());
    }
    page.emplace(std::move(*opened));
  }
  std::vector<std::vector<pipeline::Relief>> reliefs;
  const Result<std::vector<pipeline::Band>> bands = with_progress(config, [&](Progress& progress) {
    return pipeline::compensate_bands(tower, wanted, printer.settings, config.workers, progress);
  });
  if (!bands) {
    return tl::unexpected(bands.error());
  }
  if (page) {
    Result<std::vector<std::vector<pipeline::Relief>>> printed = with_progress(
        config,
        [&](Progress& progress) { return pipeline::print_bands(*bands, tower, middle, progress); });
    if (!printed) {
      return tl::unexpected(printed.error());
    }
    if (Status written = write_report(page, tune_page(wanted, tower, *printed, middle)); !written) {
      return written;
    }
  }
  for (std::size_t axis = 0; axis < 2; ++axis) {
    summary += trial_text(axis, wanted.trials[axis]);
  }
  summary += fmt::format(
      "{}: print it; then look at the right wall for x and at the front wall for y, count from the "
      "bed, and run\nunflex tune {} --read x=FIRST..LAST --read y=FIRST..LAST{} -o NEXT\n",
      config.output, config.output,
      (config.printer_file ? " --printer " + *config.printer_file : std::string{}) +
          (config.tune.accel_mm_s2 ? fmt::format(" --accel {:g}", *config.tune.accel_mm_s2)
                                   : std::string{}));
  return output->write(pipeline::join_bands(*bands)).and_then([&] { return output->commit(); });
}

}  // namespace

Result<ExitCode> run_tune(const RunConfig& config, Console& console) {
  std::string summary;
  const Result<Printer> printer =
      config.input.empty() ? first_printer(config) : read_tower(config, summary);
  if (!printer) {
    return tl::unexpected(printer.error());
  }
  console.warnings(setting_warnings(printer->settings));
  std::string printer_file;
  if (!config.input.empty()) {
    Result<std::string> text = new_printer_file(config, printer->known, summary);
    if (!text) {
      return tl::unexpected(text.error());
    }
    printer_file = std::move(*text);
  }
  // The tower comes first: what was read is in the printer file only if all went well.
  if (!config.output.empty()) {
    if (Status written = write_tower(config, *printer, summary); !written) {
      return tl::unexpected(written.error());
    }
  }
  if (!printer_file.empty()) {
    if (Status written = write_file(*config.printer_file, printer_file); !written) {
      return tl::unexpected(written.error());
    }
    summary += fmt::format("{}: written\n", *config.printer_file);
  }
  const bool says = !config.quiet && config.output != kStandardStream;
  return (says ? write_last(summary) : Status{}).map([] { return ExitCode::done; });
}

}  // namespace unflex::app
