#include "feature_log.hpp"

#include <algorithm>
#include <optional>

#include "unflex/gcode/feature.hpp"
#include "unflex/gcode/layer_mark.hpp"

namespace unflex::record {
namespace {

constexpr std::size_t kMostNames = 48;
constexpr std::size_t kLongestName = 60;

}  // namespace

void FeatureLog::read(std::string_view content, std::size_t number) {
  if (const std::optional<std::string_view> name = gcode::feature_name(content)) {
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
