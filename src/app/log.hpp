// A file to which the program adds its messages of each run, since slicers show few of them.
#pragma once

#include <string>
#include <vector>

#include "files.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

class Log {
 public:
  // Checks before the work begins that the log, if there is to be one, can be written. If not, that
  // is an error of kind usage.
  [[nodiscard]] static Result<Log> open(const RunConfig& config);

  // One entry: time (UTC), version and print, then the lines and the exit code. It is written at
  // once, so that the entries of several processes do not mix. Errors are of kind internal.
  [[nodiscard]] Status append(const std::vector<std::string>& lines, int exit_code);

 private:
  Log(std::string name, std::string print, FileDescriptor file)
      : name_(std::move(name)), print_(std::move(print)), file_(std::move(file)) {}

  std::string name_;
  std::string print_;
  FileDescriptor file_;  // invalid if no log is asked for
};

}  // namespace unflex::app
