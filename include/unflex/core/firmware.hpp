// The firmwares unflex knows.
#pragma once

#include <string_view>

// Every firmware, once: EACH(name, ...). To add one, name it here and give it a folder in
// src/firmware.
#define UNFLEX_FIRMWARES(EACH, ...)        \
  EACH(klipper __VA_OPT__(, ) __VA_ARGS__) \
  EACH(marlin __VA_OPT__(, ) __VA_ARGS__)  \
  EACH(rrf __VA_OPT__(, ) __VA_ARGS__)

namespace unflex {

#define UNFLEX_FIRMWARE(name) name,
enum class Firmware { UNFLEX_FIRMWARES(UNFLEX_FIRMWARE) };
#undef UNFLEX_FIRMWARE

#define UNFLEX_FIRMWARE(name) Firmware::name,
inline constexpr Firmware kFirmwares[] = {UNFLEX_FIRMWARES(UNFLEX_FIRMWARE)};
#undef UNFLEX_FIRMWARE

// As the configuration spells it: "klipper", "marlin", "rrf".
[[nodiscard]] std::string_view to_string(Firmware firmware);

}  // namespace unflex
