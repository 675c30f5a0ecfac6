// How a print fares at several accelerations: its time and the contour error, as sliced and
// compensated.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "unflex/report/report.hpp"
#include "unflex/verify/measured.hpp"

namespace unflex::study {

// The print with one acceleration limit.
struct AtAccel {
  double accel_mm_s2 = 0.0;
  double sliced_time_s = 0.0;
  double time_s = 0.0;  // compensated
  // While filament is laid.
  verify::DeviationStats sliced;
  verify::DeviationStats compensated;
};

struct AccelsOutcome {
  std::string version;
  std::string input;
  std::vector<report::Setting> printer;
  std::vector<AtAccel> accels;        // in the order asked for
  bool scaled = false;                // the print's own accelerations too
  std::optional<double> keep_rms_mm;  // the RMS that the compensated print is to keep
  std::vector<std::string> warnings;
  double wall_s = 0.0;

  // The fastest that keeps keep_rms_mm; null if none does, or if nothing is to be kept.
  [[nodiscard]] const AtAccel* fastest_kept() const;
};

// The line with the accelerations that it sets for the print (M204 S, P and T; SET_VELOCITY_LIMIT
// ACCEL and ACCEL_TO_DECEL) multiplied by `ratio`. All else stays byte for byte.
[[nodiscard]] std::string with_scaled_accels(const std::string& line, double ratio);

[[nodiscard]] std::string to_text(const AccelsOutcome& outcome);
// The keys are those of docs/report.md.
[[nodiscard]] std::string to_json(const AccelsOutcome& outcome);

}  // namespace unflex::study
