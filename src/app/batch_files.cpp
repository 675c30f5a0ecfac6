#include "batch_files.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <system_error>
#include <utility>

namespace unflex::app {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 5> kSuffixes = {".gcode", ".gco", ".g", ".bgcode",
                                                       ".gcode.gz"};

char small(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool ends_with(std::string_view name, std::string_view suffix) {
  return name.size() > suffix.size() &&
         std::equal(suffix.begin(), suffix.end(),
                    name.end() - static_cast<std::ptrdiff_t>(suffix.size()),
                    [](char a, char b) { return a == small(b); });
}

// Where a file is, or would be if it does not exist yet.
fs::path place_of(const fs::path& file) {
  std::error_code failed;
  fs::path place = fs::weakly_canonical(file, failed);
  return failed ? file.lexically_normal() : place;
}

// Looks through folders.
class Finder {
 public:
  explicit Finder(const RunConfig& config)
      : has_printer_file_(config.printer_file.has_value()),
        output_(config.output),
        own_{place_of(output_)} {
    if (config.report) {
      reports_ = *config.report;
      own_.insert(place_of(*reports_));
    }
  }

  // Takes what is in the folder, whose name below the root is `below`. printer_file: of the folder
  // above.
  void look(const fs::path& folder, const fs::path& below,
            const std::optional<std::string>& printer_file, BatchFiles& files) {
    std::error_code failed;
    std::vector<fs::directory_entry> entries;
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
         entry.increment(failed)) {
      entries.push_back(*entry);
    }
    if (failed) {
      files.unreadable.push_back(fail(ErrorKind::input, {folder.string(), 0},
                                      fmt::format("cannot read the folder: {}", failed.message()))
                                     .value());
      return;
    }
    std::ranges::sort(entries);
    const std::optional<std::string> own = printer_file_of(folder, below);
    for (const fs::directory_entry& entry : entries) {
      const fs::path name = entry.path().filename();
      if (!name.string().starts_with('.')) {
        take(entry, below / name, own ? own : printer_file, files);
      }
    }
  }

 private:
  // What is named on the command line holds for the folder of the batch itself.
  [[nodiscard]] std::optional<std::string> printer_file_of(const fs::path& folder,
                                                           const fs::path& below) const {
    std::error_code failed;
    const fs::path file = folder / kPrinterFileName;
    const bool holds = !below.empty() || !has_printer_file_;
    return holds && fs::is_regular_file(file, failed) ? std::optional(file.string()) : std::nullopt;
  }

  void take(const fs::directory_entry& entry, const fs::path& name,
            const std::optional<std::string>& printer_file, BatchFiles& files) {
    std::error_code failed;
    const auto pass_by = [&](std::string why) {
      files.passed_by.push_back({{entry.path().string(), 0}, std::move(why)});
    };
    if (entry.is_directory(failed)) {
      if (entry.is_symlink(failed)) {
        pass_by("is a link to a folder, which is not followed; give that folder itself");
      } else if (!own_.contains(place_of(entry.path()))) {
        look(entry.path(), name, printer_file, files);
      }
    } else if (is_print(name.string())) {
      if (entry.is_regular_file(failed)) {
        add(entry, name, printer_file, files);
      } else if (entry.is_symlink(failed)) {
        files.unreadable.push_back(
            fail(ErrorKind::input, {entry.path().string(), 0}, "is a link that leads to no file")
                .value());
      } else {
        pass_by("is neither a file nor a folder and is left out");
      }
    }
  }

  void add(const fs::directory_entry& entry, const fs::path& name,
           const std::optional<std::string>& printer_file, BatchFiles& files) {
    std::error_code failed;
    const std::uintmax_t bytes = entry.file_size(failed);
    BatchPrint print{.name = name.string(),
                     .input = entry.path().string(),
                     .output = (output_ / name).string(),
                     .report = {},
                     .printer_file = printer_file,
                     .bytes = failed ? 0 : bytes};
    if (reports_) {
      // The page's name holds the print's whole name, as a.gcode and a.g may stand side by side.
      print.report = (*reports_ / name).string() + ".html";
    }
    files.prints.push_back(std::move(print));
  }

  bool has_printer_file_;
  fs::path output_;
  std::optional<fs::path> reports_;
  std::set<fs::path> own_;
};

Status check_folders(const RunConfig& config) {
  std::error_code failed;
  if (!fs::exists(config.input, failed)) {
    return fail(ErrorKind::input, {config.input, 0},
                failed ? fmt::format("cannot read the folder: {}", failed.message())
                       : "there is no such folder");
  }
  if (!fs::is_directory(config.input, failed)) {
    return fail(ErrorKind::input, {config.input, 0},
                "is not a folder; for one print there is unflex compensate");
  }
  // We do not compare names: a folder may have several of them where capitals do not count.
  if (fs::equivalent(config.input, config.output, failed)) {
    return fail(ErrorKind::usage, {config.output, 0},
                "is the folder of the prints too; give -o another");
  }
  return {};
}

std::string in_small_letters(std::string text) {
  std::ranges::transform(text, text.begin(), small);
  return text;
}

// Checks that no two names lead to one file. Links can do that, and so can folders and printers'
// cards that take capitals for small letters.
Status check_distinct(const std::vector<BatchPrint>& prints) {
  std::map<fs::path, const BatchPrint*> inputs;
  std::map<fs::path, const BatchPrint*> outputs;
  std::map<fs::path, const BatchPrint*> reports;
  std::map<std::string, const BatchPrint*> names;
  for (const BatchPrint& print : prints) {
    inputs.emplace(place_of(print.input), &print);
  }
  for (const BatchPrint& print : prints) {
    const fs::path place = place_of(print.output);
    if (const auto replaced = inputs.find(place); replaced != inputs.end()) {
      return fail(ErrorKind::usage, {print.output, 0},
                  fmt::format("would replace the print {}; give -o another folder",
                              replaced->second->input));
    }
    if (const auto [other, is_new] = outputs.emplace(place, &print); !is_new) {
      return fail(ErrorKind::usage, {print.output, 0},
                  fmt::format("would come from {} and from {}; give -o a folder without links",
                              other->second->input, print.input));
    }
    if (const auto [other, is_new] = names.emplace(in_small_letters(print.name), &print); !is_new) {
      return fail(ErrorKind::usage, {print.input, 0},
                  fmt::format("differs from {} in capitals alone, and many folders and cards hold "
                              "only one of the two; rename one",
                              other->second->input));
    }
  }
  for (const BatchPrint& print : prints) {
    if (!print.report) {
      continue;
    }
    const fs::path place = place_of(*print.report);
    if (inputs.contains(place) || outputs.contains(place)) {
      return fail(ErrorKind::usage, {*print.report, 0},
                  "is a print too, by a link; give --report a folder without links");
    }
    if (const auto [other, is_new] = reports.emplace(place, &print); !is_new) {
      return fail(
          ErrorKind::usage, {*print.report, 0},
          fmt::format("would come from {} and from {}; give --report a folder without links",
                      other->second->input, print.input));
    }
  }
  return {};
}

}  // namespace

bool is_print(std::string_view name) {
  return std::ranges::any_of(kSuffixes,
                             [name](std::string_view suffix) { return ends_with(name, suffix); });
}

std::string print_suffixes() {
  std::string text;
  for (const std::string_view suffix : kSuffixes) {
    text += fmt::format("{}*{}", text.empty() ? "" : ", ", suffix);
  }
  return text;
}

Result<BatchFiles> find_prints(const RunConfig& config) {
  if (Status checked = check_folders(config); !checked) {
    return tl::unexpected(checked.error());
  }
  BatchFiles files;
  Finder(config).look(config.input, {}, {}, files);
  if (files.prints.empty() && !files.unreadable.empty()) {
    return tl::unexpected(files.unreadable.front());
  }
  if (files.prints.empty()) {
    return fail(ErrorKind::input, {config.input, 0},
                fmt::format("holds no print ({})", print_suffixes()));
  }
  std::ranges::sort(files.prints, {}, &BatchPrint::name);
  if (Status distinct = check_distinct(files.prints); !distinct) {
    return tl::unexpected(distinct.error());
  }
  return files;
}

}  // namespace unflex::app
