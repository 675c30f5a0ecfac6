#include "log.hpp"

#include <fmt/chrono.h>
#include <fmt/core.h>

#include <cerrno>
#include <ctime>
#include <initializer_list>
#include <utility>

#include "console.hpp"
#include "unflex/core/errno_text.hpp"
#include "unflex/platform/folders.hpp"

namespace unflex::app {
namespace {

// Checks that the log is not a file that is read or replaced.
Status check_distinct(const RunConfig& config) {
  for (const std::string& other : {config.input, config.output, config.report.value_or(""),
                                   config.printer_file.value_or("")}) {
    if (other != kStandardStream && platform::same_file(*config.log, other)) {
      return fail(ErrorKind::usage, {*config.log, 0},
                  "is read or written already; give the log a name of its own");
    }
  }
  return {};
}

}  // namespace

Result<Log> Log::open(const RunConfig& config) {
  if (!config.log) {
    return Log({}, {}, FileDescriptor());
  }
  if (Status distinct = check_distinct(config); !distinct) {
    return tl::unexpected(distinct.error());
  }
  FileDescriptor file = platform::open_to_append(*config.log);
  if (!file.valid()) {
    return fail(ErrorKind::usage, {*config.log, 0},
                fmt::format("cannot write the log: {}", write_error_text(errno)));
  }
  return Log(*config.log, config.print_name, std::move(file));
}

Status Log::append(const std::vector<std::string>& lines, int exit_code) {
  if (!file_.valid()) {
    return {};
  }
  std::string entry = fmt::format("{:%Y-%m-%dT%H:%M:%SZ} unflex {} {}\n",
                                  fmt::gmtime(std::time(nullptr)), version(), one_line(print_));
  for (const std::string& line : lines) {
    entry += fmt::format("  {}\n", line);
  }
  entry += fmt::format("  exit code {}\n", exit_code);
  const int error = write_all(file_.get(), entry);
  return error == 0
             ? Status{}
             : Status(fail(ErrorKind::internal, {name_, 0},
                           fmt::format("cannot write the log: {}", write_error_text(error))));
}

}  // namespace unflex::app
