#include "firmware_commands.hpp"

namespace unflex::gcode {

Effect m_code_effect(Firmware firmware, int number) {
  switch (firmware) {
    case Firmware::klipper:
      return klipper_m_code_effect(number);
    case Firmware::marlin:
      return marlin_m_code_effect(number);
    case Firmware::rrf:
      return rrf_m_code_effect(number);
  }
  return Effect::unknown;
}

}  // namespace unflex::gcode
