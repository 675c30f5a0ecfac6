// A read or write waits itself, since there is nothing else to do meanwhile.
#include "unflex/platform/descriptors.hpp"

namespace unflex::platform {

bool wait_to_read(int /*descriptor*/, std::chrono::milliseconds /*most*/) { return true; }

bool wait_to_write(int /*descriptor*/, std::chrono::milliseconds /*most*/) { return true; }

}  // namespace unflex::platform
