#include "batch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "batch_files.hpp"
#include "batch_manifest.hpp"
#include "batch_print.hpp"
#include "batch_shard.hpp"
#include "batch_summary.hpp"
#include "batch_workers.hpp"
#include "new_prints.hpp"
#include "outputs.hpp"
#include "results.hpp"
#include "unflex/core/threads.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/platform/folders.hpp"
#include "unflex/platform/names.hpp"
#include "unflex/report/format.hpp"

namespace unflex::app {
namespace {

constexpr int kStateColumns = 9;
constexpr std::chrono::milliseconds kPatience{100};
constexpr std::chrono::milliseconds kBetweenSweeps{2};
constexpr std::chrono::milliseconds kBetweenLooks{2000};

// Checks the settings first, so that an error in them is reported once and not for every print.
Status check_printer_file(const RunConfig& config) {
  const auto state =
      config.printer_file ? platform::state_of(*config.printer_file) : tl::unexpected(ENOENT);
  if (state && state->kind != platform::FileKind::file) {
    return fail(ErrorKind::usage, {*config.printer_file, 0},
                "is read for every print; give --printer a file");
  }
  return {};
}

// Checks the settings of each printer that has a print.
Status check_printers(const RunConfig& config, const BatchFiles& files) {
  std::set<std::optional<std::string>> printers;
  for (const BatchPrint& print : files.prints) {
    printers.insert(print.printer_file ? print.printer_file : config.printer_file);
  }
  for (const std::optional<std::string>& printer : printers) {
    if (const auto loaded = machine::load(printer, config.overrides).and_then(without_guess);
        !loaded) {
      return tl::unexpected(loaded.error());
    }
  }
  return {};
}

// The folders on the way to the output that do not exist yet. Unless they are kept, the empty ones
// are removed in the end, so that a refusal leaves none behind.
class NewFolders {
 public:
  explicit NewFolders(const std::string& folder) {
    for (std::string at = folder; !at.empty() && !platform::is_taken(at);
         at = platform::folder_of(at)) {
      missing_.push_back(at);
    }
  }
  NewFolders(const NewFolders&) = delete;
  NewFolders& operator=(const NewFolders&) = delete;
  ~NewFolders() {
    for (const std::string& folder : missing_) {
      platform::remove_empty_folder(folder);
    }
  }
  void keep() { missing_.clear(); }

 private:
  std::vector<std::string> missing_;  // the innermost first
};

// Checks that the summary does not take the place of a file that is read or made.
Status check_summary(const RunConfig& config, const BatchFiles& files) {
  if (!config.batch.summary) {
    return {};
  }
  std::vector<std::string> others = {
      platform::joined(config.output, manifest_name(config.batch.shard)),
      config.printer_file.value_or("")};
  for (const BatchPrint& print : files.prints) {
    others.insert(others.end(), {print.input, print.output, print.report.value_or("")});
  }
  const bool taken = std::ranges::any_of(others, [&](const std::string& other) {
    return platform::same_file(*config.batch.summary, other);
  });
  return taken ? Status(fail(ErrorKind::usage, {*config.batch.summary, 0},
                             "is read or written already; give the summary a name of its own"))
               : Status{};
}

// The configuration with which `unflex compensate` would make this print.
RunConfig config_of(const RunConfig& config, const BatchPrint& print, unsigned workers) {
  RunConfig one = config;
  one.command = Command::compensate;
  one.input = print.input;
  one.output = print.output;
  one.print_name = print.output;
  one.report = print.report;
  if (print.printer_file) {
    one.printer_file = print.printer_file;
  }
  one.solve.workers = workers;
  one.quiet = true;
  return one;
}

// Removes the temporary files of prints that were killed; false if some may be left.
bool sweep(const std::vector<BatchPrint>& prints) {
  std::set<std::string> folders;
  for (const BatchPrint& print : prints) {
    folders.insert(platform::folder_of(print.output));
    if (print.report) {
      folders.insert(platform::folder_of(*print.report));
    }
  }
  bool all_gone = true;
  for (const std::string& folder : folders) {
    all_gone = TemporaryFile::remove_abandoned(folder) && all_gone;
  }
  return all_gone;
}

// Sweeps for a while until nothing is left, since the prints' own workers may still be ending.
void sweep_patiently(const std::vector<BatchPrint>& prints) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!sweep(prints) && std::chrono::steady_clock::now() < end) {
    sleep_for(kBetweenSweeps);
  }
}

