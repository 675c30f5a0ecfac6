// The plant that tests of the hotend share: a 40 W hotend as many are in use.
#pragma once

#include "unflex/hotend/plant.hpp"

namespace unflex::hotend {

inline constexpr Plant kReference{.gain_c = 2.0,
                                  .time_constant_s = 300.0,
                                  .sensor_lag_s = 2.5,
                                  .dead_time_s = 5.0,
                                  .ambient_c = 25.0};

}  // namespace unflex::hotend
