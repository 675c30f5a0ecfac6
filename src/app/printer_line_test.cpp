#include "printer_line_test.hpp"

#include <fmt/core.h>

#include "outputs.hpp"
#include "results.hpp"
#include "unflex/machine/line_test.hpp"

namespace unflex::app {

Result<ExitCode> run_line_test(const RunConfig& config, Console& console) {
  const Result<machine::Settings> settings = machine::load(config.printer_file, config.overrides);
  if (!settings) {
    return tl::unexpected(settings.error());
  }
  const Result<std::string> text = machine::line_test(*settings);
  if (!text) {
    return tl::unexpected(text.error());
  }
  for (const Diagnostic& note : settings->notes) {
    console.line(to_string(note));
  }
  Result<Output> output = Output::open(config.output);
  if (!output) {
    return tl::unexpected(output.error());
  }
  return output->write(*text)
      .and_then([&] { return output->commit(); })
      .and_then([&] {
        const std::vector<machine::LineTestStage> stages = machine::line_test_stages(*settings);
        return config.quiet || config.output == kStandardStream
                   ? Status{}
                   : write_last(fmt::format("{}: {} to {} lines/s in {} stages\n", config.output,
                                            stages.front().lines_per_s, stages.back().lines_per_s,
                                            stages.size()));
      })
      .map([] { return ExitCode::done; });
}

}  // namespace unflex::app
