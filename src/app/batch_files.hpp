// The prints of a folder, and where their outputs and reports go.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

// Whether a file of that name is a print, by its suffix, in small or capital letters.
[[nodiscard]] bool is_print(std::string_view name);

// The suffixes, for messages: "*.gcode, *.g".
[[nodiscard]] std::string print_suffixes();

// The names are bytes, as the file system has them.
struct BatchPrint {
  std::string name;  // below the folder: "parts/lid.gcode"
  std::string input;
  std::string output;
  std::optional<std::string> report;
  // The printer file in the print's own folder, or in the next folder above that has one. Unset:
  // the printer file of the command line.
  std::optional<std::string> printer_file;
  std::uint64_t bytes = 0;
};

struct BatchFiles {
  std::vector<BatchPrint> prints;     // sorted by name
  std::vector<Error> unreadable;      // folders that could not be looked into
  std::vector<Diagnostic> passed_by;  // files that look like a print but were left out
};

// The printer file of a folder, which holds for the prints in it and below.
inline constexpr std::string_view kPrinterFileName = "printer.toml";

// The name of a file below the folder, without the folder's own name; "." for the folder itself.
[[nodiscard]] std::string name_below(std::string_view folder, std::string_view file);

// Looks through the folder config.input, and all below, for prints. The output mirrors it in
// config.output, pages go to config.report. Names that begin with a dot, links to folders, and the
// output's and the reports' own folders are passed by. Errors: of kind input if the folder cannot
// be read, of kind usage if an output would replace an input or another output.
[[nodiscard]] Result<BatchFiles> find_prints(const RunConfig& config);
// An error of kind input if there is none.
[[nodiscard]] Status check_has_print(const RunConfig& config, const BatchFiles& files);

}  // namespace unflex::app
