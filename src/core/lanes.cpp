#include "unflex/core/lanes.hpp"

#include <atomic>

namespace unflex {
namespace {

std::atomic<bool> two_lanes_preferred = false;

}  // namespace

bool has_four_lanes() {
#ifdef UNFLEX_FOUR_LANES
  return __builtin_cpu_supports("avx2") != 0 && !two_lanes_preferred;
#else
  return false;
#endif
}

void prefer_two_lanes(bool prefer) { two_lanes_preferred = prefer; }

}  // namespace unflex