void fail_by(const Error& error, BatchAnswer& answer) {
  answer.state = BatchState::failed;
  answer.exit_code = static_cast<int>(exit_code(error.kind));
  answer.error = error_text(error);
  answer.messages.push_back(answer.error);
}

class Batch {
 public:
  Batch(const RunConfig& config, BatchFiles files, BatchManifest& manifest, Console& console)
      : config_(&config), files_(std::move(files)), manifest_(&manifest), console_(&console) {
    summary_.input = config.input;
    summary_.output = config.output;
    summary_.shard = config.batch.shard;
    for (const Diagnostic& remark : files_.passed_by) {
      summary_.passed_by.push_back(to_string(remark));
      console.line(summary_.passed_by.back());
    }
  }

  // Stops early when a signal asks for it.
  Status work() {
    const auto begin = std::chrono::steady_clock::now();
    static_cast<void>(sweep(files_.prints));
    for (const Error& error : files_.unreadable) {
      add_unreadable(error);
    }
    // The longest prints come first, so that only short ones are left at the end.
    std::vector<std::size_t> waiting(files_.prints.size());
    std::iota(waiting.begin(), waiting.end(), std::size_t{0});
    std::ranges::stable_sort(waiting,
                             [&](std::size_t a, std::size_t b) { return bytes(a) < bytes(b); });
    Status status = work_on(std::move(waiting));
    if (platform::ending_signal() != 0) {
      sweep_patiently(files_.prints);
      status = interrupted(Command::batch);
    }
    summary_.wall_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    std::ranges::sort(summary_.rows, {}, &BatchRow::name);
    return status;
  }

  [[nodiscard]] const BatchSummary& summary() const { return summary_; }

 private:
  [[nodiscard]] std::uint64_t bytes(std::size_t print) const { return files_.prints[print].bytes; }

  // waiting: the prints still to do. The last one is taken next.
  Status work_on(std::vector<std::size_t> waiting) {
    BatchWorkers processes(config_->solve.workers);
    while (!waiting.empty() || processes.any()) {
      while (const unsigned workers = processes.workers_for_next(waiting.size())) {
        if (Status started = start(processes, waiting.back(), workers); !started) {
          return started;
        }
        waiting.pop_back();
      }
      for (BatchWorkers::Done& done : processes.take()) {
        take(std::move(done));
      }
      if (platform::ending_signal() != 0) {
        break;
      }
    }
    return {};
  }

  Status start(BatchWorkers& processes, std::size_t number, unsigned workers) {
    // A thread outlives this call, and the manifest changes meanwhile, so it works on copies.
    const BatchPrint& print = files_.prints[number];
    return processes.start(
        number, workers,
        [one = config_of(*config_, print, workers), known = manifest_->find(print.name)] {
          return work_on_batch_print(one, known);
        });
  }

  void take(BatchWorkers::Done done) {
    const BatchPrint& print = files_.prints[done.ticket];
    BatchAnswer& answer = done.answer;
    if (!done.answered) {
      fail_by({ErrorKind::internal, {print.input, 0}, answer.error}, answer);
    } else if (answer.state == BatchState::done) {
      if (const Status remembered = manifest_->put(print.name, answer.record); !remembered) {
        // The output is complete, but the manifest lacks it. So the next batch will make it again.
        fail_by(remembered.error(), answer);
      }
    }
    // If a signal ended the print, the message about the whole batch tells that.
    if (platform::ending_signal() == 0 || answer.state != BatchState::failed) {
      add({print.name, print.input, print.output, std::move(answer), done.wall_s});
    }
  }

  void add_unreadable(const Error& error) {
    BatchAnswer answer;
    fail_by(error, answer);
    add({name_below(config_->input, error.place.file),
         error.place.file,
         {},
         std::move(answer),
         0.0});
  }

  void add(BatchRow row) {
    for (const std::string& message : row.answer.messages) {
      console_->line(message);
    }
    if (!config_->quiet) {
      const std::size_t all = files_.prints.size() + files_.unreadable.size();
      const std::string number = fmt::format("{}", summary_.rows.size() + 1);
      console_->line(fmt::format(
          "[{:>{}}/{}] {:<{}}  {:>7}  {}{}", number, fmt::formatted_size("{}", all), all,
          to_string(row.answer.state), kStateColumns, report::duration_text(row.wall_s), row.name,
          row.answer.state == BatchState::failed ? "" : ": " + result_text(row.answer)));
    }
    summary_.rows.push_back(std::move(row));
  }

