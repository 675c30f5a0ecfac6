// How warm the hotend is along a print, by its model.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace unflex::report {

// One file's temperatures.
struct TemperatureRow {
  // Time in which filament is laid further from the target than the band, below and above.
  double colder_s = 0.0;
  double hotter_s = 0.0;
  double worst_c = 0.0;  // the largest distance from the target meanwhile, below 0 if too cold
  std::size_t worst_line = 0;  // of the file that the row is of
  double waiting_s = 0.0;      // for temperatures, once filament has flowed
};

// A change of temperature that the output asks for earlier than the input.
struct TemperatureAhead {
  std::size_t line = 0;  // of the input
  double lead_s = 0.0;
  double from_c = 0.0;
  double to_c = 0.0;
};

struct Temperature {
  double band_c = 0.0;  // how far from the target is near enough
  // Whether the print says how warm it wants the hotend. Otherwise nothing below is set.
  bool is_known = false;
  TemperatureRow sliced;
  TemperatureRow emitted;
  std::vector<TemperatureAhead> ahead;
  // The output over time, thinned. target_c is as sliced, and 0 where there is none.
  struct Moment {
    double time_s = 0.0;
    double target_c = 0.0;
    double temperature_c = 0.0;
  };
  std::vector<Moment> course;
};

}  // namespace unflex::report
