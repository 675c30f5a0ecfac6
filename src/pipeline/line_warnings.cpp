#include "line_warnings.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

namespace unflex::pipeline {
namespace {

// Bounds memory. No print gives rise to so many different warnings.
constexpr std::size_t kMost = 1000;

std::string without_numbers(const std::string& message) {
  std::string text;
  std::ranges::copy_if(message, std::back_inserter(text),
                       [](char c) { return c < '0' || c > '9'; });
  return text;
}

}  // namespace

void LineWarnings::add(std::size_t line, std::string message) {
  const auto known = places_.find(without_numbers(message));
  if (known != places_.end()) {
    Warning& warning = warnings_[known->second];
    ++warning.repeats;
    warning.last_line = line;
  } else if (warnings_.size() < kMost) {
    places_.emplace(without_numbers(message), warnings_.size());
    warnings_.push_back({.line = line, .message = std::move(message)});
  } else {
    ++unlisted_;
  }
}

std::vector<Diagnostic> LineWarnings::list(const std::string& file) const {
  std::vector<Diagnostic> list;
  for (const Warning& warning : warnings_) {
    const std::string others = warning.repeats == 0 ? ""
                               : warning.repeats == 1
                                   ? fmt::format(" (and line {})", warning.last_line)
                                   : fmt::format(" (likewise {} more lines, the last one {})",
                                                 warning.repeats, warning.last_line);
    list.push_back({{file, warning.line}, warning.message + others});
  }
  std::ranges::stable_sort(list, {},
                           [](const Diagnostic& diagnostic) { return diagnostic.place.line; });
  if (unlisted_ > 0) {
    list.push_back({{file, 0}, fmt::format("{} more warnings are not listed", unlisted_)});
  }
  return list;
}

}  // namespace unflex::pipeline
