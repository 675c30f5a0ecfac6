#include "samples.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

namespace unflex::identify {

DataSet named_set(std::string name) {
  DataSet set;
  set.name = std::move(name);
  set.axis = axis_in_name(set.name);
  set.place_mm = place_in_name(set.name);
  const bool is_along = set.name.find("axis=") != std::string::npos;
  const bool is_of_belt = set.name.find("belt_") != std::string::npos;
  set.is_diagonal = !set.axis && (is_along || is_of_belt);
  return set;
}

Recording recording_of(const std::vector<Row>& rows, double rate_hz) {
  Recording recording;
  recording.rate_hz = rate_hz;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const Row& row : rows) {
      recording.accel[axis].push_back(row[axis + 1]);
    }
  }
  return recording;
}

Result<DataSet> timed_set(const std::string& name, const std::vector<Row>& rows) {
  const double duration_s = rows.back()[0] - rows.front()[0];
  const double step_s = duration_s / static_cast<double>(rows.size() - 1);
  if (!(duration_s > 0.0)) {
    return fail(ErrorKind::input, {name, 0}, "its times do not grow");
  }
  DataSet set = named_set(name);
  set.data = recording_of(rows, 1.0 / step_s);
  double longest_s = 0.0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    longest_s = std::max(longest_s, rows[i][0] - rows[i - 1][0]);
  }
  if (longest_s > 3.0 * step_s) {
    set.notes.push_back(
        fmt::format("samples are missing: up to {:.1f} ms between two, {:.2f} ms on average",
                    1e3 * longest_s, 1e3 * step_s));
  }
  return set;
}

}  // namespace unflex::identify
