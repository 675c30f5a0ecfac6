#include "printer_init.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "console.hpp"
#include "files.hpp"
#include "identify.hpp"
#include "inputs.hpp"
#include "outputs.hpp"
#include "results.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/platform/folders.hpp"

namespace unflex::app {
namespace {

// The printer as the print's slicer describes it.
Result<machine::Settings> settings_from_slicer(const RunConfig& config,
                                               const machine::PrintText& print) {
  Result<machine::Settings> settings = machine::load({.print = &print,
                                                      .printer_file = {},
                                                      .overrides = config.overrides,
                                                      .firmware_as_sliced = true});
  const auto is_of_print = [&](const auto& origin) {
    return origin.second.starts_with(print.name + ":");
  };
  if (settings && std::ranges::none_of(settings->origins, is_of_print)) {
    return fail(ErrorKind::input, {config.input, 0},
                "says nothing of a printer; give its configuration, or a print that holds its "
                "slicer's settings");
  }
  return settings;
}

// The printer as the file describes it.
Result<machine::Settings> settings_from(const RunConfig& config, Input& input) {
  if (Status copied = input.make_seekable(); !copied) {
    return tl::unexpected(copied.error());
  }
  const Result<machine::PrintText> text = input.look();
  if (!text) {
    return tl::unexpected(text.error());
  }
  return machine::describes_printer(*text)
             ? machine::parse(text->tail, config.input, config.overrides)
             : settings_from_slicer(config, *text);
}

Status write_settings(const RunConfig& config, const machine::Settings& settings) {
  Result<Output> output = Output::open(config.output);
  if (!output) {
    return tl::unexpected(output.error());
  }
  return output->write(machine::to_toml(settings)).and_then([&] { return output->commit(); });
}

// The modes behind the records. Each axis with records must have one that carries a model, since
// the file is written once and used for long.
Result<Identification> identified(const RunConfig& config, Console& console) {
  Result<Identification> found = identify_records(config.identify);
  if (!found) {
    return tl::unexpected(found.error());
  }
  console.warnings(found->warnings);
  for (const IdentifiedRecord& record : found->records) {
    if (!found->axes.contains(record.axis)) {
      return fail(ErrorKind::input, {record.name, 0}, record.fit.refusal);
    }
  }
  return found;
}

// Names the records as the origin of the keys that they give.
void name_records(const Identification& found, machine::Settings& settings) {
  for (const auto& [axis, model] : found.axes) {
    std::string names;
    for (const IdentifiedRecord& record : found.records) {
      if (record.axis == axis && record.fit.is_trusted()) {
        names += (names.empty() ? "" : ", ") + record.name;
      }
    }
    const std::string section = fmt::format("dynamics.{}.", letter(axis));
    for (auto& [key, origin] : settings.origins) {
      if (key.starts_with(section) && origin == "--set") {
        origin = names;
      }
    }
  }
}

Status print_summary(const RunConfig& config) {
  if (config.quiet || config.output == kStandardStream) {
    return {};
  }
  return write_last(fmt::format("{} → {}\n", config.input, config.output));
}

}  // namespace

Result<ExitCode> run_printer_init(const RunConfig& asked, Console& console) {
  RunConfig config = asked;
  Identification found;
  if (!config.identify.records.empty()) {
    Result<Identification> result = identified(config, console);
    if (!result) {
      return tl::unexpected(result.error());
    }
    found = std::move(*result);
    const std::vector<std::string> overrides = dynamics_overrides(found);
    config.overrides.insert(config.overrides.begin(), overrides.begin(), overrides.end());
  }
  Result<Input> input = Input::open(config.input);
  if (!input) {
    return tl::unexpected(input.error());
  }
  if (platform::same_file(name_of_file(config.output, platform::kStandardOutput),
                          name_of_file(config.input, platform::kStandardInput))) {
    return fail(ErrorKind::usage, {config.output, 0},
                "is what it is made from too; give it a name of its own");
  }
  Result<machine::Settings> settings = settings_from(config, *input);
  if (!settings) {
    return tl::unexpected(settings.error());
  }
  name_records(found, *settings);
  for (const std::vector<Diagnostic>& remarks : {settings->guesses, settings->notes}) {
    for (const Diagnostic& remark : remarks) {
      console.line(to_string(remark));
    }
  }
  return write_settings(config, *settings).and_then([&] { return print_summary(config); }).map([] {
    return ExitCode::done;
  });
}

}  // namespace unflex::app
