#include "unflex/platform/usage.hpp"

#include <sys/resource.h>

#include <algorithm>

namespace unflex::platform {
namespace {

rusage usage_of(int who) {
  rusage usage{};
  ::getrusage(who, &usage);
  return usage;
}

}  // namespace

double processor_s() {
  double sum_s = 0.0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    const rusage usage = usage_of(who);
    for (const timeval& time : {usage.ru_utime, usage.ru_stime}) {
      sum_s += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    }
  }
  return sum_s;
}

double peak_memory_mb() {
  // In kilobytes, on macOS in bytes.
#ifdef __APPLE__
  constexpr double kPerMegabyte = 1024.0 * 1024.0;
#else
  constexpr double kPerMegabyte = 1024.0;
#endif
  return static_cast<double>(
             std::max(usage_of(RUSAGE_SELF).ru_maxrss, usage_of(RUSAGE_CHILDREN).ru_maxrss)) /
         kPerMegabyte;
}

}  // namespace unflex::platform
