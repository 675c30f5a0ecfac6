#include "batch_print.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <exception>
#include <utility>

#include "console.hpp"
#include "filament.hpp"
#include "files.hpp"
#include "print_run.hpp"
#include "results.hpp"
#include "unflex/core/caught.hpp"
#include "unflex/core/errno_text.hpp"
#include "unflex/core/sha256.hpp"
#include "unflex/platform/catching.hpp"
#include "unflex/platform/folders.hpp"
#include "unflex/platform/names.hpp"
#include "unflex/platform/signals.hpp"
#include "workspace.hpp"

namespace unflex::app {
namespace {

Result<std::string> hash_of_file(const std::string& name) {
  const FileDescriptor file = platform::open_to_read(name);
  Sha256 hash;
  for (;;) {
    const tl::expected<std::string, int> block =
        file.valid() ? read_some(file.get()) : tl::unexpected(errno);
    if (!block) {
      return fail(ErrorKind::input, {name, 0},
                  fmt::format("cannot read: {}", errno_text(block.error())));
    }
    if (block->empty()) {
      return hash.finish();
    }
    hash.add(*block);
    if (platform::ending_signal() != 0) {
      return interrupted(Command::batch);
    }
  }
}

std::string_view name_of(flow::EngineChoice engine) {
  switch (engine) {
    case flow::EngineChoice::banded:
      return "banded";
    case flow::EngineChoice::ipopt:
      return "ipopt";
    case flow::EngineChoice::automatic:
      break;
  }
  return "auto";
}

// The hash of the settings in force for this print, wherever they are from.
Result<std::string> hash_of_settings(const RunConfig& config) {
  Result<Input> input = Input::open(config.input);
  if (!input) {
    return tl::unexpected(input.error());
  }
  const Result<machine::Settings> settings =
      input->make_readable().and_then([&] { return load_settings(config, *input); });
  if (!settings) {
    return tl::unexpected(settings.error());
  }
  std::string text = fmt::format("engine={}\n", name_of(config.solve.engine));
  for (const machine::SettingRow& row : machine::rows(*settings)) {
    text += fmt::format("{}={}\n", row.key, row.value);
  }
  if (const auto profile = filament_profile(config, *settings)) {
    const Result<std::string> hash = hash_of_file(*profile);
    if (!hash) {
      return hash;
    }
    text += *hash;
  }
  return sha256(text);
}

// The origin of an output that would be made now. The hashes of output and report stay empty.
Result<BatchOrigin> origin_now(const RunConfig& config) {
  Result<std::string> input = hash_of_file(config.input);
  if (!input) {
    return tl::unexpected(input.error());
  }
  Result<std::string> settings = hash_of_settings(config);
  if (!settings) {
    return tl::unexpected(settings.error());
  }
  return BatchOrigin{.version = std::string(version()),
                     .input_sha256 = std::move(*input),
                     .settings_sha256 = std::move(*settings),
                     .output_sha256 = {},
                     .report_sha256 = {}};
}

// Adds the hashes of the output and of the report that are there.
Result<BatchOrigin> with_outputs(const RunConfig& config, BatchOrigin origin) {
  Result<std::string> output = hash_of_file(config.output);
  if (!output) {
    return tl::unexpected(output.error());
  }
  origin.output_sha256 = std::move(*output);
  if (config.report) {
    Result<std::string> report = hash_of_file(*config.report);
    if (!report) {
      return tl::unexpected(report.error());
    }
    origin.report_sha256 = std::move(*report);
  }
  return origin;
}

bool is_up_to_date(const RunConfig& config, const BatchOrigin& now, const BatchRecord& known) {
  if (known.origin.version != now.version || known.origin.input_sha256 != now.input_sha256 ||
      known.origin.settings_sha256 != now.settings_sha256) {
    return false;
  }
  if (config.max_deviation_mm && !(known.figures.max_after_mm <= *config.max_deviation_mm)) {
    return false;
  }
  // If no report is asked for, an old one does no harm.
  Result<BatchOrigin> there = with_outputs(config, now);
  return there && there->output_sha256 == known.origin.output_sha256 &&
         (!config.report || there->report_sha256 == known.origin.report_sha256);
}

Status make_folder_of(const std::string& file) {
  const int error = platform::make_folders(platform::folder_of(file));
  return error == 0 ? Status{}
                    : Status(fail(ErrorKind::usage, {file, 0},
                                  fmt::format("cannot make its folder: {}", errno_text(error))));
}

BatchFigures figures_of(const report::Report& report) {
  const verify::DeviationStats& before = report.measured.uncompensated.extruding;
  const verify::DeviationStats& after = report.measured.compensated.extruding;
  return {.max_before_mm = before.contour_max_mm,
          .max_after_mm = after.contour_max_mm,
          .rms_before_mm = before.contour_rms_mm,
          .rms_after_mm = after.contour_rms_mm,
          .print_time_s = report.measured.compensated.time_s};
}

// Compensates the print and fills the answer. Errors are those of compensating.
Status compensate(const RunConfig& config, const BatchOrigin& now, Console& console,
                  BatchAnswer& answer) {
  if (Status made = make_folder_of(config.output); !made) {
    return made;
  }
  if (Status made = config.report ? make_folder_of(*config.report) : Status{}; !made) {
    return made;
  }
  const Result<PrintOutcome> outcome = work_on_print(config, console);
  if (!outcome) {
    return tl::unexpected(outcome.error());
  }
  answer.measured = true;
  answer.record.figures = figures_of(outcome->report);
  answer.exit_code = static_cast<int>(outcome->verdict);
  if (outcome->verdict != ExitCode::done) {
    // The last line says why.
    answer.error = console.kept().empty() ? "" : console.kept().back();
    return {};
  }
  Result<std::string> input = hash_of_file(config.input);
  if (!input) {
    return tl::unexpected(input.error());
  }
  if (*input != now.input_sha256) {
    return fail(ErrorKind::input, {config.input, 0},
                "changed while it was worked on; run the batch again");
  }
  return with_outputs(config, now).map([&](BatchOrigin origin) {
    answer.record.origin = std::move(origin);
    answer.state = BatchState::done;
  });
}

Status work(const RunConfig& config, const std::vector<BatchRecord>& known, Console& console,
            BatchAnswer& answer) {
  const Result<BatchOrigin> now = origin_now(config);
  if (!now) {
    return tl::unexpected(now.error());
  }
  const auto current = std::ranges::find_if(
      known, [&](const BatchRecord& record) { return is_up_to_date(config, *now, record); });
  if (current != known.end()) {
    answer.state = BatchState::unchanged;
    answer.exit_code = static_cast<int>(ExitCode::done);
    answer.measured = true;
    answer.record = *current;
    return {};
  }
  return compensate(config, *now, console, answer);
}

}  // namespace

BatchAnswer work_on_batch_print(const RunConfig& config, const std::vector<BatchRecord>& known) {
  BatchAnswer answer;
  Console console(-1);
  platform::catching(
      [&] {
        if (const Status worked = work(config, known, console, answer); !worked) {
          console.error(worked.error());
          answer.error = console.kept().back();
          answer.exit_code = static_cast<int>(exit_code(worked.error().kind));
        }
      },
      [&](const std::exception& failure) {
        // Out of memory, mostly.
        Error error = error_of(failure);
        error.place.file = config.input;
        console.error(error);
        answer = {};
        answer.error = console.kept().back();
      });
  answer.messages = console.kept();
  return answer;
}

}  // namespace unflex::app
