#include "workspace.hpp"

#include <fmt/core.h>

#include <initializer_list>
#include <string>
#include <utility>

#include "filament.hpp"
#include "files.hpp"
#include "results.hpp"
#include "unflex/platform/descriptors.hpp"
#include "unflex/platform/files.hpp"
#include "unflex/platform/folders.hpp"

namespace unflex::app {
namespace {

// Checks that no two names lead to one file, since the result would destroy its own source. A
// stream that is redirected to such a file would do so, too.
Status check_distinct(const RunConfig& config) {
  const bool compensates = writes_print(config.command);
  const std::string input = name_of_file(config.input, platform::kStandardInput);
  const std::string output = name_of_file(
      config.output, compensates ? platform::kStandardOutput : platform::kStandardInput);
  const std::string printer_file = config.printer_file.value_or("");
  if (compensates && !config.in_place && platform::same_file(output, input)) {
    return fail(ErrorKind::usage, {config.output, 0},
                "is the input too; to replace it give --in-place");
  }
  if (compensates && platform::same_file(config.in_place ? input : output, printer_file)) {
    return fail(ErrorKind::usage, {config.in_place ? config.input : config.output, 0},
                "is the printer file too; give the output a name of its own");
  }
  const std::string report =
      config.report ? name_of_file(*config.report, platform::kStandardOutput) : std::string();
  for (const std::string& other : {input, output, printer_file}) {
    if (platform::same_file(report, other)) {
      return fail(ErrorKind::usage, {*config.report, 0},
                  "is read or written already; give the report a name of its own");
    }
  }
  return {};
}

Status open_outputs(const RunConfig& config, Workspace& space) {
  if (writes_print(config.command)) {
    Result<Output> output = Output::open(config.output);
    if (!output) {
      return tl::unexpected(output.error());
    }
    space.output.emplace(std::move(*output));
  }
  if (config.report) {
    Result<Output> report = Output::open(*config.report);
    if (!report) {
      return tl::unexpected(report.error());
    }
    space.report.emplace(std::move(*report));
  }
  return {};
}

// Copies what is read more than once.
Status spool(const RunConfig& config, Workspace& space) {
  if (writes_print(config.command)) {
    return space.input.make_readable();
  }
  if (Status copied = space.input.make_seekable(); !copied) {
    return copied;
  }
  return space.compensated ? space.compensated->make_seekable() : Status{};
}

// Refuses a binary output of a text, since their metadata stand in different places.
Status check_kinds(const RunConfig& config, const Workspace& space) {
  if (space.compensated && space.compensated->kind() == container::Kind::bgcode &&
      space.input.kind() != container::Kind::bgcode) {
    return fail(
        ErrorKind::usage, {config.output, 0},
        fmt::format("is binary G-code and {} is plain text, so their lines cannot be compared; "
                    "write the output as plain G-code and verify that",
                    config.input));
  }
  return {};
}

// How the output is to be packed: like the input if it is a stream or in place of the input,
// otherwise as its name says.
container::Kind output_kind(const RunConfig& config, const Workspace& space) {
  return config.in_place || space.output->is_stream() ? space.input.kind()
                                                      : container::kind_of_name(config.output);
}

}  // namespace

Result<machine::Settings> load_settings(const RunConfig& config, Input& input) {
  Result<machine::PrintText> print = input.look();
  if (!print) {
    return tl::unexpected(print.error());
  }
  print->variables = config.slicer_settings;
  Result<machine::Settings> settings =
      machine::load({.print = &*print,
                     .printer_file = config.printer_file,
                     .overrides = config.overrides,
                     .is_firmware_plain = config.command == Command::translate});
  if (settings && config.timing_method != TimingMethod::as_set && !settings->is_timing_free()) {
    return fail(ErrorKind::usage, "--timing says how --faster finds the timing; give that too");
  }
  if (config.command == Command::compensate || config.command == Command::translate) {
    return settings.and_then(without_guess);
  }
  return settings;
}

Result<Workspace> open_workspace(const RunConfig& config) {
  Result<Input> input = config.input_text ? Input::of_text(config.input, *config.input_text)
                                          : Input::open(config.input);
  if (!input) {
    return tl::unexpected(input.error());
  }
  if (config.in_place) {
    input->call(config.print_name);
  }
  Workspace space{{}, std::move(*input), {}, {}, {}, {}};
  if (config.command == Command::verify) {
    Result<Input> compensated = Input::open(config.output);
    if (!compensated) {
      return tl::unexpected(compensated.error());
    }
    space.compensated.emplace(std::move(*compensated));
  }
  const Status ready =
      check_distinct(config)
          .and_then([&] { return open_outputs(config, space); })
          .and_then([&] { return spool(config, space); })
          .and_then([&] { return check_kinds(config, space); })
          .and_then([&] { return load_settings(config, space.input); })
          .map([&](machine::Settings settings) { space.settings = std::move(settings); })
          .and_then([&] { return fit_to_filament(config, space.settings, space.input); })
          .map([&](std::optional<filament::FittedPrint> fitted) {
            space.fitted = std::move(fitted);
          });
  if (!ready) {
    // If the print has changed meanwhile, that explains what went wrong.
    const Status unchanged = space.input.check_unchanged();
    return tl::unexpected(unchanged ? ready.error() : unchanged.error());
  }
  return space;
}

Status check_inputs(const Workspace& space) {
  return space.input.check_unchanged().and_then(
      [&] { return space.compensated ? space.compensated->check_unchanged() : Status{}; });
}

void pack_output(const RunConfig& config, Workspace& space) {
  const std::optional<container::Metadata>& origin = space.input.metadata();
  space.output->pack_as(output_kind(config, space), origin ? &*origin : nullptr);
}

Result<flow::Job> job_of(const RunConfig& config, Workspace& space) {
  flow::Job job;
  job.input = space.input.text();
  job.input_name = space.input.name();
  job.output_name = writes_print(config.command) ? config.print_name : config.output;
  if (space.output) {
    pack_output(config, space);
    job.output = platform::file_store(space.output->path());
    job.input_stream_kind = space.input.kind();
    job.output_stream_kind = space.output->kind();
    const Result<int> stream = space.output->stream_fd();
    if (!stream) {
      return tl::unexpected(stream.error());
    }
    if (*stream >= 0) {
      job.output_stream = platform::descriptor_sink(*stream);
    }
    if (const int source = space.input.stream_fd(); source >= 0) {
      job.input_stream = platform::descriptor_source(source);
    }
    job.input_head = space.input.head();
  } else if (space.compensated) {
    job.output = space.compensated->text();
  }
  job.settings = space.settings;
  job.engine = config.solve.engine;
  job.check_solver = config.solve.check;
  job.workers = config.solve.workers;
  job.all_shapers = config.report.has_value();
  return job;
}

}  // namespace unflex::app
