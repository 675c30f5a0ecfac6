// Logs of temperature and power, as tables and as hosts write them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/hotend/plant.hpp"

namespace unflex::hotend {

struct Sample {
  double time_s = 0.0;
  double temperature_c = 0.0;
  double power = 0.0;  // counts, 0 … kFullPower
};

// How power goes on between two samples.
enum class Hold {
  to_next,   // a sample's power holds until the next one: each change has a row
  to_nearer  // a host asked now and then, so that a change may lie anywhere in between
};

struct Log {
  std::vector<Sample> samples;  // by increasing time
  Hold hold = Hold::to_next;
};

struct LogOptions {
  // The log's value for full power. Without it: 255 in a table, 1 in Klipper's log and 127 in that
  // of a serial line (Marlin reports half of its 255 counts, temperature.cpp, getHeaterPower()).
  std::optional<double> full_power;
  // The heater's section in Klipper's configuration. In a serial log "extruder" is T: and @:, and
  // "extruder1" is T1: and @1:.
  std::string heater = "extruder";
};

// Reads a log. Its text tells its kind:
//
// clang-format off
// * klippy.log: lines "Stats 1234.5: ... extruder: target=200 temp=199.7 pwm=0.345 ..."
//   (heaters.py, Heater.stats()).
// * A serial log, as OctoPrint writes it: "2024-01-01 12:00:00,123 - Recv: T:199.7 /200.0 @:87".
//   Lines without temperature and power are left out.
// * Otherwise a table with a header that names time, temperature and power in any order, among
//   other columns, separated by commas, semicolons or tabs. Time is in s.
// clang-format on
//
// What hosts log may contain hours and restarts. The stretch without a gap whose temperature varies
// most is taken, an hour of it at most.
//
// Errors are of kind input and name the line.
[[nodiscard]] Result<Log> parse_log(std::string_view text, const std::string& file,
                                    const LogOptions& options = {});

}  // namespace unflex::hotend
