#include "printer_macros.hpp"

#include <fmt/core.h>

#include <string>

#include "klipper_macros.hpp"
#include "outputs.hpp"
#include "results.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::app {
namespace {

Result<std::string> macros_of(const machine::Settings& settings) {
  const FirmwareWriting& writing = spec_of(settings.printer.firmware).writing;
  if (!writing.can_pause_behind_run) {
    return fail(ErrorKind::usage, std::string(writing.why_no_macros));
  }
  return klipper_macros();
}

Status write_macros(const RunConfig& config, const std::string& macros) {
  Result<Output> output = Output::open(config.output);
  if (!output) {
    return tl::unexpected(output.error());
  }
  return output->write(macros).and_then([&] { return output->commit(); });
}

Status print_summary(const RunConfig& config) {
  if (config.quiet || config.output == kStandardStream) {
    return {};
  }
  return write_last(
      fmt::format("{}: include it at the end of printer.cfg, and set emit.checkpoints = true\n",
                  config.output));
}

}  // namespace

Result<ExitCode> run_printer_macros(const RunConfig& config) {
  return machine::load(config.printer_file, config.overrides)
      .and_then(macros_of)
      .and_then([&](const std::string& macros) { return write_macros(config, macros); })
      .and_then([&] { return print_summary(config); })
      .map([] { return ExitCode::done; });
}

}  // namespace unflex::app
