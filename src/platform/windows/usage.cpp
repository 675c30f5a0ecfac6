#include "unflex/platform/usage.hpp"

// The second needs the first.
// clang-format off
#include <windows.h>
#include <psapi.h>
// clang-format on

namespace unflex::platform {
namespace {

double seconds(const FILETIME& time) {
  constexpr double kTick_s = 1e-7;
  constexpr double kTicksOfHighPart = 4294967296.0;
  return kTick_s * (kTicksOfHighPart * time.dwHighDateTime + time.dwLowDateTime);
}

}  // namespace

double processor_s() {
  FILETIME begin{};
  FILETIME end{};
  FILETIME kernel{};
  FILETIME user{};
  return GetProcessTimes(GetCurrentProcess(), &begin, &end, &kernel, &user) != 0
             ? seconds(kernel) + seconds(user)
             : 0.0;
}

double peak_memory_mb() {
  constexpr double kBytesPerMegabyte = 1024.0 * 1024.0;
  PROCESS_MEMORY_COUNTERS counters{};
  return GetProcessMemoryInfo(GetCurrentProcess(), &counters, sizeof counters) != 0
             ? static_cast<double>(counters.PeakWorkingSetSize) / kBytesPerMegabyte
             : 0.0;
}

}  // namespace unflex::platform
