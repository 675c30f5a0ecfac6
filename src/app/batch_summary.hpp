// The summary of a batch: a table for people, JSON and JUnit XML for programs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "batch_result.hpp"

namespace unflex::app {

struct BatchRow {
  std::string name;  // below the batch's folder
  std::string input;
  std::string output;
  BatchAnswer answer;
  double wall_s = 0.0;
};

struct BatchSummary {
  std::string input;
  std::string output;
  std::optional<Shard> shard;
  std::vector<BatchRow> rows;          // sorted by name
  std::vector<std::string> passed_by;  // files that were left out, and why
  double wall_s = 0.0;

  [[nodiscard]] std::size_t count(BatchState state) const;
  // The highest exit code of all prints.
  [[nodiscard]] int exit_code() const;
};

// "142 → 8.1 µm max, 14.8 → 0.13 µm RMS", or why there are no figures.
[[nodiscard]] std::string result_text(const BatchAnswer& answer);

// "10 prints: 7 done, 2 unchanged, 1 failed, in 1m 02s".
[[nodiscard]] std::string total_text(const BatchSummary& summary);

[[nodiscard]] std::string summary_table(const BatchSummary& summary);
[[nodiscard]] std::string summary_json(const BatchSummary& summary);

// JUnit XML for continuous integration. A print is a test case. A deviation above --max-deviation
// is a failure. Anything else that went wrong is an error.
[[nodiscard]] std::string summary_junit(const BatchSummary& summary);

// Text for XML. Bytes that are not UTF-8, and characters that XML 1.0 lacks, become U+FFFD.
[[nodiscard]] std::string xml_text(std::string_view text);

}  // namespace unflex::app
