#include "unflex/platform/usage.hpp"

namespace unflex::platform {

double processor_s() { return 0.0; }

double peak_memory_mb() {
  constexpr double kPagesPerMegabyte = 16.0;
  return static_cast<double>(__builtin_wasm_memory_size(0)) / kPagesPerMegabyte;
}

}  // namespace unflex::platform
