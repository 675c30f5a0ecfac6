#include "results.hpp"

#include <fmt/core.h>

#include <cerrno>

#include "files.hpp"
#include "unflex/core/errno_text.hpp"
#include "unflex/machine/recommend.hpp"
#include "unflex/platform/process.hpp"

namespace unflex::app {

ExitCode exit_code(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage:
      return ExitCode::usage;
    case ErrorKind::input:
      return ExitCode::input;
    case ErrorKind::internal:
      return ExitCode::internal;
  }
  return ExitCode::internal;
}

tl::unexpected<Error> interrupted(Command command, bool with_result) {
  if (command == Command::batch) {
    return fail(ErrorKind::internal,
                "interrupted; what is finished stays, the same batch again does the rest");
  }
  return fail(ErrorKind::internal, with_result ? "interrupted; what was written before is whole"
                                               : "interrupted, no file was written");
}

Result<machine::Settings> without_guess(machine::Settings settings) {
  if (!settings.guesses.empty()) {
    const Diagnostic& guess = settings.guesses.front();
    return fail(ErrorKind::usage, guess.place, guess.message);
  }
  return settings;
}

std::vector<std::string> setting_warnings(const machine::Settings& settings) {
  std::vector<std::string> remarks;
  for (Diagnostic guess : settings.guesses) {
    if (guess.place.file.empty()) {
      guess.place.file = "unflex";
    }
    remarks.push_back(to_string(guess));
  }
  for (const Diagnostic& note : settings.notes) {
    remarks.push_back(to_string(note));
  }
  for (const std::string& remark : machine::recommendations(settings)) {
    remarks.push_back(fmt::format("unflex: warning: {}", remark));
  }
  return remarks;
}

std::string_view consequence_of(bool passed_on) {
  return passed_on ? "what was passed on must not be printed" : "no output was written";
}

Status accept(const RunConfig& config, std::vector<std::string> warnings, bool passed_on,
              Console& console) {
  if (!config.strict || warnings.empty()) {
    return {};
  }
  constexpr std::string_view kWarning = ": warning: ";
  for (std::string& warning : warnings) {
    if (const std::size_t at = warning.find(kWarning); at != std::string::npos) {
      warning.replace(at, kWarning.size(), ": ");
    }
  }
  console.lines(warnings, warnings.size(),
                "errors; without --strict they are warnings, which --report lists");
  return fail(ErrorKind::input,
              fmt::format("--strict lets none of this pass; {}", consequence_of(passed_on)));
}

void add_setting_warnings(const machine::Settings& settings, std::vector<std::string>& warnings) {
  const std::vector<std::string> remarks = setting_warnings(settings);
  warnings.insert(warnings.begin(), remarks.begin(), remarks.end());
}

Status print_summary(const RunConfig& config, std::string_view text, Console& console) {
  console.note(text);
  if (config.quiet) {
    return {};
  }
  const bool stdout_taken = config.report == kStandardStream ||
                            (writes_print(config.command) && config.output == kStandardStream);
  if (stdout_taken) {
    if (platform::is_terminal(platform::kStandardError)) {
      static_cast<void>(write_all(platform::kStandardError, text));
    }
    return {};
  }
  return write_last(text);
}

Status write_last(std::string_view text) {
  const int error = write_all(platform::kStandardOutput, text);
  // If a signal ends the program here, the files are in place already, so no message must say that
  // there are none.
  const bool is_done = error == EINTR && platform::has_result();
  return error == 0 || is_done
             ? Status{}
             : Status(fail(ErrorKind::internal, {"stdout", 0},
                           fmt::format("cannot write: {}", write_error_text(error))));
}

Status write_report(std::optional<Output>& report, std::string_view text) {
  if (!report) {
    return {};
  }
  if (Status written = report->write(text); !written) {
    return written;
  }
  return report->commit();
}

}  // namespace unflex::app
