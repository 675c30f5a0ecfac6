#pragma once

namespace unflex::platform {

void close_descriptor(int descriptor);

}  // namespace unflex::platform
