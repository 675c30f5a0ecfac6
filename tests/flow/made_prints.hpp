// Compensated prints, and the figures that tests of machines ask of them.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "jobs.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"

namespace unflex::flow::testing {

struct Made {
  report::Report report;
  std::string text;
};

// The print compensated with these settings, all of it and by the rules.
inline Made made(const std::string& print, const std::vector<std::string>& overrides,
                 unsigned workers) {
  const JobFolder folder(print, overrides);
  SilentProgress progress;
  const Result<report::Report> report = compensate(folder.job(workers), progress);
  EXPECT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_EQ(report->violation_count, 0U) << complaints(*report);
  EXPECT_EQ(report->runs.fallback, 0U) << complaints(*report);
  return {report.value_or(report::Report{}), folder.output()};
}

inline double rms_mm(const report::Report& report) {
  return report.measured.compensated.extruding.contour_rms_mm;
}

}  // namespace unflex::flow::testing
