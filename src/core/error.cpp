#include "unflex/core/error.hpp"

#include <fmt/core.h>

namespace unflex {
namespace {

std::string prefix(const SourcePlace& place) {
  if (place.file.empty()) {
    return place.line == 0 ? std::string{} : fmt::format("line {}: ", place.line);
  }
  return place.line == 0 ? fmt::format("{}: ", place.file)
                         : fmt::format("{}:{}: ", place.file, place.line);
}

}  // namespace

std::string to_string(const Error& error) { return prefix(error.place) + error.message; }

std::string to_string(const Diagnostic& diagnostic) {
  return prefix(diagnostic.place) + "warning: " + diagnostic.message;
}

}  // namespace unflex
