// Parts that towers of all kinds share: their printer, and the files that they give.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "console.hpp"
#include "results.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/machine/toml_edit.hpp"
#include "unflex/tune/bands.hpp"

namespace unflex::app {

// A printer for which towers are made, and the codes of its prints.
struct TowerSite {
  machine::Settings settings;
  std::optional<tune::AccelLimits> own = {};  // its own limits, with --accel
  tune::Codes codes;
};

// How a kind of tower loads the settings. The print is null if there is none.
using LoadSettings =
    std::function<Result<machine::Settings>(const RunConfig& config, const machine::PrintText*)>;

// For the first tower, with the codes of --like or of the temperatures.
[[nodiscard]] Result<TowerSite> first_site(const RunConfig& config, const LoadSettings& load);
// For a tower after one that has told its codes.
[[nodiscard]] Result<TowerSite> later_site(const RunConfig& config, const LoadSettings& load,
                                           tune::Codes codes);

// The text of the tower that has been printed (RunConfig::input).
[[nodiscard]] Result<std::string> printed_tower(const RunConfig& config);

// Whether somebody has given this key.
[[nodiscard]] bool is_given(const machine::Settings& settings, const std::string& key);

// The facts of the printer that a tower's settings hold.
[[nodiscard]] tune::TowerPrinter tower_printer(const TowerSite& site);

// Limits the tower's acceleration to most_mm_s2. Behind the tower the printer has its own limits
// back.
void lower_accel(const TowerSite& site, double most_mm_s2, tune::TowerPrinter& tower);

// Compensates the bands and writes the tower to RunConfig::output, and the page that `page` makes
// of them to RunConfig::report. An error of kind usage if the tower is larger than the bed.
using PageOf =
    std::function<Result<std::string>(const std::vector<tune::Band>& bands, Progress& progress)>;
[[nodiscard]] Status write_tower(const RunConfig& config, const TowerSite& site,
                                 const tune::Tower& tower,
                                 const std::vector<machine::Settings>& of_bands,
                                 const PageOf& page);

// The options of this tower's command that the next one's needs as well.
[[nodiscard]] std::string further_options(const RunConfig& config);

// Writes the next tower, and adds to the summary what it tries and what to do with it.
using WriteNext = std::function<Status(std::string& summary)>;

// Ends the command: warns, writes the next tower if one is asked for, puts what was read into the
// printer file, and tells the summary. read: unset if no tower was read.
[[nodiscard]] Result<ExitCode> finish_tune(
    const RunConfig& config, Console& console, const machine::Settings& settings,
    const std::optional<std::vector<machine::TomlEdit>>& read, const WriteNext& write_next,
    std::string summary);

}  // namespace unflex::app
