// Klipper's configuration files as sections of options, read as klippy/configfile.py does.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"

namespace unflex::machine {

struct KlipperOption {
  std::string text;
  SourcePlace place;
};

struct KlipperSection {
  SourcePlace place;                             // place of its first header
  std::map<std::string, KlipperOption> options;  // by name in lower case; the last of a name counts

  [[nodiscard]] const KlipperOption* find(const std::string& option) const;
};

// An [include] that leads to no file.
struct MissingInclude {
  SourcePlace place;
  std::string path;         // what is included, from where we are
  bool is_allowed = false;  // a pattern, which to Klipper may match nothing
};

struct KlipperConfig {
  std::map<std::string, KlipperSection> sections;
  std::vector<Diagnostic> notes;
  std::vector<MissingInclude> missing;

  [[nodiscard]] const KlipperSection* find(const std::string& section) const;
};

// Reads the text of `file`, follows its [include]s, whose patterns are relative to the file they
// stand in, and adds what SAVE_CONFIG has saved at its end and the rest does not say. Klipper
// refuses an include that is not there. Here a note tells of it, since people copy printer.cfg
// alone. References of Kalico's to other options are followed. Errors, of kind usage, are a line
// that is no option, an included file that cannot be read, and a file that includes itself.
[[nodiscard]] Result<KlipperConfig> parse_klipper_config(std::string_view text,
                                                         const std::string& file);

}  // namespace unflex::machine
