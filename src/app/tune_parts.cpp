#include "tune_parts.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <istream>
#include <memory>
#include <sstream>
#include <utility>

#include "inputs.hpp"
#include "outputs.hpp"
#include "unflex/core/axes.hpp"
#include "unflex/core/firmware_spec.hpp"

namespace unflex::app {
namespace {

// The whole text of an input that can be read twice.
Result<std::string> read_text(const Input& input) {
  const std::unique_ptr<std::istream> file = input.text()->read();
  std::ostringstream text;
  text << file->rdbuf();
  if (!*file) {
    return fail(ErrorKind::input, {input.name(), 0}, "cannot read the file");
  }
  return text.str();
}

// The printer's own limits, if a tower of another acceleration goes beyond them.
tune::AccelLimits own_limits(const machine::Settings& settings) {
  const std::array<double, 4> axes = settings.axis_max_accel_mm_s2();
  return {axes[0], axes[1], settings.print_accel_mm_s2(), settings.travel_accel_mm_s2()};
}

// With --accel: the settings of the printer with that acceleration, and its own limits.
Status raise_accel(const RunConfig& config, const machine::PrintText* print,
                   const LoadSettings& load, TowerSite& site) {
  if (!config.tune.accel_mm_s2) {
    return {};
  }
  site.own = own_limits(site.settings);
  RunConfig raised = config;
  for (const char* const key :
       {"limits.max_accel_mm_s2", "limits.print_accel_mm_s2", "limits.travel_accel_mm_s2",
        "limits.max_x_accel_mm_s2", "limits.max_y_accel_mm_s2"}) {
    raised.overrides.push_back(fmt::format("{}={}", key, *config.tune.accel_mm_s2));
  }
  Result<machine::Settings> settings = load(raised, print);
  if (!settings) {
    return tl::unexpected(settings.error());
  }
  site.settings = std::move(*settings);
  return {};
}

Result<TowerSite> site_of(const RunConfig& config, const machine::PrintText* print,
                          const LoadSettings& load) {
  Result<machine::Settings> settings = load(config, print);
  if (!settings) {
    return tl::unexpected(settings.error());
  }
  TowerSite site{.settings = std::move(*settings), .codes = {}};
  if (Status raised = raise_accel(config, print, load, site); !raised) {
    return tl::unexpected(raised.error());
  }
  return site;
}

double accel_mm_s2(const machine::Settings& settings) {
  if (!spec_of(settings.printer.firmware).motion.has_axis_limits) {
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
  codes.center_mm = map_axes(middle, settings.printer.travel_mm);
}

// Whether the tower and its brim are on the bed.
Status check_place(const machine::Settings& settings, const tune::Tower& tower,
                   const tune::Codes& codes) {
  const double half_mm = 0.5 * tower.side_mm + tower.brim_mm;
  for (std::size_t axis = 0; axis < XY::kCount; ++axis) {
    const std::optional<machine::Range>& travel = settings.printer.travel_mm[axis];
    const double center_mm = codes.center_mm[axis];
    // The tool's travel is not known for every printer. Where it is unknown, the place of the
    // user's own print is trusted.
    if (travel && (center_mm - half_mm < travel->min || center_mm + half_mm > travel->max)) {
      return fail(ErrorKind::usage,
                  fmt::format("the tower needs {:.0f} mm around {:.0f} mm, which "
                              "printer.travel_{}_mm does not leave; it says where the tool may be",
                              2.0 * half_mm, center_mm, kAxisKeys[axis]));
    }
  }
  return {};
}

Status write_file(const std::string& name, const std::string& text) {
  Result<Output> output = Output::open(name);
  if (!output) {
    return tl::unexpected(output.error());
  }
  return output->write(text).and_then([&] { return output->commit(); });
}

// The printer file with these values; empty if there is none, and then the summary gets the lines.
Result<std::string> edited_printer_file(const RunConfig& config,
                                        const std::vector<machine::TomlEdit>& edits,
                                        std::string& summary) {
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

}  // namespace

Result<TowerSite> first_site(const RunConfig& config, const LoadSettings& load) {
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
  Result<TowerSite> site = site_of(config, print ? &*print : nullptr, load);
  if (!site) {
    return site;
  }
  if (text) {
    Result<tune::Codes> codes =
        tune::codes_of(*text, *config.tune.like, site->settings.printer.firmware);
    if (!codes) {
      return tl::unexpected(codes.error());
    }
    site->codes = std::move(*codes);
  } else {
    site->codes = tune::plain_codes(*config.tune.nozzle_temp_c, config.tune.bed_temp_c);
  }
  if (!text || all_axes([](const auto& travel) { return travel.has_value(); },
                        site->settings.printer.travel_mm)) {
    center_on_bed(site->settings, site->codes);
  }
  return site;
}

Result<TowerSite> later_site(const RunConfig& config, const LoadSettings& load, tune::Codes codes) {
  return site_of(config, nullptr, load).map([&](TowerSite site) {
    site.codes = std::move(codes);
    return site;
  });
}

Result<std::string> printed_tower(const RunConfig& config) {
  Result<Input> input = Input::open(config.input);
  if (!input) {
    return tl::unexpected(input.error());
  }
  return input->make_seekable().and_then([&] { return read_text(*input); });
}

bool is_given(const machine::Settings& settings, const std::string& key) {
  const auto found =
      std::ranges::find(settings.origins, key, &std::pair<std::string, std::string>::first);
  return found != settings.origins.end() && found->second != machine::kDefaultOrigin;
}

tune::TowerPrinter tower_printer(const TowerSite& site) {
  return {.firmware = site.settings.printer.firmware,
          .codes = site.codes,
          .accel_mm_s2 = accel_mm_s2(site.settings),
          .own = site.own,
          .max_velocity_mm_s = site.settings.limits.max_velocity_mm_s,
          .nozzle_diameter_mm = site.settings.extruder.nozzle_diameter_mm,
          .filament_diameter_mm = site.settings.extruder.filament_diameter_mm};
}

void lower_accel(const TowerSite& site, double most_mm_s2, tune::TowerPrinter& tower) {
  if (tower.accel_mm_s2 > most_mm_s2) {
    tower.accel_mm_s2 = most_mm_s2;
    tower.own = site.own.value_or(own_limits(site.settings));
  }
}

Status write_tower(const RunConfig& config, const TowerSite& site, const tune::Tower& tower,
                   const std::vector<machine::Settings>& of_bands, const PageOf& page_of) {
  if (Status placed = check_place(site.settings, tower, site.codes); !placed) {
    return placed;
  }
  // Output and page are opened first, so that nothing is computed in vain.
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
  const Result<std::vector<tune::Band>> bands = with_progress(config, [&](Progress& progress) {
    return tune::compensate_bands(tower, of_bands, config.solve.workers, progress);
  });
  if (!bands) {
    return tl::unexpected(bands.error());
  }
  if (page) {
    const Result<std::string> text =
        with_progress(config, [&](Progress& progress) { return page_of(*bands, progress); });
    if (!text) {
      return tl::unexpected(text.error());
    }
    if (Status written = write_report(page, *text); !written) {
      return written;
    }
  }
  return output->write(tune::join_bands(*bands)).and_then([&] { return output->commit(); });
}

std::string further_options(const RunConfig& config) {
  return (config.printer_file ? " --printer " + *config.printer_file : std::string{}) +
         (config.tune.accel_mm_s2 ? fmt::format(" --accel {:g}", *config.tune.accel_mm_s2)
                                  : std::string{});
}

Result<ExitCode> finish_tune(const RunConfig& config, Console& console,
                             const machine::Settings& settings,
                             const std::optional<std::vector<machine::TomlEdit>>& read,
                             const WriteNext& write_next, std::string summary) {
  console.warnings(setting_warnings(settings));
  std::string printer_file;
  if (read) {
    Result<std::string> text = edited_printer_file(config, *read, summary);
    if (!text) {
      return tl::unexpected(text.error());
    }
    printer_file = std::move(*text);
  }
  // The tower comes first: what was read is in the printer file only if all went well.
  if (!config.output.empty()) {
    if (Status written = write_next(summary); !written) {
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
