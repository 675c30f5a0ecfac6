// A file in which runs of the program add up what they said: slicers show little of it.
#pragma once

#include <string>
#include <vector>

#include "files.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

class Log {
 public:
  // Checks that the log, if there is to be one, can be written before the work begins: an error of
  // kind usage.
  [[nodiscard]] static Result<Log> open(const RunConfig& config);

  // One entry: time (UTC), version and print, then the lines and the exit code. It is written at
  // once, so that entries of several runs at a time do not mix. Errors are of kind internal.
  [[nodiscard]] Status append(const std::vector<std::string>& lines, int exit_code);

 private:
  Log(std::string name, std::string print, FileDescriptor file)
      : name_(std::move(name)), print_(std::move(print)), file_(std::move(file)) {}

  std::string name_;
  std::string print_;
  FileDescriptor file_;  // none where no log is asked for
};

}  // namespace unflex::app
