// What `unflex identify` found, for people, for programs and as a page.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "unflex/identify/mode.hpp"

namespace unflex::app {

struct IdentifiedRecord {
  std::string name;
  identify::Axis axis = identify::Axis::x;
  identify::Mode mode;
};

struct Identification {
  std::vector<IdentifiedRecord> records;          // in the order of the command line
  std::map<identify::Axis, identify::Mode> axes;  // from all records of an axis
  std::vector<std::string> warnings;              // "file: warning: …"
};

// The lines to paste into a printer file.
[[nodiscard]] std::string snippet(const Identification& identification);

[[nodiscard]] std::string identification_text(const Identification& identification);

// The keys are those of docs/identify.md.
[[nodiscard]] std::string identification_json(const Identification& identification);
[[nodiscard]] std::string identification_html(const Identification& identification);

}  // namespace unflex::app
