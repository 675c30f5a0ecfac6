#include <fmt/core.h>

#include <algorithm>

#include "file_text.hpp"
#include "klipper_config.hpp"
#include "text_lines.hpp"
#include "unflex/platform/files.hpp"

namespace unflex::machine {
namespace {

constexpr std::string_view kSavedMark = "#*#";
constexpr std::string_view kSavedHeader =
    "#*# <---------------------- SAVE_CONFIG ---------------------->";
constexpr std::string_view kInclude = "include ";

// An indented line continues the value of the option before it.
struct Parser {
  std::string file;
  KlipperConfig* config = nullptr;
  KlipperSection* section = nullptr;
  KlipperOption* option = nullptr;
  std::size_t indent = 0;  // indent of the line in which the option began
};

std::string_view without_comment(std::string_view line) {
  line = line.substr(0, line.find('#'));
  for (std::size_t at = line.find(';'); at != std::string_view::npos; at = line.find(';', at + 1)) {
    if (at == 0 || line[at - 1] == ' ' || line[at - 1] == '\t') {
      return line.substr(0, at);
    }
  }
  return line;
}

// "[stepper_x]" → "stepper_x", and "" if the line is no header.
std::string_view header_of(std::string_view content) {
  const std::size_t end = content.rfind(']');
  return content.starts_with('[') && end != std::string_view::npos && end > 1
             ? content.substr(1, end - 1)
             : std::string_view{};
}

void open_section(Parser& parser, std::string_view header, std::size_t number) {
  const auto [entry, is_new] = parser.config->sections.try_emplace(std::string(header));
  if (is_new) {
    entry->second.place = {parser.file, number};
  }
  parser.section = &entry->second;
  parser.option = nullptr;
}

// One line of a file that is no include.
Status parse_line(Parser& parser, std::string_view line, std::size_t number) {
  const std::string_view text = without_comment(line);
  const std::string_view content = trimmed(text);
  if (content.empty()) {
    return {};
  }
  const std::size_t indent = text.find(content);
  if (parser.option != nullptr && indent > parser.indent) {
    // Klipper joins such lines with line ends. We join with spaces: no value that is read here has
    // several lines, and a message that quotes a value should have one line.
    parser.option->text += fmt::format("{}{}", parser.option->text.empty() ? "" : " ", content);
    return {};
  }
  parser.indent = indent;
  if (const std::string_view header = header_of(content); !header.empty()) {
    open_section(parser, header, number);
    return {};
  }
  const std::size_t delimiter = content.find_first_of(":=");
  if (parser.section == nullptr || delimiter == std::string_view::npos || delimiter == 0) {
    return fail(ErrorKind::usage, {parser.file, number},
                parser.section == nullptr
                    ? "stands before the first [section]; is this a printer.cfg of Klipper's?"
                    : "is neither [section] nor 'option: value'; Klipper would refuse it too");
  }
  KlipperOption& option = parser.section->options[lower(trimmed(content.substr(0, delimiter)))];
  option = {std::string(trimmed(content.substr(delimiter + 1))), {parser.file, number}};
  parser.option = &option;
  return {};
}

void note_missing(const std::string& path, const SourcePlace& place, KlipperConfig& config) {
  config.missing.push_back({.place = place, .path = path});
  config.notes.push_back(
      {place, fmt::format("the included file {} is missing, and unflex does without what it says; "
                          "copy it from the printer to that place if it says more than macros, or "
                          "take the line out",
                          path)});
}

Status parse_file(std::string_view text, const std::string& file, KlipperConfig& config,
                  std::vector<std::string>& open_files);

Status include(std::string_view pattern, const SourcePlace& place, KlipperConfig& config,
               std::vector<std::string>& open_files) {
  const std::string path = platform::name_beside(place.file, pattern);
  const std::vector<std::string> files = platform::matching_files(path);
  if (files.empty() && path.find_first_of("*?[") != std::string::npos) {
    config.missing.push_back({.place = place, .path = path, .is_allowed = true});
  } else if (files.empty()) {
    note_missing(path, place, config);
  }
  for (const std::string& file : files) {
    // Mainsail and Fluidd put links here, which lead nowhere once they are copied.
    if (!platform::exists(file)) {
      note_missing(file, place, config);
      continue;
    }
    if (std::ranges::find(open_files, platform::canonical_name(file)) != open_files.end()) {
      return fail(ErrorKind::usage, place, fmt::format("{} includes itself", file));
    }
    const Result<std::string> text = read_printer_file(file);
    if (!text) {
      return tl::unexpected(text.error());
    }
    if (Status parsed = parse_file(*text, file, config, open_files); !parsed) {
      return parsed;
    }
  }
  return {};
}

Status parse_file(std::string_view text, const std::string& file, KlipperConfig& config,
                  std::vector<std::string>& open_files) {
  open_files.push_back(platform::canonical_name(file));
  Parser parser{.file = file, .config = &config};
  Status status;
  for_each_line(text, 1, [&](std::string_view line, std::size_t number) {
    if (!status) {
      return;
    }
    const std::string_view header = header_of(line.substr(0, line.find('#')));
    if (header.starts_with(kInclude)) {
      status = include(trimmed(header.substr(kInclude.size())), {file, number}, config, open_files);
      // Lines that follow the include have to open their section again.
      parser = {.file = file, .config = &config};
    } else {
      status = parse_line(parser, line, number);
    }
  });
  open_files.pop_back();
  return status;
}

// Adds the options that SAVE_CONFIG has saved as comments. An option that stands elsewhere too is
// not taken from here. If someone has written below the saved lines, none of them is taken.
Status add_saved(std::string_view text, std::size_t first_line, const std::string& file,
                 KlipperConfig& config) {
  KlipperConfig saved;
  Parser parser{.file = file, .config = &saved};
  Status status;
  std::size_t foreign = 0;
  for_each_line(text, first_line, [&](std::string_view line, std::size_t number) {
    const bool ours = line.starts_with(kSavedMark) && (line.size() == 3 || line[3] == ' ');
    if (!ours && !trimmed(line).empty() && foreign == 0) {
      foreign = number;
    }
    if (ours && status) {
      status = parse_line(parser, line.substr(std::min<std::size_t>(line.size(), 4)), number);
    }
  });
  if (foreign != 0) {
    config.notes.push_back({{file, foreign},
                            "stands below what SAVE_CONFIG has saved, all of which is ignored, as "
                            "Klipper does"});
    return {};
  }
  for (auto& [name, section] : saved.sections) {
    config.sections.try_emplace(name, KlipperSection{section.place, {}})
        .first->second.options.merge(section.options);
  }
  return status;
}

// Kalico: "${constants.belt}" stands for the option belt of [constants]. Other sections can be
// named as well (klippy/configfile.py). A reference to something that is not there stays and brings
// a note.
constexpr std::string_view kReference = "${";
constexpr int kMostReferences = 100;  // of one option, since they may go in a circle

const KlipperOption* referred_to(const KlipperConfig& config, std::string_view reference) {
  const std::size_t point = reference.rfind('.');
  const KlipperSection* const section =
      point == std::string_view::npos
          ? nullptr
          : config.find(std::string(trimmed(reference.substr(0, point))));
  return section == nullptr ? nullptr : section->find(lower(trimmed(reference.substr(point + 1))));
}

void resolve_references(KlipperConfig& config) {
  for (auto& [name, section] : config.sections) {
    for (auto& [key, option] : section.options) {
      // A macro's text is a template, in which such words may mean something else.
      const bool is_text = name.starts_with("gcode_macro") || key.ends_with("gcode");
      for (int found = 0; !is_text && found < kMostReferences; ++found) {
        const std::size_t begin = option.text.rfind(kReference);
        const std::size_t end = option.text.find('}', std::min(begin, option.text.size()));
        if (begin == std::string::npos || end == std::string::npos) {
          break;
        }
        const std::string reference =
            option.text.substr(begin + kReference.size(), end - begin - kReference.size());
        const KlipperOption* const meant = referred_to(config, reference);
        if (meant == nullptr) {
          config.notes.push_back(
              {option.place,
               fmt::format("{} refers to ${{{}}}, which is not there", key, reference)});
          break;
        }
        option.text.replace(begin, end + 1 - begin, std::string(meant->text));
      }
    }
  }
}

}  // namespace

const KlipperOption* KlipperSection::find(const std::string& option) const {
  const auto found = options.find(option);
  return found == options.end() ? nullptr : &found->second;
}

const KlipperSection* KlipperConfig::find(const std::string& section) const {
  const auto found = sections.find(section);
  return found == sections.end() ? nullptr : &found->second;
}

Result<KlipperConfig> parse_klipper_config(std::string_view text, const std::string& file) {
  KlipperConfig config;
  std::vector<std::string> open_files;
  const std::size_t saved = text.find(kSavedHeader);
  const std::string_view written = text.substr(0, saved);
  if (Status parsed = parse_file(written, file, config, open_files); !parsed) {
    return tl::unexpected(parsed.error());
  }
  if (saved == std::string_view::npos) {
    resolve_references(config);
    return config;
  }
  // Skip the header's two lines, which say who writes there.
  std::string_view rest = text.substr(saved);
  std::size_t line = 1 + static_cast<std::size_t>(std::ranges::count(written, '\n'));
  for (int skipped = 0; skipped < 2; ++skipped, ++line) {
    rest.remove_prefix(std::min(rest.find('\n'), rest.size() - 1) + 1);
  }
  if (Status added = add_saved(rest, line, file, config); !added) {
    return tl::unexpected(added.error());
  }
  resolve_references(config);
  return config;
}

}  // namespace unflex::machine
