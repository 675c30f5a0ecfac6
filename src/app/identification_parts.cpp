#include "identification_parts.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "sparkline.hpp"

namespace unflex::app {

using identify::Curve;
using identify::Estimate;
using identify::ModeEstimate;

std::string estimate_text(const Estimate& e) { return number_text(e.value, e.high - e.low); }

std::string interval_text(const Estimate& e) {
  return fmt::format("{} to {}", number_text(e.low, e.high - e.low),
                     number_text(e.high, e.high - e.low));
}

std::string mode_name(const ModeEstimate& mode) {
  return fmt::format("{:.1f} Hz", mode.freq_hz.value);
}

std::string sensor_text(const std::array<double, 3>& direction) {
  constexpr double kAlone = 0.97;
  constexpr std::string_view kNames = "xyz";
  std::string parts;
  for (std::size_t c = 0; c < 3; ++c) {
    if (std::abs(direction[c]) > kAlone) {
      return fmt::format("the sensor's {}", kNames[c]);
    }
    if (direction[c] != 0.0) {
      parts += fmt::format("{}{} {:.2f}", parts.empty() ? "" : ", ", kNames[c], direction[c]);
    }
  }
  return parts.empty() ? parts : fmt::format("the sensor's {}", parts);
}

std::vector<double> heights(const Curve& curve, const std::vector<double>& values) {
  std::vector<double> result;
  for (const double value : values) {
    result.push_back(curve.is_spectrum ? std::sqrt(std::max(value, 0.0)) : value);
  }
  return result;
}

std::vector<Trace> traces_of(const IdentifiedRecord& record) {
  constexpr std::array<std::string_view, 3> kColours = {"--series-3", "--series-4", "--series-5"};
  const Curve& curve = record.fit.curve;
  std::vector<Trace> traces = {{"measured", curve.measured, "--series-1", report::Stroke::solid},
                               {record.fit.is_trusted() ? "fitted" : "closest fit", curve.fitted,
                                "--series-2", report::Stroke::dashed}};
  if (!curve.is_spectrum) {
    return traces;
  }
  for (std::size_t m = 0; m < curve.modes.size(); ++m) {
    traces.push_back({mode_name(record.fit.model.modes[m]), curve.modes[m],
                      std::string(kColours.at(m)), report::Stroke::solid});
  }
  traces.push_back({"noise", curve.noise, "--muted", report::Stroke::solid});
  std::vector<double> left;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    left.push_back(std::abs(curve.measured[i] - curve.fitted[i]));
  }
  traces.push_back({"unexplained", left, "--series-6", report::Stroke::dotted});
  return traces;
}

}  // namespace unflex::app