  const RunConfig* config_;
  BatchFiles files_;
  BatchManifest* manifest_;
  Console* console_;
  BatchSummary summary_;
};

// Keeps the prints of this shard only. Errors in the folder are reported by the first shard alone.
void keep_shard(const RunConfig& config, BatchFiles& files) {
  if (!config.batch.shard) {
    return;
  }
  std::erase_if(files.prints,
                [&](const BatchPrint& print) { return !has(*config.batch.shard, print.name); });
  if (config.batch.shard->number != 1) {
    files.unreadable.clear();
    files.passed_by.clear();
  }
}

// Waits, but not beyond a signal. False if one has come.
bool wait_for(std::chrono::milliseconds time) {
  const auto end = std::chrono::steady_clock::now() + time;
  while (platform::ending_signal() == 0 && std::chrono::steady_clock::now() < end) {
    sleep_for(kPatience);
  }
  return platform::ending_signal() == 0;
}

// Works on what comes into the folder until a signal ends it.
Result<ExitCode> watch(const RunConfig& config, BatchManifest& manifest, Console& console) {
  NewPrints new_prints;
  if (!config.quiet) {
    console.line(fmt::format("unflex: waiting for prints in {}", config.input));
  }
  std::string last_error;
  do {
    Result<BatchFiles> files = find_prints(config);
    if (!files) {
      // The folder may be away for a while, or two prints may share a name until one is gone.
      if (const std::string error = to_string(files.error()); error != last_error) {
        console.error(files.error());
        last_error = error;
      }
      continue;
    }
    last_error.clear();
    new_prints.keep_new(*files, config.printer_file);
    keep_shard(config, *files);
    if (files->prints.empty() && files->unreadable.empty() && files->passed_by.empty()) {
      continue;
    }
    Batch batch(config, std::move(*files), manifest, console);
    if (Status worked = batch.work(); !worked && platform::ending_signal() == 0) {
      console.error(worked.error());
    }
  } while (wait_for(kBetweenLooks));
  return interrupted(Command::batch);
}

Status write_summary(const RunConfig& config, std::optional<Output>& file,
                     const BatchSummary& summary) {
  if (!file) {
    return {};
  }
  const bool xml = config.batch.summary->ends_with(".xml");
  return write_report(file, xml ? summary_junit(summary) : summary_json(summary));
}

Result<std::optional<Output>> open_summary(const RunConfig& config) {
  if (!config.batch.summary) {
    return std::optional<Output>();
  }
  return Output::open(*config.batch.summary).map([](Output output) {
    return std::optional<Output>(std::move(output));
  });
}

}  // namespace

Result<ExitCode> run_batch(const RunConfig& config, Console& console) {
  Result<BatchFiles> files = find_prints(config);
  if (!files) {
    return tl::unexpected(files.error());
  }
  const Status checked =
      check_printer_file(config)
          .and_then([&] { return config.batch.watch ? Status{} : check_has_print(config, *files); })
          .and_then([&] { return check_printers(config, *files); })
          .and_then([&] { return check_summary(config, *files); });
  if (!checked) {
    return tl::unexpected(checked.error());
  }
  NewFolders folders(config.output);
  Result<BatchManifest> manifest = BatchManifest::open(config.output, config.batch.shard);
  if (!manifest) {
    return tl::unexpected(manifest.error());
  }
  // Only now, since the summary may go into the output's folder, which exists only now.
  Result<std::optional<Output>> summary_file = open_summary(config);
  if (!summary_file) {
    return tl::unexpected(summary_file.error());
  }
  folders.keep();
  if (config.batch.watch) {
    return watch(config, *manifest, console);
  }
  keep_shard(config, *files);
  Batch batch(config, std::move(*files), *manifest, console);
  if (Status worked = batch.work(); !worked) {
    return tl::unexpected(worked.error());
  }
  return write_summary(config, *summary_file, batch.summary())
      .and_then([&] { return print_summary(config, summary_table(batch.summary()), console); })
      .map([&] { return static_cast<ExitCode>(batch.summary().exit_code()); });
}

}  // namespace unflex::app
