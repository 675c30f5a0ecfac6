// The resonance behind the frequency of a Klipper's input shaper.
#pragma once

#include <optional>
#include <string_view>

namespace unflex::machine {

struct ShaperResonance {
  double freq_hz;     // the middle of the frequencies that the resonance may have
  double ratio;       // the shaper's frequency over freq_hz
  double freq_error;  // how far the resonance may be off freq_hz, either way, as a share
};

// The resonance for which Klipper's SHAPER_CALIBRATE chooses a shaper of this type and frequency.
// nullopt for types that it does not choose.
[[nodiscard]] std::optional<ShaperResonance> resonance_of_shaper(std::string_view type,
                                                                 double shaper_freq_hz);

}  // namespace unflex::machine
