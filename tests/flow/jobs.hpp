// Jobs in a directory of their own.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/flow/flow.hpp"

namespace unflex::flow::testing {

[[nodiscard]] std::string read_file(const std::filesystem::path& file);
void write_file(const std::filesystem::path& file, std::string_view text);

// Default settings with these overrides, "key=value".
[[nodiscard]] machine::Settings settings(const std::vector<std::string>& overrides = {});

// The deviation of the sliced print as played without an input shaper.
[[nodiscard]] const verify::Deviation& unshaped(const report::Report& report);

// A directory with one input and one output, deleted with the object.
class JobFolder {
 public:
  explicit JobFolder(std::string_view input, const std::vector<std::string>& overrides = {});
  ~JobFolder();
  JobFolder(const JobFolder&) = delete;
  JobFolder& operator=(const JobFolder&) = delete;

  [[nodiscard]] Job job(unsigned workers = 1) const;
  [[nodiscard]] std::string output() const { return read_file(folder_ / "out.gcode"); }
  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }
  void set_output(std::string_view text) const { write_file(folder_ / "out.gcode", text); }

 private:
  std::filesystem::path folder_;
  machine::Settings settings_;
};

// The violations and kept runs of a report, one per line, for messages.
[[nodiscard]] std::string complaints(const report::Report& report);

}  // namespace unflex::flow::testing
