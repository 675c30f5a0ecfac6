// The program: from the user's request to files, summary and exit code.
#pragma once

#include "unflex/app/run_config.hpp"

namespace unflex::app {

// Does the work. Results go to stdout or files; warnings and errors to stderr, one line each.
// Returns the exit code, 128 + signal if SIGINT, SIGTERM or SIGHUP ended the work. Call it before
// any thread exists.
[[nodiscard]] int run(const RunConfig& config);

// Reads the command line and does the work. main() calls it.
[[nodiscard]] int run_program(const std::vector<std::string>& arguments);

}  // namespace unflex::app
