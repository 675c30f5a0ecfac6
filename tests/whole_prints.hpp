// Whole prints, of which tests/data has cuts. They are looked for in the folders `samples` and
// `traces` of the folder that the environment variable UNFLEX_SAMPLES names.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace unflex::testing {

// A path that does not exist where the variable is not set.
inline std::filesystem::path whole_print_folder(const std::string& folder) {
  const char* const samples = std::getenv("UNFLEX_SAMPLES");
  return samples != nullptr ? std::filesystem::path(samples) / folder : std::filesystem::path();
}

inline std::filesystem::path whole_print(const std::string& name) {
  return whole_print_folder("samples") / (name + ".gcode");
}

}  // namespace unflex::testing
