#include "lines.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "unflex/core/text.hpp"

namespace unflex::hotend {

std::vector<NumberedLine> lines_of(std::string_view text) {
  std::vector<NumberedLine> lines;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const bool is_whole = end != std::string_view::npos;
    lines.push_back({number, trimmed(text.substr(0, end)), is_whole});
    text.remove_prefix(is_whole ? end + 1 : text.size());
  }
  return lines;
}

namespace {

double range_c(const std::vector<Sample>& samples, std::size_t first, std::size_t end) {
  const auto from = samples.begin() + static_cast<std::ptrdiff_t>(first);
  const auto to = samples.begin() + static_cast<std::ptrdiff_t>(end);
  const auto [low, high] = std::minmax_element(
      from, to, [](const Sample& a, const Sample& b) { return a.temperature_c < b.temperature_c; });
  return high->temperature_c - low->temperature_c;
}

}  // namespace

std::optional<double> leading_number(std::string_view text) {
  if (text.starts_with('+')) {
    text.remove_prefix(1);
  }
  double value = 0.0;
  const std::from_chars_result read =
      std::from_chars(text.data(), text.data() + text.size(), value);
  return read.ec == std::errc{} && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::vector<Sample> best_stretch(const std::vector<Sample>& samples) {
  constexpr double kGap_s = 20.0;
  constexpr double kLongest_s = 3600.0;
  constexpr double kHop_s = 60.0;
  // A later stretch must show this much more than an earlier one.
  constexpr double kMore_c = 3.0;
  double best_c = 0.0;
  std::size_t best_first = 0;
  std::size_t best_end = 0;
  const auto consider = [&](std::size_t first, std::size_t end) {
    const double found_c = range_c(samples, first, end);
    if (best_end == 0 || found_c > best_c + kMore_c) {
      best_c = found_c;
      best_first = first;
      best_end = end;
    }
  };
  for (std::size_t begin = 0; begin < samples.size();) {
    std::size_t end = begin + 1;
    while (end < samples.size() && samples[end].time_s > samples[end - 1].time_s &&
           samples[end].time_s - samples[end - 1].time_s <= kGap_s) {
      ++end;
    }
    double next_s = samples[begin].time_s;
    for (std::size_t first = begin; first < end; ++first) {
      if (samples[first].time_s < next_s) {
        continue;
      }
      next_s = samples[first].time_s + kHop_s;
      std::size_t to = first + 1;
      while (to < end && samples[to].time_s - samples[first].time_s <= kLongest_s) {
        ++to;
      }
      consider(first, to);
      if (to == end) {
        break;
      }
    }
    begin = end;
  }
  return {samples.begin() + static_cast<std::ptrdiff_t>(best_first),
          samples.begin() + static_cast<std::ptrdiff_t>(best_end)};
}

}  // namespace unflex::hotend
