#include "feature_log.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "unflex/gcode/layer_mark.hpp"

namespace unflex::record {
namespace {

constexpr std::size_t kMostNames = 48;
constexpr std::size_t kLongestName = 60;

std::string_view trimmed(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && is_blank(text.front())) {
    text.remove_prefix(1);
  }
  while (!text.empty() && is_blank(text.back())) {
    text.remove_suffix(1);
  }
  return text;
}

// What follows the first of the prefixes that the text has.
template <std::size_t N>
std::optional<std::string_view> after(std::string_view text,
                                      const std::array<std::string_view, N>& prefixes) {
  for (const std::string_view prefix : prefixes) {
    if (text.starts_with(prefix)) {
      return trimmed(text.substr(prefix.size()));
    }
  }
  return std::nullopt;
}

}  // namespace

void FeatureLog::read(std::string_view content, std::size_t number) {
  if (!content.starts_with(';')) {
    return;
  }
  const std::string_view comment = trimmed(content.substr(1));
  constexpr std::array<std::string_view, 3> kFeature = {"TYPE:", "FEATURE:", "feature "};
  if (const std::optional<std::string_view> name = after(comment, kFeature)) {
    last_.feature = number_of(*name);
  } else if (gcode::begins_layer(content)) {
    ++last_.layers_begun;
  } else {
    return;
  }
  changes_.push_back({number, last_});
}

FeatureLog::At FeatureLog::at(std::size_t number) {
  while (!changes_.empty() && changes_.front().line <= number) {
    current_ = changes_.front().at;
    changes_.pop_front();
  }
  return current_;
}

std::size_t FeatureLog::number_of(std::string_view name) {
  name = name.substr(0, kLongestName);
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found != names_.end()) {
    return static_cast<std::size_t>(found - names_.begin());
  }
  if (names_.size() == kMostNames) {
    names_.back() = "others";
    return kMostNames - 1;
  }
  names_.emplace_back(name);
  return names_.size() - 1;
}

}  // namespace unflex::record
