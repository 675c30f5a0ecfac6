// Klipper weighs what vibration a shaper leaves against how much it smooths the path
// (extras/shaper_calibrate.py, fit_shaper). It assumes dampings of 0.075 to 0.15 and shapers of
// 0.1, so that the best frequency is not the resonance's, and differs from type to type.
//
// The ratios are those of its choice for one mode of 25 to 110 Hz and damping 0.02 to 0.12 under
// its own sweep: the middle of the least and the greatest, and half their distance, rounded up, as
// the error. docs/configuration.md has the table.
#include <algorithm>
#include <array>
#include <cmath>

#include "klipper_shaper.hpp"

namespace unflex::machine {
namespace {

struct Row {
  std::string_view type;
  double ratio;
  double freq_error;
};

constexpr std::array kRows = {Row{"zv", 1.01, 0.03},       Row{"mzv", 1.015, 0.05},
                              Row{"zvd", 1.16, 0.05},      Row{"ei", 1.24, 0.05},
                              Row{"2hump_ei", 1.60, 0.05}, Row{"3hump_ei", 2.01, 0.05}};

}  // namespace

std::optional<ShaperResonance> resonance_of_shaper(std::string_view type, double shaper_freq_hz) {
  const auto row = std::ranges::find(kRows, type, &Row::type);
  if (row == kRows.end()) {
    return std::nullopt;
  }
  // Klipper saves tenths.
  return ShaperResonance{.freq_hz = std::round(shaper_freq_hz / row->ratio * 10.0) / 10.0,
                         .ratio = row->ratio,
                         .freq_error = row->freq_error};
}

}  // namespace unflex::machine
