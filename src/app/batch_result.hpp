// The result of one print of a batch. The process that worked on the print passes it to the batch,
// which puts it into the manifest and the summary.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "unflex/app/run_config.hpp"
#include "unflex/report/json_parts.hpp"

namespace unflex::app {

// Figures measured on extruding moves.
struct BatchFigures {
  double max_before_mm = 0.0;
  double max_after_mm = 0.0;
  double rms_before_mm = 0.0;
  double rms_after_mm = 0.0;
  double print_time_s = 0.0;
};

// The sources of an output. The output is up to date if none of them has changed.
struct BatchOrigin {
  std::string version;
  std::string input_sha256;
  std::string settings_sha256;  // hash of everything but the input that decides the output
  std::string output_sha256;
  std::string report_sha256;  // empty without a report

  friend bool operator==(const BatchOrigin&, const BatchOrigin&) = default;
};

// A print that is done.
struct BatchRecord {
  BatchOrigin origin;
  BatchFigures figures;
};

enum class BatchState { done, unchanged, failed };

struct BatchAnswer {
  BatchState state = BatchState::failed;
  int exit_code = static_cast<int>(ExitCode::internal);
  bool measured = false;              // the figures are there
  BatchRecord record;                 // its origin is set unless the state is failed
  std::vector<std::string> messages;  // warnings and errors, one line each
  std::string error;                  // why it failed, one line
};

[[nodiscard]] std::string_view to_string(BatchState state);

[[nodiscard]] report::Json to_json(const BatchFigures& figures);
[[nodiscard]] report::Json to_json(const BatchRecord& record);
// nullopt if something is missing.
[[nodiscard]] std::optional<BatchRecord> record_from(const report::Json& json);

// The answer as a text, for the way between processes.
[[nodiscard]] std::string pack(const BatchAnswer& answer);
// An answer that is cut off counts as failed.
[[nodiscard]] BatchAnswer unpack(const std::string& text);

}  // namespace unflex::app
