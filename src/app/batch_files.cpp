#include "batch_files.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <map>
#include <set>
#include <utility>

#include "unflex/core/errno_text.hpp"
#include "unflex/platform/files.hpp"
#include "unflex/platform/folders.hpp"
#include "unflex/platform/names.hpp"

namespace unflex::app {
namespace {

using platform::FileKind;
using platform::FolderEntry;
using platform::joined;

constexpr std::array<std::string_view, 5> kSuffixes = {".gcode", ".gco", ".g", ".bgcode",
                                                       ".gcode.gz"};

char small(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool ends_with(std::string_view name, std::string_view suffix) {
  return name.size() > suffix.size() &&
         std::equal(suffix.begin(), suffix.end(),
                    name.end() - static_cast<std::ptrdiff_t>(suffix.size()),
                    [](char a, char b) { return a == small(b); });
}

tl::unexpected<Error> cannot_read_folder(const std::string& folder, int error) {
  return fail(ErrorKind::input, {folder, 0},
              fmt::format("cannot read the folder: {}", errno_text(error)));
}

// Looks through folders.
class Finder {
 public:
  explicit Finder(const RunConfig& config)
      : has_printer_file_(config.printer_file.has_value()),
        output_(config.output),
        reports_(config.report),
        own_{platform::canonical_name(output_)} {
    if (reports_) {
      own_.insert(platform::canonical_name(*reports_));
    }
  }

  // Takes the prints in `folder`, whose name below the root is `below`. printer_file: the printer
  // file of the folder above.
  void look(const std::string& folder, const std::string& below,
            const std::optional<std::string>& printer_file, BatchFiles& files) {
    const auto entries = platform::entries_of(folder);
    if (!entries) {
      files.unreadable.push_back(cannot_read_folder(folder, entries.error()).value());
      return;
    }
    const std::optional<std::string> own = printer_file_of(folder, below);
    for (const FolderEntry& entry : *entries) {
      if (!entry.name.starts_with('.')) {
        take(entry, folder, below, own ? own : printer_file, files);
      }
    }
  }

 private:
  // A printer file named on the command line holds for the folder of the batch itself.
  [[nodiscard]] std::optional<std::string> printer_file_of(const std::string& folder,
                                                           const std::string& below) const {
    std::string file = joined(folder, kPrinterFileName);
    const auto state = platform::state_of(file);
    const bool holds = !below.empty() || !has_printer_file_;
    return holds && state && state->kind == FileKind::file ? std::optional(std::move(file))
                                                           : std::nullopt;
  }

  void take(const FolderEntry& entry, const std::string& folder, const std::string& below,
            const std::optional<std::string>& printer_file, BatchFiles& files) {
    const std::string file = joined(folder, entry.name);
    const std::string name = joined(below, entry.name);
    const auto pass_by = [&](std::string why) {
      files.passed_by.push_back({{file, 0}, std::move(why)});
    };
    if (entry.kind == FileKind::folder) {
      if (entry.is_link) {
        pass_by("is a link to a folder, which is not followed; give that folder itself");
      } else if (!own_.contains(platform::canonical_name(file))) {
        look(file, name, printer_file, files);
      }
    } else if (is_print(name)) {
      if (entry.kind == FileKind::file) {
        add(file, name, entry.bytes, printer_file, files);
      } else if (entry.is_link) {
        files.unreadable.push_back(
            fail(ErrorKind::input, {file, 0}, "is a link that leads to no file").value());
      } else {
        pass_by("is neither a file nor a folder and is left out");
      }
    }
  }

  void add(const std::string& file, const std::string& name, std::uint64_t bytes,
           const std::optional<std::string>& printer_file, BatchFiles& files) {
    BatchPrint print{.name = name,
                     .input = file,
                     .output = joined(output_, name),
                     .report = {},
                     .printer_file = printer_file,
                     .bytes = bytes};
    if (reports_) {
      // The page's name holds the print's whole name, as a.gcode and a.g may stand side by side.
      print.report = joined(*reports_, name) + ".html";
    }
    files.prints.push_back(std::move(print));
  }

  bool has_printer_file_;
  std::string output_;
  std::optional<std::string> reports_;
  std::set<std::string> own_;
};

Status check_folders(const RunConfig& config) {
  const auto input = platform::state_of(config.input);
  if (!input && input.error() != ENOENT) {
    return cannot_read_folder(config.input, input.error());
  }
  if (!input) {
    return fail(ErrorKind::input, {config.input, 0}, "there is no such folder");
  }
  if (input->kind != FileKind::folder) {
    return fail(ErrorKind::input, {config.input, 0},
                "is not a folder; for one print there is unflex compensate");
  }
  // Names are not compared: one folder may have several names where capitals do not count.
  if (platform::same_file(config.input, config.output)) {
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
  std::map<std::string, const BatchPrint*> inputs;
  std::map<std::string, const BatchPrint*> outputs;
  std::map<std::string, const BatchPrint*> reports;
  std::map<std::string, const BatchPrint*> names;
  for (const BatchPrint& print : prints) {
    inputs.emplace(platform::canonical_name(print.input), &print);
  }
  for (const BatchPrint& print : prints) {
    const std::string place = platform::canonical_name(print.output);
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
    const std::string place = platform::canonical_name(*print.report);
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

std::string name_below(std::string_view folder, std::string_view file) {
  if (file == folder) {
    return ".";
  }
  const std::string any_name_in_it = joined(folder, "x");
  file.remove_prefix(std::min(any_name_in_it.size() - 1, file.size()));
  return std::string(file);
}

Status check_has_print(const RunConfig& config, const BatchFiles& files) {
  if (!files.prints.empty()) {
    return {};
  }
  return files.unreadable.empty() ? fail(ErrorKind::input, {config.input, 0},
                                         fmt::format("holds no print ({})", print_suffixes()))
                                  : tl::unexpected(files.unreadable.front());
}

Result<BatchFiles> find_prints(const RunConfig& config) {
  if (Status checked = check_folders(config); !checked) {
    return tl::unexpected(checked.error());
  }
  BatchFiles files;
  Finder(config).look(config.input, {}, {}, files);
  std::ranges::sort(files.prints, {}, &BatchPrint::name);
  if (Status distinct = check_distinct(files.prints); !distinct) {
    return tl::unexpected(distinct.error());
  }
  return files;
}

}  // namespace unflex::app
