// What a batch tells in the end: a table for people, JSON and JUnit XML for programs.
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
  std::vector<std::string> passed_by;  // what was left out, and why
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

// As continuous integration reads it: a print is a test case. A deviation above --max-deviation is
// a failure, anything else that went wrong an error.
[[nodiscard]] std::string summary_junit(const BatchSummary& summary);

// Text within XML. What is not UTF-8 or no character of XML 1.0 becomes U+FFFD.
[[nodiscard]] std::string xml_text(std::string_view text);

}  // namespace unflex::app
