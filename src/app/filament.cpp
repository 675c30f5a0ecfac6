#include "filament.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <istream>
#include <memory>
#include <string>
#include <utility>

#include "results.hpp"
#include "unflex/filament/profile.hpp"
#include "unflex/platform/files.hpp"
#include "workspace.hpp"

namespace unflex::app {
namespace {

Result<filament::Profile> profile_of(const RunConfig& config, const machine::Settings& settings) {
  const std::optional<std::string> path = filament_profile(config, settings);
  if (!path) {
    return filament::Profile(settings.filament_area_mm2());
  }
  const std::unique_ptr<std::istream> table = platform::read_file(*path);
  if (!*table || platform::is_directory(*path)) {
    return fail(ErrorKind::usage, {*path, 0},
                "cannot be read; extruder.filament_profile is to name a table of the filament");
  }
  return filament::Profile::read(*table, *path);
}

std::string summary(const filament::FittedPrint& fitted) {
  const filament::Totals& totals = fitted.totals;
  const bool is_even = totals.most - totals.least < 5e-6;
  const std::string factor = is_even ? fmt::format("{:.5f}", totals.most)
                                     : fmt::format("{:.5f} to {:.5f}", totals.least, totals.most);
  return fmt::format(
      "filament      E × {} in {} lines\n"
      "              {:.2f} mm of moves that print became {:.2f} mm, {:.1f} mm³ of material\n"
      "              the print ends at {:.1f} mm of the filament\n",
      factor, totals.changed_lines, totals.sliced_mm, totals.fitted_mm, totals.material_mm3,
      totals.end_mm);
}

}  // namespace

std::optional<std::string> filament_profile(const RunConfig& config,
                                            const machine::Settings& settings) {
  if (settings.extruder.filament_profile.empty()) {
    return std::nullopt;
  }
  const std::string& name = settings.extruder.filament_profile;
  const bool is_from_file =
      config.printer_file && std::ranges::any_of(settings.origins, [&](const auto& origin) {
        return origin.first == "extruder.filament_profile" &&
               origin.second.starts_with(*config.printer_file);
      });
  return is_from_file ? platform::name_beside(*config.printer_file, name) : name;
}

Result<std::optional<filament::FittedPrint>> fit_to_filament(const RunConfig& config,
                                                             const machine::Settings& settings,
                                                             Input& input) {
  std::optional<filament::FittedPrint> result;
  if (!settings.extruder.fits_filament()) {
    return result;
  }
  const Result<filament::Profile> profile = profile_of(config, settings);
  if (!profile) {
    return tl::unexpected(profile.error());
  }
  const Status fitted = input.make_seekable().and_then([&] {
    const std::shared_ptr<TextStore> sliced = input.text();
    return input.replace_text([&](const Input::Write& write) {
      return filament::fit_filament(*sliced, input.name(), settings, *profile,
                                    config.command == Command::filament, write)
          .map([&](filament::FittedPrint print) { result = std::move(print); });
    });
  });
  if (!fitted) {
    return tl::unexpected(fitted.error());
  }
  return result;
}

Result<ExitCode> run_filament(const RunConfig& config, Console& console) {
  Result<Workspace> space = open_workspace(config);
  if (!space) {
    return tl::unexpected(space.error());
  }
  if (!space->fitted) {
    return fail(ErrorKind::usage,
                "which filament? set extruder.filament_area_mm2 or extruder.filament_profile");
  }
  if (Status accepted = accept(config, space->fitted->warnings, false, console); !accepted) {
    return tl::unexpected(accepted.error());
  }
  console.warnings(space->fitted->warnings);
  pack_output(config, *space);
  const std::unique_ptr<std::istream> text = space->input.text()->read();
  Status written;
  std::string block(1U << 16U, '\0');
  while (written && (text->read(block.data(), static_cast<std::streamsize>(block.size())),
                     text->gcount() > 0)) {
    written = space->output->write({block.data(), static_cast<std::size_t>(text->gcount())});
  }
  return written.and_then([&] { return space->output->seal(); })
      .and_then([&] { return check_inputs(*space); })
      .and_then([&] { return space->output->commit(); })
      .and_then([&] { return print_summary(config, summary(*space->fitted), console); })
      .map([] { return ExitCode::done; });
}

}  // namespace unflex::app
