#include "unflex/report/recording.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/core/math.hpp"

namespace unflex::report {

unsigned char deviation_code(double squared_mm2) {
  constexpr double kSmallest2_mm2 = 5e-5 * 5e-5;
  constexpr double kStepsPerOctave = 15.0;
  const double code =
      0.5 * kStepsPerOctave * math::log2(std::max(squared_mm2, kSmallest2_mm2) / kSmallest2_mm2);
  return static_cast<unsigned char>(std::lround(std::min(code, 255.0)));
}

}  // namespace unflex::report
