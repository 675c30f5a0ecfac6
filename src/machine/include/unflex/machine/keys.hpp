// All keys as data: the one description from which reading, overriding, checking and the page
// docs/configuration.md are derived.
#pragma once

#include <string>
#include <vector>

namespace unflex::machine {

struct KeyDescription {
  std::string name;           // "limits.max_accel_mm_s2"
  std::string unit;           // "mm/s²"; empty for a pure number, a switch or a word
  std::string range;          // "> 0", "≥ 0, ≤ 1", "true, false"
  std::string default_value;  // "5000", or in words what holds while the key is unset
  std::string meaning;        // one line
};

// Every key a printer file may hold except schema_version and those of tools, in the order of the
// documentation.
[[nodiscard]] std::vector<KeyDescription> describe_keys();

}  // namespace unflex::machine
