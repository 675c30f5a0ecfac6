#include "unflex/verify/near_path.hpp"

#include <algorithm>
#include <numbers>

namespace unflex::verify {
namespace {

// The nozzle lags by less than half a period of its slower axis. This constant is added for a base
// whose clock is off.
constexpr double kClockReach_s = 0.02;

}  // namespace

double reach_s(const NozzleModel& model) {
  return kClockReach_s +
         std::numbers::pi / std::min(model.x.slowest_rad_s(), model.y.slowest_rad_s());
}

void NearPath::begin(const ReferencePath& path) {
  first_cut_ = last_cut_ = Cut{};
  first_ = path.first();
  end_ = path.first();
}

}  // namespace unflex::verify
