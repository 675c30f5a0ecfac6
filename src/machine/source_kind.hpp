// The kinds of files that may describe a printer, told by their content.
#pragma once

#include <string_view>

namespace unflex::machine {

enum class SourceKind {
  toml,         // unflex's own
  klipper,      // printer.cfg
  marlin_dump,  // what M503 answers
  rrf_config,   // config.g
  m115_answer,  // what M115 answers, and nothing else
  print,        // sliced G-code
  record,       // of an accelerometer: samples, or a spectrum
};

[[nodiscard]] SourceKind source_kind(std::string_view text);

}  // namespace unflex::machine
