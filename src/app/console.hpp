// Lines for people: one per message, whatever the message holds.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"

namespace unflex::app {

// Line breaks become spaces and other control characters '?', so that a file's name cannot forge
// a second line or move the cursor.
[[nodiscard]] std::string one_line(std::string_view text);

// Writes one line to stderr. What cannot be written there is lost.
void print_line(std::string_view text);

// "file:line: message", or "unflex: message" for an error without a place.
void print_error(const Error& error);

// The first few lines of each kind, which differ in place, numbers and quoted text alone, and how
// many more there are; then how many of `total` are left. `what` names them ("warnings").
[[nodiscard]] std::vector<std::string> summarised(const std::vector<std::string>& lines,
                                                  std::size_t total, std::string_view what);

// Writes them so to stderr.
void print_lines(const std::vector<std::string>& lines, std::size_t total, std::string_view what);

}  // namespace unflex::app
