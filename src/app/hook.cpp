#include "hook.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "unflex/platform/names.hpp"
#include "unflex/platform/process.hpp"

namespace unflex::app {
namespace {

constexpr std::string_view kPrefix = "SLIC3R_";
// The prefix of variables that are not settings.
constexpr std::string_view kScriptPrefix = "SLIC3R_PP_";
constexpr std::string_view kFileHost = "File";

bool is_suffix_alone(std::string_view report) { return report == ".html" || report == ".json"; }

// The report's name beside the file the print ends up in.
Result<std::string> report_beside(const RunConfig& config, const Slicer& slicer) {
  if (config.output == kStandardStream) {
    return fail(ErrorKind::usage,
                fmt::format("--report {0}: stdout has no file to stand beside; name one, as "
                            "print{0}",
                            *config.report));
  }
  const bool uploads = config.in_place && slicer.host && *slicer.host != kFileHost;
  if (uploads) {
    return fail(ErrorKind::usage,
                fmt::format("--report {}: the slicer sends the print to {}, where no report can "
                            "stand beside it; give --report a whole name",
                            *config.report, *slicer.host));
  }
  return platform::with_ending(config.print_name, *config.report);
}

}  // namespace

Slicer read_slicer() {
  Slicer slicer;
  for (auto& [name, value] : platform::environment()) {
    if (!name.starts_with(kPrefix)) {
      continue;
    }
    if (name == "SLIC3R_PP_HOST") {
      slicer.host = std::move(value);
    } else if (name == "SLIC3R_PP_OUTPUT_NAME" && !value.empty()) {
      slicer.output_name = std::move(value);
    } else if (!name.starts_with(kScriptPrefix)) {
      slicer.settings.emplace_back(name, std::move(value));
    }
  }
  std::ranges::sort(slicer.settings);
  return slicer;
}

Result<RunConfig> with_slicer(RunConfig config, const Slicer& slicer) {
  if (!writes_print(config.command)) {
    return config;
  }
  config.print_name = config.in_place ? slicer.output_name.value_or(config.output) : config.output;
  if (config.in_place) {
    config.slicer_settings = slicer.settings;
  }
  if (config.report && is_suffix_alone(*config.report)) {
    Result<std::string> report = report_beside(config, slicer);
    if (!report) {
      return tl::unexpected(report.error());
    }
    config.report = std::move(*report);
  }
  return config;
}

}  // namespace unflex::app
