#include "unflex/core/firmware.hpp"

#include "unflex/core/firmware_spec.hpp"

namespace unflex {

std::string_view to_string(Firmware firmware) { return spec_of(firmware).name; }

}  // namespace unflex
