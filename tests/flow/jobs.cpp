#include "jobs.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

#include "unflex/platform/files.hpp"

namespace unflex::flow::testing {

std::string read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  EXPECT_TRUE(stream) << file;
  return {std::istreambuf_iterator<char>(stream), {}};
}

void write_file(const std::filesystem::path& file, std::string_view text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  EXPECT_TRUE(stream.flush()) << file;
}

const verify::Deviation& unshaped(const report::Report& report) {
  return report.measured.unshaped ? *report.measured.unshaped : report.measured.uncompensated;
}

machine::Settings settings(const std::vector<std::string>& overrides) {
  // Frequencies are exact unless a test says otherwise.
  std::vector<std::string> all = {"dynamics.freq_error=0"};
  all.insert(all.end(), overrides.begin(), overrides.end());
  Result<machine::Settings> loaded = machine::load(std::nullopt, all);
  EXPECT_TRUE(loaded.has_value()) << to_string(loaded.error());
  // A Klipper has a shaper, so that every test sees it switched off and on again.
  machine::PrinterSettings& printer = loaded->printer;
  if (printer.firmware == Firmware::klipper) {
    printer.input_shaper.freq_hz.x =
        printer.input_shaper.freq_hz.x.value_or(loaded->dynamics.x.freq_hz);
    printer.input_shaper.freq_hz.y =
        printer.input_shaper.freq_hz.y.value_or(loaded->dynamics.y.freq_hz);
  }
  return *loaded;
}

JobFolder::JobFolder(std::string_view input, const std::vector<std::string>& overrides)
    : settings_(settings(overrides)) {
  std::string pattern = (std::filesystem::temp_directory_path() / "unflex_XXXXXX").string();
  EXPECT_NE(mkdtemp(pattern.data()), nullptr);
  folder_ = pattern;
  write_file(folder_ / "in.gcode", input);
}

JobFolder::~JobFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

Job JobFolder::job(unsigned workers) const {
  return {.input = platform::file_store(folder_ / "in.gcode"),
          .input_name = "in.gcode",
          .output = platform::file_store(folder_ / "out.gcode"),
          .output_name = "out.gcode",
          .settings = settings_,
          .workers = workers};
}

std::string complaints(const report::Report& report) {
  std::string text;
  for (const std::string& violation : report.violations) {
    text += violation + "\n";
  }
  for (const report::Fallback& fallback : report.runs.fallbacks) {
    text += fmt::format("lines {} to {} kept: {}\n", fallback.first_line, fallback.last_line,
                        fallback.reason);
  }
  return text;
}

}  // namespace unflex::flow::testing
