// Steps that commands share: work under a progress bar, and the delivery of results.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "console.hpp"
#include "outputs.hpp"
#include "progress.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/platform/signals.hpp"

namespace unflex::app {

// The exit code of a process that a signal ended: 128 + signal.
inline constexpr int kSignalExitBase = 128;

[[nodiscard]] ExitCode exit_code(ErrorKind kind);

// The error of a command that a signal ended. with_result: one of its results is in place.
[[nodiscard]] tl::unexpected<Error> interrupted(Command command, bool with_result = false);

// Runs a command on a print with a progress bar that is gone when it returns.
template <class Work>
auto with_progress(const RunConfig& config, Work work)
    -> decltype(work(std::declval<Progress&>())) {
  const std::unique_ptr<Progress> progress = make_progress(config.quiet);
  auto result = work(*progress);
  if (platform::ending_signal() != 0) {
    return interrupted(config.command);
  }
  return result;
}

// The settings, or an error if they rest on a guess.
[[nodiscard]] Result<machine::Settings> without_guess(machine::Settings settings);

// Warnings about odd settings and about guesses among them.
[[nodiscard]] std::vector<std::string> setting_warnings(const machine::Settings& settings);

// The fate of the output after an error, for messages. passed_on: the output has already gone to a
// stream.
[[nodiscard]] std::string_view consequence_of(bool passed_on);

// With --strict, an error if there are warnings. They are then shown as errors.
[[nodiscard]] Status accept(const RunConfig& config, std::vector<std::string> warnings,
                            bool passed_on, Console& console);

// Puts remarks about the settings before those about the print.
void add_setting_warnings(const machine::Settings& settings, std::vector<std::string>& warnings);

// The summary goes to stdout. If a result goes there, the summary goes to stderr, but only to a
// terminal.
[[nodiscard]] Status print_summary(const RunConfig& config, std::string_view text,
                                   Console& console);

// Writes to stdout, as the last thing a command does.
[[nodiscard]] Status write_last(std::string_view text);

[[nodiscard]] Status write_report(std::optional<Output>& report, std::string_view text);

}  // namespace unflex::app
