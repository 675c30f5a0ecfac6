#include "jumps.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/core/math.hpp"
#include "unflex/hotend/plant.hpp"

namespace unflex::hotend {

bool is_jump(double power) { return std::abs(power) >= 0.2 * kFullPower; }

std::vector<Jump> jumps_of(const Log& log) {
  constexpr std::size_t kMost = 6;
  std::vector<Jump> jumps;
  if (log.hold == Hold::to_next) {
    return jumps;
  }
  const double start_s = log.samples.front().time_s;
  for (std::size_t k = 1; k < log.samples.size(); ++k) {
    const Sample& from = log.samples[k - 1];
    const Sample& to = log.samples[k];
    if (is_jump(to.power - from.power)) {
      jumps.push_back({0.5 * (from.time_s + to.time_s) - start_s, to.time_s - from.time_s,
                       to.power - from.power});
    }
  }
  std::ranges::stable_sort(jumps, std::ranges::greater{},
                           [](const Jump& jump) { return std::abs(jump.power * jump.width_s); });
  jumps.resize(std::min(jumps.size(), kMost));
  return jumps;
}

Eigen::MatrixXd columns_of(const std::vector<Jump>& jumps, const Log& log, const Lags& lags) {
  constexpr double kLeastApart_s = 1e-6;
  const double apart_s = std::max(lags.time_constant_s - lags.sensor_lag_s, kLeastApart_s);
  const double start_s = log.samples.front().time_s;
  const auto rows = static_cast<Eigen::Index>(log.samples.size());
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(jumps.size()));
  for (Eigen::Index j = 0; j < columns.cols(); ++j) {
    const Jump& jump = jumps[static_cast<std::size_t>(j)];
    for (Eigen::Index k = 0; k < rows; ++k) {
      const double since_s = log.samples[static_cast<std::size_t>(k)].time_s - start_s -
                             jump.middle_s - lags.dead_time_s;
      if (since_s > 0.0) {
        columns(k, j) =
            jump.width_s / apart_s *
            (math::exp(-since_s / lags.time_constant_s) - math::exp(-since_s / lags.sensor_lag_s));
      }
    }
  }
  return columns;
}

}  // namespace unflex::hotend
