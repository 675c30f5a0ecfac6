// Printers and towers that the tests of calibration by printing share.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "flow/jobs.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/tune/bands.hpp"

namespace unflex::flow::testing {

inline machine::Settings tower_printer(const std::vector<std::string>& more) {
  std::vector<std::string> overrides = {"printer.firmware=klipper", "dynamics.x.freq_hz=45",
                                        "dynamics.y.freq_hz=45"};
  overrides.insert(overrides.end(), more.begin(), more.end());
  Result<machine::Settings> settings = machine::load(std::nullopt, overrides);
  EXPECT_TRUE(settings) << to_string(settings.error());
  return *settings;
}

// What verification tells of the bands as one print, which all are made for the same.
inline Result<report::Report> verify_joined(const tune::Tower& tower,
                                            const std::vector<tune::Band>& bands) {
  std::string sliced = tower.start + tower.base;
  for (std::size_t number = 1; number <= tower.bands.size(); ++number) {
    sliced += tune::band_begins(number) + tower.bands[number - 1] + tune::band_ends(number);
  }
  const JobFolder folder(sliced + tower.foot);
  folder.set_output(tune::join_bands(bands));
  Job job = folder.job();
  job.settings = bands.front().made_for;
  SilentProgress progress;
  return verify(job, progress);
}

}  // namespace unflex::flow::testing
