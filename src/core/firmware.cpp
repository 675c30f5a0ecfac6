#include "unflex/core/firmware.hpp"

namespace unflex {

std::string_view to_string(Firmware firmware) {
  switch (firmware) {
    case Firmware::klipper:
      return "klipper";
    case Firmware::marlin:
      return "marlin";
    case Firmware::rrf:
      return "rrf";
  }
  return "";
}

}  // namespace unflex
